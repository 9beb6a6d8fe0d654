"""What tracks tell of the errors of their rails: passes of the scanner that are not aligned, and a gauge that scatters.

Real tracks do not jump sideways, and are built to a gauge within a millimetre or two. See docs/method.md sections 6.6
and 6.11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..heads.head_points import STATION_STEP_M
from ..parameters import ALIGNED, Parameters
from ..polyline import Polyline, interpolate
from ..progress import SILENT, Progress
from ..rails import HALF_TRACK_M, STRIP_OFF_M, Centerline, RailLine, Support

ARM_M, CORE_M = 5.0, 1.0
"""Length of the track on either side of a place that shows a step, and half the length in the middle that is left out:
smoothing draws a step as a bend 2 m long."""

MIN_SHARE = 0.5
"""Smallest step of a rail, relative to the mean of both rails of the track."""

MIN_STEP_M = 0.008
"""Smallest step: waves of 1 mm that are 5 m long look like 4 mm."""

BEND_M2 = 1.9
"""A sudden change of curvature can look like a step of up to this many metres per 1/m of change."""

STEP_SIGMAS, STEP_GAIN = 5.0, 2.75
"""Standard errors from which a step is not chance, and the standard error of a step relative to that of its line, whose
errors are correlated over about a metre."""


MIN_STRIPS_APART_M = 5.0
"""Length of rail on which strips are apart from which the user is warned; they are compared over twice this length."""

MAX_LISTED = 3
"""Steps that a warning lists."""

LARGEST_PERCENT = 95.0
"""Percentile of the distances that is stated as the largest: switches and crossings make some of them wrong."""


ALIKE_M = 20.0
"""Length over which errors of dense matching are alike, at most."""


def find_jumps(track: Centerline, rails: Sequence[RailLine]) -> list[tuple[float, float]]:
    """Find the jumps of a track: places where a rail on either side steps the same way.

    At switches one of the rails may be off for some metres, as no pass of a scanner puts it. Where the track does not
    name its rails, the centerline decides alone. Returns the chainage of each step, and its size to the left in metres:
    the mean of the rails, which are smoothed less.
    """
    line = track.line
    t = np.arange(0.0, line.length_m, STATION_STEP_M)
    sides = [
        [(rail.xyz, rail.support) for rail in rails if rail.rail_id in ids] for ids in (track.left_ids, track.right_ids)
    ]
    left, right = (_shown(line, t, side if all(sides) else [(line.xyz, None)]) for side in sides)
    across, bend = 0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])
    chance = STEP_SIGMAS * STEP_GAIN * 0.5 * np.hypot(left[2], right[2])
    with np.errstate(invalid="ignore"):
        alike = np.minimum(left[0] * across, right[0] * across) >= MIN_SHARE * across**2
        is_step = alike & (np.abs(across) >= np.maximum(MIN_STEP_M, chance) + bend)
    return _peaks(t, np.where(is_step, across, 0.0))


def _shown(line: Polyline, t: np.ndarray, side: Sequence[tuple[np.ndarray, Support | None]]) -> np.ndarray:
    """Return what the lines on one side of a track show at its chainages `t`, (n,): rows of `_steps_along`, or NaN."""
    found = np.full((3, len(t)), np.nan)
    for xyz, support in side:
        places, *shown = _steps_along(xyz[:, :2], support)
        feet = line.feet(places, HALF_TRACK_M)
        for row, column in zip(found, shown):
            if len(feet.t) > 1:
                here = np.interp(t, feet.t, column[feet.point], left=np.nan, right=np.nan)
                row[:] = np.where(np.isnan(row), here, row)
    return found


def _peaks(t: np.ndarray, across: np.ndarray) -> list[tuple[float, float]]:
    """Return the places and sizes of steps, given what each station, (n,), shows; the largest one counts."""
    found = []
    size = np.abs(across)
    while len(size) and size.max() > 0:
        place = int(np.argmax(size))
        found.append((float(t[place]), float(across[place])))
        size[np.abs(t - t[place]) <= 2 * ARM_M] = 0.0
    return sorted(found)


def doubting_jumps(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline], progress: Progress = SILENT
) -> list[RailLine]:
    """Warn the user of jumps, and add half of each to the standard errors of both rails: either pass may be right."""
    found = [(line, at_m, jump_m) for line in centerlines for at_m, jump_m in find_jumps(line, rails)]
    if found:
        largest = sorted(found, key=lambda one: -abs(one[2]))[:MAX_LISTED]
        words = [f"{1000 * abs(by_m):.0f} mm at {at_m:.0f} m of track {line.track_id}" for line, at_m, by_m in largest]
        more = f" and {len(found) - MAX_LISTED} more" if len(found) > MAX_LISTED else ""
        progress.warning(
            f"Sideways jumps in tracks: {', '.join(words)}{more}. Real track has none; probably two passes of the "
            "scanner that are not aligned meet there."
        )
    doubted = []
    for rail in rails:
        own = [
            (line.line.at(np.array([at_m]))[0, :2], abs(jump_m))
            for line, at_m, jump_m in found
            if rail.rail_id in (*line.left_ids, *line.right_ids)
        ]
        doubted.append(_doubting(rail, own) if own else rail)
    return doubted


def _doubting(rail: RailLine, found: Sequence[tuple[np.ndarray, float]]) -> RailLine:
    """Add half of the nearest step, given the places on the centerline and the sizes, to the error of a rail."""
    support = rail.support
    feet = rail.line.feet(np.array([place for place, _ in found]), HALF_TRACK_M)
    if support is None or not len(feet.t):
        return rail
    nearest = np.argmin(np.abs(support.t[:, None] - feet.t), axis=1)
    step_m = np.array([size_m for _, size_m in found])[feet.point][nearest]
    strips = support.strips.copy()
    strips[:, 1], strips[:, 2] = np.fmax(strips[:, 1], step_m), np.hypot(strips[:, 2], 0.5 * step_m)
    support = replace(support, sigma_m=np.hypot(support.sigma_m, 0.5 * step_m), strips=strips)
    return replace(rail, sigma_mm=1000 * support.rms_m, support=support)


def _steps_along(line: np.ndarray, support: Support | None = None) -> tuple[np.ndarray, ...]:
    """Fit a cubic and a step to a line, (n, 2), on either side of stations along it.

    Returns places, (k, 2), and (k,) each: the step to the left, metres, in either direction along the line; the step
    that the difference between the curvatures on both sides looks like; and the standard error of the line, less what
    passes of a scanner add to it.
    """
    own = Polyline(line)
    t = np.arange(0.0, own.length_m, STATION_STEP_M)
    weights, bends = _weights()
    half = len(weights) // 2
    if len(t) < len(weights):
        return np.empty((0, 2)), *np.empty((3, 0))
    places, normals = own.at(t), interpolate(own.normals, own.t, t)[half:-half]
    across, bend = (
        np.einsum("ij,ij->i", np.column_stack([np.correlate(column, one, "valid") for column in places.T]), normals)
        for one in (weights, bends)
    )
    variance = np.zeros(len(t))
    if support is not None:
        variance = np.interp(t, support.t, np.maximum(support.sigma_m**2 - support.strips[:, 2] ** 2, 0.0))
    chance = np.sqrt(uniform_filter1d(variance, len(weights))[half:-half])
    return places[half:-half], across, BEND_M2 * np.abs(bend), chance


def _weights() -> tuple[np.ndarray, np.ndarray]:
    """Return the weights of stations around a place whose sums are the step and the change of curvature, (k,) each."""
    count = int(round(ARM_M / STATION_STEP_M))
    t = np.arange(-count, count + 1) * STATION_STEP_M
    used = np.abs(t) >= CORE_M
    steps, bends = np.zeros(len(t)), np.zeros(len(t))
    steps[used] = np.linalg.pinv(np.stack([t**0, t, t**2, t**3, t > 0], axis=1)[used])[-1]
    for side in (1, -1):
        arm = used & (side * t > 0)
        bends[arm] = side * np.linalg.pinv(np.stack([t**0, t, t**2 / 2], axis=1)[arm])[-1]
    return steps, bends


def warn_of_strips(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> None:
    """Warn the user if strips, the passes of a scanner, differ."""
    shown = np.concatenate(
        [rail.support.strips[:, :2] for rail in rails if rail.support is not None] or [np.empty((0, 2))]
    )
    count, spread_m = shown[np.nan_to_num(shown[:, 1]) >= STRIP_OFF_M].T
    if STATION_STEP_M * np.sum(count > 1) >= MIN_STRIPS_APART_M:
        remedy = (
            "they are aligned to their mean, and sigma_mm states what remains in doubt"
            if parameters.strips == ALIGNED
            else "correct the positions of the scanner, or set STRIPS to ALIGNED"
        )
        progress.warning(
            f"Where strips overlap ({STATION_STEP_M * np.sum(count > 1):.0f} m of rail), they differ by up to "
            f"{_largest(spread_m[count > 1])}: {remedy}."
        )
    if STATION_STEP_M * np.sum(count == 1) >= MIN_STRIPS_APART_M:
        progress.warning(
            f"On {STATION_STEP_M * np.sum(count == 1):.0f} m of rail the heads look blurred or too wide, as if passes "
            f"of the scanner were up to {_largest(spread_m[count == 1])} apart. The points have no source id or GPS "
            "time, so the passes cannot be separated: sigma_mm and sigmaz_mm contain half of it. Export the cloud with "
            "them, or pass by pass."
        )


def _largest(spread_m: np.ndarray) -> str:
    """Write the largest of the distances between strips."""
    return f"{1000 * np.percentile(spread_m, LARGEST_PERCENT):.0f} mm"


def gauge_scatter(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline], gauges_m: Sequence[float]
) -> dict[int, float]:
    """Return by how much rails err beyond their standard errors, by `rail_id`, metres.

    Both rails of a track err independently, and by as much as each other: half of the variance of the gauge is each
    one's. The stiff curve along a single rail follows errors that are as long as itself, and shows nothing of them.
    """
    own = {rail.rail_id: (rail.sigma_mm / 1000) ** 2 for rail in rails}
    beyond: dict[int, float] = {}
    for line, scatter_mm in zip(centerlines, _scatter_mm(centerlines, gauges_m)):
        sides = [np.mean([own[one] for one in ids]) for ids in (line.left_ids, line.right_ids)]
        more = max((scatter_mm / 1000) ** 2 - sum(sides), 0.0) / 2
        for one in (*line.left_ids, *line.right_ids):
            beyond[one] = max(beyond.get(one, 0.0), float(np.sqrt(more)))
    return beyond


def _scatter_mm(centerlines: Sequence[Centerline], gauges_m: Sequence[float]) -> np.ndarray:
    """Return by how much the gauge of each track scatters.

    A track that is about as long as its errors shows little of them. What it shows counts by its length, and one error
    more as all tracks of its gauge scatter about their mean, if that is more.
    """
    tracks = [(line.gauge_mm, line.gaugesd_mm, line.length_m) for line in centerlines]
    mean_mm, own_mm, length_m = np.reshape(tracks, (-1, 3)).T
    nominal = np.abs(np.subtract.outer(mean_mm, 1000 * np.array(gauges_m))).argmin(axis=1)
    scatter_mm = own_mm.copy()
    for same in (nominal == one for one in np.unique(nominal)):
        off_mm = mean_mm[same] - np.average(mean_mm[same], weights=length_m[same])
        all_mm2 = np.average(own_mm[same] ** 2 + off_mm**2, weights=length_m[same])
        more_mm2 = np.maximum(all_mm2 - own_mm[same] ** 2, 0.0) * ALIKE_M / (length_m[same] + ALIKE_M)
        scatter_mm[same] = np.sqrt(own_mm[same] ** 2 + more_mm2)
    return scatter_mm


def doubting_scatter(rails: Sequence[RailLine], beyond_m: Mapping[int, float]) -> list[RailLine]:
    """Add what `gauge_scatter` found to the standard errors of rails."""
    return [_scattering(rail, beyond_m.get(rail.rail_id, 0.0)) for rail in rails]


def _scattering(rail: RailLine, beyond_m: float) -> RailLine:
    """Add an error to the standard errors of a rail."""
    if rail.support is None or not beyond_m:
        return rail
    support = replace(rail.support, sigma_m=np.hypot(rail.support.sigma_m, beyond_m))
    return replace(rail, sigma_mm=1000 * support.rms_m, support=support)
