"""Lines in plan: chainage, normals, parts and feet of one line, and the feet of points on the nearest of many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from .kernels import threads
from .progress import SILENT, Progress

STATION_M = 0.05
"""Length of the chords among which points find their nearest line; of two lines this close, either is taken."""

POINTS_AT_ONCE = 500_000
"""Points projected at once: limits the memory, and allows several checks for cancellation per second."""

POINTS_FOR_THREADS = 10_000
"""Fewer points are projected by a single thread: on two cores, starting the threads takes 0.3 ms, the points 2 ms."""

CANDIDATES = 4
"""Number of nearest chords of which one has the nearest point: near a place there may be two of a line and a second
line."""

CLOSED_M = 0.01
"""Largest distance between the ends of a closed line; the ends of extracted rings coincide, even after thinning."""

MIN_RING_M = 10.0
"""Shortest closed rail: no track turns round in less."""

FOOT_ROUNDS = 3
"""Rounds of the search for the segment with the foot of a point, from a place near it: the first one is off by the bend
of the line."""

PAST_END = 1.0
"""A foot this many segments from the middle of its segment is beside the line; a bend leaves small gaps."""

SAME_PLACE_M = 1e-9
"""Vertices closer than this along a line are the same."""

NORTH_TANGENT = np.tan(np.radians(1.0))
"""Lines within one degree of north start at their southern end, all others at their western end."""


def length_along(vertices: np.ndarray) -> np.ndarray:
    """Return the distance of each vertex from the first along a line: in plan for (n, 2), in space for (n, 3).

    >>> length_along(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 10.0]])).tolist()
    [0.0, 5.0, 11.0]
    """
    steps = np.linalg.norm(np.diff(vertices, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


@dataclass(frozen=True, eq=False)
class Polyline:
    """A line, `xyz` (n, 2) or (n, 3) metres, with chainages; all that is computed along it is in plan.

    `given`, (n,), are rising chainages of the vertices where they are those of another line; None for the distance from
    the first.

    Examples
    --------
    >>> line = Polyline(np.array([[0.0, 0.0], [4.0, 0.0], [9.0, 0.0]]))
    >>> line.length_m, line.at(np.array([5.0])).tolist(), line.part(3.0, 5.0).xyz[:, 0].tolist()
    (9.0, [[5.0, 0.0]], [3.0, 4.0, 5.0])
    """

    xyz: np.ndarray
    given: np.ndarray | None = None

    def __reduce__(self) -> tuple[type[Polyline], tuple[np.ndarray, np.ndarray | None]]:
        """Send to another process what the rest follows from."""
        return Polyline, (self.xyz, self.given)

    @property
    def xy(self) -> np.ndarray:
        """Vertices in plan, (n, 2)."""
        return self.xyz[:, :2]

    @cached_property
    def t(self) -> np.ndarray:
        """Chainage of each vertex, (n,) metres."""
        return length_along(self.xy) if self.given is None else self.given

    @property
    def length_m(self) -> float:
        """Difference of the chainages of both ends."""
        return float(self.t[-1] - self.t[0])

    @property
    def is_closed(self) -> bool:
        """Whether the line ends where it starts."""
        dx, dy = self.xyz[-1, :2] - self.xyz[0, :2]
        return math.hypot(dx, dy) <= CLOSED_M and self.length_m > MIN_RING_M

    @property
    def starts_at_its_end(self) -> bool:
        """Whether the line must be reversed to start in the west, or in the south if it runs north."""
        dx, dy = self.xyz[-1, :2] - self.xyz[0, :2]
        if abs(dx) <= NORTH_TANGENT * abs(dy):
            return bool(dy < 0)
        return bool(dx < 0)

    @cached_property
    def tangents(self) -> np.ndarray:
        """Unit vectors along the line at its vertices, (n, 2)."""
        ahead = np.diff(self.xy, axis=0)
        both = np.concatenate([ahead[:1], ahead[:-1] + ahead[1:], ahead[-1:]])
        return both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), np.finfo(float).tiny)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit vectors to the left at the vertices, (n, 2): at a vertex, of the bisector of its two segments."""
        return np.column_stack([-self.tangents[:, 1], self.tangents[:, 0]])

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return the places at chainages, (m, d); beyond the ends, those of the ends."""
        return interpolate(self.xyz, self.t, t)

    def left_at(self, t: np.ndarray) -> np.ndarray:
        """Return unit vectors to the left at chainages, (m, 2)."""
        left = interpolate(self.normals, self.t, t)
        return left / np.hypot(*left.T)[:, None]

    def part(self, start: float, end: float) -> Polyline:
        """Return the part between two chainages, with vertices at both; its chainages start at 0."""
        inner = self.t[(self.t > start + SAME_PLACE_M) & (self.t < end - SAME_PLACE_M)]
        return Polyline(self.at(np.concatenate([[start], inner, [end]])))

    def resampled(self, step_m: float, start: float = -np.inf, end: float = np.inf) -> Polyline:
        """Return the line from one chainage to another with vertices at equal distances of at most `step_m`.

        >>> Polyline(np.array([[0.0, 0.0], [10.0, 0.0]])).resampled(4.0).t.round(2).tolist()
        [0.0, 3.33, 6.67, 10.0]
        """
        start, end = max(start, self.t[0]), min(end, self.t[-1])
        t = np.linspace(start, end, max(int(np.ceil((end - start) / step_m)), 1) + 1)
        return Polyline(self.at(t), t)

    def feet(self, xy: np.ndarray, reach_m: float) -> Feet:
        """Project points, (k, 2), onto the line; points beyond `reach_m` or past its ends are left out."""
        feet = self._chords.feet(xy, reach_m)
        return feet if self.given is None else replace(feet, t=np.interp(feet.t, length_along(self.xy), self.given))

    def feet_near(self, xy: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return chainages of the feet of points, (k, 2), and distances to the left; NaN past both ends.

        The chainages `t`, (k,), of places beside the feet lead to them, much faster than a search.
        """
        along = np.diff(self.xy, axis=0)
        length = np.hypot(*along.T)
        segment = np.searchsorted(self.t, t) - 1
        for _ in range(FOOT_ROUNDS + 1):
            segment = np.clip(segment, 0, len(length) - 1)
            step = xy - self.xy[segment]
            share = np.einsum("ij,ij->i", step, along[segment]) / length[segment] ** 2
            last, segment = segment, segment + np.floor(share).astype(np.int64)
        across = cross(along[last], step) / length[last]
        beside = np.abs(share - 0.5) < PAST_END
        return np.where(beside, self.t[last] + share * np.diff(self.t)[last], np.nan), np.where(beside, across, np.nan)

    def feet_of(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return chainages of the feet of points, (k, 2), and distances to the left; NaN past both ends."""
        return self.feet_near(xy, self.t[cKDTree(self.xy).query(xy)[1]])

    @cached_property
    def _chords(self) -> Chords:
        return Chords.of([Polyline(self.xy)], STATION_M)


def interpolate(values: np.ndarray, along: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Interpolate linearly between the rows of an array, (n, d), at increasing chainages, (n,); returns (m, d)."""
    return np.column_stack([np.interp(t, along, column) for column in values.T])


def distance_to(t: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Return the distance of stations from the nearest of the chainages `t`, increasing; inf if there are none."""
    around = np.concatenate([[-np.inf], t, [np.inf]])
    after = np.searchsorted(t, stations) + 1
    return np.minimum(stations - around[after - 1], around[after] - stations)


@dataclass(frozen=True)
class Feet:
    """Feet of points: their perpendicular projections onto the nearest of several lines, (n,) each.

    `point` and `line` are numbers; feet are sorted by line, then by the chainage `t`, metres. `across` is the distance
    of the point from its foot in metres, positive to the left of the line.
    """

    point: np.ndarray
    line: np.ndarray
    t: np.ndarray
    across: np.ndarray

    def of(self, line: int) -> Feet:
        """Return the feet on one line."""
        mine = slice(*np.searchsorted(self.line, [line, line + 1]))
        return self[mine]

    def __getitem__(self, which: slice | np.ndarray) -> Feet:
        return Feet(self.point[which], self.line[which], self.t[which], self.across[which])


def project(lines: Sequence[np.ndarray], xy: np.ndarray, reach_m: float, progress: Progress = SILENT) -> Feet:
    """Project points, (k, 2), onto the nearest line; points beyond `reach_m` or past a line's end are left out.

    >>> feet = project([np.array([[0.0, 0.0], [10.0, 0.0]])], np.array([[4.0, 0.05], [7.0, 3.0]]), reach_m=0.1)
    >>> feet.point.tolist(), feet.t.round(3).tolist(), feet.across.round(3).tolist()
    ([0], [4.0], [0.05])
    """
    return Chords.of([Polyline(line[:, :2]) for line in lines], STATION_M).feet(xy, reach_m, progress)


@dataclass(frozen=True, eq=False)
class Chords:
    """Lines cut into short chords, in search trees.

    `xyz`, (n, d), are places on the lines, one line after the other, from each of which a chord leads to the next;
    number of the line and chainage of each are (n,).
    """

    xyz: np.ndarray
    line: np.ndarray
    t: np.ndarray

    @classmethod
    def of(cls, lines: Iterable[Polyline], step_m: float) -> Chords:
        """Cut lines into chords of equal length, at most `step_m`."""
        return cls.joined([line.resampled(step_m) for line in lines])

    @classmethod
    def joined(cls, lines: Sequence[Polyline]) -> Chords:
        """Take the segments of lines as chords."""
        number = np.repeat(np.arange(len(lines), dtype=np.int32), [len(one.xyz) for one in lines])
        if not lines:
            return cls(np.empty((0, 3)), number, np.empty(0))
        return cls(np.concatenate([one.xyz for one in lines]), number, np.concatenate([one.t for one in lines]))

    @cached_property
    def first(self) -> np.ndarray:
        """Place at which each chord starts, (m,) int."""
        return np.flatnonzero(self.line[1:] == self.line[:-1])

    @property
    def number(self) -> np.ndarray:
        """Number of the line of each chord, (m,)."""
        return self.line[self.first]

    @cached_property
    def start(self) -> np.ndarray:
        """Where chords start, (m, d)."""
        return self.xyz[self.first]

    @cached_property
    def step(self) -> np.ndarray:
        """Vectors of the chords, (m, d)."""
        return self.xyz[self.first + 1] - self.start

    @property
    def middle(self) -> np.ndarray:
        """Middles of the chords, (m, d)."""
        return 0.5 * (self.start + self.xyz[self.first + 1])

    @property
    def middle_t(self) -> np.ndarray:
        """Chainages of the middles, (m,)."""
        return 0.5 * (self.t[self.first] + self.t[self.first + 1])

    @property
    def left(self) -> np.ndarray:
        """Unit vectors to the left of the chords in plan, (m, 2)."""
        x, y = self.step[:, 0], self.step[:, 1]
        return np.column_stack([-y, x]) / np.hypot(x, y)[:, None]

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the chords, (m,): in space where they have heights."""
        return np.linalg.norm(self.step, axis=1)

    @cached_property
    def _places(self) -> cKDTree:
        return cKDTree(self.xyz[:, :2])

    @cached_property
    def _middles(self) -> cKDTree:
        return cKDTree(self.middle[:, :2])

    def nearest(self, places: np.ndarray, candidates: int = CANDIDATES) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest point in plan on any chord for places, (k, d), and the numbers of these chords, (k,).

        Of the chords with the nearest middles, as many as `candidates` are tried.
        """
        xy = places[:, :2]
        _, tried = self._middles.query(xy, k=np.arange(1, min(candidates, len(self.first)) + 1))
        start, step = self.start[tried], self.step[tried]
        ahead = np.sum((xy[:, None] - start[..., :2]) * step[..., :2], axis=2)
        share = np.clip(ahead / np.sum(step[..., :2] ** 2, axis=2), 0, 1)
        feet = start + share[..., None] * step
        distance = np.linalg.norm(feet[..., :2] - xy[:, None], axis=2)
        rows, best = np.arange(len(xy)), np.argmin(distance, axis=1)
        return feet[rows, best], tried[rows, best]

    def feet(self, xy: np.ndarray, reach_m: float, progress: Progress = SILENT) -> Feet:
        """Project points, (k, 2), onto the nearest line; points beyond `reach_m` or past a line's end are left out."""
        if not len(self.xyz) or not len(xy):
            nothing = np.empty(0)
            return Feet(nothing.astype(np.int64), nothing.astype(np.int32), nothing, nothing)
        starts = range(0, len(xy), POINTS_AT_ONCE)
        found = [self._feet(xy[start : start + POINTS_AT_ONCE], start, reach_m) for start in progress.follow(starts)]
        point, line, t, across = (np.concatenate(column) for column in zip(*found))
        order = np.lexsort((t, line))
        return Feet(point[order], line[order], t[order], across[order])

    def _feet(
        self, xy: np.ndarray, first: int, reach_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return indices of the points in reach (that of `xy[0]` is `first`), and their lines, t and across."""
        workers = threads() if len(xy) > POINTS_FOR_THREADS else 1
        distance, nearest = self._places.query(xy, distance_upper_bound=reach_m + STATION_M, workers=workers)
        near = np.flatnonzero(np.isfinite(distance))
        xy, nearest = xy[near], nearest[near]
        before, after = self._foot(xy, nearest - 1), self._foot(xy, nearest)
        t, across = np.where(np.abs(before[1]) < np.abs(after[1]), before, after)
        inside = np.abs(across) <= reach_m
        return near[inside] + first, self.line[nearest[inside]], t[inside], across[inside]

    def _foot(self, xy: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return t and across of each point's foot on the chord from a place, (2, k); inf where there is none.

        A foot may be up to 1 % of the chord's length past its ends, so that no point outside a bend is lost.
        """
        start, end, exists = self._ends(place)
        a, b = self._places.data[start], self._places.data[end]
        length = self.t[end] - self.t[start]
        exists &= length > 0
        direction = (b - a) / np.where(exists, length, 1.0)[:, None]
        ahead = np.einsum("ij,ij->i", xy - a, direction)
        across = direction[:, 0] * (xy[:, 1] - a[:, 1]) - direction[:, 1] * (xy[:, 0] - a[:, 0])
        is_foot = exists & (ahead > -0.01 * length) & (ahead < 1.01 * length)
        return np.where(is_foot, [self.t[start] + ahead, across], np.inf)

    def _ends(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return both places of the chords from places, (k,) each, and whether there is such a chord."""
        start, end = np.maximum(place, 0), np.minimum(place + 1, len(self.t) - 1)
        return start, end, (place == start) & (place < end) & (self.line[start] == self.line[end])

    def meet(
        self, stations: np.ndarray, directions: np.ndarray, expected_m: float, max_offset_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find the lines in given directions, unit vectors (k, 2), from stations, (k, 2).

        A line is expected at `expected_m`, give or take `max_offset_m`. Returns the place on a line that is nearest to
        the expected one, (k,), where the line is met, (k, d), NaN where none is, and the chainage there, (k,).
        """
        off, nearest = self._places.query(stations + expected_m * directions, distance_upper_bound=max_offset_m)
        nearest = np.where(np.isfinite(off), nearest, 0)
        xyz, t = np.full((len(stations), self.xyz.shape[1]), np.nan), np.full(len(stations), np.nan)
        for place in (nearest - 1, nearest):
            a, b, exists = self._ends(place)
            left_a, left_b = (cross(directions, self.xyz[one, :2] - stations) for one in (a, b))
            passed = left_a - left_b
            share = np.divide(left_a, passed, out=np.full(len(passed), np.inf), where=passed != 0)
            # A line is extended by a chord, because two rails of a track do not end abreast to the centimetre.
            met = np.isfinite(off) & exists & (share >= -1) & (share <= 2)
            share = np.where(met, share, 0.0)
            xyz = np.where(met[:, None], self.xyz[a] + share[:, None] * (self.xyz[b] - self.xyz[a]), xyz)
            t = np.where(met, self.t[a] + share * (self.t[b] - self.t[a]), t)
        return nearest, xyz, t


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the cross products of vectors in plan, (k, 2) each, as (k,): how far the other one leads to the left."""
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of marked items.

    >>> runs(np.array([False, True, True, False, True]))
    [(1, 2), (4, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]
