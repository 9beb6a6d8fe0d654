"""Squares of the plane that are processed one at a time, so that memory does not grow with the cloud.

The grid of squares is anchored at the zero of the cloud's coordinate system, so the division depends neither on how the
cloud is cut into files nor on which other files are given. The side is a whole number of raster tiles, so that all
squares share one raster grid. See docs/method.md section 7.1.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..clouds.on_heads import heads_of
from ..clouds.points import RailPoints
from ..frame import LocalFrame
from ..polyline import project
from ..rails import RailLine, SearchFigures
from ..raster import ROW

OVERLAP_M = 40.0
"""Width of the surroundings from which the lines of a square are drawn: that much of a line is needed to decide its
route through a switch. Rounded up to whole tiles, it is 41 m at a gauge of 1435 mm."""

HALO_M = 4.0
"""Distance beyond the border of a square up to which its lines are valid; there they blend into the neighbour's."""

SAME_RAIL_M = 0.3
"""Distance from the line of sharp points within which blunt ones show the same rail: half a foot, 75 mm, blurred by
6 cm, in a survey that is registered 10 cm aside."""

WINDOW_M, MIN_IN_WINDOW = 4.0, 10
"""A point with fewer points than this in its cell of the window's size and the eight around it belongs to no rail: the
shortest rail that is drawn, 1 m with 20 points per metre, has twice as many."""


MAX_CHECKED = 20_000
"""Squares with more points than this are not checked for strays: these would be ten points per window everywhere."""


Key = tuple[int, int]
"""Column (to the east) and row (to the north) of a square."""


@dataclass(frozen=True)
class Square:
    """A square, or the whole plane if the cloud is small; then `side_m` is infinite.

    The origin of the frame is the south-western corner of the square; for the whole plane, the origin of the cloud.
    """

    key: Key
    frame: LocalFrame
    side_m: float

    @property
    def is_whole_plane(self) -> bool:
        """Whether the cloud is not divided."""
        return not np.isfinite(self.side_m)

    @classmethod
    def on_grid(cls, key: Key, side_m: float, frame: LocalFrame) -> Square:
        """Create a square of the grid of a cloud, given its local frame."""
        corner = np.array([*key, 0]) * side_m / frame.horizontal_unit_m
        return cls(key, replace(frame, origin=corner), side_m)

    def holds(self, xyz: np.ndarray, margin_m: float = 0.0) -> np.ndarray:
        """Return which places, (n, 2) or (n, 3) local metres, are in the square or at most `margin_m` outside."""
        if self.is_whole_plane:
            return np.ones(len(xyz), dtype=bool)
        inside = (xyz[:, :2] >= -margin_m) & (xyz[:, :2] < self.side_m + margin_m)
        return inside[:, 0] & inside[:, 1]


class PointSource(Protocol):
    """Points on the heads of one class, read square by square."""

    @property
    def frame(self) -> LocalFrame:
        """Local frame of the cloud."""

    @property
    def class_code(self) -> int:
        """Code of the class."""

    @property
    def side_m(self) -> float:
        """Side of the squares."""

    @property
    def counts(self) -> Mapping[Key, int]:
        """Number of points by square, on disk with those below heads; squares without points are not listed."""

    @property
    def span_m(self) -> float:
        """Longer side of the bounding rectangle of all points."""

    @property
    def is_marked(self) -> bool:
        """Whether the points state several strips."""

    def near(self, square: Square, margin_m: float) -> RailPoints:
        """Read the points of a square and those at most `margin_m` outside, in the frame of the square."""

    def judged(self, blunt: bool) -> PointSource:
        """Return the source of points that know whether their cloud blunts heads."""

    @property
    def fills(self) -> bool:
        """Whether the lines of others come first, see `Filling`."""

    def of_strips(self, strips: Collection[int], among: bool = True) -> PointSource:
        """Return the source of the points of some strips, or if not `among` them, of the others, without the rest."""

    def part(self, square: Square) -> PointSource:
        """Return the source without the squares that are neither `square` nor its neighbours, where that is smaller."""


def parted(source: PointSource, blunt: Collection[int]) -> list[PointSource]:
    """Part the points of a class into the sharp strips and the blunt ones, given by their numbers, which fill in."""
    return [source.of_strips(blunt, among=False), Filling(source.of_strips(blunt).judged(True))]


def drawn_from(rail: RailLine, source: PointSource) -> bool:
    """Return whether a rail of an extraction was drawn from the points of a source."""
    return rail.class_code == source.class_code and rail.fills == source.fills


