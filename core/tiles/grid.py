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
from ..raster import TILE, RailRaster

OVERLAP_M = 40.0
"""Width of the surroundings from which the lines of a square are drawn: that much of a line is needed to decide its
route through a switch. Rounded up to whole tiles, it is 41 m at a gauge of 1435 mm."""

HALO_M = 4.0
"""Distance beyond the border of a square up to which its lines are valid; there they blend into the neighbour's."""

SAME_RAIL_M = 0.3
"""Distance from the line of sharp points within which blunt ones show the same rail: half a foot, 75 mm, blurred by
6 cm, in a survey that is registered 10 cm aside."""

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


@dataclass(frozen=True)
class Filling:
    """Blunt points of a cloud that has sharp ones as well: they show rails only where no `lines` are, a `PointSource`.

    Lines, (k, 2) or (k, 3) each in the frame of the cloud, are those that the sharp points have shown.
    """

    source: PointSource
    lines: tuple[np.ndarray, ...] = ()
    fills = True

    @property
    def frame(self) -> LocalFrame:
        """See `PointSource`."""
        return self.source.frame

    @property
    def class_code(self) -> int:
        """See `PointSource`."""
        return self.source.class_code

    @property
    def side_m(self) -> float:
        """See `PointSource`."""
        return self.source.side_m

    @property
    def counts(self) -> Mapping[Key, int]:
        """See `PointSource`; with the points beside lines."""
        return self.source.counts

    @property
    def span_m(self) -> float:
        """See `PointSource`."""
        return self.source.span_m

    def near(self, square: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        points = self.source.near(square, margin_m)
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


def own_tiles(raster: RailRaster, square: Square) -> RailRaster:
    """Keep the tiles of a raster that are in the square."""
    if square.is_whole_plane:
        return raster
    count = tiles_along(square.side_m, raster.cell_m)
    inside = {
        (row, column): tile for (row, column), tile in raster.tiles.items() if -count <= row < 0 and 0 <= column < count
    }
    return replace(raster, tiles=inside)


def mosaic(rasters: Mapping[Key, RailRaster], square: Square, margin: int) -> RailRaster:
    """Combine the raster of a square with `margin` tiles of its neighbours' around it.

    Each raster has its origin at the corner of its own square; that of a neighbour may be missing.
    """
    own = rasters[square.key]
    if square.is_whole_plane:
        return own
    count, tiles = tiles_along(square.side_m, own.cell_m), {}
    for key in around(square.key):
        down, right = -count * (key[1] - square.key[1]), count * (key[0] - square.key[0])
        for (row, column), tile in rasters[key].tiles.items() if key in rasters else ():
            place = (row + down, column + right)
            if -count - margin <= place[0] < margin and -margin <= place[1] < count + margin:
                tiles[place] = tile
    return replace(own, tiles=tiles)


def assembled(rasters: Mapping[Key, RailRaster], squares: Mapping[Key, Square], frame: LocalFrame) -> RailRaster:
    """Combine the rasters of all squares into one in a local frame."""
    first = min(rasters)
    if squares[first].is_whole_plane:
        return rasters[first]
    count = tiles_along(squares[first].side_m, rasters[first].cell_m)
    x0, y0, _ = squares[first].frame.shift_to(frame)
    tiles = {
        (row - count * (key[1] - first[1]), column + count * (key[0] - first[0])): tile
        for key, raster in rasters.items()
        for (row, column), tile in raster.tiles.items()
    }
    return replace(rasters[first], tiles=tiles, x0=float(x0), y0=float(y0))


def merged(one: RailRaster, other: RailRaster) -> RailRaster:
    """Combine two rasters of one frame whose grids differ by whole tiles."""
    tiles, side_m = dict(one.tiles), TILE * one.cell_m
    down, right = round((one.y0 - other.y0) / side_m), round((other.x0 - one.x0) / side_m)
    for (row, column), tile in other.tiles.items():
        key = (row + down, column + right)
        tiles[key] = tiles[key] | tile if key in tiles else tile
    return replace(one, tiles=tiles)


def tiles_along(side_m: float, cell_m: float) -> int:
    """Return the number of raster tiles along the side of a square."""
    return round(side_m / (TILE * cell_m))
