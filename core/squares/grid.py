"""Stretches: squares of the plane that are worked on by themselves, so that neither length nor memory has a limit.

The squares lie on a grid anchored at the zero of the cloud's coordinate system. The split is therefore the same however
files are cut, and whichever other files there are. Sides are whole raster tiles: all stretches share one raster grid.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..clouds.points import RailPoints
from ..frame import LocalFrame
from ..raster import TILE, RailRaster

SQUARE_TILES = 50
"""Tiles along the side, half a kilometre: what overlaps is a sixth of it, and the widest yard fits into memory."""

OVERLAP_M = 40.0
"""A stretch's lines are drawn from as much around it as well: by so much of it a line's way through a switch is told.
Its whole tiles make 41 m at a gauge of 1435 mm."""

HALO_M = 4.0
"""Beyond its border a stretch's lines are still good for so far, and fade into those of the neighbour."""

Key = tuple[int, int]
"""Column and row of a square, to the east and to the north."""


@dataclass(frozen=True)
class Square:
    """A square, or the whole plane where the cloud is small.

    Attributes
    ----------
    key : tuple of int
    frame : LocalFrame
        Its local metres count from its south-western corner; those of the whole plane from the cloud's origin.
    side_m : float
        Infinite for the whole plane.
    """

    key: Key
    frame: LocalFrame
    side_m: float

    @classmethod
    def square(cls, key: Key, side_m: float, frame: LocalFrame) -> Square:
        """Make a square of the grid; `frame` is the cloud's."""
        corner = np.array([*key, 0]) * side_m / frame.horizontal_unit_m
        return cls(key, replace(frame, origin=corner), side_m)

    def holds(self, xyz: np.ndarray, margin_m: float = 0.0) -> np.ndarray:
        """Tell which of (n, 2) or (n, 3) places, in its local metres, lie at most `margin_m` outside, (n,) bool."""
        if not np.isfinite(self.side_m):
            return np.ones(len(xyz), dtype=bool)
        return ((xyz[:, :2] >= -margin_m) & (xyz[:, :2] < self.side_m + margin_m)).all(axis=1)


class PointSource(Protocol):
    """Rail points of one class that can be asked for by squares.

    Attributes
    ----------
    frame : LocalFrame
    class_code : int
    side_m : float
        Side of the squares.
    counts : mapping of key to int
        Points by square; squares without points are missing.
    span_m : float
        Longer side of the rectangle that holds all points.
    """

    frame: LocalFrame
    class_code: int
    side_m: float
    counts: Mapping[Key, int]
    span_m: float

    def near(self, stretch: Square, margin_m: float) -> RailPoints:
        """Read the points of a stretch and those at most `margin_m` outside, in its frame."""


