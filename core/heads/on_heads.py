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

MOST_BELOW = 0.5
"""Share of the places of a sheet with a head above, from which the sheet is what heads stand on. Below a standing train,
heads are a smaller part of their sheet."""


@dataclass(frozen=True)
class Levels:
    """Heights at which places have many points: p places with `LEVELS` each, the fullest first, NaN without points.

    Attributes
    ----------
    height : (p, LEVELS) array
        Height of the crown, metres.
    count : (p, LEVELS) int array
        Points of each level.
    """

    height: np.ndarray
    count: np.ndarray

    @classmethod
    def of(cls, place: np.ndarray, z: np.ndarray, places: int) -> Levels:
        """Find the levels of places.

        Parameters
        ----------
        place : (n,) int array
            Place to which each point belongs.
        z : (n,) array
            Heights of the points.
        places : int
            Number of places.
        """
        height, count = np.full((places, LEVELS), np.nan), np.zeros((places, LEVELS), dtype=int)
        order = np.lexsort((z, place))
        place, z = place[order], z[order]
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
            bottom, top = np.full((2, places), np.inf)
            bottom[here], top[here] = z[first], z[first + inside - 1]
            left = ~((z >= bottom[place]) & (z <= top[place]))
            place, z = place[left], z[left]
        strays = count < MIN_LEVEL_SHARE * count.max(axis=1, keepdims=True, initial=0)
        return cls(np.where(strays, np.nan, height), np.where(strays, 0, count))

    def noise(self, place: np.ndarray, z: np.ndarray) -> float:
        """Return the standard deviation of heights, metres, as points above the highest level of their place show it."""
        above_m = z - np.fmax.reduce(self.height, axis=1)[place]
        above_m = above_m[(above_m > 0) & (above_m < LEVEL_M)]
        return 1.4826 * float(np.median(above_m)) if len(above_m) else 0.0


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

    Nothing is left out of a class that holds heads alone.
    """
    return points.kept(on_heads(points.xyz))


def on_heads(xyz: np.ndarray) -> np.ndarray:
    """Return which points of rails are not below a head, (n,) bool, given (n, 3) local metres."""
    if not len(xyz):
        return np.zeros(0, dtype=bool)
    cell = np.floor(xyz[:, :2] / PLACE_M).astype(np.int64)
    _, first, place = np.unique(cell @ [1 << 32, 1], return_index=True, return_inverse=True)
    sample = xyz[_thinned(place.ravel())]
    places, own, point = Places.around(xyz[first, :2], sample[:, :2])
    levels = Levels.of(own, sample[point, 2], len(first))
    pairs = places.along()
    head_m = HEAD_M + levels.noise(own, sample[point, 2])
    below = _have_heads_above(levels, pairs, head_m)
    if not below.any():
        return np.ones(len(xyz), dtype=bool)
    sheet, height = _sheets(levels, pairs)
    there = sheet >= 0
    share = np.bincount(sheet[there], below[there]) / np.bincount(sheet[there])
    return _kept(xyz[:, 2], place.ravel(), height, there & (share[sheet] >= MOST_BELOW), head_m)


def _thinned(place: np.ndarray) -> np.ndarray:
    """Choose at most `MOST_PER_PLACE` points of each place, evenly in the order of the cloud; `place` of each, (n,)."""
    order, count = np.argsort(place, kind="stable"), np.bincount(place)
    rank = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    each = np.repeat(np.maximum(count, MOST_PER_PLACE), count)
    chosen = (rank + 1) * MOST_PER_PLACE // each > rank * MOST_PER_PLACE // each
    return order[chosen]


@dataclass(frozen=True)
class Places:
    """Places on rails: the middles of the points around them, (p, 2), and the directions of the rails, (p,) radians."""

    xy: np.ndarray
    direction: np.ndarray

    @classmethod
    def around(cls, xy: np.ndarray, points: np.ndarray) -> tuple[Places, np.ndarray, np.ndarray]:
        """Find the points that belong to places on rails, (p, 2), among (n, 2).

        Returns the places, and the place and the number of each point that belongs to one, (k,) each; a point may
        belong to several.
        """
        tree = cKDTree(points)
        nearest = tree.query(xy, min(POINTS_PER_PLACE, len(points)), workers=threads())[0].reshape(len(xy), -1)
        reach_m = np.hypot(np.clip(nearest[:, -1], *HALF_LENGTH_M), HALF_WIDTH_M)
        lists = tree.query_ball_point(xy, reach_m, workers=threads())
        place, point = np.repeat(np.arange(len(xy)), [len(one) for one in lists]), np.concatenate(lists).astype(int)
        east, north = (points[point] - xy[place]).T
        count = np.bincount(place, minlength=len(xy))
        x, y, xx, yy, xy_ = (
            np.bincount(place, one, len(xy)) / count for one in (east, north, east**2, north**2, east * north)
        )
        places = cls(xy + np.column_stack([x, y]), 0.5 * np.arctan2(2 * (xy_ - x * y), xx - x**2 - yy + y**2))
        beside = np.abs(places.across(place, points[point] - xy[place])) <= HALF_WIDTH_M
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


def _have_heads_above(levels: Levels, pairs: tuple[np.ndarray, np.ndarray], head_m: float) -> np.ndarray:
    """Return which levels of places have a level above, there or along the rail, that can be their head, (p, LEVELS)."""
    one, other = pairs
    above_m = levels.height[other][:, None, :] - levels.height[one][:, :, None]
    is_head = levels.count[other][:, None, :] >= MIN_ABOVE_SHARE * levels.count[one][:, :, None]
    has_head = ((above_m >= head_m) & (above_m <= RAIL_M) & is_head).any(axis=2)
    found = np.zeros(levels.height.shape, dtype=bool)
    np.logical_or.at(found, one, has_head)
    return found


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
