"""Track centerlines: the line midway between the two rails of a track, and forks (docs/method.md section 8).

The rails of a branch become separate lines only where they are more than a head from the stock rails, some metres
beyond the point where the centerlines part. In between, a track leaves another tangentially, so that its distance grows
with the square of the way, or it leaves at the small angle of a straight switch. The centerline of the branch is
extended back to the point where it leaves the through track.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..errors import NoTrackError
from ..lines.ends import ARC, ROUNDS, STRAIGHT, PartingLaw, left_of
from ..lines.finishing import finished, united
from ..lines.smoothing import STATIONS_PER_SIGMA, smooth_line
from ..parameters import Parameters
from ..polyline import MIN_RING_M, Polyline
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine
from ..spread import rms
from ..standards import distinct_gauges
from .chaining import MEETING_STEP_M, TrackChain, chain_pairs, provisional_centerline, runs_on, single_rail_limit
from .midline import (
    MAX_OFFSET_M,
    Side,
    at_gauge,
    bridged_steps,
    midway,
)
from .pairing import pair_rails, refuse_other_spacing
from .parallels import SAMPLE_STEP_M

MAX_APART_M = 0.3
"""Largest distance of the end of a branch from the track that it left: rails are separate when heads and flangeway are
side by side, at 0.12 m, or a few raster cells later."""

TOUCH_M = 0.002
"""An end this close to a track is on it, within the tolerance of thinning."""

FIT_WITHIN_M = 0.8
"""A branch bends evenly at least up to this distance: 6 m along the branch of a tramway, 63 m along the widest one."""

MIN_LENGTH_M = 3.0
"""Shorter branches do not show where they begin."""

MISFIT_M = 0.01
"""Largest distance of a branch from the parabola: that of a lead that begins straight, or of stairs of the raster."""

BENT_M = 0.0025
"""A branch further from the parabola, root mean square, has a straight switch: a heel of 0.15 m leaves 3 mm."""

HEEL_STEP_M = 0.5
"""Step in which the end of a straight switch is searched; straight switches are 3 to 12 m long."""

MAX_BACK_M = 40.0
"""Largest extension: a branch of 2500 m radius, the widest in use, is 0.3 m from the through track after 39 m."""

SEEN_M = 150.0
"""Length of either line next to the end that is considered. What matters is between 40 m before the end and 89 m behind
it, where the widest branch is 1.6 m from the through track."""

VERTEX_STEP_M = 0.2
"""Spacing of the vertices of the extension, as on smoothed centerlines."""

START_STEP_M = 0.05
"""Spacing of the places where a closed rail may start: the rails of a track then start abreast to within half of it."""

MAX_SEAM_M = 0.5
"""Maximum distance between the ends of a ring's centerline, which may overlap or leave a gap: matches end a little
early."""


def fork_centerlines(lines: Sequence[Centerline], progress: Progress = SILENT) -> list[Centerline]:
    """Extend branches back to the tracks that they leave, and give these tracks a vertex there.

    Takes lines of one gauge and class and returns them in the same order; the extension counts as bridged.
    """
    forked = list(lines)
    for branch, end, through in progress.follow(list(_near_ends(lines))):
        turn = 1 if end == 0 else -1
        side, main = forked[branch].xyz[::turn], forked[through].xyz
        start, seen = _seen_from(side[0], side), _seen_from(side[0], main)
        extended = _extended(side[start], main[seen])
        if extended is not None:
            side = np.concatenate([extended, side[start.stop :]])
            forked[branch] = _with_bridged(forked[branch], side[::turn])
            main = np.concatenate([main[: seen.start], _with_vertex(main[seen], extended[0]), main[seen.stop :]])
            forked[through] = replace(forked[through], xyz=main)
    return forked


def _seen_from(place: np.ndarray, line: np.ndarray) -> slice:
    """Return the range of vertices around the one nearest to a place that are less than `SEEN_M` away."""
    away = np.hypot(*(line[:, :2] - place[:2]).T)
    nearest = int(np.argmin(away))
    hidden = np.flatnonzero(away >= SEEN_M)
    before, after = hidden[hidden < nearest], hidden[hidden > nearest]
    return slice(before[-1] + 1 if len(before) else 0, after[0] if len(after) else len(line))


def _near_ends(lines: Sequence[Centerline]) -> Iterator[tuple[int, int, int]]:
    """Yield the ends near another line: number of the line, 0 or -1 for its end, and number of the nearest line."""
    if len(lines) < 2:
        return
    stations_of = [line.line.resampled(SAMPLE_STEP_M).xy for line in lines]
    number = np.repeat(np.arange(len(lines)), [len(one) for one in stations_of])
    stations = np.concatenate(stations_of)
    tree = cKDTree(stations)
    for line, end in ((line, end) for line in range(len(lines)) for end in (0, -1)):
        place = lines[line].xyz[end, :2]
        near = [other for other in tree.query_ball_point(place, MAX_APART_M + SAMPLE_STEP_M) if number[other] != line]
        if near:
            yield line, end, int(number[min(near, key=lambda other: np.hypot(*(stations[other] - place)))])


def _extended(branch: np.ndarray, through: np.ndarray) -> np.ndarray | None:
    """Extend the start of a branch back to a through track, both (n, 3); None if they do not meet within reach."""
    s, feet = Polyline(branch).t, Polyline(through).feet(branch[:, :2], FIT_WITHIN_M)
    order = np.argsort(feet.point)
    count = int(np.argmin(np.append(feet.point[order] == np.arange(len(order)), False)))
    s, t, off = s[:count], feet.t[order][:count], feet.across[order][:count]
    if not count or s[-1] < MIN_LENGTH_M or abs(off[0]) > MAX_APART_M:
        return None
    law, misfit_m = _law(s, off)
    first = int(np.searchsorted(s, law.touch))
    joins = max(first, int(np.max(np.flatnonzero(misfit_m > MISFIT_M), initial=-1)) + 1)
    if joins > len(s) // 2 or law.touch < -MAX_BACK_M:
        return None
    length = s[joins] - law.touch if s[joins] - law.touch > VERTEX_STEP_M else 0.0
    along = Polyline(through).t
    parting = t[joins] - np.sign(t[-1] - t[0]) * length
    if not 0 <= parting <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / VERTEX_STEP_M)) + 1)
    chainage = parting + share * (t[joins] - parting)
    grown = share**law.power * (length > 0)
    rise = branch[joins, 2] - np.interp(t[joins], along, through[:, 2])
    plan = left_of(through[:, :2], chainage, grown * off[joins])
    start = np.column_stack([plan, np.interp(chainage, along, through[:, 2]) + grown * rise])
    return np.concatenate([start, branch[joins + 1 :]])


def _law(s: np.ndarray, off: np.ndarray) -> tuple[PartingLaw, np.ndarray]:
    """Find the law by which a branch leaves the through track: an arc, or else an angle; and the misfit, metres.

    Given are the distances between the tracks, (n,), at `s` along the branch.
    """
    off = np.sign(off[-1]) * off
    arc, arc_misfit_m = _arc(s, off)
    if rms(arc_misfit_m) <= BENT_M:
        return arc, arc_misfit_m
    heels_m = np.arange(HEEL_STEP_M, s[-1] / 2, HEEL_STEP_M)
    angle, angle_misfit_m = min((_angle(s, off, heel_m) for heel_m in heels_m), key=lambda found: rms(found[1]))
    if rms(angle_misfit_m) < rms(arc_misfit_m) / 2 and np.isfinite(angle.touch):
        return angle, angle_misfit_m
    return arc, arc_misfit_m


def _arc(s: np.ndarray, off: np.ndarray) -> tuple[PartingLaw, np.ndarray]:
    """Fit a parabola that touches the through track, with less weight where the raster bent merging rails."""
    weights = np.sqrt(np.maximum(off, 0.0)) + np.sqrt(TOUCH_M)  # the smaller a distance, the less certain its root
    trust = np.ones_like(s)
    for _ in range(ROUNDS):
        law = PartingLaw.fitted(s, off, ARC, weights * trust)
        misfit_m = np.abs(off - law(s))
        trust = 1 / np.sqrt(1 + (misfit_m / MISFIT_M) ** 2)
    return law, misfit_m


def _angle(s: np.ndarray, off: np.ndarray, heel_m: float) -> tuple[PartingLaw, np.ndarray]:
    """Fit a straight switch up to `heel_m` along the branch and an arc behind it."""
    terms = np.column_stack([np.ones_like(s), s, np.maximum(s - heel_m, 0.0) ** 2])
    (root, slope, bend), *_ = np.linalg.lstsq(terms, off, rcond=None)
    return PartingLaw(slope if bend > 0 else 0.0, root, STRAIGHT), np.abs(off - terms @ (root, slope, bend))


def _with_bridged(line: Centerline, xyz: np.ndarray) -> Centerline:
    """Give a branch its new vertices; the extension has no rails of its own."""
    added = Polyline(xyz).length_m - line.line.length_m
    return replace(line, xyz=xyz, bridged_m=line.bridged_m + max(added, 0.0))


def _with_vertex(xyz: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """Give a line a vertex at a place on it; a vertex within `TOUCH_M` moves to the place instead."""
    away = np.hypot(*(xyz[:, :2] - vertex[:2]).T)
    nearest = int(np.argmin(away))
    if away[nearest] <= TOUCH_M:
        moved = xyz.copy()
        moved[nearest] = vertex
        return moved
    line = Polyline(xyz)
    return np.insert(xyz, np.searchsorted(line.t, line.feet(vertex[None, :2], TOUCH_M).t), vertex, axis=0)


def tracks_of(rails: Sequence[RailLine], parameters: Parameters, progress: Progress = SILENT) -> list[Centerline]:
    """Pair the rails of each class at every gauge, and draw, simplify and number the centerlines.

    Takes the rails as the user gets them, so that rails from a file give the same tracks. Raises NoTrackError if rails
    run parallel, but in no class at one of the gauges; if that is true of some classes only, the user is warned
    instead.
    """
    codes = sorted({rail.class_code for rail in rails})
    centerlines: list[Centerline] = []
    errors: dict[int, NoTrackError] = {}
    for code, share in zip(codes, progress.split(len(codes))):
        try:
            centerlines += tracks_of_class([rail for rail in rails if rail.class_code == code], parameters, share)
        except NoTrackError as error:
            errors[code] = error
    if errors and not centerlines:
        raise next(iter(errors.values()))
    for code, without_track in errors.items():
        progress.warning(f"Class {code}: {without_track}")
    return [replace(line, track_id=number) for number, line in enumerate(centerlines, start=1)]


def tracks_of_class(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> tuple[Centerline, ...]:
    """Pair the rails of one class; see `tracks_of`."""
    distinct = distinct_gauges(parameters.gauges_m, parameters.centerline_tolerance_m)
    gauges = [(gauge_m, dict(parameters.gauges)[gauge_m]) for gauge_m in distinct]
    centerlines: list[Centerline] = []
    errors: list[NoTrackError] = []
    for one, step in zip(gauges, progress.split(len(gauges))):
        others_m = [sum(other) for other in gauges if other != one]
        try:
            centerlines += build_centerlines(
                rails, replace(parameters, gauge_m=one[0], head_width_m=one[1]), others_m, step
            )
        except NoTrackError as error:
            errors.append(error)
    if errors and not centerlines:
        raise errors[0]
    if not centerlines:
        progress.warning("No two rails run parallel: there are rails but no track centerlines.")
    return finished(centerlines, parameters, progress)


def build_centerlines(
    rails: Sequence[RailLine],
    parameters: Parameters,
    other_spacings_m: Sequence[float] = (),
    progress: Progress = SILENT,
) -> tuple[Centerline, ...]:
    """Draw the centerlines of all tracks of one gauge, numbered from 1 in order of their starts from west to east.

    The result refers to the rails by their ids; rails without heights give centerlines without heights. Rails closer to
    `other_spacings_m`, the distances of the rails of other gauges, are left to these.
    """
    rails = _in_order(rails)
    pairs = pair_rails(rails, parameters, other_spacings_m, progress.span(0.0, 0.5))
    if not pairs:
        refuse_other_spacing(rails, parameters)
    chains = chain_pairs(rails, pairs, parameters.max_gap_m, parameters.centerline_tolerance_m)
    drawn = [_draw(rails, chain, parameters) for chain in progress.span(0.5, 0.95).follow(chains)]
    kept = [line for line in drawn if line is not None and line.length_m >= parameters.min_length_m]
    forked = fork_centerlines(kept, progress.span(0.95, 1.0))
    ordered = sorted(forked, key=lambda line: tuple(line.xyz[0, :2]))
    return tuple(replace(line, track_id=number) for number, line in enumerate(ordered, start=1))


def _in_order(rails: Sequence[RailLine]) -> list[RailLine]:
    """Sort rails by place and turn them to start in the west: tracks must not depend on the order of the rails."""
    turned = [rail.reversed() if rail.line.starts_at_its_end else rail for rail in rails]
    return started_abreast(sorted(turned, key=lambda rail: (*rail.xyz[0, :2], *rail.xyz[-1, :2], rail.length_m)))


def _draw(rails: Sequence[RailLine], chain: TrackChain, parameters: Parameters) -> Centerline | None:
    """Draw the centerline of one track; None if its rails are nowhere opposite each other."""
    spacing_m = parameters.gauge_m + parameters.head_width_m
    reach_m, tolerance_m = single_rail_limit(parameters.max_gap_m), parameters.centerline_tolerance_m
    provisional = Polyline(provisional_centerline(rails, chain, spacing_m / 2, reach_m))
    drawn = Polyline(provisional.resampled(MEETING_STEP_M).xyz)
    stations, normals = drawn.xyz, drawn.normals
    spans = (
        _spans((pair.left, pair.left_span) for pair in chain.pairs),
        _spans((pair.right, pair.right_span) for pair in chain.pairs),
    )
    # The stations are half a gauge from one rail, so the other is off by the whole deviation of the gauge.
    left, right = (
        Side.of(rails, side, reach_m).meet(stations, ways, spacing_m / 2, max(MAX_OFFSET_M, tolerance_m))
        for side, ways in zip(spans, (normals, -normals))
    )
    left, right = at_gauge(left, right, spacing_m, tolerance_m)
    apart = left.distance_m + right.distance_m
    both = ~np.isnan(apart)
    if not both.any():
        return None
    xyz = midway(stations, normals, left, right)
    cant = (left.height_m - right.height_m)[both]
    gauge = np.hypot(apart[both], np.nan_to_num(cant)) - parameters.head_width_m
    numbers = {number for side in spans for number, _ in side}
    if all(rails[number].line.is_closed for number in numbers):
        xyz = closed_centerline(xyz)
    xyz = _smoothed(xyz, parameters.smoothing_xy_m)
    bridged_m = float(bridged_steps(rails, left, right, drawn.t).sum())
    ids = [tuple(dict.fromkeys(rails[number].rail_id for number, _ in side)) for side in spans]
    if Polyline(xyz).starts_at_its_end:
        xyz, cant, ids = xyz[::-1], -cant, [side[::-1] for side in ids[::-1]]
    return Centerline(
        xyz=xyz,
        track_id=0,
        class_code=rails[chain.pairs[0].left].class_code,
        left_ids=ids[0],
        right_ids=ids[1],
        gauge_mm=1000 * float(gauge.mean()),
        gaugesd_mm=1000 * float(gauge.std()),
        cant_mm=1000 * float(cant.mean()),
        cantmax_mm=1000 * float(cant[np.argmax(np.abs(cant))]),
        bridged_m=bridged_m if all(rails[number].knows_gaps for number in numbers) else np.nan,
    )


def _spans(sections: Iterable[tuple[int, tuple[float, float]]]) -> list[tuple[int, tuple[float, float]]]:
    """List a track's rails on one side and their sections, merging sections between which the rail continues."""
    merged: list[tuple[int, tuple[float, float]]] = []
    for rail, span in sections:
        if merged and rail == merged[-1][0] and runs_on(merged[-1][1], span):
            merged[-1] = (rail, (merged[-1][1][0], span[1]))
        else:
            merged.append((rail, span))
    return merged