class MemorySource:
    """Points that are in memory already."""

    def __init__(self, points: RailPoints, side_m: float) -> None:
        self.frame, self.class_code, self.side_m = points.frame, points.class_code, side_m
        origin = Square.square((0, 0), side_m, points.frame).frame.shift_to(points.frame)
        keys, number = unique_keys(points.xyz - origin, side_m)
        self._points, self._order = points, np.argsort(number, kind="stable")
        borders = np.searchsorted(number[self._order], np.arange(len(keys) + 1))
        self._ranges = {key: slice(*borders[place : place + 2]) for place, key in enumerate(keys)}
        self.counts = {key: part.stop - part.start for key, part in self._ranges.items()}
        self.span_m = float(np.ptp(points.xyz[:, :2], axis=0).max()) if len(points.xyz) else 0.0

    def near(self, stretch: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        if not np.isfinite(stretch.side_m):
            return self._points
        parts = [self._order[self._ranges[key]] for key in around(stretch.key) if key in self._ranges]
        chosen = np.sort(np.concatenate(parts)) if parts else np.empty(0, dtype=np.int64)
        xyz = self._points.xyz[chosen] - stretch.frame.shift_to(self.frame)
        return RailPoints(xyz[stretch.holds(xyz, margin_m)], stretch.frame, self.class_code)


def unique_keys(xyz_m: np.ndarray, side_m: float) -> tuple[list[Key], np.ndarray]:
    """Squares that hold points, given in metres from the zero of the coordinate system, and each point's among them."""
    rows, number = np.unique(np.floor(xyz_m[:, :2] / side_m).astype(np.int64), axis=0, return_inverse=True)
    return [(column, row) for column, row in rows.tolist()], number.ravel()


def around(key: Key) -> list[Key]:
    """Name a square and its eight neighbours."""
    return [(key[0] + right, key[1] + up) for right in (-1, 0, 1) for up in (-1, 0, 1)]


def lay_out(sources: Sequence[PointSource], source: PointSource) -> list[Square]:
    """List the stretches of one of the sources; a single one where all of them together are no longer than a square."""
    if max(one.span_m for one in sources) <= source.side_m:
        return [Square((0, 0), source.frame, np.inf)]
    return [Square.square(key, source.side_m, source.frame) for key in sorted(source.counts)]


def in_turn(keys: Iterable[Key]) -> Iterator[tuple[Key, list[Key], list[Key]]]:
    """Go through squares in order.

    Yields
    ------
    Key
        The square whose turn it is.
    list of Key
        Those that now have had their turn with all their neighbours.
    list of Key
        Those that now have been listed so with all their neighbours: nothing needs them any longer.
    """
    everyone, passed, finished = set(keys), set(), set()

    def surrounded(one: Key, by: set[Key]) -> bool:
        return everyone & set(around(one)) <= by

    for key in sorted(everyone):
        passed.add(key)
        ready = [one for one in around(key) if one in passed - finished and surrounded(one, passed)]
        finished.update(ready)
        beside = {near for one in ready for near in around(one) if near in finished}
        yield key, ready, sorted(near for near in beside if surrounded(near, finished))


def own_tiles(raster: RailRaster, stretch: Square) -> RailRaster:
    """Keep the tiles of a raster that lie inside the stretch."""
    if not np.isfinite(stretch.side_m):
        return raster
    count = tiles_along(stretch.side_m, raster.cell_m)
    inside = {
        (row, column): tile for (row, column), tile in raster.tiles.items() if -count <= row < 0 and 0 <= column < count
    }
    return replace(raster, tiles=inside)


def mosaic(rasters: Mapping[Key, RailRaster], stretch: Square, reach: int) -> RailRaster:
    """Put together the tiles of a stretch and those of its neighbours that lie within `reach` tiles of it."""
    own = rasters[stretch.key]
    if not np.isfinite(stretch.side_m):
        return own
    count, tiles = tiles_along(stretch.side_m, own.cell_m), {}
    for key in around(stretch.key):
        down, right = -count * (key[1] - stretch.key[1]), count * (key[0] - stretch.key[0])
        for (row, column), tile in rasters[key].tiles.items() if key in rasters else ():
            place = (row + down, column + right)
            if -count - reach <= place[0] < reach and -reach <= place[1] < count + reach:
                tiles[place] = tile
    return replace(own, tiles=tiles)


def assembled(rasters: Mapping[Key, RailRaster], stretches: Mapping[Key, Square], frame: LocalFrame) -> RailRaster:
    """Put the rasters of all stretches into one, in the local metres of `frame`."""
    first = min(rasters)
    if len(rasters) == 1 and not np.isfinite(stretches[first].side_m):
        return rasters[first]
    count = tiles_along(stretches[first].side_m, rasters[first].cell_m)
    x0, y0, _ = stretches[first].frame.shift_to(frame)
    tiles = {
        (row - count * (key[1] - first[1]), column + count * (key[0] - first[0])): tile
        for key, raster in rasters.items()
        for (row, column), tile in raster.tiles.items()
    }
    return replace(rasters[first], tiles=tiles, x0=float(x0), y0=float(y0))


def tiles_along(side_m: float, cell_m: float) -> int:
    """Count the tiles along a side."""
    return round(side_m / (TILE * cell_m))
