"""Points at the height of their rail: dirt next to a covered rail is lower, a train that stands on it is higher.

Where a head is covered, what lies next to it or above it is all that a line has. A rail does not step: a level that
begins and ends with a step is not the rail's, and no vehicle is lower than the rail on which it stands. See
docs/method.md section 6.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_opening, median_filter

from .head_points import MIN_ON_HEAD, HeadPoints
from .level import LEVEL_BIN_M, medians, robust_sigma

WINDOW_M = 0.02
"""Height in which the points on top of a head are: noise of 5 mm, and 100 mm of cant."""

LEVELS = 3
"""Levels that are looked for in a bin: the head, what stands on it, and what is in between."""

APART_M = 0.03
"""Distance of two levels of a bin from which the points of one are not those of the other."""

MIN_POINTS = 3
"""Points that make a level: on the sparsest rails a bin has five."""

MIN_IN_BIN = 4.0
"""Points on the head in bins that have any, on average, from which levels are looked for: with fewer, as from the air,
noise alone makes steps, and a line would lose its ends."""

STEP_M, STEP_SIGMAS = (0.008, 0.015), 4.0
"""Largest change of the level beyond the gradient, between these limits, in standard deviations of what bins show by
chance: dirt in a flangeway is 10 to 50 mm below the top."""

SEVERAL_SHARE = 0.25
"""Share of the bins with a second level from which more than chance makes them differ: 0.8 to 1.0 where half of the
points are ballast, 0.01 in a wide beam from the air."""

SAGITTA = 5e-5
"""Sagitta of a rail's profile, metres, per product of the distances from both ends, m²: half the curvature of waves of
10 mm that are 60 m long."""

SLOPE_BINS = 41
"""Bins, 20 m, whose median change of level is the gradient."""

MIN_BINS = 4
"""Bins, 2 m, of a level that counts, because what stands out by chance is shorter, and of its end that is compared with
the next bin; a level runs across fewer bins that lack it."""

DRIFT = 0.004
"""Error of the gradient, by which the levels on both sides of a gap may differ per metre, and at most `MAX_DRIFT_M`."""

MAX_DRIFT_M = 0.1
"""Largest difference of two levels across a gap: longer gaps are not seen through by gradients alone."""

SHIFTED_M, SHIFT_BINS = 0.05, 24
"""Largest step between two passes of a scanner, or the crown and the face of a head, and bins, 12 m, that a level must
have to be taken for another pass or view: a road, with a step on either side, may be twice as wide."""

VEHICLE_M = 0.07
"""Height above the rail from which parts of vehicles are: the lowest gauge allows 80 mm."""

VEHICLE_NEAR_M = 3.0
"""Distance along the line within which a level that is lower by this shows that another is a vehicle's."""

VEHICLE_WEIGHT = 0.25
"""Weight of a level that is rather that of a vehicle: it counts if the lower one is very short."""

FOOT_M, FOOT_SHARE, HEAD_BINS = 0.20, 0.9, 20
"""Height of the tallest rails with their pad, up to which a level above another one may be the head above its foot; and
share of the bins of the foot in which the head is seen, too, or bins of the head, 10 m, if something hides more of it.
No part of a vehicle is this low along all of a rail, or as long: wheels, rail brakes and the frames of bogies are."""

ABOVE_M, BELOW_M = 0.03, 0.06
"""Heights above and below its level up to which points are on a head: weeds are higher, and faces with their noise are
not lower."""


@dataclass(frozen=True)
class _Levels:
    """Levels of the bins of a line, (n,) arrays, in order of the bins."""

    bin: np.ndarray
    height: np.ndarray


