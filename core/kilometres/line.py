"""Places beside a line that carries kilometres: foot, offset and side, and the kilometre there.

See docs/stationing.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Chords, Polyline, cross
from ..progress import SILENT, Progress
from ..rails import Kilometres
from .stationing import Stationing
from .text import write_km

PIECE_M = 10.0
"""Longest part of a segment of the axis among which the nearest is sought, metres."""

CANDIDATES = 8
"""Parts with the nearest middles, of which one has the foot: of parts of 10 m, middles are at most 5 m off it."""

SAMPLE_M = 5.0
"""Spacing of the places at which a second foot is sought, metres; chords of this length are within 6 mm of R 500 m."""

APART_M, CLEARLY = 50.0, 1.2
"""A second foot makes a place ambiguous if it is at least this far along the axis from the first, metres, and less than
this many times as far from the place: the inside of a curve, or a place between two lines."""

BEYOND_M = 1.0
"""Places up to this far beyond an end of the axis have the kilometre of its end, metres; others have none."""

ON_AXIS_M = 0.0005
"""Places closer to the axis are on neither side of it: less than the last decimal of the offset, metres."""

PLACES_AT_ONCE = 5_000
"""Places whose feet are computed at once: between two checks for cancellation."""


@dataclass(frozen=True)
class AxisFeet:
    """Feet of places on an axis; (n,) arrays, metres.

    `s` is the plan distance of the foot from the first vertex, `left_m` that of the place from its foot, positive to
    the left, and `beyond_m` how far the place lies beyond the nearer end, 0 between the ends.
    """

    s: np.ndarray
    left_m: np.ndarray
    beyond_m: np.ndarray

    @property
    def distance_m(self) -> np.ndarray:
        """Distance of the place from the axis, (n,)."""
        return np.hypot(self.left_m, self.beyond_m)


@dataclass(frozen=True)
class KilometreLine:
    """A line, `xy` (n, 2) metres, that carries the kilometres of a railway, directed with them.

    No two successive vertices are equal.
    """

    name: str
    xy: np.ndarray
    stationing: Stationing

    @cached_property
    def line(self) -> Polyline:
        """Chainages, and normals at the vertices."""
        return Polyline(self.xy)

    @cached_property
    def _parts(self) -> tuple[Chords, np.ndarray]:
        """Parts of segments, and the segment of each."""
        counts = np.ceil(np.diff(self.line.t) / PIECE_M).astype(int)
        segment = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[segment]
        xy = np.concatenate([self._place(segment, share), self.xy[-1:]])
        return Chords.joined([Polyline(xy)]), segment

    @cached_property
    def _samples(self) -> tuple[cKDTree, np.ndarray]:
        """Places at equal distances, and their `s`."""
        samples = self.line.resampled(SAMPLE_M)
        return cKDTree(samples.xy), samples.t

    def feet(self, xy: np.ndarray) -> AxisFeet:
        """Find the feet of places, (k, 2) metres.

        The foot is on the normal through the place. Normals turn evenly from the bisector at one vertex to that at the
        next, so that feet move steadily along the axis on both sides of a bend. Where normals cross on the inside of a
        bend, the foot is that of the plain perpendicular.
        """
        parts, of_part = self._parts
        segment, last = of_part[parts.nearest(xy, CANDIDATES)[1]], len(self.xy) - 2
        plain, length = self._perpendicular(segment, xy)
        past = np.maximum(np.where(segment == 0, -plain, 0.0), np.where(segment == last, plain - 1, 0.0))
        beyond = length * np.maximum(past, 0.0)
        around = np.clip(segment + np.array([[-1], [0], [1]]), 0, last)
        shares = np.stack([self._fan(one, xy) for one in around])
        away = np.stack([self._away(one, share, xy) for one, share in zip(around, shares)])
        away[~((shares >= 0) & (shares <= 1))] = np.inf
        best, places = np.argmin(away, axis=0), np.arange(len(xy))
        on_fan = np.isfinite(away[best, places]) & (beyond <= 0)
        segment = np.where(on_fan, around[best, places], segment)
        share = np.where(on_fan, shares[best, places], np.clip(plain, 0.0, 1.0))
        side = np.sign(cross(self._steps[segment], xy - self._place(segment, share)))
        across = np.sqrt(np.maximum(self._away(segment, share, xy) ** 2 - beyond**2, 0.0))
        return AxisFeet(self.line.t[segment] + share * np.diff(self.line.t)[segment], side * across, beyond)

    @cached_property
    def _steps(self) -> np.ndarray:
        """Vectors of the segments, (n - 1, 2)."""
        return np.diff(self.xy, axis=0)

    def _perpendicular(self, segment: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the share of segments at which the perpendicular meets places, (k,), and the segments' lengths."""
        step = self._steps[segment]
        length = np.hypot(*step.T)
        return np.einsum("ij,ij->i", xy - self.xy[segment], step) / length**2, length

    def _fan(self, segment: np.ndarray, xy: np.ndarray) -> np.ndarray:
        """Return the share of segments at which the normal passes through places, (k,); NaN where none does.

        The place P is on the normal at the share u if (P - A - u d) x (a + u e) = 0, with the segment's start A and
        vector d, its normal a at the start, and the change e of the normal: a quadratic equation, of which the root
        that stays where e vanishes is the foot.
        """
        away, step = xy - self.xy[segment], self._steps[segment]
        normal = self.line.normals[segment]
        turn = self.line.normals[segment + 1] - normal
        constant, square = cross(away, normal), -cross(step, turn)
        linear = cross(away, turn) - cross(step, normal)
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(linear**2 - 4 * square * constant)
            return -2 * constant / (linear + np.sign(linear) * root)

    def _place(self, segment: np.ndarray, share: np.ndarray) -> np.ndarray:
        return self.xy[segment] + share[:, None] * self._steps[segment]

    def _away(self, segment: np.ndarray, share: np.ndarray, xy: np.ndarray) -> np.ndarray:
        return np.linalg.norm(xy - self._place(segment, share), axis=1)

    @cached_property
    def _box(self) -> np.ndarray:
        """Smallest and largest coordinates, (2, 2)."""
        return np.array([self.xy.min(axis=0), self.xy.max(axis=0)])

    def farther_than(self, xy: np.ndarray) -> np.ndarray:
        """Return the distance of places, (k, 2), from the bounding box, (k,): the axis is not closer."""
        return np.hypot(*np.maximum(np.maximum(self._box[0] - xy, xy - self._box[1]), 0.0).T)

    def ambiguous(self, xy: np.ndarray, s: np.ndarray, distance_m: np.ndarray) -> np.ndarray:
        """Return whether places, (k, 2), have a second foot that may as well be meant as those at `s`, (k,) bool."""
        tree, _ = self._samples
        reach = CLEARLY * distance_m
        near = tree.query_ball_point(xy, np.hypot(reach, SAMPLE_M / 2), return_sorted=True)
        places = zip(xy, s, reach, near)
        return np.array([self._has_second(place, foot, at, np.array(ids)) for place, foot, at, ids in places], bool)

    def _has_second(self, place: np.ndarray, foot: float, reach_m: float, ids: np.ndarray) -> bool:
        """Return whether a place has another foot within reach among samples, ascending."""
        tree, s = self._samples
        if not len(ids) or (np.abs(s[ids] - foot) < APART_M).all():
            return False
        distance = np.linalg.norm(tree.data[ids] - place, axis=1)
        follows = np.diff(ids) == 1
        before = np.where(np.append(False, follows), np.append(np.inf, distance[:-1]), np.inf)
        after = np.where(np.append(follows, False), np.append(distance[1:], np.inf), np.inf)
        feet = ids[(distance <= before) & (distance <= after) & (np.abs(s[ids] - foot) >= APART_M)]
        around = (Chords.joined([Polyline(tree.data[max(at - 1, 0) : at + 2])]) for at in feet)
        return any(np.linalg.norm(chords.nearest(place[None])[0] - place) < reach_m for chords in around)


