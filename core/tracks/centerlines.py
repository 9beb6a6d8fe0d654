"""Track centerlines: the line midway between the two rails of a track (docs/method.md section 8)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import NoTrackError
from ..lines.finishing import united
from ..lines.smoothing import REACH_SIGMAS, STATIONS_PER_SIGMA, smooth_line
from ..parameters import Parameters
from ..polyline import MIN_RING_M, is_closed, left_normals, length_along, resample, starts_at_its_end
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine
from ..standards import STANDARDS
from .chaining import Chain, chain_pairs, runs_on, single_rail_limit
from .forking import fork_centerlines
from .midline import (
    MAX_OFFSET_M,
    PROVISIONAL_STEP_M,
    Meeting,
    Side,
    at_gauge,
    bridged_steps,
    midway,
    provisional_centerline,
)
from .pairing import MIN_SECTION_M, pair_rails
from .parallels import most_common_spacing

STATIONS_AT_ONCE = 8192
"""Stations processed at once, 2 km of track: lets the user cancel several times per second."""

SAME_GAUGE_M = 0.04
"""Gauges in use differ by more than this, so a measured spacing this close to one of them suggests it."""

START_STEP_M = 0.05
"""Spacing of the places where a closed rail may start: the rails of a track then start abreast to within half of it."""

MAX_SEAM_M = 0.5
"""Maximum distance between the ends of a ring's centerline, which may overlap or leave a gap: matches end a little
early."""


@dataclass(frozen=True)
class CenterlineParameters:
    """Parameters of the centerlines, in metres.

    Attributes
    ----------
    tolerance_m : float
        Maximum deviation of the rails from the gauge.
    max_gap_m : float
        Maximum length without any rail that does not end a track.
    smoothing_m : float
        Sigma of PAEK in plan.
    min_length_m : float
        Shorter centerlines are dropped.
    other_spacings_m : tuple of float
        Distances of the rails of other gauges for which centerlines are made: rails closer to one are left to it.
    """

    tolerance_m: float = Parameters.centerline_tolerance_m
    max_gap_m: float = Parameters.max_gap_m
    smoothing_m: float = Parameters.smoothing_xy_m
    min_length_m: float = Parameters.min_length_m
    other_spacings_m: tuple[float, ...] = ()


def build_centerlines(
    rails: Sequence[RailLine],
    gauge_m: float,
    head_width_m: float,
    parameters: CenterlineParameters = CenterlineParameters(),  # noqa: B008 - frozen
    progress: Progress = SILENT,
) -> tuple[Centerline, ...]:
    """Draw the centerlines of all tracks of one gauge.

    Parameters
    ----------
    rails : sequence of RailLine
        The result refers to them by their ids. Rails without heights give centerlines without heights.
    gauge_m, head_width_m : float
        Their sum is the distance between the rail lines of a track.
    parameters : CenterlineParameters
    progress : Progress

    Returns
    -------
    tuple of Centerline
        In order of their starts from west to east, numbered from 1; none if no rails are parallel.

    Raises
    ------
    NoTrackError
        Rails are parallel, but at another spacing.
    """
    rails = _in_order(rails)
    others_m = parameters.other_spacings_m
    pairs = pair_rails(rails, gauge_m, head_width_m, parameters.tolerance_m, others_m, progress.span(0.0, 0.5))
    if not pairs:
        _refuse_other_spacing(rails, gauge_m, head_width_m, parameters.tolerance_m)
    chains = chain_pairs(rails, pairs, parameters.max_gap_m, parameters.tolerance_m)
    steps = progress.span(0.5, 0.95).split(len(chains))
    drawn = [_draw(rails, chain, gauge_m, head_width_m, parameters, step) for chain, step in zip(chains, steps)]
    kept = [line for line in drawn if line is not None and line.length_m >= parameters.min_length_m]
    forked = fork_centerlines(kept, progress.span(0.95, 1.0))
    ordered = sorted(forked, key=lambda line: tuple(line.xyz[0, :2]))
    return tuple(replace(line, track_id=number) for number, line in enumerate(ordered, start=1))


def _in_order(rails: Sequence[RailLine]) -> list[RailLine]:
    """Sort rails by place and turn them to start in the west: tracks must not depend on the order of the rails."""
    turned = [rail.reversed() if starts_at_its_end(rail.xyz) else rail for rail in rails]
    return started_abreast(sorted(turned, key=lambda rail: (*rail.xyz[0, :2], *rail.xyz[-1, :2], rail.length_m)))


def _refuse_other_spacing(rails: Sequence[RailLine], gauge_m: float, head_width_m: float, tolerance_m: float) -> None:
    """Raise NoTrackError if the spacing of the rails clearly differs from the one given."""
    spacing = most_common_spacing(rails, MIN_SECTION_M)
    if spacing is None or abs(spacing - gauge_m - head_width_m) < tolerance_m:
        return
    message = f"No track of {1000 * gauge_m:.0f} mm gauge found: rails are {1000 * spacing:.0f} mm apart"
    gauges = {standard.gauge_m for standard in STANDARDS.values()}
    likely = min(gauges, key=lambda gauge: abs(gauge - (spacing - head_width_m)))
    if abs(likely - (spacing - head_width_m)) < SAME_GAUGE_M and abs(likely - gauge_m) > 1e-9:
        message += f", is the gauge {1000 * likely:.0f} mm?"
    raise NoTrackError(message if message.endswith("?") else message + ".")


def _draw(
    rails: Sequence[RailLine],
    chain: Chain,
    gauge_m: float,
    head_width_m: float,
    parameters: CenterlineParameters,
    progress: Progress,
) -> Centerline | None:
    """Draw the centerline of one track; None if its rails are nowhere opposite each other."""
    half = 0.5 * (gauge_m + head_width_m)
    provisional = provisional_centerline(rails, chain, half, single_rail_limit(parameters.max_gap_m))
    stations, _ = resample(provisional, PROVISIONAL_STEP_M)
    normals = left_normals(stations)
    left, right = _meetings(rails, chain, stations, normals, half, parameters, progress.span(0.0, 0.67))
    apart = left.distance_m + right.distance_m
    both = ~np.isnan(apart)
    if not both.any():
        return None
    xyz = midway(stations, normals, left, right)
    cant = (left.height_m - right.height_m)[both]
    gauge = np.hypot(apart[both], np.nan_to_num(cant)) - head_width_m
    if all(is_closed(rails[number].xyz) for pair in chain.pairs for number in (pair.left, pair.right)):
        xyz = closed_centerline(xyz)
    xyz = _smoothed(xyz, parameters.smoothing_m, progress.span(0.67, 1.0))
    flip = starts_at_its_end(xyz)
    sides = [_ids(rails, (pair.left for pair in chain.pairs)), _ids(rails, (pair.right for pair in chain.pairs))]
    bridged_m = float(bridged_steps(rails, left, right, length_along(stations)).sum())
    gaps_known = all(rails[number].knows_gaps for pair in chain.pairs for number in (pair.left, pair.right))
    return Centerline(
        xyz=xyz[::-1] if flip else xyz,
        track_id=0,
        class_code=rails[chain.pairs[0].left].class_code,
        left_ids=sides[1][::-1] if flip else sides[0],
        right_ids=sides[0][::-1] if flip else sides[1],
        gauge_mm=1000 * float(gauge.mean()),
        gaugesd_mm=1000 * float(gauge.std()),
        cant_mm=(-1000 if flip else 1000) * float(cant.mean()),
        cantmax_mm=(-1000 if flip else 1000) * float(cant[np.argmax(np.abs(cant))]),
        bridged_m=bridged_m if gaps_known else np.nan,
    )


def _meetings(
    rails: Sequence[RailLine],
    chain: Chain,
    stations: np.ndarray,
    normals: np.ndarray,
    half_m: float,
    parameters: CenterlineParameters,
    progress: Progress,
) -> tuple[Meeting, Meeting]:
    """Find the left and the right rail of a track from stations between them."""
    reach_m = single_rail_limit(parameters.max_gap_m)
    # The stations are half a gauge from one rail, so the other is off by the whole deviation of the gauge.
    max_offset_m = max(MAX_OFFSET_M, parameters.tolerance_m)
    lefts = _spans([pair.left for pair in chain.pairs], [pair.left_span for pair in chain.pairs])
    rights = _spans([pair.right for pair in chain.pairs], [pair.right_span for pair in chain.pairs])
    to_left, to_right = progress.split(2)
    left = _met(Side.of(rails, lefts, reach_m), stations, normals, half_m, max_offset_m, to_left)
    right = _met(Side.of(rails, rights, reach_m), stations, -normals, half_m, max_offset_m, to_right)
    return at_gauge(left, right, 2 * half_m, parameters.tolerance_m)


def _ids(rails: Sequence[RailLine], numbers: Iterable[int]) -> tuple[int, ...]:
    """Return the ids of rails without repetition, in order of first occurrence."""
    return tuple(dict.fromkeys(rails[number].rail_id for number in numbers))


def _spans(rails: Sequence[int], spans: Sequence[tuple[float, float]]) -> list[tuple[int, tuple[float, float]]]:
    """List a track's rails on one side and their sections, merging sections between which the rail continues."""
    merged = [(rails[0], spans[0])]
    for rail, span in zip(rails[1:], spans[1:]):
        if rail == merged[-1][0] and runs_on(merged[-1][1], span):
            merged[-1] = (rail, (merged[-1][1][0], span[1]))
        else:
            merged.append((rail, span))
    return merged


