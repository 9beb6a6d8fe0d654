"""Heights of rails, from the points on top of each railhead.

The steps are those of Gribov and Chang, section 8 (docs/method.md section 6.4): points are projected onto their line,
those on top of the head are selected by a rolling disc, and their heights are smoothed by PAEK.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..clouds.points import RailPoints
from ..lines.network import LineNetwork
from ..lines.smoothing import STATIONS_PER_SIGMA
from ..parameters import Parameters
from ..polyline import Feet, interpolate, length_along, project, resample, starts_at_its_end
from ..progress import SILENT, Progress
from ..rails import RailLine, Support
from .axis import CELL_M, Axis, unseen_m
from .blunt import SMOOTHING_M, wander
from .edges import Widths, search_distance, stations_along, widest
from .level import AXIS_SHARE, fit_crown, rough_level
from .neighbours import free_edges
from .own_level import on_own_level
from .smoother import KNOT_M
from .strips import StripOffsets, aligned, measure_strips
from .top import MIN_POINTS, Top, by_outline, find_top, smoothed

MIN_GAP_M, MAX_CHANCE_GAP_M = 0.5, 0.9
"""Length without points from which a line counts as bridged: five profiles of the fastest train's scanner. Where points
are few, shorter sections than the second length are bridged only if chance does not explain them."""

CHANCE_GAPS = 0.002
"""Gaps per metre of line that may be due to chance."""

MAX_UNSUPPORTED_END_M = 0.15
"""Length without points from which a free end is cut off: the raster's lines curl where a rail ends."""

NO_FREE_ENDS = np.zeros(2, dtype=bool)
"""Marks both ends of a line to be kept, with or without points."""

END_POINTS = 3
"""Number of points that mark the end of support; one alone may be a weed."""


@dataclass(frozen=True)
class ElevationParameters:
    """Parameters of the heights, in metres.

    Attributes
    ----------
    head_width_m : float
        Width of the railhead.
    tolerance_xy_m : float
        Maximum distance in plan from the line of a point that gives height, at most half a head.
    tolerance_z_m : float
        Maximum depth of a point below the top surface.
    crown_radius_m : float
        Radius of the disc that rolls along the top.
    smoothing_z_m : float or None
        See `Parameters`.
    cell_m : float
        Cell size of the raster from which the line was drawn.
    min_length_m : float
        Shorter lines are dropped.
    align : bool
        Whether the strips of the points are moved onto their mean.
    """

    head_width_m: float
    tolerance_xy_m: float = Parameters.tolerance_xy_m
    tolerance_z_m: float = Parameters.tolerance_z_m
    crown_radius_m: float = Parameters.crown_radius_m
    smoothing_z_m: float | None = Parameters.smoothing_z_m
    cell_m: float = CELL_M
    min_length_m: float = Parameters.min_length_m
    align: bool = False


def elevate(
    network: LineNetwork,
    points: RailPoints,
    parameters: ElevationParameters,
    progress: Progress = SILENT,
    strips: Sequence[StripOffsets | None] = (),
    head_width_m: Widths | None = None,
) -> tuple[RailLine, ...]:
    """Add heights and figures to the smoothed plan lines of a network.

    Parameters
    ----------
    network : LineNetwork
        Smoothed lines; lines that meet in a node still meet there.
    points : RailPoints
        The points from which the network was made.
    parameters : ElevationParameters
    progress : Progress
    strips : sequence of StripOffsets or None
        For each line, from `strips.strips_along`; empty if the points are of one strip.
    head_width_m : float or (n,) array, optional
        Width of the heads, of all lines or of each; that of the parameters by default.

    Returns
    -------
    tuple of RailLine
        In order of their starts from west to east, numbered from 1; without lines that are short or have no points.
    """
    widths = parameters.head_width_m if head_width_m is None else head_width_m
    feet = project(network.lines, points.xyz[:, :2], search_distance(widest(widths)), progress.span(0.0, 0.6))
    free_ends = (network.degrees() == 1)[network.ends]
    edges = free_edges(network.lines, widest(widths))
    of_lines = [replace(parameters, head_width_m=float(one)) for one in np.broadcast_to(widths, len(network.lines))]
    rails = []
    for number, line in enumerate(progress.span(0.6, 1.0).follow(network.lines)):
        own = strips[number] if strips else None
        rail = _measured(line, free_ends[number], edges[number], feet.of(number), points, of_lines[number], own)
        if rail is not None and rail.length_m >= parameters.min_length_m:
            rails.append(replace(rail, class_code=points.class_code))
    return numbered(rails)


