"""Heights of rails: the points on top of each railhead, found by a rolling disc and smoothed along the line.

The steps are those of the paper's section "Postprocessing of Vectorized Geometry": points are projected onto their
line, those on the head's top kept, and their heights smoothed by PAEK.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .envelope import extremal_boundary
from .points import RailPoints
from .polyline import Feet, interpolate, project, starts_at_its_end
from .progress import SILENT, Progress
from .railhead import cross_slope, rough_level, spread
from .rails import RailLine, length_along
from .smoothing import simplify, smooth_profile
from .vectorize.network import LineNetwork

LEAST_POINTS = 10
"""A line that fewer points support is none of a rail: 1 m of the sparsest rail has more."""

OUTLIER_M = 0.03
"""Points this far above the level of most, such as weeds, would lift the disc; a head's slope makes 5 mm at most."""

LEAST_DEPTH_M = 0.01
"""Depth below the disc that is searched even in the cleanest cloud: the disc sags 6 mm into a gap of 1 m."""

DEPTH_SIGMAS = 6.0
"""Depth in standard deviations of the noise: the disc lies about three above the top, the points reach as far below."""

TOP_SIGMAS = 3.0
"""Half height of the band around the top, in standard deviations of the noise."""

TOP_ROUNDS = 3
"""Rounds of smoothing and choosing anew; the fourth moves the top by less than 0.1 mm."""

AXIS_SHARE = 0.25
"""Part of the head width, to either side of the axis, that gives the height: its crown is 0.5 mm lower at most."""

BIN_M = 0.25
"""Points this close together along the line count as one of mean height: a twelfth of the smoothing's length."""

END_M = 1.0
"""A profile goes on as it slopes at its end for this length, and level from there."""

BRIDGE_M = 0.5
"""A longer stretch without points counts as bridged: five profiles of the fastest train's scanner."""

UNSUPPORTED_END_M = 0.15
"""A free end that runs on further than this without points is cut: the raster's lines curl where a rail ends."""

END_POINTS = 3
"""Points that mark the end of support; one alone may be a weed."""

VARIANCE_FACTOR = 0.33375
"""Of independent points `spacing` apart, PAEK's result has this variance times spacing / sigma (section 2.4)."""


@dataclass(frozen=True)
class ElevationParameters:
    """How heights are found; metres throughout.

    Attributes
    ----------
    head_width_m : float
        Width of the railhead.
    tolerance_xy_m : float
        Greatest distance of a point from its line, in plan.
    tolerance_z_m : float
        Greatest depth of a point below the top surface.
    crown_radius_m : float
        Radius of the disc that rolls along the top.
    smoothing_xy_m, smoothing_z_m : float
        Sigma of PAEK that smoothed the line in plan, and the one for its heights.
    simplify_xy_m, simplify_z_m : float
        Tolerances within which vertices are left out.
    min_length_m : float
        Shorter lines are dropped.
    """

    head_width_m: float
    tolerance_xy_m: float = 0.10
    tolerance_z_m: float = 0.03
    crown_radius_m: float = 20.0
    smoothing_xy_m: float = 0.8
    smoothing_z_m: float = 3.0
    simplify_xy_m: float = 0.002
    simplify_z_m: float = 0.002
    min_length_m: float = 1.0


def elevate(
    network: LineNetwork, points: RailPoints, parameters: ElevationParameters, progress: Progress = SILENT
) -> tuple[RailLine, ...]:
    """Give the smoothed plan lines of a network heights and figures.

    Parameters
    ----------
    network : LineNetwork
        Smoothed lines; all that its nodes join stays joined.
    points : RailPoints
        The cloud that the network was made from.
    parameters : ElevationParameters
    progress : Progress

    Returns
    -------
    tuple of RailLine
        By place of their starts from west to east, numbered from 1. Lines without points and short ones are left out.
    """
    feet = project(network.lines, points.xyz[:, :2], parameters.tolerance_xy_m, progress.span(0.0, 0.6))
    free_ends = (network.degrees() == 1)[network.ends]
    rails = []
    for number, line in enumerate(progress.span(0.6, 1.0).follow(network.lines)):
        mine = feet.of(number)
        rail = _raise_line(line, free_ends[number], mine, points.xyz[mine.point, 2], parameters)
        if rail is not None and rail.length_m >= parameters.min_length_m:
            rails.append(replace(rail, class_code=points.class_code))
    return _numbered(rails)


def flat_rails(network: LineNetwork, class_code: int, parameters: ElevationParameters) -> tuple[RailLine, ...]:
    """Make rails without heights of the lines of a network, for want of points; figures of support are 0 or NaN."""
    rails = []
    for line in network.lines:
        xyz = _finished(np.column_stack([line, np.full(len(line), np.nan)]), parameters)
        rail = RailLine(xyz, 0, class_code, points=0, resid_mm=np.nan, sigma_mm=np.nan, bridged_m=0.0)
        if rail.length_m >= parameters.min_length_m:
            rails.append(rail)
    return _numbered(rails)


def _numbered(rails: Sequence[RailLine]) -> tuple[RailLine, ...]:
    ordered = sorted(rails, key=lambda rail: tuple(rail.xyz[0, :2]))
    return tuple(replace(rail, rail_id=number) for number, rail in enumerate(ordered, start=1))


def _finished(xyz: np.ndarray, parameters: ElevationParameters) -> np.ndarray:
    """Leave out needless vertices and start at the right end."""
    xyz = simplify(xyz, parameters.simplify_xy_m, parameters.simplify_z_m)
    return xyz[::-1] if starts_at_its_end(xyz) else xyz


