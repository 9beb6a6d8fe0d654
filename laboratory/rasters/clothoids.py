"""Combinations of clothoids that join oriented points, from a table computed once (docs/synthetic.md).

A combination has three elements: the curvature rises from zero, changes linearly, and falls back to zero, so that the
curvature of a chain of combinations is continuous. With the chord as unit of length, the deflections at both ends and
the share of each outer element in the length determine the curvature except for one unknown, the skew.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..curves import Element

SHARES = (0.15, 0.25, 0.35, 0.45)
"""Shares of the first and of the last element in the length: from nearly an arc to nearly two clothoids."""

MAX_DEFLECTION_DEG, GRID_DEG = 70.0, 2.0
"""Range and step of the deflections in the table; beyond this range curves turn back on themselves."""

MAX_LENGTH_CHORDS = 2.0
"""A combination longer than this, in chords, is a detour."""

TABLE_STEPS, POLISH_STEPS = 8, 2
UNSOLVED = 1e6
"""Value in the table where Newton's method finds no usable curve; as a curvature it is too sharp to be drawn."""

CLOSED = 1e-9
"""Greatest distance between the end of a combination and its point, in lengths of the curve."""

SOFT_ENERGY = 0.1
"""Added to the bending energy before it is inverted, so that not only straight lines are drawn."""

DIRECTIONS = 4
"""Number of ways to join two poses: each can be passed in either direction."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Pose:
    """A point with a direction in radians."""

    x: float
    y: float
    heading: float

    def turned(self) -> Pose:
        """Return the same point with the opposite direction."""
        return Pose(self.x, self.y, self.heading + math.pi)


@dataclass(frozen=True)
class Table:
    """Combinations with unit chord, by share and by the deflections at start and end; arrays are (shares, n, n).

    `skew` is an approximate solution, which is refined for the combination that is drawn, `sharpest` the largest
    curvature, and `energy` the integral of the squared curvature.
    """

    skew: np.ndarray
    sharpest: np.ndarray
    energy: np.ndarray

    def look_up(self, values: np.ndarray, share: int, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Interpolate one of the arrays at deflections in radians; outside the table it has the value at the border."""
        places = [(np.degrees(np.ravel(angle)) + MAX_DEFLECTION_DEG) / GRID_DEG for angle in (first, last)]
        return ndimage.map_coordinates(values[share], places, order=1, mode="nearest").reshape(np.shape(first))


@functools.lru_cache(maxsize=1)
def table() -> Table:
    """Solve the combinations of the whole grid, once per process."""
    angles = np.radians(np.arange(-MAX_DEFLECTION_DEG, MAX_DEFLECTION_DEG + GRID_DEG / 2, GRID_DEG))
    first, last = np.meshgrid(angles, angles, indexing="ij")
    columns = []
    for share in SHARES:
        skew = _solve(share, first, last, _first_guess(share, first, last), TABLE_STEPS)
        length, before, after = _shape(share, first, last, skew)
        values = skew, np.maximum(abs(before), abs(after)), _energy(share, length, before, after)
        solved = (length > 0) & (length < MAX_LENGTH_CHORDS)
        columns.append([np.where(solved, value, UNSOLVED) for value in values])
    return Table(*(np.stack(values) for values in zip(*columns)))


def join(start: Pose, end: Pose, share: int = 1) -> list[Element] | None:
    """Join two oriented points by a combination for `trace` from `start`; None where the deflections are too large.

    `share` is an index into `SHARES`.
    """
    chord = math.hypot(end.x - start.x, end.y - start.y)
    first, last = (np.asarray(angle) for angle in _deflections(start, end))
    if max(abs(first), abs(last)) > math.radians(MAX_DEFLECTION_DEG):
        return None
    known = table()
    skew = _solve(SHARES[share], first, last, known.look_up(known.skew, share, first, last), POLISH_STEPS)
    length, before, after = (float(value) for value in _shape(SHARES[share], first, last, skew))
    if not 0 < length < MAX_LENGTH_CHORDS or abs(_miss(SHARES[share], first, last, skew)) > CLOSED:
        return None
    outer, inner = SHARES[share] * length * chord, (1 - 2 * SHARES[share]) * length * chord
    before, after = before / chord, after / chord
    return [Element(outer, 0.0, before), Element(inner, before, after), Element(outer, after, 0.0)]


