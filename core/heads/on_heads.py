"""Heads of whole rails: points on webs, feet and sleepers below a head are left out.

In most classifications "rail" means the rail from head to foot. A line belongs on the head, so that everything else is
left out before a raster is drawn. See docs/method.md section 1.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..clouds.points import RailPoints
from ..kernels import threads

PLACE_M = 0.25
"""Side of the cells, each a place at which levels are looked for: along it, a gradient of 4 % changes them by 1 cm."""

POINTS_PER_PLACE = 60
"""Points around a place that tell its levels: of ten on a head, a level is known to a few millimetres."""

MOST_PER_PLACE = 30
"""Points in the cell of a place that are looked at: with those of the cells next to it, they are enough."""

BLOCK = 4096
"""Places that are looked at together: their points take some 20 MB."""

HALF_LENGTH_M = (0.25, 1.5)
"""Least and largest distance from a place, along the rail, of the points that belong to it. Where points are few, the
second one finds them, and a rail of 25 m radius bends by 45 mm there, which is less than a head."""

HALF_WIDTH_M = 0.13
"""Distance across the rail of the points that belong to a place: from one edge of the widest foot, 75 mm from the axis,
the far edge of the head is 114 mm away."""

LEVELS = 4
"""Levels of a place that are looked for: head, web, foot, and something that stands above the rail."""

LEVEL_M, CROWN_M = 0.05, 0.015
"""Height of the points that make a level, about that of a head with its faces, and of the fullest part of it, which is
the crown: all but a tenth of its points, with a noise of 4 mm."""

MIN_CROWN_SHARE = 0.5
"""Points of a crown as a share of those in the fullest part of the level: a scanner to one side sees more of the face
than of the crown above it."""

MIN_IN_LEVEL, MIN_LEVEL_SHARE = 3, 0.15
"""Fewest points of a level, and their least share of those in the fullest level of the place: fewer are strays."""

ALONG_M, STEP_M = 0.5, 0.02
"""Distance of places along a rail whose levels are compared, and largest difference of levels that continue each other:
a gradient of 4 % over this distance."""

HEAD_M = 0.04
"""Depth below the crown of points that are on a head: its faces end at 37 mm on 60E1, and at 45 mm on the tallest head
of the standards."""

RAIL_M = 0.20
"""Depth below a head down to which points are on its web and foot, and on the sleeper below the tallest rails."""

MIN_ABOVE_SHARE = 1 / 3
"""Points of a head as a share of those on its web, foot or sleeper, at one place: from grazing angles, the foot returns
twice as many. Strays above a head are fewer."""

MAX_SPREAD_M = 0.04
"""Largest standard deviation across of the points of a head: evenly on a head of 78 mm it is 23 mm, with the blur of
images 35 mm. That of weeds and of ballast is 75 mm, the width that is looked at."""

MOST_BELOW = 0.5
"""Share of a sheet with heads above from which it is what heads stand on. Of a rail below a standing train or weeds, a
smaller part has something above it."""


@dataclass(frozen=True)
class Levels:
    """Heights at which places have many points: p places with `LEVELS` each, the fullest first, NaN without points.

    Attributes
    ----------
    height : (p, LEVELS) array
        Height of the crown, metres.
    count : (p, LEVELS) int array
        Points of each level.
    spread_m : (p, LEVELS) array
        Standard deviation of these points across the rail, metres.
    """

    height: np.ndarray
    count: np.ndarray
    spread_m: np.ndarray

    @classmethod
    def of(cls, place: np.ndarray, across: np.ndarray, z: np.ndarray, places: int) -> Levels:
        """Find the levels of places.

        Parameters
        ----------
        place : (n,) int array
            Place to which each point belongs.
        across, z : (n,) arrays
            Offsets of the points across the rail, and their heights.
        places : int
            Number of places.
        """
        height, spread_m = np.full((2, places, LEVELS), np.nan)
        count = np.zeros((places, LEVELS), dtype=int)
        order = np.lexsort((z, place))
        place, across, z = place[order], across[order], z[order]
        for number in range(LEVELS):
            if not len(z):
                break
            first, inside = _highest(place, z, LEVEL_M, 1.0)
            first, inside = first[inside >= MIN_IN_LEVEL], inside[inside >= MIN_IN_LEVEL]
            if not len(first):
                break
            of_level = np.repeat(np.arange(len(first)), inside)
            member = np.arange(inside.sum()) + np.repeat(first - np.cumsum(inside) + inside, inside)
            crown, in_crown = _highest(of_level, z[member], CROWN_M, MIN_CROWN_SHARE)
            here = place[first]
            height[here, number] = z[member][crown + in_crown // 2]
            count[here, number] = inside
            mean, square = (np.bincount(of_level, across[member] ** power) / inside for power in (1, 2))
            spread_m[here, number] = np.sqrt(np.maximum(square - mean**2, 0.0))
            bottom, top = np.full((2, places), np.inf)
            bottom[here], top[here] = z[first], z[first + inside - 1]
            left = ~((z >= bottom[place]) & (z <= top[place]))
            place, across, z = place[left], across[left], z[left]
        strays = count < MIN_LEVEL_SHARE * count.max(axis=1, keepdims=True, initial=0)
        return cls(np.where(strays, np.nan, height), np.where(strays, 0, count), spread_m)

    def above(self, place: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the heights of points above the highest level of their place, metres, of those close to it."""
        above_m = z - np.fmax.reduce(self.height, axis=1)[place]
        return above_m[(above_m > 0) & (above_m < LEVEL_M)]