def _raise_line(
    line: np.ndarray, free_ends: np.ndarray, feet: Feet, z: np.ndarray, parameters: ElevationParameters
) -> RailLine | None:
    """Give one line its heights; None where hardly a point supports it."""
    head = np.abs(feet.across) <= 0.5 * parameters.head_width_m
    feet, z = feet[head], z[head]
    if len(z) < LEAST_POINTS:
        return None
    found = _top(feet.t, feet.across, z, parameters)
    if found is None:
        return None
    profile, top = found
    supporting = feet[top]
    along = length_along(line)
    start, end = _supported(supporting.t, along[-1], free_ends)
    stations = np.concatenate([[start], along[(along > start) & (along < end)], [end]])
    bridged = bridged_length(supporting.t, start, end)
    spacing = max(end - start - bridged, BRIDGE_M) / len(supporting.t)
    resid = float(np.sqrt(np.mean(supporting.across**2)))
    sigma = resid * np.sqrt(min(VARIANCE_FACTOR * spacing / parameters.smoothing_xy_m, 1.0))
    xyz = _finished(np.column_stack([interpolate(line, along, stations), profile.at(stations)]), parameters)
    return RailLine(xyz, 0, 0, len(supporting.t), 1000 * resid, 1000 * float(sigma), bridged)


def _supported(t: np.ndarray, length_m: float, free_ends: np.ndarray) -> tuple[float, float]:
    """Chainages between which a line is kept: all of it, but for free ends without points."""
    start, end = t[END_POINTS - 1], t[-END_POINTS]
    keep_start = not free_ends[0] or start <= UNSUPPORTED_END_M
    keep_end = not free_ends[1] or length_m - end <= UNSUPPORTED_END_M
    return 0.0 if keep_start else float(start), length_m if keep_end else float(end)


def bridged_length(t: np.ndarray, start: float, end: float) -> float:
    """Length without points from `start` to `end`: of the stretches longer than BRIDGE_M between chainages `t`."""
    gaps = np.diff(np.concatenate([[start], np.clip(np.sort(t), start, end), [end]]))
    return float(gaps[gaps > BRIDGE_M].sum())


def _top(
    t: np.ndarray, across: np.ndarray, z: np.ndarray, parameters: ElevationParameters
) -> tuple[_Profile, np.ndarray] | None:
    """Find the height of a head's top on its axis; None where too few points agree on one.

    The points are laid flat first, as if the head stood upright. The disc then tells the top from the faces, but it
    rests on the highest points, three standard deviations above it; a band around their own smoothed height,
    chosen anew a few times, takes that lift away.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Points on the head, t increasing.

    Returns
    -------
    profile : _Profile
    top : (n,) bool array
        Points that lie on the top.
    """
    flat = z - cross_slope(t, across, z - rough_level(t, z), parameters.head_width_m) * across
    top, noise = _under_disc(t, flat, parameters)
    central = np.abs(across) <= AXIS_SHARE * parameters.head_width_m
    band = min(parameters.tolerance_z_m, max(LEAST_DEPTH_M, TOP_SIGMAS * noise))
    for _ in range(TOP_ROUNDS):
        chosen = top & central if (top & central).sum() >= LEAST_POINTS else top
        profile = _Profile.through(t[chosen], flat[chosen], parameters.smoothing_z_m)
        top = np.abs(flat - profile.at(t)) <= band
        if top.sum() < LEAST_POINTS:
            return None
    return profile, top


def _under_disc(t: np.ndarray, z: np.ndarray, parameters: ElevationParameters) -> tuple[np.ndarray, float]:
    """Tell which points lie just under the disc that rolls along the top, (n,) bool, and how noisy these are."""
    above = z - rough_level(t, z)
    ordinary = above <= OUTLIER_M
    surface = extremal_boundary(t[ordinary], z[ordinary], parameters.crown_radius_m)
    inside = ordinary & (t >= surface.x[0]) & (t <= surface.x[-1])
    depth = np.full(len(z), np.inf)
    depth[inside] = surface.closing(t[inside]) - z[inside]
    noise = spread(above[depth <= parameters.tolerance_z_m])
    return depth <= min(parameters.tolerance_z_m, max(LEAST_DEPTH_M, DEPTH_SIGMAS * noise)), noise


@dataclass(frozen=True)
class _Profile:
    """A smoothed height profile: heights `z` at chainages `t`, (n,) each."""

    t: np.ndarray
    z: np.ndarray

    @classmethod
    def through(cls, t: np.ndarray, z: np.ndarray, sigma_m: float) -> _Profile:
        """Smooth the heights of points; those of one bin count as one, so that none alone marks the edge of a gap."""
        _, number, count = np.unique(np.floor(t / BIN_M), return_inverse=True, return_counts=True)
        t, z = np.bincount(number, t) / count, np.bincount(number, z) / count
        return cls(t, smooth_profile(t, z, sigma_m, t))

    def at(self, stations: np.ndarray) -> np.ndarray:
        """Height at any chainage, (m,)."""
        height = np.interp(stations, self.t, self.z)
        if self.t[-1] - self.t[0] < END_M:
            return height
        before = np.clip(self.t[0] - stations, 0.0, END_M)
        after = np.clip(stations - self.t[-1], 0.0, END_M)
        inner_start, inner_end = np.interp([self.t[0] + END_M, self.t[-1] - END_M], self.t, self.z)
        return height + (self.z[0] - inner_start) / END_M * before + (self.z[-1] - inner_end) / END_M * after
