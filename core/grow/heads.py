"""What the growth looks at: the points that the classification finds on heads, and the heads in a window of them.

It is given the track, the user's tolerances, and those that depend on the cloud.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from ..classify import settings as classify
from ..classify.flush import BESIDE_M, HEAD_LEVEL_M
from ..classify.square import classify_square
from ..classify.ways import is_blunt, is_decided
from ..parameters import GrowParameters
from ..polyline import Feet, Polyline
from ..rails import SearchFigures

Key = tuple[int, int]

MIN_POINTS = 3
"""Fewest points of a head."""

CROWN_SHARE = 0.7
"""Middle part of the head whose points give the height: its edges are rounded."""


@dataclass(frozen=True)
class Beam:
    """Tolerances across and in height, metres.

    Attributes
    ----------
    gap_m : float
        Distance across between points of two heads; those of one are closer. A flangeway is 35 mm wide and more.
    beside_m : float
        Distance beyond the side of a head up to which the classification labels its points.
    below_m, above_m : float
        Heights of rail points relative to the top.
    widen_m : float
        Added to either side of the user's strip; the beam is as wide.
    level_m : float
        Added to the user's tolerance in height between windows.
    sigma_m : float
        Accuracy across of a window.
    fit_m, smooth_m : float
        Length over which a course is fitted, and half the length over which the axis is smoothed.
    """

    gap_m: float
    beside_m: float
    below_m: float
    above_m: float
    widen_m: float
    level_m: float
    sigma_m: float
    fit_m: float
    smooth_m: float


DENSE = Beam(
    gap_m=0.025,
    beside_m=0.008,
    below_m=0.040,
    above_m=0.025,
    widen_m=0.0,
    level_m=0.0,
    sigma_m=0.005,
    fit_m=5.0,
    smooth_m=1.5,
)
"""For scanners on vehicles: beams of a few millimetres, range noise up to 5 mm."""

THIN = Beam(
    gap_m=0.10,
    beside_m=0.06,
    below_m=0.055,
    above_m=0.040,
    widen_m=0.02,
    level_m=0.20,
    sigma_m=0.020,
    fit_m=10.0,
    smooth_m=3.0,
)
"""For scanners in the air: a beam of 4 to 9 cm blends the head and the ballast. Height only has to tell a rail from one
on a bridge: measured on blunt heads, tops are up to 0.15 m off their course."""

BLUNT = replace(THIN, below_m=classify.BLUNT.below_m, above_m=classify.BLUNT.above_m)
"""For clouds that blur a head to a round ridge."""


@dataclass(frozen=True)
class GrowSettings:
    """What the user chooses."""

    gauge_m: float
    head_width_m: float
    parameters: GrowParameters = GrowParameters()

    @property
    def spacing_m(self) -> float:
        """Distance of the two heads of a track."""
        return self.gauge_m + self.head_width_m

    @property
    def classification(self) -> classify.Settings:
        """Settings of the classification whose points are followed."""
        return classify.Settings((self.gauge_m,), self.head_width_m, low_m=self.parameters.min_height_m)


@dataclass(frozen=True)
class SeenHead:
    """A head in a window: place of its axis to the left, height of its top, and number of points on it.

    It is `alone` if no other head touches it.
    """

    across_m: float
    top_m: float
    count: int
    alone: bool


@dataclass(frozen=True)
class Rail:
    """A rail that was followed: its axis on the top of the head, (k, 3), and the windows in which it was seen, (k,).

    There is a place for each window from the first one in which the rail was seen to the last.
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
) -> list[SeenHead]:
    """List the heads in a window with as many points or more: one for each group of points, or two that touch.

    Points on heads are given by places across and heights, (n,) each.
    """
    order = np.argsort(across_m, kind="stable")
    across_m, height_m = across_m[order], height_m[order]
    borders = np.flatnonzero(np.diff(across_m) > beam.gap_m) + 1
    groups = zip(np.split(across_m, borders), np.split(height_m, borders))
    found = [head for group in groups if len(group[0]) for head in _heads_of(*group, settings.head_width_m / 2, beam)]
    return [head for head in found if head.count >= least]


def _heads_of(across_m: np.ndarray, height_m: np.ndarray, half_m: float, beam: Beam) -> list[SeenHead]:
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
        heads.append(SeenHead(place_m, top_m, int((off <= half_m + beam.beside_m).sum()), len(places) == 1))
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

    `read` returns the points, (n, 3) metres, of the square of the classification in a column and row, with its margin.
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
        self._is_decided = seen.sharp_m + seen.round_m + seen.unsure_m > 0
        if is_blunt(seen):
            self._own = replace(self._own, way=classify.Way.BLUNT)
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