def on_own_level(points: HeadPoints) -> HeadPoints:
    """Choose the points that may be on the head by their height.

    All points are, where the level of a line is not in doubt, where beams blend heads with the ballast, or where bins
    have one level each that differs by chance: few points of a far head's face are 40 mm apart, and points from the air
    scatter as much.
    """
    t, head = points.t, points.within(0.5)
    occupied = len(np.unique((t[head] / LEVEL_BIN_M).astype(int)))
    if head.sum() < max(MIN_ON_HEAD, MIN_IN_BIN * occupied) or points.is_blunt:
        return points
    number = (t / LEVEL_BIN_M).astype(int)
    flat = _flat(number, points.z, t, head)
    levels = _levels(number[head], flat[head])
    by_chance_m = _by_chance(levels)
    if by_chance_m > STEP_M[1] and len(levels.bin) < (1 + SEVERAL_SHARE) * len(np.unique(levels.bin)):
        return points
    step_m = float(np.clip(by_chance_m, *STEP_M))
    chosen = _chain(_pieces(levels, step_m), step_m)
    if not len(chosen):
        return points
    bins = np.arange(number.max() + 1)
    level = np.interp(bins, chosen[:, 0], chosen[:, 1])
    own, any_level = np.zeros((2, len(bins)), dtype=bool)
    any_level[levels.bin] = True
    near_m = step_m + _sagitta(levels.bin, chosen[:, 0])
    own[levels.bin[np.abs(levels.height - level[levels.bin]) <= near_m]] = True
    other = binary_opening(any_level & ~own, np.ones(MIN_BINS))
    above = flat - np.interp(t, (bins + 0.5) * LEVEL_BIN_M, level)
    return points[(above <= ABOVE_M) & (above >= -BELOW_M) & ~other[number]]


