"""Geometry along polylines in plan: stations, normals, projection of points, and direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .kernels import threads
from .progress import SILENT, Progress

STATION_M = 0.05
"""Spacing of the stations among which points find their nearest line; of two lines this close, either is taken."""

POINTS_AT_ONCE = 500_000
"""Points projected at once: limits the memory, and allows several checks for cancellation per second."""

POINTS_FOR_THREADS = 10_000
"""Fewer points are projected by a single thread: on two cores, starting the threads takes 0.3 ms, the points 2 ms."""

CLOSED_M = 0.01
"""Largest distance between the ends of a closed line; the ends of extracted rings coincide, even after thinning."""

MIN_RING_M = 10.0
"""Shortest closed rail: no track turns round in less."""

SAME_PLACE_M = 1e-9
"""Vertices closer than this along a line are the same."""

NORTH_TANGENT = np.tan(np.radians(1.0))
"""Lines within one degree of north start at their southern end, all others at their western end."""


def length_along(vertices: np.ndarray) -> np.ndarray:
    """Return the distance of each vertex from the first, along the line.

    Parameters
    ----------
    vertices : (n, 2) or (n, 3) array
        A polyline; plan length for two columns, true length for three.

    Returns
    -------
    (n,) float array, starting at 0

    Examples
    --------
    >>> length_along(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 10.0]])).tolist()
    [0.0, 5.0, 11.0]
    """
    steps = np.linalg.norm(np.diff(vertices, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def resample(vertices: np.ndarray, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Place stations along a polyline, from end to end, at equal distances of at most `step_m`.

    Parameters
    ----------
    vertices : (n, d) array
        A polyline of nonzero length; distances are measured in the first two columns.
    step_m : float

    Returns
    -------
    stations : (m, d) array
    t : (m,) array
        Plan distance from the start.

    Examples
    --------
    >>> stations, t = resample(np.array([[0.0, 0.0], [10.0, 0.0]]), 4.0)
    >>> t.round(2).tolist()
    [0.0, 3.33, 6.67, 10.0]
    """
    along = length_along(vertices[:, :2])
    t = np.linspace(0.0, along[-1], max(int(np.ceil(along[-1] / step_m)), 1) + 1)
    return interpolate(vertices, along, t), t


def is_closed(line: np.ndarray) -> bool:
    """Return whether a line, (n, 2) or (n, 3), ends in plan where it starts."""
    dx, dy = line[-1, :2] - line[0, :2]
    return math.hypot(dx, dy) <= CLOSED_M and bool(length_along(line[:, :2])[-1] > MIN_RING_M)


