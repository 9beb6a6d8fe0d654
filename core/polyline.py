"""Geometry along plan polylines: stations, normals, feet of points, and which end is the start."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .progress import SILENT, Progress

STATION_M = 0.05
"""Spacing of the stations at which points look for their line; of two lines this close, either may be taken."""

POINTS_AT_ONCE = 500_000
"""Points projected in one go: bounds the memory, and lets a cancel through several times a second."""

POINTS_FOR_THREADS = 10_000
"""Fewer are projected by one thread: to start one for each core takes 0.3 ms on two cores, and these take 2 ms."""

CLOSED_M = 0.01
"""A line whose ends lie this close together is closed; ours meet exactly, and thinning leaves ends where they are."""

LEAST_ROUND_M = 10.0
"""A closed rail is longer: a track can't turn in less."""

NORTH_TANGENT = np.tan(np.radians(1.0))
"""A line within one degree of north starts at its southern end, not at its western one."""


def length_along(vertices: np.ndarray) -> np.ndarray:
    """Distance of each vertex from the first, along the line.

    Parameters
    ----------
    vertices : (n, 2) or (n, 3) array
        A polyline; plan length for two columns, true length for three.

    Returns
    -------
    (n,) float array, starting at 0
    """
    steps = np.linalg.norm(np.diff(vertices, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def resample(vertices: np.ndarray, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Place stations at equal distances of at most `step_m` along a polyline, both ends among them.

    Parameters
    ----------
    vertices : (n, d) array
        A polyline of some length; distances are measured in the first two columns.
    step_m : float

    Returns
    -------
    stations : (m, d) array
    t : (m,) array
        Plan distance from the start.
    """
    along = length_along(vertices[:, :2])
    t = np.linspace(0.0, along[-1], max(int(np.ceil(along[-1] / step_m)), 1) + 1)
    return interpolate(vertices, along, t), t


def is_closed(line: np.ndarray) -> bool:
    """Tell whether a line, (n, 2) or (n, 3), ends in plan where it begins."""
    return np.hypot(*(line[-1, :2] - line[0, :2])) <= CLOSED_M and length_along(line[:, :2])[-1] > LEAST_ROUND_M


def interpolate(values: np.ndarray, along: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Interpolate the columns of `values`, (n, d) given at `along`, linearly at `t`; returns (m, d)."""
    return np.column_stack([np.interp(t, along, column) for column in values.T])


def unit_tangents(vertices: np.ndarray) -> np.ndarray:
    """Directions of a polyline at its vertices, (n, 2) unit vectors; of (n, d) vertices the first two columns count."""
    ahead = np.diff(vertices[:, :2], axis=0)
    both = np.concatenate([ahead[:1], ahead[:-1] + ahead[1:], ahead[-1:]])
    return both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), np.finfo(float).tiny)


def distance_to(t: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Distance of stations from the nearest of the chainages `t`, increasing; inf where there are none."""
    around = np.concatenate([[-np.inf], t, [np.inf]])
    after = np.searchsorted(t, stations) + 1
    return np.minimum(stations - around[after - 1], around[after] - stations)


def left_normals(vertices: np.ndarray) -> np.ndarray:
    """Point to the left of a polyline at its vertices; (n, 2) unit vectors."""
    tangents = unit_tangents(vertices)
    return np.column_stack([-tangents[:, 1], tangents[:, 0]])


def starts_at_its_end(vertices: np.ndarray) -> bool:
    """Tell whether a line has to be turned around to start in the west, or in the south when it runs north."""
    dx, dy = vertices[-1, :2] - vertices[0, :2]
    if abs(dx) <= NORTH_TANGENT * abs(dy):
        return bool(dy < 0)
    return bool(dx < 0)


@dataclass(frozen=True)
class Feet:
    """Points and where they project perpendicularly onto the nearest of several lines.

    Attributes
    ----------
    point, line : (n,) int arrays
        Numbers of the points and of the lines; sorted by line, then by `t`.
    t : (n,) array
        Distance of the foot from the line's start, metres.
    across : (n,) array
        Distance of the point from its foot, metres, positive to the left of the line.
    """

    point: np.ndarray
    line: np.ndarray
    t: np.ndarray
    across: np.ndarray

    def of(self, line: int) -> Feet:
        """Pick those on one line."""
        mine = slice(*np.searchsorted(self.line, [line, line + 1]))
        return self[mine]

    def __getitem__(self, which: slice | np.ndarray) -> Feet:
        return Feet(self.point[which], self.line[which], self.t[which], self.across[which])


def project(lines: Sequence[np.ndarray], xy: np.ndarray, reach_m: float, progress: Progress = SILENT) -> Feet:
    """Project points onto the nearest line; points further away than `reach_m` or past a line's end are left out.

    Parameters
    ----------
    lines : sequence of (n, 2) arrays
    xy : (k, 2) array
    reach_m : float
    progress : Progress
    """
    if not len(lines) or not len(xy):
        nothing = np.empty(0)
        return Feet(nothing.astype(np.int64), nothing.astype(np.int32), nothing, nothing)
    target = _Stations.along(lines)
    starts = range(0, len(xy), POINTS_AT_ONCE)
    found = [target.feet(xy[start : start + POINTS_AT_ONCE], start, reach_m) for start in progress.follow(starts)]
    point, line, t, across = (np.concatenate(column) for column in zip(*found))
    order = np.lexsort((t, line))
    return Feet(point[order], line[order], t[order], across[order])


def threads() -> int:
    """Give the number of threads to compute with, as scipy takes it: all cores, unless this process is told a number.

    Numerical libraries go by the same variable; Dask sets it for each of several workers on a computer.
    """
    told = os.environ.get("OMP_NUM_THREADS", "")
    return int(told) if told.isdecimal() and int(told) else -1


@dataclass(frozen=True)
class _Stations:
    """Stations of several lines in one row; piece k runs from station k to station k + 1."""

    tree: cKDTree
    line: np.ndarray
    t: np.ndarray

    @classmethod
    def along(cls, lines: Sequence[np.ndarray]) -> _Stations:
        stations, t = zip(*(resample(line, STATION_M) for line in lines))
        number = np.repeat(np.arange(len(lines), dtype=np.int32), [len(one) for one in t])
        return cls(cKDTree(np.concatenate(stations)), number, np.concatenate(t))

    def feet(self, xy: np.ndarray, first: int, reach_m: float) -> Iterator[np.ndarray]:
        """Numbers of the points in reach (the first of `xy` is number `first`), their lines, t and across."""
        workers = threads() if len(xy) > POINTS_FOR_THREADS else 1
        distance, nearest = self.tree.query(xy, distance_upper_bound=reach_m + STATION_M, workers=workers)
        near = np.flatnonzero(np.isfinite(distance))
        xy, nearest = xy[near], nearest[near]
        before, after = self._foot(xy, nearest - 1), self._foot(xy, nearest)
        t, across = np.where(np.abs(before[1]) < np.abs(after[1]), before, after)
        inside = np.abs(across) <= reach_m
        return near[inside] + first, self.line[nearest[inside]], t[inside], across[inside]

    def _foot(self, xy: np.ndarray, piece: np.ndarray) -> np.ndarray:
        """Place and signed distance of the feet on one piece for each point, (2, k); inf where there is no such foot.

        Feet up to a hundredth of a piece past its ends count, so that none is lost outside a bend.
        """
        start, end = np.maximum(piece, 0), np.minimum(piece + 1, len(self.t) - 1)
        a, b = self.tree.data[start], self.tree.data[end]
        length = self.t[end] - self.t[start]
        is_piece = (piece == start) & (self.line[start] == self.line[end]) & (length > 0)
        direction = (b - a) / np.where(is_piece, length, 1.0)[:, None]
        ahead = np.einsum("ij,ij->i", xy - a, direction)
        across = direction[:, 0] * (xy[:, 1] - a[:, 1]) - direction[:, 1] * (xy[:, 0] - a[:, 0])
        is_foot = is_piece & (ahead > -0.01 * length) & (ahead < 1.01 * length)
        return np.where(is_foot, [self.t[start] + ahead, across], np.inf)


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """First and last number of each run of marked items."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]
