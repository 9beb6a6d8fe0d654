"""Rails in pavements: level crossings and tram tracks, where only the groove beside the head is seen.

The head is as high as the pavement around it. Its axis follows from the groove and from the edge of what is level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation, binary_propagation, median
from scipy.spatial import cKDTree

from ..spread import sigma_by_median
from .bed import COARSE_M, MAX_LEVELS
from .gaps import STOREY_M, outer_edges, summed_along, thinned
from .lines import Lines, Marks, find_lines, joined
from .partner import partners
from .pieces import lengths, links, mean_of, pieces_of, to_one_side
from .ridges import steadied
from .settings import Settings
from .tops import TENTHS_OF_MM, Grid, centroids

MIN_PER_M2, FAR_PER_M2 = 500.0, 300.0
"""Least points per square metre of a pavement that shows grooves: they are 45 mm apart then, and each groove of 42 mm
holds most of a row of them. Between points that are further apart, as those of images are, a groove and a wave of the
pavement look alike. Far from the scanner, the rest of the same pavement shows them from the second number on."""

MIN_SHARE, LEVEL_M, NEAR_BED_M = 0.65, 0.008, 0.03
"""A coarse cell is paved if this share of its points is this close to their mean height; the mean is that of the
points near the bed. Ballast scatters by 12 mm and more."""

CAVITY_M, CAVITY_SIGMAS = (0.012, 0.19), 2.5
"""Depth of points in a groove below the pavement: from three times a good scanner's noise to a rail's height; and least
depth in standard deviations of the points about their pavement: noise of 7 mm would hollow out all of it."""

REACH_M, BESIDE_LINE_M, MIN_COVER, MIN_PURE = 1.0, 0.05, 0.5, 0.3
"""See `lines`; stricter than for rails, because nothing else confirms a groove."""

INSIDE_M, SPACING_M = 0.052, 0.05
"""Distance of the two grooves below the gauge, and its tolerance: grooves are 35 to 80 mm wide and are inside."""

MIN_STATIONS = 3
"""Stations with a partner of five."""

MIN_LENGTH_M = 2.0
"""Shortest groove that has its partner."""

OTHER_ROW_M = 0.3
"""Distance from cells with a partner within which those without one are of another row of the same groove, or of the
gap on the outer side of the head."""

HEAD_LEVEL_M = 0.012
"""Largest difference in height between a head and the pavement."""

FACE_M, CORNER_M = 0.035, 0.013
"""Depth of the face of a head below the pavement, and radius of the corner above it."""

BESIDE_M = 0.003
"""Distance beyond the edge within which a point on the side of the groove is still rail: noise across."""

STREET_M = 4.0
"""Width of a street beside a rail in it: to the next track, or a lane for road vehicles."""

NO_LINES = Lines(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0), np.empty(0), REACH_M)

NO_POINTS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Flush:
    """Rails in pavement: the numbers of the `points` on heads, (k,), and the `lines` along these.

    `rails` are those that the guide leaves out as well, and `paved` the numbers of all points of pavements, (p,).
    """

    points: np.ndarray
    lines: Lines
    rails: Lines
    paved: np.ndarray

    def street(self, xy: np.ndarray) -> np.ndarray:
        """Return the numbers of the points of pavement beside rails in it, (k,), given the places of all, (n, 2)."""
        if not len(self.rails.axis):
            return NO_POINTS
        paved = xy[self.paved]
        distance, cell = cKDTree(self.rails.axis).query(paved, distance_upper_bound=STREET_M)
        near = np.flatnonzero(np.isfinite(distance))
        step = paved[near] - self.rails.axis[cell[near]]
        beside = np.abs(np.einsum("ij,ij->i", step, self.rails.along[cell[near]])) < COARSE_M
        return self.paved[near[beside]]


NO_FLUSH = Flush(NO_POINTS, NO_LINES, NO_LINES, NO_POINTS)


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
    noise_m = sigma_by_median(below[np.abs(below) < NEAR_BED_M])
    hollow = np.flatnonzero((below > max(CAVITY_M[0], CAVITY_SIGMAS * noise_m)) & (below < CAVITY_M[1]))
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
    return Flush(np.unique(np.concatenate(points)), heads[most].lines, rails[most].lines, np.flatnonzero(paved))


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

    def with_others(self, others: Heads) -> Heads:
        """Add further cells."""
        return Heads(joined(self.lines, others.lines), np.concatenate([self.inward, others.inward]))

    def opposite(self, apart_m: np.ndarray) -> Heads:
        """Return the cells opposite of these, (n,) metres away."""
        return replace(self.moved(apart_m), inward=-self.inward)

    def moved(self, inward_m: np.ndarray) -> Heads:
        """Move the axes towards the other rail, (n,) metres."""
        axis = self.lines.axis + inward_m[:, None] * self.inward
        return replace(self, lines=replace(self.lines, axis=axis))


def _grooves(lines: Lines, gauge_m: float) -> Heads:
    """Keep the lines that have their partner at the gauge over a length, and continue them without partners.

    Far from the scanner, or beside a train, points show how deep one groove of a track is, and of the other one only
    a gap in what is level: a groove that has its partner elsewhere has it there as well.
    """
    stations, side, apart_m = partners(lines, gauge_m - INSIDE_M, SPACING_M, STOREY_M)
    paired, piece = stations >= MIN_STATIONS, pieces_of(len(lines.axis), links(lines))
    with_partner, number = np.unique(piece[paired], return_inverse=True)
    paired &= np.isin(piece, with_partner[lengths(lines.axis[paired], number) >= MIN_LENGTH_M])
    if not paired.any():
        return Heads(lines.of(paired), np.empty((0, 2)))
    grooves = Heads(lines, _inward(lines, piece, paired, side))
    alone = np.isin(piece, piece[paired]) & (cKDTree(lines.axis[paired]).query(lines.axis)[0] > OTHER_ROW_M)
    rest = grooves.of(alone)
    return (
        grooves.of(paired)
        .with_others(rest)
        .with_others(rest.opposite(median(apart_m, np.where(paired, piece, -1), piece[alone])))
    )


def _inward(lines: Lines, piece: np.ndarray, paired: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return unit vectors, (n, 2), to where most of the paired cells, (n,) bool, of a piece have the other rail.

    `side`, (n,), is 1 where this is to the left, and -1 to the right.
    """
    left = to_one_side(lines, piece)
    to_left = np.where(paired, side * np.einsum("ij,ij->i", lines.across, left), 0.0)
    return np.where(mean_of(to_left, piece)[piece] > 0, 1.0, -1.0)[:, None] * left


def _at_edge(grooves: Heads, xyz: np.ndarray, flat: np.ndarray, head_width_m: float) -> Heads:
    """Put the axes of the heads beside the outer edges of the grooves, given the points of pavements, (k, 3).

    The groove is a gap in what is level, `flat`, (k,) bool. A scanner to one side sees one wall only, and the middle of
    what it sees in the groove is not the groove's; but the gap begins where the head ends.
    """
    if not len(grooves.inward) or not flat.any():
        return grooves.of(np.zeros(len(grooves.inward), dtype=bool))
    grooves = replace(grooves, lines=steadied(grooves.lines)).of(thinned(grooves.lines))
    level, every = summed_along(grooves.lines, grooves.inward, xyz, flat)
    edge_m = outer_edges(level, every, head_width_m)
    seen = np.isfinite(edge_m)
    return grooves.of(seen).moved(edge_m[seen] - head_width_m / 2)


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