@dataclass
class Filling:
    """Blunt points of a cloud that has sharp ones as well: they show rails only where no `lines` are, a `PointSource`.

    Lines, (k, 2) or (k, 3) each in the frame of the cloud, are those that the sharp points have shown; the points
    beside them count among those of the squares.
    """

    source: PointSource
    lines: tuple[np.ndarray, ...] = ()
    fills = True

    def __post_init__(self) -> None:
        source = self.source
        self.frame, self.class_code, self.side_m = source.frame, source.class_code, source.side_m
        self.counts, self.span_m, self.is_marked = source.counts, source.span_m, source.is_marked

    def near(self, square: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        points = replace(self.source.near(square, margin_m), scanned=False)  # they may be a camera's
        if not self.lines:
            return points
        shift = square.frame.shift_to(self.frame)[:2]
        free = np.ones(len(points.xyz), dtype=bool)
        free[project([line[:, :2] - shift for line in self.lines], points.xyz[:, :2], SAME_RAIL_M).point] = False
        return points.kept(free)

    def judged(self, blunt: bool) -> Filling:
        """See `PointSource`; these points are known to be blunt."""
        return self

    def of_strips(self, strips: Collection[int], among: bool = True) -> Filling:
        """See `PointSource`."""
        return replace(self, source=self.source.of_strips(strips, among))

    def part(self, square: Square) -> Filling:
        """See `PointSource`."""
        if square.is_whole_plane:
            return self
        corner = square.frame.shift_to(self.frame)[:2]
        near = [
            line
            for line in self.lines
            if (line[:, :2].max(axis=0) >= corner - 2 * self.side_m).all()
            and (line[:, :2].min(axis=0) <= corner + 3 * self.side_m).all()
        ]
        return replace(self, source=self.source.part(square), lines=tuple(near))


@dataclass(frozen=True)
class SortedPoints:
    """Rail points by class and square, and the figures of the search if the points are from a raw cloud.

    `only_pairs`: nothing but its partner tells a rail from other ridges, where heads are blunt. `is_warned`: the user
    has been warned of another gauge.
    """

    classes: Sequence[PointSource]
    search: SearchFigures | None = None
    only_pairs: bool = False
    is_warned: bool = False


class MemorySource:
    """Points in memory, a `PointSource`."""

    fills = False

    def __init__(self, points: RailPoints, side_m: float) -> None:
        self._given = points
        self._of_strips: dict[tuple[frozenset[int], bool], MemorySource] = {}
        points = heads_of(points)
        self.is_marked = points.strips is not None
        self.frame, self.class_code, self.side_m = points.frame, points.class_code, side_m
        origin = Square.on_grid((0, 0), side_m, points.frame).frame.shift_to(points.frame)
        self._points, self._members = points, Tiling(side_m).sort(points.xyz - origin)
        self.counts = {key: len(part) for key, part in self._members.items()}
        self.span_m = float(np.ptp(points.xyz[:, :2], axis=0).max()) if len(points.xyz) else 0.0

    def near(self, square: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        if square.is_whole_plane:
            return self._points
        parts = [self._members[key] for key in around(square.key) if key in self._members]
        chosen = np.sort(np.concatenate(parts)) if parts else np.empty(0, dtype=np.int64)
        xyz = self._points.xyz[chosen] - square.frame.shift_to(self.frame)
        near = replace(self._points.kept(chosen), xyz=xyz, frame=square.frame)
        return near.kept(square.holds(xyz, margin_m))

    def judged(self, blunt: bool) -> MemorySource:
        """See `PointSource`."""
        other = copy(self)
        other._points = replace(self._points, blunt=blunt)
        return other

    def of_strips(self, strips: Collection[int], among: bool = True) -> MemorySource:
        """See `PointSource`."""
        key = (frozenset(strips), among)
        if key not in self._of_strips:
            own = np.zeros(len(self._given.xyz)) if self._given.strips is None else self._given.strips
            chosen = self._given.kept(np.isin(own, list(strips)) == among)
            self._of_strips[key] = MemorySource(chosen, self.side_m)
        return self._of_strips[key]

    def part(self, square: Square) -> MemorySource:
        """See `PointSource`."""
        return self


@dataclass(frozen=True)
class Tiling:
    """A division of the plane into squares, from the zero of the coordinate system.

    Points belong to a square up to `margin_m`, less than half a side, beyond its border as well.
    """

    side_m: float
    margin_m: float = 0.0

    def keys(self, xyz_m: np.ndarray) -> tuple[list[Key], np.ndarray]:
        """Find the squares in which points, (n, 2) or (n, 3) metres from the zero of the coordinate system, are.

        Returns the squares, in ascending order, and for each point the number of its square among them, (n,).
        """
        if not len(xyz_m):
            return [], np.empty(0, dtype=np.int64)
        column, row = (np.floor(values / self.side_m).astype(np.int64) for values in xyz_m[:, :2].T)
        first_column, first_row, height = int(column.min()), int(row.min()), int(np.ptp(row)) + 1
        square = (column - first_column) * height + row - first_row
        found, number = _distinct(square, (int(column.max()) - first_column + 1) * height)
        return [(first_column + one // height, first_row + one % height) for one in found.tolist()], number

    def sort(self, xyz_m: np.ndarray) -> dict[Key, np.ndarray]:
        """Sort points, (n, 2) or (n, 3) metres from the zero of the coordinate system, into squares.

        Returns the numbers of the points of each square, ascending without a margin; squares are in ascending order.
        """
        number = np.arange(len(xyz_m))
        if self.margin_m:
            xyz_m, number = self._with_margin(xyz_m[:, :2])
        keys, square = self.keys(xyz_m)
        # Sorting small numbers takes linear time.
        order = np.argsort(square.astype(np.min_scalar_type(len(keys))), kind="stable")
        borders = np.searchsorted(square[order], np.arange(1, len(keys)))
        return dict(zip(keys, np.split(number[order], borders)))

    def _with_margin(self, xy_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Repeat places near the borders of squares, moved into each square that they belong to, and their numbers."""
        xy_m = np.ascontiguousarray(xy_m.T)
        low, high = (np.floor((xy_m + out) / self.side_m) for out in (-self.margin_m, self.margin_m))
        crosses = low != high
        moved, number = [xy_m - self.margin_m], [np.arange(xy_m.shape[1])]
        for chosen, sense in ((crosses[0], (1, -1)), (crosses[1], (-1, 1)), (crosses.all(axis=0), (1, 1))):
            number.append(np.flatnonzero(chosen))
            moved.append(xy_m[:, number[-1]] + np.multiply(sense, self.margin_m)[:, None])
        return np.concatenate(moved, axis=1).T, np.concatenate(number)


def _distinct(numbers: np.ndarray, limit: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct numbers below `limit`, ascending, and the index of each number among them, (n,)."""
    if limit > len(numbers):
        found, index = np.unique(numbers, return_inverse=True)
        return found, index.ravel()
    there = np.bincount(numbers, minlength=limit) > 0
    return np.flatnonzero(there), (np.cumsum(there) - 1)[numbers]


def around(key: Key) -> list[Key]:
    """Return the keys of a square and its eight neighbours."""
    return [(key[0] + right, key[1] + up) for right in (-1, 0, 1) for up in (-1, 0, 1)]


def lay_out(sources: Sequence[PointSource], source: PointSource) -> list[Square]:
    """List the squares of one of the sources; a single one if every source fits into a square."""
    if max(one.span_m for one in sources) <= source.side_m:
        return [Square((0, 0), source.frame, np.inf)]
    return [Square.on_grid(key, source.side_m, source.frame) for key in sorted(source.counts)]


def occupied_squares(sources: Sequence[PointSource], source: PointSource) -> list[Square]:
    """List the squares of one of the sources in which rails can be; see `grid.lay_out`."""
    return [
        square
        for square in lay_out(sources, source)
        if square.is_whole_plane or source.counts[square.key] > MAX_CHECKED or not _holds_only_strays(source, square)
    ]


def fullest_square(source: PointSource) -> RailPoints:
    """Return the points of the square of a class that has the most."""
    return source.near(fullest(source)[0], 0.0)


def fullest(source: PointSource) -> list[Square]:
    """List the squares of a class in the order of their numbers of points, the largest first."""
    return sorted(lay_out([source], source), key=lambda square: -source.counts.get(square.key, 0))


def _holds_only_strays(source: PointSource, square: Square) -> bool:
    """Return whether no point of a square has company, be it across the border."""
    if sum(source.counts.get(key, 0) for key in around(square.key)) < MIN_IN_WINDOW:
        return True
    xyz = source.near(square, 2 * WINDOW_M).xyz
    number, company = company_of(xyz, WINDOW_M, 1)
    return not (company[number][square.holds(xyz)] >= MIN_IN_WINDOW).any()


def company_of(xyz: np.ndarray, side_m: float, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Count points, (n, 3), by cells of a side; points in the `rings` of cells around a cell count as well.

    Returns the number of the cell of each point, (n,), and the points in each cell and its rings, (m,).
    """
    columns, rows = np.floor(xyz[:, :2] / side_m).astype(np.int64).T
    cells, number, counts = np.unique(rows * ROW + columns, return_inverse=True, return_counts=True)
    company = np.zeros(len(cells), dtype=np.int64)
    for down in range(-rings, rings + 1):
        for right in range(-rings, rings + 1):
            other = cells + down * ROW + right
            place = np.minimum(np.searchsorted(cells, other), len(cells) - 1)
            company += np.where(cells[place] == other, counts[place], 0)
    return number.ravel(), company
