"""Heights of rails: the points on top of each railhead, found by a rolling disc and smoothed along the line.

The steps are those of Gribov and Chang, section 8 (docs/method.md section 6.4): points are projected onto their
line, those on the head's top kept, and their heights smoothed by PAEK.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..clouds.points import RailPoints
from ..lines.network import LineNetwork
from ..parameters import Parameters
from ..polyline import Feet, interpolate, length_along, project, resample, starts_at_its_end
from ..progress import SILENT, Progress
from ..rails import RailLine, Support
from .edges import stations_along, widest_reach
from .neighbours import free_edges
from .top import LEAST_POINTS, find_top
from .uncertainty import measure_support

BRIDGE_M = 0.5
"""A longer stretch without points counts as bridged: five profiles of the fastest train's scanner."""

UNSUPPORTED_END_M = 0.15
"""A free end that runs on further than this without points is cut: the raster's lines curl where a rail ends."""

FIXED_ENDS = np.zeros(2, dtype=bool)
"""Marks ends of a line that are kept whether points support them or not."""

END_POINTS = 3
"""Points that mark the end of support; one alone may be a weed."""


@dataclass(frozen=True)
class ElevationParameters:
    """How heights are found; metres throughout.

    Attributes
    ----------
    head_width_m : float
        Width of the railhead.
    tolerance_xy_m : float
        Greatest distance from its line, in plan, of a point that gives height; half a head is the limit in any case.
    tolerance_z_m : float
        Greatest depth of a point below the top surface.
    crown_radius_m : float
        Radius of the disc that rolls along the top.
    smoothing_xy_m, smoothing_z_m : float
        Sigma of PAEK that smoothed the line in plan, and the one for its heights.
    cell_m : float
        Cell of the raster that the line was drawn from.
    min_length_m : float
        Shorter lines are dropped.
    """

    head_width_m: float
    tolerance_xy_m: float = Parameters.tolerance_xy_m
    tolerance_z_m: float = Parameters.tolerance_z_m
    crown_radius_m: float = Parameters.crown_radius_m
    smoothing_xy_m: float = Parameters.smoothing_xy_m
    smoothing_z_m: float = Parameters.smoothing_z_m
    cell_m: float = 0.04
    min_length_m: float = Parameters.min_length_m

    @property
    def unseen_m(self) -> float:
        """Standard deviation of a line where no points show its head: it lies anywhere in its cell."""
        return self.cell_m / np.sqrt(12)


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
    reach_m = widest_reach(parameters.head_width_m)
    feet = project(network.lines, points.xyz[:, :2], reach_m, progress.span(0.0, 0.6))
    free_ends = (network.degrees() == 1)[network.ends]
    edges = free_edges(network.lines, parameters.head_width_m)
    rails = []
    for number, line in enumerate(progress.span(0.6, 1.0).follow(network.lines)):
        mine = feet.of(number)
        rail = _raise_line(line, free_ends[number], edges[number], mine, points.xyz[mine.point, 2], parameters)
        if rail is not None and rail.length_m >= parameters.min_length_m:
            rails.append(replace(rail, class_code=points.class_code))
    return numbered(rails)


def flat_rails(network: LineNetwork, class_code: int, parameters: ElevationParameters) -> tuple[RailLine, ...]:
    """Make rails without heights of the lines of a network, for want of points; figures of support are 0 or NaN."""
    rails = []
    for line in network.lines:
        xyz = np.column_stack([line, np.full(len(line), np.nan)])
        rail = RailLine(xyz, 0, class_code, points=0, resid_mm=np.nan, sigma_mm=np.nan, bridged_m=0.0)
        if rail.length_m >= parameters.min_length_m:
            rails.append(rail)
    return numbered(rails)


def numbered(rails: Sequence[RailLine]) -> tuple[RailLine, ...]:
    """Let rails start at the right end, and number them from west to east."""
    directed = (rail.reversed() if starts_at_its_end(rail.xyz) else rail for rail in rails)
    ordered = sorted(directed, key=lambda rail: tuple(rail.xyz[0, :2]))
    return tuple(replace(rail, rail_id=number) for number, rail in enumerate(ordered, start=1))


