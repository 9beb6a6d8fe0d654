"""What the growth looks at: the points that the classification finds on heads, and the heads in a window of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from ..classify.flush import BESIDE_M, HEAD_LEVEL_M
from ..classify.sharpness import is_blunt, is_decided
from ..classify.square import classify_square
from ..polyline import Feet, Polyline
from ..rails import SearchFigures
from .settings import BLUNT, DENSE, THIN, Beam, GrowSettings

Key = tuple[int, int]

MIN_POINTS = 3
"""Fewest points of a head."""

CROWN_SHARE = 0.7
"""Middle part of the head whose points give the height: its edges are rounded."""


@dataclass(frozen=True)
class Head:
    """A head in a window.

    Attributes
    ----------
    across_m : float
        Place of its axis, to the left.
    top_m : float
        Height of its top.
    count : int
        Points on it.
    alone : bool
        Whether no other head touches it.
    """

    across_m: float
    top_m: float
    count: int
    alone: bool


@dataclass(frozen=True)
class Rail:
    """A rail that was followed.

    Attributes
    ----------
    xyz : (k, 3) array
        Its axis on the top of the head, a place for each window from the first one in which it was seen to the last.
    seen : (k,) bool array
        Windows in which it was seen.
    """

    xyz: np.ndarray
    seen: np.ndarray
    beam: Beam

    @property
    def length_m(self) -> float:
        """Length in plan."""
        return Polyline(self.xyz).length_m


def heads_in(
    across_m: np.ndarray, height_m: np.ndarray, settings: GrowSettings, beam: Beam, least: float = MIN_POINTS
) -> list[Head]:
    """List the heads in a window with as many points or more: one for each group of points, or two that touch.

    Parameters
    ----------
    across_m, height_m : (n,) arrays
        Points on heads: places across and heights.
    """
    order = np.argsort(across_m, kind="stable")
    across_m, height_m = across_m[order], height_m[order]
    borders = np.flatnonzero(np.diff(across_m) > beam.gap_m) + 1
    groups = zip(np.split(across_m, borders), np.split(height_m, borders))
    found = [head for group in groups if len(group[0]) for head in _heads_of(*group, settings.head_width_m / 2, beam)]
    return [head for head in found if head.count >= least]


def _heads_of(across_m: np.ndarray, height_m: np.ndarray, half_m: float, beam: Beam) -> list[Head]:
    """Measure the head that a group of points is on, or the two at its sides if it is wider."""
    spare_m = (across_m[-1] - across_m[0]) / 2 - half_m - beam.beside_m
    if spare_m <= 0:
        places = [float(across_m.mean())]
    else:
        middle, off_m = (across_m[0] + across_m[-1]) / 2, spare_m + beam.beside_m / 2
        places = [float(middle - off_m), float(middle + off_m)]
    heads = []
    for place_m in places:
        off = np.abs(across_m - place_m)
        crown = height_m[off <= CROWN_SHARE * half_m]
        top_m = float(np.median(crown if len(crown) else height_m))
        heads.append(Head(place_m, top_m, int((off <= half_m + beam.beside_m).sum()), len(places) == 1))
    return heads


@dataclass(frozen=True)
class _Square:
    """A classified square: its points on heads, (k, 3), their numbers as read, and which are in pavements, (k,)."""

    xyz: np.ndarray
    number: np.ndarray
    paved: np.ndarray
    tree: cKDTree
    beam: Beam
    figures: SearchFigures


class OnHeads:
    """The points on heads by the classification; squares are classified when they are reached, and once.

    Parameters
    ----------
    read : callable
        Returns the points, (n, 3) metres, of the square of the classification in a column and row, with its margin.
    """

    def __init__(self, read: Callable[[Key], np.ndarray], settings: GrowSettings) -> None:
        self._read, self._settings, self._own = read, settings, settings.classification
        self._squares: dict[Key, _Square] = {}
        self._is_decided = False

    def around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """Return the points on heads, (k, 3), up to `reach_m` to the east, west, north and south of a place, (2,)."""
        found = [self._square(key) for key in self._keys(xy, reach_m)]
        return np.concatenate([one.xyz[one.tree.query_ball_point(xy, reach_m, p=np.inf)] for one in found])

    def all_around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """Return all points there, (k, 3); `reach_m` is at most the margin of a square."""
        column, row = np.floor(xy / self._own.side_m).astype(int).tolist()
        xyz = self._read((column, row))
        return xyz[(np.abs(xyz[:, :2] - xy) <= reach_m).all(axis=1)]

    def beam(self, xy: np.ndarray) -> Beam:
        """Return the tolerances for the square there."""
        (key,) = self._keys(xy, 0.0)
        return self._square(key).beam

    def on(self, rails: Sequence[Rail]) -> Iterator[tuple[Key, np.ndarray]]:
        """Yield the squares in which points lie on rails, and the numbers of these points as they are read."""
        boxes = np.array([(rail.xyz.min(axis=0), rail.xyz.max(axis=0)) for rail in rails]).reshape(-1, 2, 3)[..., :2]
        for key in sorted(self._squares):
            xyz = self._read(key)
            corner = np.multiply(key, self._own.side_m)
            own = np.flatnonzero(self._own.own(xyz[:, :2] - corner))
            on = np.zeros(len(xyz), dtype=bool)
            near = (boxes[:, 0] <= corner + 2 * self._own.side_m) & (boxes[:, 1] >= corner - self._own.side_m)
            for rail in (rails[at] for at in np.flatnonzero(near.all(axis=1)).tolist()):
                on[own[self._level_with(rail, xyz[own], self._squares[key])]] = True
                if rail.beam is not THIN:  # whose points beside the head are labelled as well
                    on[self._squares[key].number[self._along(rail, self._squares[key].xyz).point]] = True
            if on.any():
                yield key, np.flatnonzero(on)

    def _along(self, rail: Rail, xyz: np.ndarray) -> Feet:
        """Project points, (n, 3), in the user's strip onto a rail."""
        return Polyline(rail.xyz).feet(xyz[:, :2], self._settings.parameters.thickness_m / 2 + rail.beam.widen_m)

    def _level_with(self, rail: Rail, xyz: np.ndarray, square: _Square) -> np.ndarray:
        """Return the numbers of the points, (n, 3), in the height of a rail; beside it, a pavement is as high."""
        along_m = Polyline(rail.xyz).t
        borders = (along_m[1:] + along_m[:-1]) / 2
        paved = np.zeros(len(along_m), dtype=bool)
        paved[np.searchsorted(borders, self._along(rail, square.xyz[square.paved]).t)] = True
        feet = self._along(rail, xyz)
        above = xyz[feet.point, 2] - np.interp(feet.t, along_m, rail.xyz[:, 2])
        level = (np.abs(above) <= HEAD_LEVEL_M) & (np.abs(feet.across) <= self._settings.head_width_m / 2 + BESIDE_M)
        window = np.searchsorted(borders, feet.t)
        on = rail.seen[window] & (above >= -rail.beam.below_m) & (above <= rail.beam.above_m)
        return feet.point[on & (level | ~paved[window])]

    def _keys(self, xy: np.ndarray, reach_m: float) -> list[Key]:
        """List the squares within `reach_m` of a place, (2,)."""
        side_m = self._own.side_m
        low, high = (np.floor((xy + step) / side_m).astype(int).tolist() for step in (-reach_m, reach_m))
        return [(c, r) for c in range(low[0], high[0] + 1) for r in range(low[1], high[1] + 1)]

    def _square(self, key: Key) -> _Square:
        if not self._is_decided:
            self._decide_around(key)
        return self._classified(key)

    def _decide_around(self, key: Key) -> None:
        """Find out whether the cloud is sharp or blunt, by the rails in a square and in those next to it."""
        seen = SearchFigures()
        for step in sorted(product((-1, 0, 1), repeat=2), key=lambda step: step[0] ** 2 + step[1] ** 2):
            if not is_decided(seen):
                seen += self._classified((key[0] + step[0], key[1] + step[1])).figures
        self._is_decided = seen.sharp_m + seen.round_m + seen.flush_m > 0
        if is_blunt(seen):
            self._own = replace(self._own, blunt=True)
            self._squares.clear()

    def _classified(self, key: Key) -> _Square:
        if key not in self._squares:
            xyz = self._read(key)
            found = classify_square(xyz - np.append(np.multiply(key, self._own.side_m), 0.0), self._own)
            number, figures = np.flatnonzero(found.rail), found.figures
            beam = THIN if figures.thin else BLUNT if self._own.blunt else DENSE
            on = xyz[number]
            self._squares[key] = _Square(on, number, found.flush.rail[number], cKDTree(on[:, :2]), beam, figures)
        return self._squares[key]
