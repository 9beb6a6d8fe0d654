"""Pieces of line: cells that continue each other, and which of them are long enough to be kept."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .lines import Lines
from .tops import HIGH_M, Tops

ALIGNED_M = 0.03
"""Two cells continue each other if the axis of each passes the other one this close."""

HEAD_M = 0.17
"""Distance within which a higher cell shows that a lower one is not a head: half a foot, the fastening beyond it, and
the errors of both axes. Only a guard rail is as near to a rail, and it is as high."""

LEAST_M = 1.5
"""Shortest piece of a rail that has its partner."""

LEAST_PAIRED = 0.4
"""Share of a piece's cells with a partner from which the piece has one."""

HIDDEN_M = 1.3
"""Length of a rail with a partner that a wheel may hide without dividing the rail: a wheel of 0.92 m and a cell at both
ends. Between the wheels of a bogie, 1.5 m are seen."""

LEAST_SINGLE_M = 5.0
"""Shortest piece without a partner: FRPDF is trained to remove shorter lone lines; a longer one may be the visible rail
of a hidden pair."""

GAP_M = 1.0
"""Longest gap between two cells of a rail that counts towards its length."""

ACROSS_M = (0.09, 0.13, 0.17, 0.21, 0.25, 0.29)
"""Distances from the axis at which the surroundings are looked at: from beyond the head to the next 0.2 m."""

ALONG = 9
"""Places along the line, over half its reach to either side."""

SHOWN_SHARE = 0.25
"""Least share of the places of one side that are seen, by those of the other side at the same distance, from which they
count: beams that meet the edge of a head and what is behind it show up to a fifth as many points in its shadow."""

MAX_HIGH = 4
"""Of these distances, as many may be as high as the line on one side. A guard rail takes three; the edge of a kerb, of
a cable trough, or of the shoulder of the ballast takes all."""


def links(lines: Lines, within_m: float | None = None) -> np.ndarray:
    """Pairs of cells that are on each other's axis, at most `within_m` apart or within reach, (m, 2) int."""
    if len(lines.axis) < 2:
        return np.empty((0, 2), dtype=np.int64)
    pairs = cKDTree(lines.axis).query_pairs(within_m or lines.reach_m, output_type="ndarray")
    one, other = pairs.T
    step = lines.axis[other] - lines.axis[one]
    on = np.ones(len(pairs), dtype=bool)
    for end in (one, other):
        on &= np.abs(np.einsum("ij,ij->i", step, lines.across[end])) < ALIGNED_M
    return pairs[on]


def _around(lines: Lines, within_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return cells, others at most `within_m` from them, and how far these are ahead and to the left, (k,) each."""
    if not len(lines.axis):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0), np.empty(0)
    pairs = cKDTree(lines.axis).query_pairs(within_m, output_type="ndarray")
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    step = lines.axis[other] - lines.axis[own]
    ahead, left = (np.einsum("ij,ij->i", step, way[own]) for way in (lines.along, lines.across))
    return own, other, ahead, left


def _links_past_wheels(lines: Lines) -> np.ndarray:
    """Pairs of cells that are on each other's axis, also past what a wheel hides, (m, 2) int."""
    return links(lines, max(HIDDEN_M, lines.reach_m))


def lower_than_beside(lines: Lines, depth_m: float) -> np.ndarray:
    """Return which cells have one near them that is higher by more than `depth_m`, (n,) bool: feet and fastenings."""
    lower = np.zeros(len(lines.axis), dtype=bool)
    if len(lower) > 1:
        one, other = cKDTree(lines.axis).query_pairs(HEAD_M, output_type="ndarray").T
        rise = lines.height[other] - lines.height[one]
        lower[one[rise > depth_m]] = True
        lower[other[rise < -depth_m]] = True
    return lower


def pieces_of(count: int, pairs: np.ndarray) -> np.ndarray:
    """Find the piece of each of `count` cells that pairs, (m, 2), connect, (count,) int numbers."""
    ones = np.ones(len(pairs), dtype=bool)
    return connected_components(coo_matrix((ones, tuple(pairs.T)), shape=(count, count)), directed=False)[1]


def linked(count: int, pairs: np.ndarray) -> csr_matrix:
    """Return which cells are a pair with each cell, (m, 2) numbers, and the cell itself: (count, count) ones."""
    (one, other), own = pairs.T, np.arange(count)
    rows, columns = np.concatenate([own, one, other]), np.concatenate([own, other, one])
    return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))