def _smoothed(xyz: np.ndarray, smoothing_m: float) -> np.ndarray:
    """Smooth a centerline, (n, 3), in plan, with vertices as close as its shape requires."""
    line = Polyline(xyz)
    stations, closed = line.resampled(smoothing_m / STATIONS_PER_SIGMA), line.is_closed
    # The ends are free, because rails are smooth already and a fixed end would straighten a curve.
    plan = smooth_line(line.xy, smoothing_m, stations.t, ends="free", closed=closed)
    smooth = np.column_stack([plan, stations.xyz[:, 2]])
    return np.concatenate([smooth[:-1], smooth[:1]]) if closed else smooth


def started_abreast(rails: Sequence[RailLine]) -> list[RailLine]:
    """Move the start of closed rails to the place nearest to the start of the first one.

    The rails of a track then start on a common normal, wherever they started before.
    """
    place = next((rail.xyz[0, :2] for rail in rails if rail.line.is_closed), None)
    if place is None:
        return list(rails)
    return [_started_near(rail, place) if rail.line.is_closed else rail for rail in rails]


def _started_near(rail: RailLine, place: np.ndarray) -> RailLine:
    """Move the start of a closed rail to the place nearest to a given one, (2,)."""
    stations = rail.line.resampled(START_STEP_M)
    start, end = stations.t[np.argmin(np.linalg.norm(stations.xy - place, axis=1))], stations.t[-1]
    if start in (0.0, end):
        return rail
    return united([rail.between(start, end), rail.between(0.0, start)])


def closed_centerline(xyz: np.ndarray) -> np.ndarray:
    """Close a centerline, (n, d), drawn along closed rails if its ends are close together."""
    away = np.linalg.norm(xyz[:, :2] - xyz[0, :2], axis=1)
    along = Polyline(xyz).t
    if away[-1] > MAX_SEAM_M or along[-1] <= MIN_RING_M:
        return xyz
    ahead = (xyz[:, :2] - xyz[0, :2]) @ (xyz[1, :2] - xyz[0, :2])
    past = (along > along[-1] - 2 * MAX_SEAM_M) & (away <= 2 * MAX_SEAM_M) & (ahead >= 0)
    return np.concatenate([xyz[~past], xyz[:1]])
