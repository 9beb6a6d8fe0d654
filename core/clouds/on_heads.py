"""Heads of whole rails: points on webs, feet and sleepers below a head are left out.

In most classifications "rail" means the rail from head to foot. A line belongs on the head, so that everything else is
left out before a raster is drawn. See docs/method.md section 1.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..kernels import threads
from ..spread import sigma_by_median
from .points import RailPoints

PLACE_M = 0.25
"""Side of the cells, each a place at which a rail is looked at: along it, a gradient of 4 % changes heights by 1 cm."""

POINTS_PER_PLACE = 60
"""Points around a place that tell the height of its head: of ten on a head, it is known to a few millimetres."""

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

CROWN_M = 0.015
"""Height of the fullest part of a head, its crown: all but a tenth of its points, with a noise of 4 mm."""

MIN_IN_CROWN, MIN_CROWN_SHARE = 3, 0.15
"""Fewest points of a crown, and their least share of those in the fullest part of the rail, as high as a crown: fewer
are strays. From grazing angles, the foot returns twice as many."""

MAX_SPREAD_M = 0.04
"""Largest standard deviation across of the points of a crown: evenly on a head of 78 mm it is 23 mm, with the blur of
images 35 mm. That of weeds and of ballast is 75 mm, the width that is looked at."""

HEAD_M, RAIL_M = 0.04, 0.20
"""Depths below the crown down to which points are on the head, and on web and foot and on the sleeper below the tallest
rails. The faces of a head end at 37 mm on 60E1, and at 45 mm on the tallest head of the standards."""

NOISE_SIGMAS, SCATTER_SIGMAS = 3.0, 2.0
"""Standard deviations of the noise of heights by which points on the lower ends of faces may be deeper, and of the
scatter of points about a face by which others may be off it: beams from the air see no upright face."""

FACE_M = (0.015, 0.03)
"""Depths below the crown between which the faces of a head are upright, whatever its wear: they show how wide it is."""

FACES_PERCENT, MIN_ON_FACES = (20.0, 80.0), 10
"""Percentiles of the offsets of the points on faces that tell both edges of a head, or twice the one that is seen; of
five points, one may be a stray."""

WIDEST_M = 0.08
"""Distance of the faces of the widest head, 78 mm; those of two heads, as in switches, are further apart."""

FACES_M, FACES_SIGMAS = 0.036, 7.0
"""Depth below the crown of the points on heads where others lie below, and standard deviations of the noise if they are
more, as in clouds from the air: what is left of a web is in the middle of the head, and a scanner that sees few points
of the crown shows more there. The lowest part of a face may go. The noise is known from points above the crown alone,
whose height is above the mean of the top, so that it is taken for half."""

BELOW_SHARE, WEB_SHARE = 0.05, 0.25
"""Least share of the points of a class that are below heads and as narrow about the axis as a head, where it holds
whole rails; and their least share of all that is below heads. Measured on classes of heads alone, up to 0.03; on whole
rails, 0.1 to 0.6 and 0.3 to 0.9; on flanks that beams from the air show, 0.05 to 0.13 and 0.3 to 0.7. Ridges of images
have most of these points beside the axis, up to 0.15, and they show that the cloud is blunt. The search of a raw cloud
always takes the web down to 50 mm below the top where a rail is seen from the side."""

RECESS_M = (0.015, 0.05)
"""Distances of a web from the face above it: 20 mm or more on every standard, and the undersides of heads are between;
beyond half of the widest head and half a web, what is there may be the other face."""

FULL_SHARE = 0.5
"""Points in the crown as a share of those in the fullest part of the head: a scanner to one side sees more of the face
than of the crown above it."""

ALONG_M = 2.0
"""Distance to either side of a place along which a rail is straight in height: a crest of 2,000 m radius bends by 1 mm,
and what stands on the rail for as long as this is not half of what is seen."""

ROUNDS, LEAST_OFF_M = 12, 0.002
"""Rounds of reweighting, by which a fit no longer moves, and the deviation below which heights weigh the same."""

GRADIENT = 0.04
"""Steepest gradient of railways, which is expected, plus or minus, where a place has no others along its rail."""

MIN_AGREE, AGREE_M = 0.5, 0.02
"""Share of the places along the rail that must agree on its height, and how far off they may be."""


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

    def along(self, place: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the parts of steps, (k, 2), along the rails of places, (k,)."""
        return step[:, 0] * np.cos(self.direction)[place] + step[:, 1] * np.sin(self.direction)[place]

    def beside(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the pairs of places, each with itself and with those along its rail, and the ways between them."""
        pairs = cKDTree(self.xy).query_pairs(ALONG_M, output_type="ndarray")
        own = np.arange(len(self.xy))
        one, other = np.concatenate([pairs, pairs[:, ::-1], np.column_stack([own, own])]).T
        step = self.xy[other] - self.xy[one]
        near = np.abs(self.across(one, step)) <= HALF_WIDTH_M
        return one[near], other[near], self.along(one[near], step[near])


def heads_of(points: RailPoints) -> RailPoints:
    """Return the points of rails without those on webs and feet, and on what lies below.

    The search of a raw cloud takes what is up to a head deep below the tops of cells: where a rail is seen from one
    side, some of its web, too. In a blunt cloud it takes ridges, whose flanks show the head and what lies below it.
    """
    if points.found and points.blunt:
        return points
    kept = on_heads(points.xyz, points.found, points.strips)
    return points if kept.all() else points.kept(kept)


def on_heads(xyz: np.ndarray, found: bool = False, strips: np.ndarray | None = None) -> np.ndarray:
    """Return which points of rails are not below a head, (n,) bool, given (n, 3) local metres.

    They are those of a class, or those that were `found` in a raw cloud. Each of the strips, (n,), may show something
    else: a scanner heads alone, and images what is around them, too.
    """
    if not len(xyz):
        return np.zeros(0, dtype=bool)
    cell = np.floor(xyz[:, :2] / PLACE_M).astype(np.int64)
    _, first, place = np.unique(cell @ [1 << 32, 1], return_index=True, return_inverse=True)
    place = place.ravel()
    places, crown, faces = _seen_at(xyz[first, :2], xyz[_thinned(place)])
    level, slope = _course(places, crown)
    # Coordinate by coordinate: all points of a square are in memory beside what is made here.
    depth_m = level[place]
    depth_m -= xyz[:, 2]
    across_m = np.zeros(len(xyz), dtype=np.float32)
    east, north = np.cos(places.direction), np.sin(places.direction)
    for axis, (along, left) in enumerate(((east, -north), (north, east))):
        step = xyz[:, axis] - places.xy[place, axis]
        across_m += step * left[place]
        step *= (slope * along)[place]
        depth_m += step
    noise_m = _noise(depth_m)
    below = depth_m > HEAD_M + NOISE_SIGMAS * noise_m
    whole = found or _are_whole(below & (depth_m <= RAIL_M), np.abs(across_m) <= WIDEST_M / 2, strips)
    if np.any(whole):
        higher_m = np.abs(slope).astype(np.float32) * HALF_LENGTH_M[0] / 2  # the crown is that of the upper points
        below |= whole & (depth_m - higher_m[place] > max(FACES_M + noise_m, FACES_SIGMAS * noise_m))
    off_m = np.full(len(xyz), np.inf, dtype=np.float32)
    for edge in faces.astype(np.float32).T:
        np.fmin(off_m, np.abs(across_m - edge[place]), out=off_m)
    on_faces = (depth_m > FACE_M[0]) & (depth_m <= FACE_M[1]) & np.isfinite(off_m)
    scatter_m = sigma_by_median(off_m[on_faces]) if on_faces.any() else np.inf
    recessed = (off_m > RECESS_M[0] + SCATTER_SIGMAS * scatter_m) & (off_m < RECESS_M[1])
    recessed &= depth_m > FACE_M[1] + noise_m
    return ~((recessed | below) & (depth_m <= RAIL_M))


def _are_whole(below: np.ndarray, narrow: np.ndarray, strips: np.ndarray | None) -> np.ndarray:
    """Return which points are of strips that hold whole rails, (n,) bool.

    It is given which points are below heads, and which are as narrow about the axis as a head, (n,) bool each.
    """
    number = np.zeros(len(below), dtype=np.int64) if strips is None else np.unique(strips, return_inverse=True)[1]
    deep, webs = np.bincount(number, below), np.bincount(number, below & narrow)
    return ((webs > BELOW_SHARE * np.bincount(number)) & (webs > WEB_SHARE * deep))[number]


def _thinned(place: np.ndarray) -> np.ndarray:
    """Choose at most `MOST_PER_PLACE` points of each place, evenly in the order of the cloud; `place` of each, (n,)."""
    order, count = np.argsort(place, kind="stable"), np.bincount(place)
    rank = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    each = np.repeat(np.maximum(count, MOST_PER_PLACE), count)
    chosen = (rank + 1) * MOST_PER_PLACE // each > rank * MOST_PER_PLACE // each
    return order[chosen]


def _seen_at(xy: np.ndarray, points: np.ndarray) -> tuple[Places, np.ndarray, np.ndarray]:
    """Look at the points, (n, 3), around places, (p, 2).

    Returns the places, the heights of their crowns, (p,) metres, and the offsets of their faces, (p, 2) metres; NaN
    where none is seen.
    """
    tree, found = cKDTree(points[:, :2]), []
    for block in np.array_split(xy, -(-len(xy) // BLOCK)):
        places, own, point = Places.around(block, tree)
        across, z = places.across(own, points[point, :2] - places.xy[own]), points[point, 2]
        crown = _crowns(own, across, z, len(block))
        faces = _faces(own, across, crown[own] - z, len(block))
        found.append((places.xy, places.direction, crown, faces))
    places_xy, direction, crown, faces = (np.concatenate(each) for each in zip(*found))
    return Places(places_xy, direction), crown, faces


def _noise(depth_m: np.ndarray) -> float:
    """Return the noise of heights, metres: above the crown, nothing else spreads the points of heads; depths, (n,)."""
    above_m = -depth_m[(depth_m < 0) & (depth_m > -HEAD_M)]
    return sigma_by_median(above_m) if len(above_m) else 0.0


def _crowns(place: np.ndarray, across: np.ndarray, z: np.ndarray, places: int) -> np.ndarray:
    """Return the heights of the crowns of places, (p,) metres: the highest part of a rail that is as narrow as a head.

    Points are given by their place, offset across the rail and height, (n,) each.
    """
    order = np.lexsort((z, place))
    place, across, z = place[order], across[order], z[order]
    ends = _windows(place, z)
    inside = ends - np.arange(len(z))
    fullest = np.zeros(places, dtype=int)
    np.maximum.at(fullest, place, inside)
    full = inside >= np.maximum(MIN_CROWN_SHARE * fullest[place], MIN_IN_CROWN)
    lowest, highest = np.full((2, places), np.nan)
    lowest[place[full][::-1]] = z[full][::-1]
    mean, square = (
        (total[ends] - total[:-1]) / inside for total in (np.append(0, np.cumsum(across**power)) for power in (1, 2))
    )
    narrow = full & (square - mean**2 <= MAX_SPREAD_M**2) & (z <= lowest[place] + RAIL_M)
    highest[place[narrow]] = z[narrow]
    near = narrow & (z >= highest[place] - HEAD_M)
    fullest[:] = 0
    np.maximum.at(fullest, place[near], inside[near])
    chosen = np.flatnonzero(near & (inside >= FULL_SHARE * fullest[place]))
    highest[place[chosen]] = z[chosen + inside[chosen] // 2]
    return highest


def _faces(place: np.ndarray, across: np.ndarray, depth_m: np.ndarray, places: int) -> np.ndarray:
    """Return the offsets of the right and the left face of the heads of places, (p, 2) metres, NaN where none is seen.

    Where one face is seen, both are that one; two heads side by side show none that is certain.
    """
    on = (depth_m > FACE_M[0]) & (depth_m <= FACE_M[1])
    place, across = place[on], across[on]
    order = np.lexsort((across, place))
    across, count = across[order], np.bincount(place, minlength=places)
    first, seen = np.cumsum(count) - count, count >= MIN_ON_FACES
    edges = np.full((places, 2), np.nan)
    for column, percent in enumerate(FACES_PERCENT):
        edges[seen, column] = across[first[seen] + np.rint(percent / 100 * (count[seen] - 1)).astype(int)]
    edges[edges[:, 1] - edges[:, 0] > WIDEST_M] = np.nan
    return edges


def _windows(place: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the ends of windows as high as a crown that begin at each point, (n,), sorted by place and height."""
    key = place * (np.ptp(z) + 2 * CROWN_M) + z - z.min()
    return np.searchsorted(key, key + CROWN_M, side="right")


def _course(places: Places, crown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the heights of heads at places, metres, and their slopes, (p,) each, as the places along their rails show.

    Around each place, the straight line with the least sum of deviations is fitted: it does not follow what stands on
    a rail or hides its head for less than half of the way. NaN where the places do not agree.
    """
    own, other, way = places.beside()
    seen = np.isfinite(crown[other])
    own, way, z, size = own[seen], way[seen], crown[other[seen]], len(crown)
    count = np.maximum(np.bincount(own, minlength=size), 1)
    middle = np.bincount(own, z, size) / count
    z, weight = z - middle[own], np.ones(len(z))
    for _ in range(ROUNDS):
        w, wx, wz, wxx, wxz = (np.bincount(own, weight * one, size) for one in (1.0, way, z, way**2, way * z))
        bound = wxx + AGREE_M / GRADIENT**2
        fall = np.maximum(w * bound - wx**2, 1e-12)
        level, slope = (bound * wz - wx * wxz) / fall, (w * wxz - wx * wz) / fall
        off_m = np.abs(z - level[own] - slope[own] * way)
        weight = 1 / np.maximum(off_m, LEAST_OFF_M)
    agree = np.bincount(own, off_m <= AGREE_M, size)
    return np.where(agree >= MIN_AGREE * count, middle + level, np.nan), slope
