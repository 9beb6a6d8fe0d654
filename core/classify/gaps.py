"""Gaps in what is level beside a head in a pavement: the groove for the flanges, whose outer edge is the head's.

What a scanner sees of a groove depends on its side. The head's face is seen from beyond the groove, and its corner,
which is round, is hidden from beyond the head; the other edge of the groove is that of the pavement, and sharp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import linked

ROW_M = 0.015
"""Largest distance across of two cells of the same row, of which a groove may have one on either wall: an arc of 25 m
bends by 7 mm over 0.6 m."""

STOREY_M = 0.3
"""Difference in height up to which places belong to one pavement: a wall of a groove, cant and gradient over a metre
take less, and floors, decks and ceilings are 0.6 m and more apart."""

ALONG_M, DOUBLINGS, ENOUGH = 0.6, 4, 30.0
"""Length to either side over which the points of slices are added up, how often it is doubled where they are few, and
points in a bin of 4 mm from which it is not: beams that meet an edge of the groove leave a tenth as many in it, and
these seem level where the scanner is far, so one of few would close the gap."""

SLICE_M = 0.05
"""Length of a slice, and distance of slices along a groove."""

BIN_M, BINS = 0.004, 56
"""Bins across in which the level points of a slice are counted: 112 mm to either side, a wide groove and a head."""

LEVEL_QUANTILE, GAP_SHARE = 0.6, 0.35
"""Quantile over the bins that stands for what is level, because grooves and gaps fill less than half of them; and share
of it below which a bin is part of the gap: near the edge of a head that hides its own corner half of the points are
left."""

MIDDLES_M = (np.arange(BINS) - BINS // 2 + 0.5) * BIN_M
"""Middles of the bins, inwards."""

WALL_M, NARROWEST_M, MIN_KNOWN = 0.01, 0.035, 30
"""Distance from the edge of a gap within which points below the pavement are on its wall; width of the narrowest groove
that a flange passes; and slices that have to show the width: 1.5 m of groove."""

WIDTH_QUANTILE, HIDDEN_M = 0.9, 0.01
"""Quantile of their widths: where the scanner is far, beams that meet an edge make the gap narrower, never wider; and
most of a head that is hidden, of a corner with a radius of 13 mm."""

SEARCH_BINS = 6
"""Distance from the middle of the cavities within which the gap is looked for: where only one wall is seen, the middle
is on it."""


def thinned(lines: Lines) -> np.ndarray:
    """Choose one cell in each square of `SLICE_M`, (k,) numbers."""
    return np.unique(np.floor(lines.axis / SLICE_M).astype(np.int64), axis=0, return_index=True)[1]


def summed_along(lines: Lines, inward: np.ndarray, xyz: np.ndarray, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count the points, (k, 3), by distance from thinned cells in their direction `inward`, (n, BINS) each.

    Those that are level, `flat`, (k,) bool, come first, and then all of them. They are those of the same row within
    `ALONG_M`, or further where points are few.
    """
    level, every = _counts(lines, inward, xyz, flat)
    reach = _same_row(lines, inward)
    level_sum, every_sum = reach @ level, reach @ every
    for _ in range(DOUBLINGS):
        few = np.quantile(level_sum, LEVEL_QUANTILE, axis=1) < ENOUGH
        if not few.any():
            break
        reach = (reach @ reach).sign()
        level_sum[few], every_sum[few] = reach[few] @ level, reach[few] @ every
    return level_sum, every_sum