def _flat(number: np.ndarray, z: np.ndarray, t: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Return heights, (n,), without the gradient of the line, by bins of points, (n,), of which some are on the `head`.

    The gradient of the medians of bins is taken off first: on a slope, a bin has no level. The levels then show what is
    left of it, because medians of a head that is seen from one side are anywhere on its face.
    """
    bins, first, count = np.unique(number[head], return_index=True, return_counts=True)
    flat = z - _gradient(_Levels(bins, medians(z[head], first, count)), t)
    return flat - _gradient(_levels(number[head], flat[head]), t)


def _gradient(levels: _Levels, at: np.ndarray) -> np.ndarray:
    """Sum up the gradient of the fullest levels, and return it at chainages `at`: steps do not count."""
    bins, first = np.unique(levels.bin, return_index=True)
    if len(bins) < 2:
        return np.zeros(len(at))
    place, height = (bins + 0.5) * LEVEL_BIN_M, levels.height[first]
    slope = median_filter(np.diff(height) / np.diff(bins), SLOPE_BINS, mode="reflect") / LEVEL_BIN_M
    place = np.concatenate([[place[0] - 1.0], place, [place[-1] + 1.0]])
    slope = np.concatenate([slope[:1], slope, slope[-1:]])
    return np.interp(at, place, np.concatenate([[0.0], np.cumsum(slope * np.diff(place))]))


def _levels(number: np.ndarray, z: np.ndarray) -> _Levels:
    """Find the heights at which most points of each bin are, up to LEVELS in each; the fullest first."""
    found_bin, found_height = [], []
    left = np.ones(len(z), dtype=bool)
    for _ in range(LEVELS):
        order = np.flatnonzero(left)[np.lexsort((z[left], number[left]))]
        if not len(order):
            break
        key = number[order] * (2 * np.ptp(z) + 1.0) + z[order] - z.min()
        count = np.searchsorted(key, key + WINDOW_M, side="right") - np.arange(len(key))
        best = np.lexsort((-count, number[order]))
        best = best[np.flatnonzero(np.diff(number[order], prepend=-1))]
        best = best[count[best] >= MIN_POINTS]
        if not len(best):
            break
        height = z[order[best + count[best] // 2]]
        found_bin.append(number[order[best]])
        found_height.append(height)
        at = np.full(number.max() + 1, np.inf)
        at[found_bin[-1]] = height
        left &= np.abs(z - at[number]) > APART_M
    bins, heights = np.concatenate([[], *found_bin]).astype(int), np.concatenate([[], *found_height])
    order = np.argsort(bins, kind="stable")
    return _Levels(bins[order], heights[order])


def _by_chance(levels: _Levels) -> float:
    """Return the largest change of level, metres, that chance explains; the fullest level of a bin is the first."""
    first = np.flatnonzero(np.diff(levels.bin, prepend=-1))
    return STEP_SIGMAS * robust_sigma(np.diff(levels.height[first]))


def _sagitta(bins: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return by how much a rail may leave the straight line between the known bins next to each bin, metres."""
    after = np.clip(np.searchsorted(known, bins), 1, max(len(known) - 1, 1))
    before_m, behind_m = (
        LEVEL_BIN_M * np.maximum(side, 0) for side in (bins - known[after - 1], known[after % len(known)] - bins)
    )
    return SAGITTA * before_m * behind_m


def _pieces(levels: _Levels, step_m: float) -> list[np.ndarray]:
    """Link levels of successive bins that do not step: bins and heights, (k, 2), of each piece."""
    pieces: list[tuple[list[int], list[float]]] = []
    ends: dict[int, tuple[int, float]] = {}
    for here, up in zip(levels.bin.tolist(), levels.height.tolist()):
        ends = {one: end for one, end in ends.items() if here - end[0] < MIN_BINS}
        steps = [(abs(height - up), one) for one, (end, height) in ends.items() if end < here]
        step, nearest = min(steps, default=(np.inf, -1))
        if step > step_m:
            nearest = len(pieces)
            pieces.append(([], []))
        bins, heights = pieces[nearest]
        bins.append(here)
        heights.append(up)
        # The median, so that a level cannot step by halves.
        last = sorted(heights[-MIN_BINS:])
        ends[nearest] = here, last[len(last) // 2]
    return [np.column_stack(piece) for piece in pieces if len(piece[0]) >= MIN_BINS]


def _apart(earlier: np.ndarray, later: np.ndarray) -> float:
    """Return by how much two levels differ where both are, metres."""
    ending = max(MIN_BINS, int(np.count_nonzero(earlier[:, 0] >= later[0, 0])))
    beginning = max(MIN_BINS, int(np.count_nonzero(later[:, 0] <= earlier[-1, 0])))
    return float(abs(np.median(later[:beginning, 1]) - np.median(earlier[-ending:, 1])))


def _weight(piece: np.ndarray, pieces: Sequence[np.ndarray]) -> float:
    """Return how much a level counts, in bins: less if it is a vehicle's, which shows where another is far below it.

    The foot of a rail is as far below its head, all along it, and counts less as well.
    """
    near = VEHICLE_NEAR_M / LEVEL_BIN_M
    for other in pieces:
        if other[0, 0] > piece[-1, 0] + near or other[-1, 0] < piece[0, 0] - near:
            continue
        above_m = float(np.median(_near(piece, other, near)) - np.median(_near(other, piece, near)))
        is_vehicle = above_m > VEHICLE_M and not _is_foot(other, piece, above_m)
        if is_vehicle or (above_m < -VEHICLE_M and _is_foot(piece, other, -above_m)):
            return VEHICLE_WEIGHT * len(piece)
    return float(len(piece))


def _is_foot(lower: np.ndarray, upper: np.ndarray, apart_m: float) -> bool:
    """Return whether a level may be that of the foot of a rail below another one, that of its head."""
    share = np.isin(lower[:, 0], upper[:, 0]).mean()
    return apart_m <= FOOT_M and bool(share >= FOOT_SHARE or len(upper) >= HEAD_BINS)


def _near(piece: np.ndarray, other: np.ndarray, near: float) -> np.ndarray:
    """Return the heights of a level in the bins that are within `near` bins of another one, (k,)."""
    return piece[(piece[:, 0] >= other[0, 0] - near) & (piece[:, 0] <= other[-1, 0] + near), 1]


def _chain(pieces: list[np.ndarray], step_m: float) -> np.ndarray:
    """Choose the pieces that one rail can have, with most bins: their bins and heights, (k, 2)."""
    if not pieces:
        return np.empty((0, 2))
    pieces.sort(key=lambda piece: piece[0, 0])
    start, end = np.array([[piece[0, 0], piece[-1, 0]] for piece in pieces]).T
    first, last = np.array([[np.median(piece[:MIN_BINS, 1]), np.median(piece[-MIN_BINS:, 1])] for piece in pieces]).T
    weight = np.array([_weight(piece, pieces) for piece in pieces])
    best, before = weight.copy(), np.full(len(pieces), -1)
    for number in range(1, len(pieces)):
        gap_m = (start[number] - end[:number]) * LEVEL_BIN_M
        off_m = np.abs(first[number] - last[:number])
        for earlier in np.flatnonzero(gap_m <= 0):
            off_m[earlier] = _apart(pieces[earlier], pieces[number])
        fits = off_m <= step_m + np.clip(DRIFT * gap_m, 0.0, MAX_DRIFT_M)
        cost = np.where(fits, 0.0, np.where(off_m <= SHIFTED_M, SHIFT_BINS, np.inf))
        follows = gap_m > -MIN_BINS * LEVEL_BIN_M
        sums = np.where(follows | fits, best[:number] - cost, 0.0)
        if sums.max() > 0:
            before[number] = int(np.argmax(sums))
            best[number] += sums.max()
    chosen, number = [], int(np.argmax(best))
    while number >= 0:
        chosen.append(pieces[number])
        number = int(before[number])
    chain = np.concatenate(chosen[::-1])
    return chain[np.argsort(chain[:, 0], kind="stable")]
