"""Rails in pavements: level crossings and tram tracks, where only the groove beside the head is seen.

The head is as high as the pavement around it. Its axis follows from the groove and from the edge of what is level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

from .bed import Coarse
from .lines import Lines, Marks, find_lines
from .partner import partners
from .pieces import lengths, links, pieces_of
from .settings import Settings
from .tops import Grid

MIN_POINTS, MIN_SHARE, LEVEL_M, NEAR_BED_M = 60, 0.65, 0.008, 0.03
"""A coarse cell is paved if it has more points than this, and this share of them lies this close to their mean height;
the mean is that of the points near the bed. Ballast scatters by 12 mm and more."""

CAVITY_M = (0.012, 0.19)
"""Depth of points in a groove below the pavement: from three times a good scanner's noise to a rail's height."""

CROWD, CROWD_M = 60, 0.3
"""Cavities with more neighbours than this are rough ground: a groove fills 25 cells within that distance."""

REACH_M, STRIP_M, MIN_COVER, MIN_PURE = 1.0, 0.05, 0.5, 0.3
"""See `lines`; stricter than for rails, because nothing else confirms a groove."""

INSIDE_M, SPACING_M = 0.052, 0.05
"""Distance of the two grooves below the gauge, and its tolerance: grooves are 35 to 80 mm wide and lie inside."""

MIN_STATIONS = 3
"""Stations with a partner of five."""

MIN_LENGTH_M = 2.0
"""Shortest groove."""

ALONG_M = 0.6
"""Length to either side over which the spacing and the edge are averaged."""

EDGE_M = 0.022
"""Distance beyond the head's side in which the edge of what is level is looked for."""

SLICE_M = 0.05
"""Length of a slice in which the outermost point is an edge."""

BESIDE_M = 0.003
"""Width beyond the head's side within which a level point is rail."""

HEAD_LEVEL_M = 0.012
"""Largest difference in height between a head and the pavement."""

TENTHS_OF_MM = 10_000

NO_LINES = Lines(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0), np.empty(0), REACH_M)


@dataclass(frozen=True)
class Flush:
    """Rails in pavement.

    Attributes
    ----------
    points : (k,) int array
        Numbers of the points on heads.
    lines : Lines
        Axes of the heads.
    rails : Lines
        Those that the guide leaves out as well.
    """

    points: np.ndarray
    lines: Lines
    rails: Lines


def flush_rails(
    coarse: Coarse,
    near: np.ndarray,
    xy: np.ndarray,
    height: np.ndarray,
    grid: Grid,
    cell: np.ndarray,
    settings: Settings,
) -> Flush:
    """Find rails in pavement.

    Parameters
    ----------
    coarse : Coarse
    near : (n,) int array
        Numbers of the points near the bed among those of `coarse`.
    xy, height : (n, 2) and (n,) arrays
        Of these points; height above the bed.
    grid : Grid
    cell : (n,) int array
        Cell of each of these points.
    settings : Settings
    """
    nothing = Flush(np.empty(0, dtype=np.int64), NO_LINES, NO_LINES)
    head_width_m = settings.head_width_m
    level_m = _pavement(coarse, coarse.cell[near], height)
    if not np.isfinite(level_m).any():
        return nothing
    below = level_m[coarse.cell[near]] - height
    hollow = np.flatnonzero((below > CAVITY_M[0]) & (below < CAVITY_M[1]))
    marks = _centroids(cell[hollow], xy[hollow])
    if len(marks) < 2:
        return nothing
    crowd = cKDTree(marks).query_ball_point(marks, CROWD_M, return_length=True)
    marks = marks[crowd <= CROWD]
    lines = find_lines(Marks(marks, np.zeros(len(marks))), REACH_M, 1.0, STRIP_M)
    lines = lines.of((lines.cover >= MIN_COVER) & (lines.pure >= MIN_PURE))
    flat = np.flatnonzero(np.abs(below) < HEAD_LEVEL_M)
    rails = [_at_edge(_heads(lines, gauge_m, head_width_m), xy[flat], head_width_m) for gauge_m in settings.gauges_m]
    heads = [_guided(one, settings) for one in rails]
    points = [flat[_on_heads(one, xy[flat], head_width_m)] for one in heads]
    most = int(np.argmax([len(one.inward) for one in rails]))
    return Flush(np.unique(np.concatenate(points)), heads[most].lines, rails[most].lines)


def _guided(heads: Heads, settings: Settings) -> Heads:
    """Keep the heads that the guide, if there is one, asks for."""
    if settings.guide is None:
        return heads
    kept = settings.guide.keeps(heads.lines, links(heads.lines), settings.spacings_m, np.inf)
    return Heads(heads.lines.of(kept), heads.inward[kept])


