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
from ..parameters import Parameters
from ..polyline import Polyline, project
from ..progress import SILENT, Progress
from ..rails import RailLine, Support
from .axis import CELL_M, Axis, unseen_m
from .faces import above_course
from .head_points import STATION_STEP_M, HeadPoints, Widths, near_lines, stations_along
from .own_level import on_own_level
from .smoother import BLUNT_HEIGHTS, KNOT_M, SHARP
from .strips import StripOffsets, measure_strips
from .top import MIN_POINTS, Top, by_lone_ridge, by_outline, find_top, fit_crown, smoothed
from .unmarked import told_apart

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
    tolerance_xy_m : float
        Maximum distance in plan from the line of a point that gives height, at most half a head.
    tolerance_z_m : float
        Maximum depth of a point below the top surface.
    crown_radius_m : float
        Radius of the disc that rolls along the top.
    cell_m : float
        Cell size of the raster from which the line was drawn.
    min_length_m : float
        Shorter lines are dropped.
    align : bool
        Whether the strips of the points are moved onto their mean.
    """

    tolerance_xy_m: float = Parameters.tolerance_xy_m
    tolerance_z_m: float = Parameters.tolerance_z_m
    crown_radius_m: float = Parameters.crown_radius_m
    smoothing_z_m: float | None = Parameters.smoothing_z_m
    cell_m: float = CELL_M
    min_length_m: float = Parameters.min_length_m
    align: bool = False


def elevate(
    network: LineNetwork,
    near: Sequence[HeadPoints],
    class_code: int,
    parameters: ElevationParameters = ElevationParameters(),
    progress: Progress = SILENT,
    strips: Sequence[StripOffsets | None] = (),
) -> tuple[RailLine, ...]:
    """Add heights and figures to the smoothed plan lines of a network, which still meet where they meet in a node.

    Points and offsets of the strips are given by line; offsets are empty if the points are of one strip. The rails are
    numbered from 1 in order of their starts from west to east; those that are short or have no points are left out.
    """
    free_ends = (network.degrees() == 1)[network.ends]
    rails, shared_m = [], []
    for number, points in enumerate(progress.follow(near)):
        rail = _measured(points, free_ends[number], parameters, strips[number] if strips else None)
        if rail is not None and rail.length_m >= parameters.min_length_m:
            rails.append(replace(rail, class_code=class_code))
            shared_m.append(shared_ends(points))
    return numbered(begun_on_others(rails, parameters.tolerance_xy_m, shared_m))


def begun_on_others(
    rails: Sequence[RailLine], reach_m: float, shared_m: Sequence[tuple[float, float]] = ()
) -> list[RailLine]:
    """Give ends that no points show the height of the rail on whose head they begin, within `reach_m` of it.

    A branch begins on its stock rail, on the same sleepers. Where points show neither blade nor frog, its heights would
    be extrapolated for up to 10 m; the grade where its points begin stays as it is. `shared_m` are the lengths of both
    ends of each rail that points show as one with others; see `shared_ends`.
    """
    level = []
    for number, rail in enumerate(rails):
        others = [other for other in rails if other is not rail]
        for ends_m in shared_m[number] if shared_m else (0.0, 0.0):
            rail = _begun_on(others, rail, reach_m, ends_m).reversed()
        level.append(rail)
    return level


def _begun_on(others: Sequence[RailLine], rail: RailLine, reach_m: float, shared_m: float) -> RailLine:
    """Give the start of a rail, if it is in a gap or shared, the height of another rail there that has points."""
    gap_m = max(rail.gaps[0, 1] if len(rail.gaps) and rail.gaps[0, 0] == 0 else 0.0, shared_m)
    feet = project([other.xyz[:, :2] for other in others if gap_m], rail.xyz[:1, :2], reach_m)
    if not len(feet.t):
        return rail
    other, (t,), along = others[feet.line[0]], feet.t, rail.line.t
    if not shared_m and any(start <= t <= end for start, end in other.gaps):
        return rail
    above_m = np.interp(t, other.line.t, other.xyz[:, 2]) - rail.xyz[0, 2]
    way = np.minimum(along / gap_m, 1.0)
    # A ridge of both is about as high up to where they part; a gap is extrapolated, the further the worse.
    raised_m = above_m * (1 - way**2 if shared_m else (1 - way) ** 2)
    return replace(rail, xyz=rail.xyz + raised_m[:, None] * [0.0, 0.0, 1.0])


def shared_ends(points: HeadPoints) -> tuple[float, float]:
    """Return the lengths at both ends of a line over which its ridge is one with those of other heads, metres.

    Sharp heads are as high beside others as alone.
    """
    alone = np.flatnonzero(points.free.all(axis=0))
    if not points.is_blunt or not len(alone):
        return 0.0, 0.0
    return float(STATION_STEP_M * alone[0]), float(STATION_STEP_M * (points.free.shape[1] - 1 - alone[-1]))


def flat_rails(network: LineNetwork, class_code: int, parameters: ElevationParameters) -> tuple[RailLine, ...]:
    """Make rails as from `elevate`, but with heights of NaN and figures of support of 0 or NaN."""
    rails = (flat_rail(line, class_code) for line in network.lines)
    return numbered([rail for rail in rails if rail.length_m >= parameters.min_length_m])


def flat_rail(line: np.ndarray, class_code: int) -> RailLine:
    """Make a rail without heights from a line in plan, (n, 2)."""
    xyz = np.column_stack([line, np.full(len(line), np.nan)])
    return RailLine(xyz, 0, class_code, points=0, resid_mm=np.nan, sigma_mm=np.nan, bridged_m=np.nan)


def numbered(rails: Sequence[RailLine]) -> tuple[RailLine, ...]:
    """Turn rails so that they start in the west, and number them from west to east."""
    directed = (rail.reversed() if rail.line.starts_at_its_end else rail for rail in rails)
    ordered = sorted(directed, key=lambda rail: tuple(rail.xyz[0, :2]))
    return tuple(replace(rail, rail_id=number) for number, rail in enumerate(ordered, start=1))


def _measured(
    near: HeadPoints, free_ends: np.ndarray, parameters: ElevationParameters, strips: StripOffsets | None
) -> RailLine | None:
    """Measure one line, given its points and their strips; None if too few points support it."""
    own = on_own_level(strips.moved(near, parameters.align) if strips else near)
    axis = Axis.of(own, unseen_m(parameters.cell_m))
    top = _top_of(own, axis, parameters)
    if top is None:
        return None
    along, supporting = near.along, top.points
    start, end = _supported(supporting.t, near.length_m, free_ends)
    stations = np.concatenate([[start], along[(along > start) & (along < end)], [end]])
    gaps = find_gaps(supporting.t, start, end)
    bridged = float(np.sum(gaps[:, 1] - gaps[:, 0]))
    resid = float(np.sqrt(np.mean(supporting.across**2)))
    support = axis.support(strips is not None)
    error_m = top.height_error(support)
    support = replace(support, sigmaz_m=np.hypot(error_m, np.nan_to_num(support.sigmaz_m)))
    if strips is not None:
        support = strips.added_to(support, parameters.align)
    support = support.between(start, end)
    xyz = np.column_stack([Polyline(near.line).at(stations), top.course.at(stations)])
    figures = (len(supporting.t), 1000 * resid, 1000 * support.rms_m, bridged)
    return RailLine(xyz, 0, 0, *figures, gaps - start, support, sigmaz_mm=1000 * support.rmsz_m)


def _top_of(points: HeadPoints, axis: Axis, parameters: ElevationParameters) -> Top | None:
    """Find the top of a head; None if too few points are on it."""
    head = points[points.within(min(0.5, parameters.tolerance_xy_m / points.width_m))]
    if len(head.t) < MIN_POINTS:
        return None
    if axis.flank is not None:
        above_m = axis.flank.top_m - np.mean(above_course(points))
        course = smoothed(points.t, points.z + above_m, parameters.smoothing_z_m)
        return Top(course, points, np.zeros(len(points.t)))
    crown = fit_crown(points)
    level = replace(head, z=head.z + crown.fall(head.across))
    smoothing_m, prior = parameters.smoothing_z_m, BLUNT_HEIGHTS if axis.ridge else SHARP
    top = find_top(level, parameters.crown_radius_m, parameters.tolerance_z_m, smoothing_m, prior)
    if top is None:
        return None
    top = replace(top, crown_m=crown.error(points.width_m))
    if axis.ridge:
        return by_lone_ridge(top, smoothing_m, prior)
    return top if smoothing_m is not None else by_outline(top, axis.shown.outline)


def measure_again(
    rails: Sequence[RailLine],
    points: RailPoints,
    head_width_m: Widths,
    progress: Progress = SILENT,
    align: bool = False,
) -> list[RailLine]:
    """Measure heights, as far as the points show them, and the support of finished rails, which may come from files.

    Returns rails in the order given; one without points keeps its heights and is a gap from end to end.
    """
    plans = [rail.line.resampled(KNOT_M).xy for rail in rails]
    points = told_apart(points, plans, head_width_m)
    near = near_lines(plans, points, head_width_m, progress.span(0.0, 0.7))
    measured = []
    for rail, head in zip(rails, progress.span(0.7, 1.0).follow(near)):
        # Lines from a file are only known to be on their heads, so the head width takes the place of the cell size.
        parameters = ElevationParameters(cell_m=head.width_m, align=align)
        again = _measured(head, NO_FREE_ENDS, parameters, measure_strips(head))
        if again is None:
            measured.append(_unsupported(rail, head.width_m))
        else:
            measured.append(replace(rail, xyz=again.xyz, gaps=again.gaps, support=_with_strips_of(rail, again.support)))
    return measured


def _with_strips_of(rail: RailLine, support: Support | None) -> Support | None:
    """Keep the strips that the rail was measured with before: more of its surroundings were seen then."""
    before = rail.support
    if before is None or support is None:
        return support
    strips = before.strips[np.searchsorted(0.5 * (before.t[1:] + before.t[:-1]), support.t)]
    own = np.sqrt(np.maximum(support.sigma_m**2 - support.strips[:, 2] ** 2, 0.0))
    return replace(support, sigma_m=np.hypot(own, strips[:, 2]), strips=strips)


def _unsupported(rail: RailLine, head_width_m: float) -> RailLine:
    """Mark a rail as supported nowhere."""
    length_m = rail.line.length_m
    t = stations_along(length_m)
    support = Support.of_one_strip(t, np.zeros(len(t), dtype=int), np.full(len(t), unseen_m(head_width_m)))
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
    """Find the gaps, (k, 2), between points at chainages `t`, (n,): longer than MIN_GAP_M, and than chance makes them.

    Of n points per metre at random places, n exp(-n g) per metre are followed by a gap longer than g.
    """
    borders = np.concatenate([[start], np.clip(np.sort(t), start, end), [end]])
    per_m = _points_per_m(np.diff(borders))
    by_chance_m = np.log(max(per_m / CHANCE_GAPS, 1.0)) / per_m
    wide = np.flatnonzero(np.diff(borders) > np.clip(by_chance_m, MIN_GAP_M, MAX_CHANCE_GAP_M))
    return np.column_stack([borders[wide], borders[wide + 1]])


def _points_per_m(spacings_m: np.ndarray) -> float:
    """Estimate the points per metre, n, at random places, from the median of their spacings, which is 0.69 / n."""
    return float(np.log(2) / max(float(np.median(spacings_m)), 1e-3))