def _met(
    side: Side, stations: np.ndarray, directions: np.ndarray, half_m: float, max_offset_m: float, progress: Progress
) -> Meeting:
    """Find the rails of one side from stations, part by part."""
    parts = range(0, len(stations), STATIONS_AT_ONCE)
    pieces = (slice(start, start + STATIONS_AT_ONCE) for start in progress.follow(parts))
    return Meeting.joined([side.meet(stations[piece], directions[piece], half_m, max_offset_m) for piece in pieces])


def _smoothed(xyz: np.ndarray, smoothing_m: float, progress: Progress) -> np.ndarray:
    """Smooth a centerline, (n, 3), in plan, with vertices as close as its shape requires."""
    stations, t = resample(xyz, smoothing_m / STATIONS_PER_SIGMA)
    margin_m = REACH_SIGMAS * smoothing_m
    closed = is_closed(xyz)
    if closed:
        xyz, added_m = extended_ring(xyz, margin_m)
        t = t + added_m
    along = length_along(xyz[:, :2])
    plan = []
    for part in progress.follow(np.array_split(t, int(np.ceil(len(t) / STATIONS_AT_ONCE)))):
        first, last = np.searchsorted(along, [part[0] - margin_m, part[-1] + margin_m])
        first = max(first - 1, 0)
        # The ends are free, because rails are smooth already and a fixed end would straighten a curve.
        near = xyz[first : last + 1, :2]
        plan.append(smooth_line(near, smoothing_m, stations=part - along[first], ends="free"))
    smooth = np.column_stack([np.concatenate(plan), stations[:, 2]])
    return np.concatenate([smooth[:-1], smooth[:1]]) if closed else smooth