def flat_rails(network: LineNetwork, class_code: int, parameters: ElevationParameters) -> tuple[RailLine, ...]:
    """Make rails without heights from the lines of a network.

    Parameters
    ----------
    network : LineNetwork
    class_code : int
    parameters : ElevationParameters

    Returns
    -------
    tuple of RailLine
        As from `elevate`, but with heights of NaN and figures of support of 0 or NaN.
    """
    rails = (flat_rail(line, class_code) for line in network.lines)
    return numbered([rail for rail in rails if rail.length_m >= parameters.min_length_m])


def flat_rail(line: np.ndarray, class_code: int) -> RailLine:
    """Make a rail without heights from a line in plan, (n, 2)."""
    xyz = np.column_stack([line, np.full(len(line), np.nan)])
    return RailLine(xyz, 0, class_code, points=0, resid_mm=np.nan, sigma_mm=np.nan, bridged_m=np.nan)


def numbered(rails: Sequence[RailLine]) -> tuple[RailLine, ...]:
    """Turn rails so that they start in the west, and number them from west to east."""
    directed = (rail.reversed() if starts_at_its_end(rail.xyz) else rail for rail in rails)
    ordered = sorted(directed, key=lambda rail: tuple(rail.xyz[0, :2]))
    return tuple(replace(rail, rail_id=number) for number, rail in enumerate(ordered, start=1))


def _measured(
    line: np.ndarray,
    free_ends: np.ndarray,
    edges: np.ndarray,
    feet: Feet,
    points: RailPoints,
    parameters: ElevationParameters,
    strips: StripOffsets | None,
) -> RailLine | None:
    """Measure one line, given the feet of its points and its strips; None if too few points support it."""
    z = points.xyz[feet.point, 2]
    if parameters.align:
        feet, z = aligned(strips, feet, z, points)
    own = on_own_level(feet.t, feet.across, z, parameters.head_width_m)
    feet, z = feet[own], z[own]
    head = np.abs(feet.across) <= min(0.5 * parameters.head_width_m, parameters.tolerance_xy_m)
    if head.sum() < MIN_POINTS:
        return None
    along = length_along(line)
    axis = Axis.of(line, feet.t, feet.across, z, parameters.head_width_m, edges, unseen_m(parameters.cell_m))
    if axis.flank is None:
        crown = fit_crown(feet.t, feet.across, z, parameters.head_width_m)
        level_z = z + crown.fall(feet.across)
        top = find_top(
            feet.t[head],
            feet.across[head],
            level_z[head],
            parameters.head_width_m,
            parameters.crown_radius_m,
            parameters.tolerance_z_m,
            parameters.smoothing_z_m or (SMOOTHING_M if axis.ridge else None),
        )
        if top is None:
            return None
        top = replace(top, crown_m=crown.error(parameters.head_width_m))
        if axis.ridge is None and parameters.smoothing_z_m is None:
            flat_z = level_z[head] - top.slope * feet.across[head]
            near_axis = np.abs(feet.across[head]) <= AXIS_SHARE * parameters.head_width_m
            top = by_outline(top, feet.t[head], flat_z, near_axis, axis.shown.outline, along[-1])
    else:
        head = np.ones(len(z), dtype=bool)
        above_m = axis.flank.top_m - np.mean(z - rough_level(feet.t, z))
        top = Top(smoothed(feet.t, z + above_m, parameters.smoothing_z_m), head, np.zeros(len(z)))
    supporting = feet[head][top.points]
    start, end = _supported(supporting.t, along[-1], free_ends)
    stations = np.concatenate([[start], along[(along > start) & (along < end)], [end]])
    gaps = find_gaps(supporting.t, start, end)
    bridged = float(np.sum(gaps[:, 1] - gaps[:, 0]))
    resid = float(np.sqrt(np.mean(supporting.across**2)))
    support = axis.support(strips is not None)
    error_m = top.height_error(supporting.t, support)
    if axis.ridge is not None:
        error_m = np.hypot(error_m, wander(top.course.at(support.t)))
    support = replace(support, sigmaz_m=np.hypot(error_m, np.nan_to_num(support.heights_m)))
    if strips is not None:
        support = strips.added_to(support, parameters.align)
    support = support.between(start, end)
    xyz = np.column_stack([interpolate(line, along, stations), top.course.at(stations)])
    figures = (len(supporting.t), 1000 * resid, 1000 * support.rms_m, bridged)
    return RailLine(xyz, 0, 0, *figures, gaps - start, support, sigmaz_mm=1000 * support.rmsz_m)