def lengths(xy: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Length of each piece: the diagonal of the rectangle around its cells, (pieces,) metres."""
    count = int(piece.max()) + 1 if len(piece) else 0
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, piece, xy)
    np.maximum.at(high, piece, xy)
    return np.hypot(*(high - low).T)


def mean_of(values: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Return the mean of the cells' values, (cells,), over each piece, (pieces,)."""
    return np.bincount(piece, values) / np.bincount(piece)


def to_one_side(lines: Lines, piece: np.ndarray) -> np.ndarray:
    """Return unit vectors across the lines, (n, 2), to the same side on all of a piece: lines have no direction.

    The side goes from cell to cell: a sharp arc turns by more than a right angle.
    """
    across, count = lines.across, len(piece)
    first = np.unique(piece, return_index=True)[1][piece]
    one, other = links(lines).T
    turned = np.einsum("ij,ij->i", across[one], across[other]) < 0
    # Each cell is there twice, by the side that its vector points to: cells that point to one side are connected.
    rights = np.where(turned, other + count, other), np.where(turned, other, other + count)
    pairs = np.column_stack([np.append(one, one + count), np.append(*rights)])
    side = pieces_of(2 * count, pairs)
    same, opposite = side[:count] == side[first], side[count:] == side[first]
    near = np.einsum("ij,ij->i", across, across[first]) >= 0  # parts that nothing connects
    return np.where(np.where(same == opposite, near, same)[:, None], across, -across)


def long_enough(
    lines: Lines,
    pairs: np.ndarray,
    paired: np.ndarray,
    open_ended: np.ndarray,
    keep_single: bool,
    least_m: float = LEAST_M,
) -> np.ndarray:
    """Return which cells belong to pieces that are kept, (n,) bool: with a partner, if they are as long as `least_m`.

    Pieces without a partner are kept with `keep_single`. Pieces of cells that are `open_ended`, at the border of what
    the square sees, continue beyond it and are long enough, because they already run through the whole margin.
    """
    if not len(lines.axis):
        return np.zeros(0, dtype=bool)
    piece = pieces_of(len(lines.axis), _links_past_wheels(lines))
    kept = _reaches(lines.axis, piece, LEAST_SINGLE_M, open_ended) & keep_single
    pair = np.flatnonzero(with_partner(pairs, paired))
    piece = pieces_of(len(pair), _links_past_wheels(lines.of(pair)))
    long = np.zeros(len(paired), dtype=bool)
    long[pair] = _reaches(lines.axis[pair], piece, least_m, open_ended[pair])
    return kept | long


def with_partner(pairs: np.ndarray, paired: np.ndarray) -> np.ndarray:
    """Return which cells belong to pieces that have a partner, (n,) bool."""
    piece = pieces_of(len(paired), pairs)
    return (np.bincount(piece, paired) > LEAST_PAIRED * np.bincount(piece))[piece]


def _reaches(xy: np.ndarray, piece: np.ndarray, least_m: float, open_ended: np.ndarray) -> np.ndarray:
    """Return which cells belong to pieces of at least this length, or to open-ended ones, (n,) bool."""
    return ((lengths(xy, piece) >= least_m) | (np.bincount(piece, open_ended) > 0))[piece]


def shares_of_length(lines: Lines, half_m: float) -> np.ndarray:
    """Length of rail that each cell stands for, (n,) metres: half the way to the next cell ahead and behind.

    Two cells within `half_m` across are on one line.
    """
    own, _, ahead, left = _around(lines, np.hypot(GAP_M, half_m))
    share_m = np.zeros(len(lines.axis))
    for is_ahead in (True, False):
        mine = (np.abs(left) < half_m) & ((ahead > 0) == is_ahead)
        gap_m = np.full(len(share_m), GAP_M)
        np.minimum.at(gap_m, own[mine], np.abs(ahead[mine]))
        share_m += np.where(gap_m < GAP_M, gap_m / 2, 0.0)
    return share_m


def stands_free(
    tops: Tops, depth_m: np.ndarray, marks: np.ndarray, lines: Lines, slope: np.ndarray, pairs: np.ndarray
) -> np.ndarray:
    """Return which lines of cells, `marks`, have lower ground, or nothing seen, on each side, (n,) bool.

    Lower by `depth_m`, (n,), than a plane through the line with this `slope` to the left, (n,), height per length. Each
    cell decides with those that continue it, `pairs`, (m, 2): in a thin cloud, or where the scanner is far, a cell
    alone sees one place of what is beside it, or none.
    """
    seen, high = (_with_continued(counts, lines, pairs) for counts in _seen_beside(tops, depth_m, marks, lines, slope))
    shown = seen >= SHOWN_SHARE * seen.max(axis=1, keepdims=True)
    return ((shown & (2 * high > seen)).sum(axis=2) <= MAX_HIGH).all(axis=1)


def _seen_beside(
    tops: Tops, depth_m: np.ndarray, marks: np.ndarray, lines: Lines, slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Count the places beside each line that are seen, and of these the high ones: (n, 2, distances) each.

    The left side comes first.
    """
    along = np.linspace(-0.5, 0.5, ALONG) * lines.reach_m
    seen, high = (np.zeros((len(lines.axis), 2, len(ACROSS_M)), dtype=np.int64) for _ in range(2))
    z, high_cells = tops.z.ravel(), tops.high.ravel()
    own, ahead_m, left_m = z[marks], lines.along, lines.across
    for number, side in enumerate((1, -1)):
        for distance, left in enumerate(ACROSS_M):
            for ahead in along:
                cell, inside = tops.grid.cells(lines.axis + ahead * ahead_m + side * left * left_m)
                rise = z[cell] - own - side * left * slope
                wall = inside & high_cells[cell]
                seen[:, number, distance] += wall | (inside & (np.abs(rise) < HIGH_M))
                high[:, number, distance] += wall | (inside & (rise >= -depth_m) & (rise < HIGH_M))
    return seen, high


def _with_continued(counts: np.ndarray, lines: Lines, pairs: np.ndarray) -> np.ndarray:
    """Add to each cell's counts on both sides, (n, 2, k), those of the cells that continue it, `pairs`, (m, 2)."""
    one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    turned = np.einsum("ij,ij->i", lines.across[one], lines.across[other]) < 0  # lines have no direction
    total, columns = counts.copy(), np.prod(counts.shape[1:])
    for chosen, of_others in ((~turned, counts), (turned, counts[:, ::-1])):
        ones = np.ones(int(chosen.sum()), dtype=np.int64)
        of_each = csr_matrix((ones, (one[chosen], other[chosen])), shape=(len(counts), len(counts)))
        total += (of_each @ of_others.reshape(-1, columns)).reshape(total.shape)
    return total