def locate(axes: Sequence[KilometreLine], xy: np.ndarray, notation: str, progress: Progress = SILENT) -> Kilometres:
    """Find kilometre, offset and side of places, (n, 2) metres, along the nearest of several axes.

    Those further than `BEYOND_M` beyond the ends of all axes have none. The notation is one of `text.NOTATIONS`.
    """
    parts = range(0, len(xy), PLACES_AT_ONCE)
    found = [_locate(axes, xy[start : start + PLACES_AT_ONCE], progress) for start in progress.follow(parts)]
    if not found:
        return Kilometres.empty(0)
    axis, s, left_m, ambiguous = (np.concatenate(column) for column in zip(*found))
    made = Kilometres.empty(len(xy))
    for number, mine in _groups(axis):
        one = axes[number]
        piece, km = one.stationing.at(s[mine])
        counts_from = one.stationing.counts_from()[piece]
        made.axis[mine], made.piece[mine], made.km[mine] = one.name, piece + 1, km
        made.km_text[mine] = [write_km(value, notation, again) for value, again in zip(np.round(km, 6), counts_from)]
        made.offset_m[mine], made.ambiguous[mine] = left_m[mine], ambiguous[mine]
        made.side[mine] = np.select([left_m[mine] > ON_AXIS_M, left_m[mine] < -ON_AXIS_M], ["left", "right"], "on")
    return made