def measure_again(
    rails: Sequence[RailLine],
    points: RailPoints,
    head_width_m: Widths,
    smoothing_z_m: float | None,
    progress: Progress = SILENT,
    align: bool = False,
) -> list[RailLine]:
    """Measure heights, with another smoothing, and the support of finished rails, which may come from files.

    Parameters
    ----------
    rails : sequence of RailLine
    points : RailPoints
    head_width_m : float or (n,) array
        Width of the heads, of all rails or of each.
    smoothing_z_m : float or None
        See `Parameters`.
    progress : Progress
    align : bool
        See `ElevationParameters`.

    Returns
    -------
    list of RailLine
        In the order given. A rail without points keeps its heights and is a gap from end to end.
    """
    step_m = KNOT_M if smoothing_z_m is None else smoothing_z_m / STATIONS_PER_SIGMA
    plans = [resample(rail.xyz[:, :2], step_m)[0] for rail in rails]
    feet = project(plans, points.xyz[:, :2], search_distance(widest(head_width_m)), progress.span(0.0, 0.7))
    # Lines from a file are only known to be on their heads, so the head width takes the place of the cell size.
    of_rails = [
        ElevationParameters(float(one), smoothing_z_m=smoothing_z_m, cell_m=float(one), align=align)
        for one in np.broadcast_to(head_width_m, len(rails))
    ]
    edges = free_edges(plans, widest(head_width_m))
    strips = measure_strips(plans, feet, points, edges, head_width_m)
    measured = []
    for number, rail in enumerate(progress.span(0.7, 1.0).follow(rails)):
        own = feet.of(number)
        again = _measured(plans[number], NO_FREE_ENDS, edges[number], own, points, of_rails[number], strips[number])
        if again is None:
            measured.append(_unsupported(rail, of_rails[number]))
        else:
            measured.append(replace(rail, xyz=again.xyz, gaps=again.gaps, support=_with_strips_of(rail, again.support)))
    return measured


def _with_strips_of(rail: RailLine, support: Support | None) -> Support | None:
    """Let a support state the strips as the rail did before, which was measured with more of its surroundings."""
    before = rail.support
    if before is None or before.strips is None or support is None:
        return support
    strips = before.strips[np.searchsorted(0.5 * (before.t[1:] + before.t[:-1]), support.t)]
    own = np.sqrt(np.maximum(support.sigma_m**2 - support.every_strip[:, 2] ** 2, 0.0))
    return replace(support, sigma_m=np.hypot(own, strips[:, 2]), strips=strips)


def _unsupported(rail: RailLine, parameters: ElevationParameters) -> RailLine:
    """Mark a rail as supported nowhere."""
    length_m = float(length_along(rail.xyz[:, :2])[-1])
    t = stations_along(length_m)
    support = Support(t, np.zeros(len(t), dtype=int), np.full(len(t), unseen_m(parameters.cell_m)))
    return replace(rail, gaps=np.array([[0.0, length_m]]), support=support)


def _supported(t: np.ndarray, length_m: float, free_ends: np.ndarray) -> tuple[float, float]:
    """Return the chainages between which a line is kept: all of it except free ends without points.

    Where points are few, the first of those that mark the end is expected further out.
    """
    further_m = max((END_POINTS - 1) / _points_per_m(np.diff(np.sort(t))) - MAX_UNSUPPORTED_END_M, 0.0)
    start, end = max(t[END_POINTS - 1] - further_m, 0.0), min(t[-END_POINTS] + further_m, length_m)
    keep_start = not free_ends[0] or start <= MAX_UNSUPPORTED_END_M
    keep_end = not free_ends[1] or length_m - end <= MAX_UNSUPPORTED_END_M
    return 0.0 if keep_start else float(start), length_m if keep_end else float(end)


def find_gaps(t: np.ndarray, start: float, end: float) -> np.ndarray:
    """Find the gaps between the points of a line: longer than MIN_GAP_M, and than chance makes them.

    Of n points per metre at random places, n exp(-n g) per metre are followed by a gap longer than g.

    Parameters
    ----------
    t : (n,) array
        Chainages of the points.
    start, end : float
        Chainages of the ends of the line.

    Returns
    -------
    (k, 2) array
        Start and end of each gap.
    """
    borders = np.concatenate([[start], np.clip(np.sort(t), start, end), [end]])
    per_m = _points_per_m(np.diff(borders))
    by_chance_m = np.log(max(per_m / CHANCE_GAPS, 1.0)) / per_m
    wide = np.flatnonzero(np.diff(borders) > np.clip(by_chance_m, MIN_GAP_M, MAX_CHANCE_GAP_M))
    return np.column_stack([borders[wide], borders[wide + 1]])


def _points_per_m(spacings_m: np.ndarray) -> float:
    """Estimate the points per metre, n, at random places, from the median of their spacings, which is 0.69 / n."""
    return float(np.log(2) / max(float(np.median(spacings_m)), 1e-3))