def random_joins(
    rng: np.random.Generator, poses: list[Pose], count: int, min_radius_m: float
) -> list[tuple[Pose, list[Element]]]:
    """Return start and elements of up to `count` joined pairs of poses; less bending energy makes a pair more likely.

    A pose can be passed in both directions, and two poses are joined at most once, with no radius below `min_radius_m`.
    """
    pairs = [
        (start, end)
        for number, one in enumerate(poses)
        for other in poses[number + 1 :]
        for start in (one, one.turned())
        for end in (other, other.turned())
    ]
    first, last = np.array([_deflections(*pair) for pair in pairs]).T
    chord = np.array([math.hypot(end.x - start.x, end.y - start.y) for start, end in pairs])
    known = table()
    shares = range(len(SHARES))
    sharpest = np.stack([known.look_up(known.sharpest, share, first, last) for share in shares]) / chord
    energy = np.stack([known.look_up(known.energy, share, first, last) for share in shares])
    facing = np.maximum(abs(first), abs(last)) < math.radians(MAX_DEFLECTION_DEG)
    weight = np.where(facing & (sharpest * min_radius_m < 1), 1 / (SOFT_ENERGY + energy), 0.0).ravel()
    if not weight.any():
        return []
    drawn = rng.choice(len(weight), size=np.count_nonzero(weight), replace=False, p=weight / weight.sum())
    joined: dict[int, tuple[Pose, list[Element]]] = {}
    for share, number in (divmod(place, len(pairs)) for place in drawn.tolist()):
        start, end = pairs[number]
        elements = join(start, end, share)
        if elements and max(abs(elements[0].end), abs(elements[2].start)) * min_radius_m < 1:
            joined.setdefault(number // DIRECTIONS, (start, elements))
        if len(joined) == count:
            break
    return list(joined.values())


def _deflections(start: Pose, end: Pose) -> tuple[float, float]:
    """Return the directions at both ends relative to the chord, radians from -pi to pi."""
    chord = math.atan2(end.y - start.y, end.x - start.x)
    return math.remainder(start.heading - chord, 2 * math.pi), math.remainder(end.heading - chord, 2 * math.pi)


@functools.lru_cache(maxsize=len(SHARES))
def _basis(share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how the two inner curvatures turn the curve: their even and odd part, and the weights of integration.

    An inner curvature is a hat function over the length; it turns the direction by the integral of the hat. Both parts
    are given at the nodes of integration.
    """
    borders = np.array([0.0, share, 1 - share, 1.0])
    lengths = np.diff(borders)[:, None]
    t = (borders[:-1, None] + 0.5 * (_NODES + 1) * lengths).ravel()
    weights = (0.5 * _WEIGHTS * lengths).ravel()
    rising, falling = _hat_integral(t, share), 0.5 * (1 - share) - _hat_integral(1 - t, share)
    return rising + falling, rising - falling, weights


def _hat_integral(t: np.ndarray, share: float) -> np.ndarray:
    """Integrate, from 0 to t, the hat function that is 0 at 0, 1 at `share`, and 0 from 1 - `share`."""
    inner = 1 - 2 * share
    past = np.clip(t - share, 0, inner)
    return 0.5 * np.minimum(t, share) ** 2 / share + past - 0.5 * past**2 / inner


def _first_guess(share: float, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Solve for small angles, where the sine equals the angle."""
    even, odd, weights = _basis(share)
    return -(first + (last - first) / (1 - share) * (weights @ even)) / (weights @ odd)


def _solve(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray, steps: int) -> np.ndarray:
    """Improve the skew by Newton's method until the curve ends on its chord."""
    _, odd, weights = _basis(share)
    for _ in range(steps):
        slope = np.cos(_directions(share, first, last, skew)) @ (weights * odd)
        skew = skew - _miss(share, first, last, skew) / slope
    return skew


def _miss(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray) -> np.ndarray:
    """Return the distance between the end of a curve and its chord, in lengths of the curve."""
    _, _, weights = _basis(share)
    return np.sin(_directions(share, first, last, skew)) @ weights


def _directions(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray) -> np.ndarray:
    """Return the directions relative to the chord at the nodes of integration, (..., nodes)."""
    even, odd, _ = _basis(share)
    mean = (np.asarray(last) - first) / (1 - share)
    return np.asarray(first)[..., None] + mean[..., None] * even + np.asarray(skew)[..., None] * odd


def _shape(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the length and the two inner curvatures of a combination with unit chord."""
    _, _, weights = _basis(share)
    length = 1 / (np.cos(_directions(share, first, last, skew)) @ weights)
    mean = (np.asarray(last) - first) / (1 - share)
    return length, (mean + skew) / length, (mean - skew) / length


def _energy(share: float, length: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Integrate the squared curvature, which is piecewise linear."""
    outer = share / 3 * (before**2 + after**2)
    return length * (outer + (1 - 2 * share) / 3 * (before**2 + before * after + after**2))
