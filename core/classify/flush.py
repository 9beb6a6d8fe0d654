"""Rails in pavements: level crossings and tram tracks, where only the groove beside the head is seen.

The head is as high as the pavement around it. Its axis follows from the groove and from the edge of what is level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation, binary_propagation
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from .bed import COARSE_M, MAX_LEVELS
from .lines import Lines, Marks, find_lines
from .partner import partners
from .pieces import lengths, links, pieces_of
from .settings import Settings
from .tops import TENTHS_OF_MM, Grid, centroids

MIN_PER_M2, FAR_PER_M2 = 500.0, 300.0
"""Least points per square metre of a pavement that shows grooves: they are 45 mm apart then, and each groove of 42 mm
holds most of a row of them. Between points that are further apart, as those of images are, a groove and a wave of the
pavement look alike. Far from the scanner, the rest of the same pavement shows them from the second number on."""

MIN_SHARE, LEVEL_M, NEAR_BED_M = 0.65, 0.008, 0.03
"""A coarse cell is paved if this share of its points is this close to their mean height; the mean is that of the
points near the bed. Ballast scatters by 12 mm and more."""

CAVITY_M = (0.012, 0.19)
"""Depth of points in a groove below the pavement: from three times a good scanner's noise to a rail's height."""

REACH_M, BESIDE_LINE_M, MIN_COVER, MIN_PURE = 1.0, 0.05, 0.5, 0.3
"""See `lines`; stricter than for rails, because nothing else confirms a groove."""

INSIDE_M, SPACING_M = 0.052, 0.05
"""Distance of the two grooves below the gauge, and its tolerance: grooves are 35 to 80 mm wide and are inside."""

MIN_STATIONS = 3
"""Stations with a partner of five."""

STOREY_M = 0.3
"""Difference in height up to which places belong to one pavement: a wall of a groove, cant and gradient over a metre
take less, and floors, decks and ceilings are 0.6 m and more apart."""

MIN_LENGTH_M = 2.0
"""Shortest groove."""

ALONG_M = 0.6
"""Length to either side over which the points of slices are added up."""

SLICE_M = 0.05
"""Length of the slice of level points that each cell of a groove looks at, to either side."""

BIN_M, BINS = 0.004, 56
"""Bins across in which the level points of a slice are counted: 112 mm to either side, a wide groove and a head."""

LEVEL_QUANTILE, GAP_SHARE = 0.6, 0.35
"""Quantile over the bins that stands for what is level, because grooves and gaps fill less than half of them; and share
of it below which a bin is part of the gap: near the edge of a head that hides its own corner half of the points are
left."""

SEARCH_BINS = 6
"""Distance from the middle of the cavities within which the gap is looked for: where only one wall is seen, the middle
is on it."""

HEAD_LEVEL_M = 0.012
"""Largest difference in height between a head and the pavement."""

FACE_M, CORNER_M = 0.035, 0.013
"""Depth of the face of a head below the pavement, and radius of the corner above it."""

BESIDE_M = 0.003
"""Distance beyond the edge within which a point on the side of the groove is still rail: noise across."""

NO_LINES = Lines(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0), np.empty(0), REACH_M)


@dataclass(frozen=True)
class Flush:
    """Rails in pavement: the numbers of the `points` on heads, (k,), and the `lines` along these.

    `rails` are those that the guide leaves out as well.
    """

    points: np.ndarray
    lines: Lines
    rails: Lines


NO_FLUSH = Flush(np.empty(0, dtype=np.int64), NO_LINES, NO_LINES)


@dataclass(frozen=True)
class NearBed:
    """Points near the bed: places, (n, 2), and, (n,) each, heights `z`, heights above the bed, coarse cells, levels."""

    xy: np.ndarray
    z: np.ndarray
    height: np.ndarray
    coarse: np.ndarray
    level: np.ndarray


def flush_rails(shape: tuple[int, int], near: NearBed, grid: Grid, cell: np.ndarray, settings: Settings) -> Flush:
    """Find rails in pavement, given rows and columns of the coarse cells, and the cell of each point, (n,)."""
    head_width_m = settings.head_width_m
    xy, below = near.xy, _pavement(shape, near) - near.height
    if not np.isfinite(below).any():
        return NO_FLUSH
    places = np.column_stack([xy, near.z])
    hollow = np.flatnonzero((below > CAVITY_M[0]) & (below < CAVITY_M[1]))
    marks = _marks(places[hollow], near.level[hollow], cell[hollow])
    if len(marks.xy) < 2:
        return NO_FLUSH
    lines = find_lines(marks, REACH_M, STOREY_M, BESIDE_LINE_M)
    lines = lines.of(lines.good(MIN_COVER, MIN_PURE))
    paved = np.isfinite(below)
    flat = np.abs(below[paved]) < HEAD_LEVEL_M
    rails = [_at_edge(_grooves(lines, gauge_m), places[paved], flat, head_width_m) for gauge_m in settings.gauges_m]
    heads = [_guided(one, settings) for one in rails]
    upper = np.flatnonzero((below > -HEAD_LEVEL_M) & (below < FACE_M))
    points = [upper[_on_heads(one, places[upper], below[upper], head_width_m)] for one in heads]
    most = int(np.argmax([len(one.inward) for one in rails]))
    return Flush(np.unique(np.concatenate(points)), heads[most].lines, rails[most].lines)


def _marks(places: np.ndarray, level: np.ndarray, cell: np.ndarray) -> Marks:
    """Find the middles and mean heights of hollow places, (k, 3), of each level, (k,), in each cell, (k,)."""
    middles = centroids(level.astype(np.int64) * (int(cell.max(initial=0)) + 1) + cell, places)
    return Marks(middles[:, :2], middles[:, 2])


def _guided(heads: Heads, settings: Settings) -> Heads:
    """Keep the heads that the guide, if there is one, asks for."""
    if settings.guide is None:
        return heads
    kept = settings.guide.keeps(heads.lines, links(heads.lines), settings.spacings_m, np.inf)
    return heads.of(kept)


def _pavement(shape: tuple[int, int], points: NearBed) -> np.ndarray:
    """Height above the bed of the pavement at each point, (n,); NaN where the level that it belongs to is not paved.

    Walls and the sides of vehicles have levels of their own, which have no grooves.
    """
    number = points.level.astype(np.int64) * (shape[0] * shape[1]) + points.coarse
    cells = MAX_LEVELS * shape[0] * shape[1]
    near = np.abs(points.height) < NEAR_BED_M
    # Whole numbers add up to the same sum in any order of the points.
    tenths, own = np.round(points.height[near] * TENTHS_OF_MM), number[near]
    mean = np.bincount(own, tenths, cells) / np.maximum(np.bincount(own, minlength=cells), 1)
    flat = np.bincount(own[np.abs(tenths - mean[own]) < LEVEL_M * TENTHS_OF_MM], minlength=cells)
    count = np.bincount(number, minlength=cells)
    paved = (count > FAR_PER_M2 * COARSE_M**2) & (flat > MIN_SHARE * count)
    paved, dense = (one.reshape(MAX_LEVELS, *shape) for one in (paved, paved & (count > MIN_PER_M2 * COARSE_M**2)))
    around = np.ones((1, 3, 3), dtype=bool)
    grown = binary_dilation(binary_propagation(dense, around, paved), around).ravel()
    return np.where(grown, mean / TENTHS_OF_MM, np.nan)[number]


@dataclass(frozen=True)
class Heads:
    """Lines along heads, or along the grooves inside them; `inward`, (n, 2), has unit vectors to the other rail."""

    lines: Lines
    inward: np.ndarray

    def of(self, chosen: np.ndarray) -> Heads:
        """Choose some of the cells."""
        return Heads(self.lines.of(chosen), self.inward[chosen])

    def moved(self, inward_m: np.ndarray) -> Heads:
        """Move the axes towards the other rail, (n,) metres."""
        axis = self.lines.axis + inward_m[:, None] * self.inward
        return replace(self, lines=replace(self.lines, axis=axis))


def _grooves(lines: Lines, gauge_m: float) -> Heads:
    """Keep the lines that have their partner at the gauge and are long enough."""
    stations, side, _ = partners(lines, gauge_m - INSIDE_M, SPACING_M, STOREY_M)
    paired = stations >= MIN_STATIONS
    lines, side = lines.of(paired), side[paired]
    pairs = links(lines)
    piece = pieces_of(len(lines.axis), pairs)
    long = lengths(lines.axis, piece)[piece] >= MIN_LENGTH_M
    return Heads(lines.of(long), (side[:, None] * lines.across)[long])


def _at_edge(grooves: Heads, xyz: np.ndarray, flat: np.ndarray, head_width_m: float) -> Heads:
    """Put the axes of the heads beside the outer edges of the grooves, given the points of pavements, (k, 3).

    The groove is a gap in what is level, `flat`, (k,) bool. A scanner to one side sees one wall only, and the middle of
    what it sees in the groove is not the groove's; but the gap begins where the head ends.
    """
    if not len(grooves.inward) or not flat.any():
        return grooves.of(np.zeros(len(grooves.inward), dtype=bool))
    level, every = (_summed_along(grooves, counts) for counts in _counts(grooves, xyz, flat))
    edge_m = _outer_edges(level, every, head_width_m)
    seen = np.isfinite(edge_m)
    return grooves.of(seen).moved(edge_m[seen] - head_width_m / 2)


def _counts(grooves: Heads, xyz: np.ndarray, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count the points, (k, 3), of the same pavement by distance inwards from each cell of a groove, (n, BINS) each.

    Those that are level, `flat`, (k,) bool, come first, and then all of them.
    """
    axis, inward = grooves.lines.axis, grooves.inward
    reach_m = np.hypot(BIN_M * BINS / 2, SLICE_M)
    near = cKDTree(axis).sparse_distance_matrix(cKDTree(xyz[:, :2]), reach_m, output_type="ndarray")
    own, other = near["i"], near["j"]
    same = np.abs(xyz[other, 2] - grooves.lines.height[own]) < STOREY_M
    own, other = own[same], other[same]
    step = xyz[other, :2] - axis[own]
    bins = np.floor(np.einsum("ij,ij->i", step, inward[own]) / BIN_M).astype(np.int64) + BINS // 2
    inside = np.abs(np.einsum("ij,ij->i", step, grooves.lines.along[own])) < SLICE_M
    inside &= (bins >= 0) & (bins < BINS)
    number, size = own * BINS + bins, len(axis) * BINS
    level, every = (
        np.bincount(number[chosen], minlength=size).reshape(-1, BINS) for chosen in (inside & flat[other], inside)
    )
    return level, every