def _pavement(coarse: Coarse, cell: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Height of the pavement above the bed by coarse cell, (cells,); NaN where there is none."""
    cells = len(coarse.count)
    near = np.abs(height) < NEAR_BED_M
    # Whole numbers add up to the same sum in any order of the points.
    tenths = np.round(height[near] * TENTHS_OF_MM)
    count = np.bincount(cell[near], minlength=cells)
    level = np.bincount(cell[near], tenths, cells) / np.maximum(count, 1)
    flat = np.bincount(cell[near][np.abs(tenths - level[cell[near]]) < LEVEL_M * TENTHS_OF_MM], minlength=cells)
    paved = (coarse.count > MIN_POINTS) & (flat > MIN_SHARE * np.bincount(cell, minlength=cells))
    grown = binary_dilation(paved.reshape(coarse.shape), np.ones((3, 3))).ravel()
    return np.where(grown, level / TENTHS_OF_MM, np.nan)


def _centroids(cell: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Mean places of the points of each cell, (k, 2)."""
    cells, number = np.unique(cell, return_inverse=True)
    count = np.bincount(number, minlength=len(cells))
    tenths = np.round(xy * TENTHS_OF_MM)
    return np.column_stack([np.bincount(number, column, len(cells)) / count for column in tenths.T]) / TENTHS_OF_MM


@dataclass(frozen=True)
class Heads:
    """Lines along the axes of heads.

    Attributes
    ----------
    lines : Lines
    inward : (n, 2) array
        Unit vectors across, towards the other rail.
    """

    lines: Lines
    inward: np.ndarray

    def moved(self, inward_m: np.ndarray) -> Heads:
        """Move the axes towards the other rail, (n,) metres."""
        axis = self.lines.axis + inward_m[:, None] * self.inward
        return replace(self, lines=replace(self.lines, axis=axis))


def _heads(lines: Lines, gauge_m: float, head_width_m: float) -> Heads:
    """Find pairs of grooves and put the axes of the heads outside of them.

    An error that both grooves share, such as that of walls that are seen from one side, does not move the middle.
    """
    stations, side, apart_m = partners(lines, gauge_m - INSIDE_M, SPACING_M, 1.0)
    paired = stations >= MIN_STATIONS
    lines, side, apart_m = lines.of(paired), side[paired], apart_m[paired]
    pairs = links(lines)
    piece = pieces_of(len(lines.axis), pairs)
    long = lengths(lines.axis, piece)[piece] >= MIN_LENGTH_M
    lines, side, apart_m = lines.of(long), side[long], apart_m[long]
    inward = side[:, None] * lines.across
    spacing_m = _smoothed(lines, inward, apart_m)
    outward_m = (gauge_m + head_width_m - spacing_m) / 2
    return Heads(lines, inward).moved(-outward_m)


def _smoothed(lines: Lines, inward: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Average values over the cells of the same groove within `ALONG_M`, (n,)."""
    if len(values) < 2:
        return values
    one, other = cKDTree(lines.axis).query_pairs(ALONG_M, output_type="ndarray").T
    same = np.einsum("ij,ij->i", inward[one], inward[other]) > 0
    one, other = one[same], other[same]
    total = values + np.bincount(one, values[other], len(values)) + np.bincount(other, values[one], len(values))
    count = 1 + np.bincount(one, minlength=len(values)) + np.bincount(other, minlength=len(values))
    return total / count


def _at_edge(heads: Heads, xy: np.ndarray, head_width_m: float) -> Heads:
    """Move axes so that the heads end where the level points do, towards the groove.

    A groove that is seen from one side shows one wall only; its middle then is not the middle of its points.
    """
    if not len(heads.inward) or not len(xy):
        return heads
    limit_m = head_width_m / 2 + EDGE_M
    near = cKDTree(heads.lines.axis).sparse_distance_matrix(
        cKDTree(xy), np.hypot(limit_m, SLICE_M), output_type="ndarray"
    )
    own = near["i"]
    step = xy[near["j"]] - heads.lines.axis[own]
    inward = np.einsum("ij,ij->i", step, heads.inward[own])
    inside = (np.abs(np.einsum("ij,ij->i", step, heads.lines.along[own])) < SLICE_M / 2) & (inward < limit_m)
    edge_m = np.full(len(heads.lines.axis), -np.inf)
    np.maximum.at(edge_m, own[inside], inward[inside])
    edge_m[edge_m < 0] = np.nan
    shift_m = _medians(heads, edge_m) - head_width_m / 2
    return heads.moved(np.nan_to_num(shift_m))


def _medians(heads: Heads, values: np.ndarray) -> np.ndarray:
    """Median of values on the same head within `ALONG_M`, (n,); NaN where there is none."""
    near = cKDTree(heads.lines.axis).query_ball_point(heads.lines.axis, ALONG_M)
    found = np.full(len(values), np.nan)
    for number, members in enumerate(near):
        mine = np.array(members)
        mine = mine[heads.inward[mine] @ heads.inward[number] > 0]
        known = values[mine][np.isfinite(values[mine])]
        if len(known):
            found[number] = np.median(known)
    return found


def _on_heads(heads: Heads, xy: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which level points lie on a head, (k,) bool."""
    if not len(heads.inward) or not len(xy):
        return np.zeros(len(xy), dtype=bool)
    distance, cell = cKDTree(heads.lines.axis).query(xy, distance_upper_bound=REACH_M / 2)
    near = np.isfinite(distance)
    on = np.zeros(len(xy), dtype=bool)
    across = np.einsum("ij,ij->i", xy[near] - heads.lines.axis[cell[near]], heads.inward[cell[near]])
    on[near] = np.abs(across) <= head_width_m / 2 + BESIDE_M
    return on