def _raise_line(
    line: np.ndarray,
    free_ends: np.ndarray,
    edges: np.ndarray,
    feet: Feet,
    z: np.ndarray,
    parameters: ElevationParameters,
) -> RailLine | None:
    """Give one line its heights; None where hardly a point supports it."""
    head = np.abs(feet.across) <= min(0.5 * parameters.head_width_m, parameters.tolerance_xy_m)
    if head.sum() < LEAST_POINTS:
        return None
    found = find_top(
        feet.t[head],
        feet.across[head],
        z[head],
        parameters.head_width_m,
        parameters.crown_radius_m,
        parameters.tolerance_z_m,
        parameters.smoothing_z_m,
    )
    if found is None:
        return None
    profile, top = found
    supporting = feet[head][top]
    along = length_along(line)
    start, end = _supported(supporting.t, along[-1], free_ends)
    stations = np.concatenate([[start], along[(along > start) & (along < end)], [end]])
    gaps = find_gaps(supporting.t, start, end)
    bridged = float(np.sum(gaps[:, 1] - gaps[:, 0]))
    resid = float(np.sqrt(np.mean(supporting.across**2)))
    support = measure_support(
        feet.t,
        feet.across,
        z,
        along[-1],
        parameters.head_width_m,
        parameters.smoothing_xy_m,
        unseen_m=parameters.unseen_m,
        free=edges,
    ).between(start, end)
    xyz = np.column_stack([interpolate(line, along, stations), profile.at(stations)])
    figures = (len(supporting.t), 1000 * resid, 1000 * support.rms_m, bridged)
    return RailLine(xyz, 0, 0, *figures, gaps - start, support)


def measure_again(
    rails: Sequence[RailLine],
    points: RailPoints,
    head_width_m: float,
    smoothing_z_m: float,
    progress: Progress = SILENT,
) -> list[RailLine]:
    """Give finished rails heights of another smoothing and support anew: the same for rails read from files.

    Parameters
    ----------
    rails : sequence of RailLine
    points : RailPoints
    head_width_m : float
    smoothing_z_m : float
        Sigma of PAEK for the heights.
    progress : Progress

    Returns
    -------
    list of RailLine
        In their order; a rail without points keeps its heights, and is a gap from end to end.
    """
    plans = [resample(rail.xyz[:, :2], smoothing_z_m / 4)[0] for rail in rails]
    feet = project(plans, points.xyz[:, :2], widest_reach(head_width_m), progress.span(0.0, 0.7))
    # Of lines from anywhere nothing else is known than that they lie on their heads: these take the cell's place.
    parameters = ElevationParameters(head_width_m, smoothing_z_m=smoothing_z_m, cell_m=head_width_m)
    edges = free_edges(plans, head_width_m)
    measured = []
    for number, rail in enumerate(progress.span(0.7, 1.0).follow(rails)):
        mine = feet.of(number)
        again = _raise_line(plans[number], FIXED_ENDS, edges[number], mine, points.xyz[mine.point, 2], parameters)
        if again is None:
            measured.append(_unsupported(rail, parameters))
        else:
            measured.append(replace(rail, xyz=again.xyz, gaps=again.gaps, support=again.support))
    return measured


def _unsupported(rail: RailLine, parameters: ElevationParameters) -> RailLine:
    """Say of a rail that no points support it anywhere."""
    length_m = float(length_along(rail.xyz[:, :2])[-1])
    t = stations_along(length_m)
    support = Support(t, np.zeros(len(t), dtype=int), np.full(len(t), parameters.unseen_m))
    return replace(rail, gaps=np.array([[0.0, length_m]]), support=support)


def _supported(t: np.ndarray, length_m: float, free_ends: np.ndarray) -> tuple[float, float]:
    """Chainages between which a line is kept: all of it, but for free ends without points."""
    start, end = t[END_POINTS - 1], t[-END_POINTS]
    keep_start = not free_ends[0] or start <= UNSUPPORTED_END_M
    keep_end = not free_ends[1] or length_m - end <= UNSUPPORTED_END_M
    return 0.0 if keep_start else float(start), length_m if keep_end else float(end)


def find_gaps(t: np.ndarray, start: float, end: float) -> np.ndarray:
    """Find the stretches longer than BRIDGE_M without points from `start` to `end`, given the points' chainages.

    Returns
    -------
    (k, 2) array
        Start and end of each.
    """
    borders = np.concatenate([[start], np.clip(np.sort(t), start, end), [end]])
    wide = np.flatnonzero(np.diff(borders) > BRIDGE_M)
    return np.column_stack([borders[wide], borders[wide + 1]])