def interpolate(values: np.ndarray, along: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Interpolate linearly between rows of an array.

    Parameters
    ----------
    values : (n, d) array
    along : (n,) array
        Chainage of each row, increasing.
    t : (m,) array
        Chainages to interpolate at.

    Returns
    -------
    (m, d) array
    """
    return np.column_stack([np.interp(t, along, column) for column in values.T])


def part(vertices: np.ndarray, start: float, end: float) -> np.ndarray:
    """Return the part of a polyline, (n, d), between two plan chainages, with vertices at both, (m, d).

    >>> part(np.array([[0.0, 0.0], [4.0, 0.0], [9.0, 0.0]]), 3.0, 5.0)[:, 0].tolist()
    [3.0, 4.0, 5.0]
    """
    along = length_along(vertices[:, :2])
    inner = along[(along > start + SAME_PLACE_M) & (along < end - SAME_PLACE_M)]
    return interpolate(vertices, along, np.concatenate([[start], inner, [end]]))


def unit_tangents(vertices: np.ndarray) -> np.ndarray:
    """Return the plan directions of a polyline, (n, d), at its vertices as (n, 2) unit vectors."""
    ahead = np.diff(vertices[:, :2], axis=0)
    both = np.concatenate([ahead[:1], ahead[:-1] + ahead[1:], ahead[-1:]])
    return both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), np.finfo(float).tiny)


def distance_to(t: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Return the distance of stations from the nearest of the chainages `t`, increasing; inf if there are none."""
    around = np.concatenate([[-np.inf], t, [np.inf]])
    after = np.searchsorted(t, stations) + 1
    return np.minimum(stations - around[after - 1], around[after] - stations)


def left_normals(vertices: np.ndarray) -> np.ndarray:
    """Return the normals to the left of a polyline at its vertices as (n, 2) unit vectors."""
    tangents = unit_tangents(vertices)
    return np.column_stack([-tangents[:, 1], tangents[:, 0]])


def starts_at_its_end(vertices: np.ndarray) -> bool:
    """Return whether a line must be reversed to start in the west, or in the south if it runs north.

    >>> starts_at_its_end(np.array([[5.0, 0.0], [0.0, 0.0]]))
    True
    """
    dx, dy = vertices[-1, :2] - vertices[0, :2]
    if abs(dx) <= NORTH_TANGENT * abs(dy):
        return bool(dy < 0)
    return bool(dx < 0)


@dataclass(frozen=True)
class Feet:
    """Feet of points: their perpendicular projections onto the nearest of several lines.

    Attributes
    ----------
    point, line : (n,) int arrays
        Indices of the points and of the lines; sorted by line, then by `t`.
    t : (n,) array
        Chainage of the foot in metres.
    across : (n,) array
        Distance of the point from its foot in metres, positive to the left of the line.
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
    """Project points onto the nearest line; points beyond `reach_m` or past a line's end are left out.

    Parameters
    ----------
    lines : sequence of (n, 2) arrays
    xy : (k, 2) array
    reach_m : float
        Largest distance between a point and its foot, metres.
    progress : Progress

    Examples
    --------
    >>> feet = project([np.array([[0.0, 0.0], [10.0, 0.0]])], np.array([[4.0, 0.05], [7.0, 3.0]]), reach_m=0.1)
    >>> feet.point.tolist(), feet.t.round(3).tolist(), feet.across.round(3).tolist()
    ([0], [4.0], [0.05])
    """
    if not len(lines) or not len(xy):
        nothing = np.empty(0)
        return Feet(nothing.astype(np.int64), nothing.astype(np.int32), nothing, nothing)
    target = Stations.along(lines)
    starts = range(0, len(xy), POINTS_AT_ONCE)
    found = [target.feet(xy[start : start + POINTS_AT_ONCE], start, reach_m) for start in progress.follow(starts)]
    point, line, t, across = (np.concatenate(column) for column in zip(*found))
    order = np.lexsort((t, line))
    return Feet(point[order], line[order], t[order], across[order])


@dataclass(frozen=True)
class Stations:
    """Stations of several lines, one line after the other; segment k runs from station k to station k + 1."""

    tree: cKDTree
    line: np.ndarray
    t: np.ndarray

    @classmethod
    def along(cls, lines: Sequence[np.ndarray]) -> Stations:
        """Set stations along lines, (n, 2) each."""
        stations, t = zip(*(resample(line, STATION_M) for line in lines))
        number = np.repeat(np.arange(len(lines), dtype=np.int32), [len(one) for one in t])
        return cls(cKDTree(np.concatenate(stations)), number, np.concatenate(t))

    def feet(self, xy: np.ndarray, first: int, reach_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return indices of the points in reach (that of `xy[0]` is `first`), and their lines, t and across."""
        workers = threads() if len(xy) > POINTS_FOR_THREADS else 1
        distance, nearest = self.tree.query(xy, distance_upper_bound=reach_m + STATION_M, workers=workers)
        near = np.flatnonzero(np.isfinite(distance))
        xy, nearest = xy[near], nearest[near]
        before, after = self._foot(xy, nearest - 1), self._foot(xy, nearest)
        t, across = np.where(np.abs(before[1]) < np.abs(after[1]), before, after)
        inside = np.abs(across) <= reach_m
        return near[inside] + first, self.line[nearest[inside]], t[inside], across[inside]

    def _foot(self, xy: np.ndarray, segment: np.ndarray) -> np.ndarray:
        """Return t and across of each point's foot on one segment, (2, k); inf where there is none.

        A foot may be up to 1 % of the segment's length past its ends, so that no point outside a bend is lost.
        """
        start, end = np.maximum(segment, 0), np.minimum(segment + 1, len(self.t) - 1)
        a, b = self.tree.data[start], self.tree.data[end]
        length = self.t[end] - self.t[start]
        exists = (segment == start) & (self.line[start] == self.line[end]) & (length > 0)
        direction = (b - a) / np.where(exists, length, 1.0)[:, None]
        ahead = np.einsum("ij,ij->i", xy - a, direction)
        across = direction[:, 0] * (xy[:, 1] - a[:, 1]) - direction[:, 1] * (xy[:, 0] - a[:, 0])
        is_foot = exists & (ahead > -0.01 * length) & (ahead < 1.01 * length)
        return np.where(is_foot, [self.t[start] + ahead, across], np.inf)


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of marked items.

    >>> runs(np.array([False, True, True, False, True]))
    [(1, 2), (4, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]