def _summed_along(grooves: Heads, counts: np.ndarray) -> np.ndarray:
    """Add up the counts of the cells of the same groove within `ALONG_M`, (n, BINS)."""
    axis, inward = grooves.lines.axis, grooves.inward
    one, other = cKDTree(axis).query_pairs(ALONG_M, output_type="ndarray").T
    same = np.abs(np.einsum("ij,ij->i", axis[other] - axis[one], inward[one])) < BESIDE_LINE_M
    same &= np.abs(grooves.lines.height[other] - grooves.lines.height[one]) < STOREY_M
    same &= np.einsum("ij,ij->i", inward[one], inward[other]) > 0
    own = np.arange(len(axis))
    rows, columns = np.concatenate([own, one[same], other[same]]), np.concatenate([own, other[same], one[same]])
    return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(axis), len(axis))) @ counts


def _outer_edges(counts: np.ndarray, every: np.ndarray, head_width_m: float) -> np.ndarray:
    """Distance inwards at which the gap that is nearest to the middle begins, (n,) metres; NaN where there is none.

    Given are the level points and all points in each bin, (n, BINS). Nor is there one where less than half of a head
    beside it is level, by most of its points: at the foot of a wall, or of a slope.
    """
    limit = GAP_SHARE * np.quantile(counts, LEVEL_QUANTILE, axis=1)[:, None]
    level, number, middle = counts >= np.maximum(limit, 1), np.arange(BINS), BINS // 2
    far = np.where(level, BINS, np.abs(number - middle))
    gap = np.argmin(far, axis=1)
    head = np.max(np.where(level & (number < gap[:, None]), number, -1), axis=1)
    rows = np.arange(len(counts))
    on_head = (number <= head[:, None]) & (number > head[:, None] - head_width_m / BIN_M)
    flat = on_head & level & (2 * counts > every)
    found = (far[rows, gap] <= SEARCH_BINS) & (2 * flat.sum(axis=1) > on_head.sum(axis=1))
    high, low = counts[rows, head], counts[rows, np.minimum(head + 1, BINS - 1)]
    share = (high - limit[:, 0]) / np.maximum(high - low, 1)
    return np.where(found, (head - middle + 0.5 + share) * BIN_M, np.nan)


def _on_heads(heads: Heads, xyz: np.ndarray, below_m: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which points, (k, 3), are on a head: on its level top, or on the face beside the groove, (k,) bool."""
    if not len(heads.inward) or not len(xyz):
        return np.zeros(len(xyz), dtype=bool)
    # Where pavements are one above the other, the nearest head in space is the one on the same.
    axes = np.column_stack([heads.lines.axis, heads.lines.height])
    distance, cell = cKDTree(axes).query(xyz, distance_upper_bound=REACH_M / 2)
    near = np.isfinite(distance)
    inward = np.full(len(xyz), np.inf)
    step = xyz[near, :2] - heads.lines.axis[cell[near]]
    inward[near] = np.einsum("ij,ij->i", step, heads.inward[cell[near]])
    half_m = head_width_m / 2
    top = (np.abs(below_m) < HEAD_LEVEL_M) & (inward >= -half_m)
    face = (below_m >= HEAD_LEVEL_M) & (below_m < FACE_M) & (inward >= half_m - CORNER_M)
    return (top | face) & (inward <= half_m + BESIDE_M)