def _locate(axes: Sequence[KilometreLine], xy: np.ndarray, progress: Progress) -> tuple[np.ndarray, ...]:
    """Return the number of the nearest axis (-1 without one), `s`, the offset and whether they are ambiguous."""
    near = nearest(axes, xy, BEYOND_M, progress)
    ambiguous = near.second_m < CLEARLY * near.distance_m
    for number, mine in _groups(np.where(ambiguous, -1, near.axis)):
        progress.check()
        ambiguous[mine] = axes[number].ambiguous(xy[mine], near.s[mine], near.distance_m[mine])
    return near.axis, near.s, near.left_m, ambiguous


def _groups(axis: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the number of each axis that places have, and the numbers of these places; -1 is none."""
    order = np.argsort(axis, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(axis[order])) + 1):
        if len(mine) and axis[mine[0]] >= 0:
            yield int(axis[mine[0]]), mine


@dataclass(frozen=True)
class Nearest:
    """The nearest axis of places, -1 without one, and their feet on it as in `AxisFeet`; (n,) arrays.

    `second_m` is the distance of the axis that is the nearest but one; infinity without one, or where it is clearly
    farther away.
    """

    axis: np.ndarray
    s: np.ndarray
    left_m: np.ndarray
    distance_m: np.ndarray
    second_m: np.ndarray

    def put(self, number: int, mine: np.ndarray, feet: AxisFeet, beyond_m: float) -> None:
        """Take note of the feet of some places on an axis."""
        distance_m, known_m = np.where(feet.beyond_m <= beyond_m, feet.distance_m, np.inf), self.distance_m[mine]
        closer = distance_m < known_m
        self.second_m[mine] = np.where(closer, known_m, np.minimum(self.second_m[mine], distance_m))
        own = mine[closer]
        self.axis[own] = number
        self.s[own], self.left_m[own], self.distance_m[own] = feet.s[closer], feet.left_m[closer], distance_m[closer]


def nearest(axes: Sequence[KilometreLine], xy: np.ndarray, beyond_m: float, progress: Progress = SILENT) -> Nearest:
    """Find the nearest axis of places, (n, 2) metres, of those beyond whose ends they are by less than `beyond_m`.

    Of many axes, only those are looked at whose bounding box is not clearly farther away than an axis.
    """
    infinite = np.full(len(xy), np.inf)
    found = Nearest(np.full(len(xy), -1), np.zeros(len(xy)), np.zeros(len(xy)), infinite, infinite.copy())
    first, closest_m = np.zeros(len(xy), dtype=int), infinite.copy()
    for number, axis in enumerate(axes):
        bound_m = axis.farther_than(xy)
        first[bound_m < closest_m] = number
        closest_m = np.minimum(closest_m, bound_m)
    for number, mine in _groups(first):
        progress.check()
        found.put(number, mine, axes[number].feet(xy[mine]), beyond_m)
    for number, axis in enumerate(axes):
        progress.check()
        mine = np.flatnonzero((first != number) & (axis.farther_than(xy) <= CLEARLY * found.distance_m))
        if len(mine):
            found.put(number, mine, axis.feet(xy[mine]), beyond_m)
    return found