def _highest(group: np.ndarray, z: np.ndarray, window_m: float, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the highest window of heights in each group with a share of the points of the fullest one.

    The points, at least one, are sorted by group and height. Returns the first point of each window, and the number of
    its points, (k,) each.
    """
    key = group * (np.ptp(z) + 2 * window_m) + z - z.min()
    inside = np.searchsorted(key, key + window_m, side="right") - np.arange(len(key))
    borders = np.flatnonzero(np.diff(group, prepend=-1))
    best = np.repeat(np.maximum.reduceat(inside, borders), np.diff(np.append(borders, len(group))))
    enough = np.flatnonzero(inside >= share * best)
    last = enough[np.flatnonzero(np.diff(group[enough], append=-1))]
    return last, inside[last]


def heads_of(points: RailPoints) -> RailPoints:
    """Return the points of rails without those on webs and feet, and on what lies below.

    Nothing is left out of a class that holds heads alone, and points that were found in a raw cloud are on heads.
    """
    if points.found:
        return points
    kept = on_heads(points.xyz)
    return points if kept.all() else points.kept(kept)


def on_heads(xyz: np.ndarray) -> np.ndarray:
    """Return which points of rails are not below a head, (n,) bool, given (n, 3) local metres."""
    if not len(xyz):
        return np.zeros(0, dtype=bool)
    cell = np.floor(xyz[:, :2] / PLACE_M).astype(np.int64)
    _, first, place = np.unique(cell @ [1 << 32, 1], return_index=True, return_inverse=True)
    place = place.ravel()
    sample = xyz[_thinned(place)]
    places, levels, noise_m = _seen_at(xyz[first, :2], sample)
    pairs, head_m = places.along(), HEAD_M + noise_m
    lower, head = _heads_above(levels, pairs, head_m)
    if not len(head):
        return np.ones(len(xyz), dtype=bool)
    sheet, height = _sheets(levels, pairs)
    return _kept(xyz[:, 2], place, height, _are_below(sheet, lower, head), head_m)


def _thinned(place: np.ndarray) -> np.ndarray:
    """Choose at most `MOST_PER_PLACE` points of each place, evenly in the order of the cloud; `place` of each, (n,)."""
    order, count = np.argsort(place, kind="stable"), np.bincount(place)
    rank = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    each = np.repeat(np.maximum(count, MOST_PER_PLACE), count)
    chosen = (rank + 1) * MOST_PER_PLACE // each > rank * MOST_PER_PLACE // each
    return order[chosen]


def _seen_at(xy: np.ndarray, points: np.ndarray) -> tuple[Places, Levels, float]:
    """Look at the points, (n, 3), around places, (p, 2); the third figure is the noise of heights, metres."""
    tree, found = cKDTree(points[:, :2]), []
    for block in np.array_split(xy, -(-len(xy) // BLOCK)):
        places, own, point = Places.around(block, tree)
        across, z = places.across(own, points[point, :2] - places.xy[own]), points[point, 2]
        levels = Levels.of(own, across, z, len(block))
        found.append((places.xy, places.direction, levels.height, levels.count, levels.spread_m, levels.above(own, z)))
    places_xy, direction, height, count, spread_m, above_m = (np.concatenate(each) for each in zip(*found))
    noise_m = 1.4826 * float(np.median(above_m)) if len(above_m) else 0.0
    return Places(places_xy, direction), Levels(height, count, spread_m), noise_m


@dataclass(frozen=True)
class Places:
    """Places on rails: the middles of the points around them, (p, 2), and the directions of the rails, (p,) radians."""

    xy: np.ndarray
    direction: np.ndarray

    @classmethod
    def around(cls, xy: np.ndarray, tree: cKDTree) -> tuple[Places, np.ndarray, np.ndarray]:
        """Find the points of a tree, (n, 2), that belong to places on rails, (p, 2).

        Returns the places, and the place and the number of each point that belongs to one, (k,) each; a point may
        belong to several.
        """
        nearest = tree.query(xy, min(POINTS_PER_PLACE, tree.n), workers=threads())[0].reshape(len(xy), -1)
        reach_m = np.hypot(np.clip(nearest[:, -1], *HALF_LENGTH_M), HALF_WIDTH_M)
        lists = tree.query_ball_point(xy, reach_m, workers=threads())
        place, point = np.repeat(np.arange(len(xy)), [len(one) for one in lists]), np.concatenate(lists).astype(int)
        east, north = (tree.data[point] - xy[place]).T
        count = np.bincount(place, minlength=len(xy))
        x, y, xx, yy, xy_ = (
            np.bincount(place, one, len(xy)) / count for one in (east, north, east**2, north**2, east * north)
        )
        places = cls(xy + np.column_stack([x, y]), 0.5 * np.arctan2(2 * (xy_ - x * y), xx - x**2 - yy + y**2))
        beside = np.abs(places.across(place, tree.data[point] - xy[place])) <= HALF_WIDTH_M
        return places, place[beside], point[beside]

    def across(self, place: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the parts of steps, (k, 2), across the rails of places, (k,)."""
        return step[:, 1] * np.cos(self.direction)[place] - step[:, 0] * np.sin(self.direction)[place]

    def along(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs of places, in both orders and with themselves, of which the second is along the rail."""
        pairs = cKDTree(self.xy).query_pairs(ALONG_M, output_type="ndarray")
        own = np.arange(len(self.xy))
        one, other = np.concatenate([pairs, pairs[:, ::-1], np.column_stack([own, own])]).T
        beside = np.abs(self.across(one, self.xy[other] - self.xy[one])) <= HALF_WIDTH_M
        return one[beside], other[beside]


def _heads_above(levels: Levels, pairs: tuple[np.ndarray, np.ndarray], head_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the levels that can be the heads above others, at their place or along the rail.

    Returns the numbers of the lower levels and of the heads, (k,) each, in order of places and their `LEVELS`.
    """
    one, other = pairs
    above_m = levels.height[other][:, None, :] - levels.height[one][:, :, None]
    is_head = levels.count[other][:, None, :] >= MIN_ABOVE_SHARE * levels.count[one][:, :, None]
    is_head &= levels.spread_m[other][:, None, :] <= MAX_SPREAD_M
    pair, lower, head = np.nonzero((above_m >= head_m) & (above_m <= RAIL_M) & is_head)
    return one[pair] * LEVELS + lower, other[pair] * LEVELS + head


def _are_below(sheet: np.ndarray, lower: np.ndarray, head: np.ndarray) -> np.ndarray:
    """Return which levels are of sheets on which heads stand, given the sheets and numbers of levels, as an array.

    Most of a sheet has a head above it, and has one of its own: a few points above a rail are near many of its places.
    """
    size = np.bincount(sheet[sheet >= 0])
    heads = np.unique(np.column_stack([sheet.flat[lower], head]), axis=0)[:, 0]
    each = [np.bincount(which, minlength=len(size)) for which in (sheet.flat[np.unique(lower)], heads)]
    return (sheet >= 0) & (np.minimum(*each) >= MOST_BELOW * size)[sheet]


def _sheets(levels: Levels, pairs: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Join levels that continue each other, from place to place and without a step, to sheets.

    Returns the number of the sheet of each level, -1 where there is no level, and the mean height of the level and of
    those that continue it, (p, LEVELS) each.
    """
    one, other = pairs
    there = np.isfinite(levels.height)
    size, number = int(there.sum()), np.cumsum(there).reshape(there.shape) - 1
    step_m = levels.height[one][:, :, None] - levels.height[other][:, None, :]
    pair, here, beyond = np.nonzero(np.abs(step_m) <= STEP_M)
    links = number[one[pair], here], number[other[pair], beyond]
    joined = coo_matrix((np.ones(len(pair)), links), (size, size)).tocsr()
    sheet, height = np.full(there.shape, -1), np.full(there.shape, np.nan)
    sheet[there] = connected_components(joined, directed=False)[1]
    height[there] = joined @ levels.height[there] / np.bincount(links[0], minlength=size)
    return sheet, height


def _kept(z: np.ndarray, place: np.ndarray, height: np.ndarray, below: np.ndarray, head_m: float) -> np.ndarray:
    """Return which points are not below a head, (n,) bool.

    Parameters
    ----------
    z : (n,) array
        Heights of the points.
    place : (n,) int array
        Place of each point.
    height : (p, LEVELS) array
        Levels of the places.
    below : (p, LEVELS) bool array
        Levels of what heads stand on.
    """
    on_head, under_head, on_other = np.zeros((3, len(z)), dtype=bool)
    for level, is_below in zip(height.T, below.T):
        depth_m = level[place] - z
        here = np.abs(depth_m) <= LEVEL_M
        on_other |= here & is_below[place]
        on_head |= here & (depth_m <= head_m) & ~is_below[place]
        under_head |= (depth_m > head_m) & (depth_m <= RAIL_M) & ~is_below[place]
    return on_head | ~(under_head | on_other)