def started_abreast(rails: Sequence[RailLine]) -> list[RailLine]:
    """Move the start of closed rails to the place nearest to the start of the first one.

    The rails of a track then start on a common normal, wherever they started before.
    """
    place = next((rail.xyz[0, :2] for rail in rails if is_closed(rail.xyz)), None)
    if place is None:
        return list(rails)
    return [_started_near(rail, place) if is_closed(rail.xyz) else rail for rail in rails]


def _started_near(rail: RailLine, place: np.ndarray) -> RailLine:
    """Move the start of a closed rail to the place nearest to a given one, (2,)."""
    stations, t = resample(rail.xyz[:, :2], START_STEP_M)
    start = t[np.argmin(np.linalg.norm(stations - place, axis=1))]
    if start in (0.0, t[-1]):
        return rail
    return united([rail.between(start, t[-1]), rail.between(0.0, start)])


def closed_centerline(xyz: np.ndarray) -> np.ndarray:
    """Close a centerline, (n, d), drawn along closed rails if its ends are close together."""
    away = np.linalg.norm(xyz[:, :2] - xyz[0, :2], axis=1)
    along = length_along(xyz[:, :2])
    if away[-1] > MAX_SEAM_M or along[-1] <= MIN_RING_M:
        return xyz
    ahead = (xyz[:, :2] - xyz[0, :2]) @ (xyz[1, :2] - xyz[0, :2])
    past = (along > along[-1] - 2 * MAX_SEAM_M) & (away <= 2 * MAX_SEAM_M) & (ahead >= 0)
    return np.concatenate([xyz[~past], xyz[:1]])


def extended_ring(xyz: np.ndarray, margin_m: float) -> tuple[np.ndarray, float]:
    """Extend a closed line, (n, d), at both ends by at least `margin_m`; returns it and the length before its start."""
    along = length_along(xyz[:, :2])
    margin_m = min(margin_m, along[-1])
    first, last = np.searchsorted(along, [along[-1] - margin_m, margin_m])
    first, last = max(first - 1, 0), min(last + 1, len(xyz))
    return np.concatenate([xyz[first:-1], xyz, xyz[1:last]]), float(along[-1] - along[first])
