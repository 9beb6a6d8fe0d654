"""Track centerlines: the line midway between the two rails of a track (docs/method.md section 8)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..errors import NoTrackError
from ..lines.finishing import finished, united
from ..lines.smoothing import STATIONS_PER_SIGMA, smooth_line
from ..parameters import Parameters
from ..polyline import MIN_RING_M, Polyline
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine
from ..standards import closest_standard, distinct_gauges
from .chaining import Chain, chain_pairs, runs_on, single_rail_limit
from .forking import fork_centerlines
from .midline import (
    MAX_OFFSET_M,
    PROVISIONAL_STEP_M,
    Side,
    at_gauge,
    bridged_steps,
    midway,
    provisional_centerline,
)
from .pairing import MIN_SECTION_M, pair_rails
from .parallels import most_common_spacing

START_STEP_M = 0.05
"""Spacing of the places where a closed rail may start: the rails of a track then start abreast to within half of it."""

MAX_SEAM_M = 0.5
"""Maximum distance between the ends of a ring's centerline, which may overlap or leave a gap: matches end a little
early."""


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
    `other_spacings_m`, the distances of the rails of other gauges, are left to these. Raises NoTrackError if rails are
    parallel, but at another spacing.
    """
    rails = _in_order(rails)
    pairs = pair_rails(rails, parameters, other_spacings_m, progress.span(0.0, 0.5))
    if not pairs:
        _refuse_other_spacing(rails, parameters)
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


def _refuse_other_spacing(rails: Sequence[RailLine], parameters: Parameters) -> None:
    """Raise NoTrackError if the spacing of the rails clearly differs from the one given."""
    gauge_m, head_width_m = parameters.gauge_m, parameters.head_width_m
    spacing = most_common_spacing(rails, MIN_SECTION_M)
    if spacing is None or abs(spacing - gauge_m - head_width_m) < parameters.centerline_tolerance_m:
        return
    message = f"No track of {1000 * gauge_m:.0f} mm gauge found: rails are {1000 * spacing:.0f} mm apart"
    likely = closest_standard(spacing, head_width_m)
    if likely is not None and abs(likely.gauge_m - gauge_m) > 1e-9:
        raise NoTrackError(f"{message}, is the gauge {1000 * likely.gauge_m:.0f} mm?")
    raise NoTrackError(f"{message}.")


def _draw(rails: Sequence[RailLine], chain: Chain, parameters: Parameters) -> Centerline | None:
    """Draw the centerline of one track; None if its rails are nowhere opposite each other."""
    spacing_m = parameters.gauge_m + parameters.head_width_m
    reach_m, tolerance_m = single_rail_limit(parameters.max_gap_m), parameters.centerline_tolerance_m
    provisional = Polyline(provisional_centerline(rails, chain, spacing_m / 2, reach_m))
    drawn = Polyline(provisional.resampled(PROVISIONAL_STEP_M).xyz)
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