def _counts(lines: Lines, inward: np.ndarray, xyz: np.ndarray, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count the points, (k, 3), of the same pavement by distance inwards from each cell of a groove, (n, BINS) each.

    Those that are level, `flat`, (k,) bool, come first, and then all of them.
    """
    axis = lines.axis
    reach_m = np.hypot(BIN_M * BINS / 2, SLICE_M / 2)
    near = cKDTree(axis).sparse_distance_matrix(cKDTree(xyz[:, :2]), reach_m, output_type="ndarray")
    own, other = near["i"], near["j"]
    same = np.abs(xyz[other, 2] - lines.height[own]) < STOREY_M
    own, other = own[same], other[same]
    step = xyz[other, :2] - axis[own]
    bins = np.floor(np.einsum("ij,ij->i", step, inward[own]) / BIN_M).astype(np.int64) + BINS // 2
    inside = np.abs(np.einsum("ij,ij->i", step, lines.along[own])) < SLICE_M / 2
    inside &= (bins >= 0) & (bins < BINS)
    number, size = own * BINS + bins, len(axis) * BINS
    level, every = (
        np.bincount(number[chosen], minlength=size).reshape(-1, BINS) for chosen in (inside & flat[other], inside)
    )
    return level, every


def _same_row(lines: Lines, inward: np.ndarray) -> csr_matrix:
    """Which cells are of the same row as each cell and within `ALONG_M` of it, and the cell itself, (n, n)."""
    pairs = cKDTree(lines.axis).query_pairs(ALONG_M, output_type="ndarray")
    one, other = pairs.T
    same = np.abs(np.einsum("ij,ij->i", lines.axis[other] - lines.axis[one], inward[one])) < ROW_M
    same &= np.abs(lines.height[other] - lines.height[one]) < STOREY_M
    same &= np.einsum("ij,ij->i", inward[one], inward[other]) > 0
    return linked(len(lines.axis), pairs[same])


def outer_edges(level: np.ndarray, every: np.ndarray, head_width_m: float) -> np.ndarray:
    """Distance inwards at which the gap that is nearest to the middle begins, (n,) metres; NaN where there is none.

    Given are the level points and all points in each bin, (n, BINS). A scanner beyond the head does not see the corner
    of the head, and its gap seems to begin early; but both edges of the pavement are sharp, and grooves that show the
    faces of their heads show how wide all of them are.
    """
    gaps = Gaps.of(level, every, head_width_m)
    hollow = every - level
    faces = _within(hollow, gaps.outer_m) > _within(hollow, gaps.inner_m)
    width_m = gaps.inner_m - gaps.outer_m
    known = faces & (width_m >= NARROWEST_M)
    if np.count_nonzero(known) < MIN_KNOWN:
        return gaps.outer_m
    hidden_m = np.clip(width_m - np.quantile(width_m[known], WIDTH_QUANTILE), 0.0, HIDDEN_M)
    return np.where(faces, gaps.outer_m, gaps.outer_m + np.nan_to_num(hidden_m))


def _within(counts: np.ndarray, place_m: np.ndarray) -> np.ndarray:
    """Add up counts, (n, BINS), within `WALL_M` of a place in each row, (n,)."""
    return np.where(np.abs(MIDDLES_M - place_m[:, None]) < WALL_M, counts, 0).sum(axis=1)


@dataclass(frozen=True)
class Gaps:
    """Where gaps in what is level begin, at the head, and end, at the pavement, (n,) metres inwards; NaN if unseen."""

    outer_m: np.ndarray
    inner_m: np.ndarray

    @classmethod
    def of(cls, counts: np.ndarray, every: np.ndarray, head_width_m: float) -> Gaps:
        """Find the gap nearest to the middle of each row, given the level points and all points by bin, (n, BINS).

        There is none where less than half of a head beside it is level, by most of its points: at the foot of a wall,
        or of a slope.
        """
        usual = np.quantile(counts, LEVEL_QUANTILE, axis=1)
        limit = GAP_SHARE * usual
        level, number, middle = counts >= np.maximum(limit, 1)[:, None], np.arange(BINS), BINS // 2
        far = np.where(level, BINS, np.abs(number - middle))
        gap = np.argmin(far, axis=1)[:, None]
        head = np.max(np.where(level & (number < gap), number, -1), axis=1)
        road = np.min(np.where(level & (number > gap), number, BINS), axis=1)
        on_head = (number <= head[:, None]) & (number > head[:, None] - head_width_m / BIN_M)
        flat = on_head & level & (2 * counts > every)
        found = (far.min(axis=1) <= SEARCH_BINS) & (2 * flat.sum(axis=1) > on_head.sum(axis=1))
        # A face holds many points in a bin, which would draw the edge towards the next one.
        rows, capped = np.arange(len(counts)), np.minimum(counts, usual[:, None])

        def edge_m(last: np.ndarray, seen: np.ndarray, step: int) -> np.ndarray:
            """Place between the last level bin and the first one of the gap at which the counts reach the limit."""
            high, low = (capped[rows, np.clip(one, 0, BINS - 1)] for one in (last, last + step))
            share = (high - limit) / np.maximum(high - low, 1)
            return np.where(seen, (last - middle + 0.5 + step * share) * BIN_M, np.nan)

        return cls(edge_m(head, found, 1), edge_m(road, found & (road < BINS), -1))
