"""Combinations of clothoids that join oriented points, from a table computed once (docs/method.md section 11.3).

A combination is three pieces: its curvature rises from zero, runs linearly, and falls back to zero, so that chains of
them have no jump of curvature. With the chord as unit of length, the curvature is fixed by the deflections at both
ends and by the share of the length that each outer piece takes; what remains is one unknown, the skew.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..curves import Element

SHARES = (0.15, 0.25, 0.35, 0.45)
"""Shares of the length that the first piece takes, and the last one: from nearly an arc to nearly two clothoids."""

MAX_DEFLECTION_DEG, GRID_DEG = 70.0, 2.0
"""Range and step of the deflections in the table; beyond that range curves turn back on themselves."""

MAX_LENGTH_CHORDS = 2.0
"""Chords after which a combination counts as a detour."""

TABLE_STEPS, POLISH_STEPS = 8, 2
UNSOLVED = 1e6
"""Stands in the table where Newton's method finds no curve worth having: too sharp to be drawn."""

CLOSED = 1e-9
"""How far, in lengths of the curve, a combination may end beside its point."""

SOFT_ENERGY = 0.1
"""Added to the bending energy before it is inverted, so that straight lines are not all that is ever drawn."""

DIRECTIONS = 4
"""Ways to join two poses: each may be left or reached in either direction."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Pose:
    """A point with a direction in radians."""

    x: float
    y: float
    heading: float

    def turned(self) -> Pose:
        """Look back."""
        return Pose(self.x, self.y, self.heading + math.pi)


@dataclass(frozen=True)
class Table:
    """Combinations of unit chord, by share and by deflections of start and end, each (shares, n, n).

    Attributes
    ----------
    skew : array
        Solution of the unknown, from which an exact combination is polished.
    sharpest : array
        Largest curvature.
    energy : array
        Integral of the squared curvature.
    """

    skew: np.ndarray
    sharpest: np.ndarray
    energy: np.ndarray

    def look_up(self, values: np.ndarray, share: int, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Interpolate one of the arrays at deflections in radians; outside the table the border's value counts."""
        places = [(np.degrees(np.ravel(angle)) + MAX_DEFLECTION_DEG) / GRID_DEG for angle in (first, last)]
        return ndimage.map_coordinates(values[share], places, order=1, mode="nearest").reshape(np.shape(first))


@functools.lru_cache(maxsize=1)
def table() -> Table:
    """Solve the combinations for the whole grid, once a process."""
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
    """Join two oriented points by the combination of one of `SHARES`.

    Returns
    -------
    list of Element or None
        To be traced from `start`; None where the points do not face each other well enough.
    """
    chord = math.hypot(end.x - start.x, end.y - start.y)
    first, last = _deflections(start, end)
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
    rng: np.random.Generator, poses: list[Pose], count: int, sharpest_m: float
) -> list[tuple[Pose, list[Element]]]:
    """Join up to `count` pairs of poses, drawn with a chance that falls with the bending energy.

    A pose may be passed in both directions, and two poses are joined once at most. Combinations with a radius below
    `sharpest_m` are left out.

    Returns
    -------
    list of (Pose, list of Element)
        Start and pieces of each joint curve.
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
    weight = np.where(facing & (sharpest * sharpest_m < 1), 1 / (SOFT_ENERGY + energy), 0.0).ravel()
    if not weight.any():
        return []
    drawn = rng.choice(len(weight), size=np.count_nonzero(weight), replace=False, p=weight / weight.sum())
    joined: dict[int, tuple[Pose, list[Element]]] = {}
    for share, number in (divmod(place, len(pairs)) for place in drawn.tolist()):
        elements = join(*pairs[number], share)
        if elements and max(abs(elements[0].end), abs(elements[2].start)) * sharpest_m < 1:
            joined.setdefault(number // DIRECTIONS, (pairs[number][0], elements))
        if len(joined) == count:
            break
    return list(joined.values())


def _deflections(start: Pose, end: Pose) -> tuple[float, float]:
    """Directions at both ends against the chord, radians in -pi to pi."""
    chord = math.atan2(end.y - start.y, end.x - start.x)
    return math.remainder(start.heading - chord, 2 * math.pi), math.remainder(end.heading - chord, 2 * math.pi)


@functools.lru_cache(maxsize=len(SHARES))
def _basis(share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How the two inner curvatures turn the curve: even and odd part at the nodes of integration, and their weights.

    Each inner curvature acts as a hat over the length, and turns the direction by the hat's integral.
    """
    borders = np.array([0.0, share, 1 - share, 1.0])
    lengths = np.diff(borders)[:, None]
    t = (borders[:-1, None] + 0.5 * (_NODES + 1) * lengths).ravel()
    weights = (0.5 * _WEIGHTS * lengths).ravel()
    rising, falling = _hat_integral(t, share), 0.5 * (1 - share) - _hat_integral(1 - t, share)
    return rising + falling, rising - falling, weights


def _hat_integral(t: np.ndarray, share: float) -> np.ndarray:
    """Integral from 0 to t of the hat that is 0 at 0, 1 at `share`, and 0 from 1 - `share` on."""
    inner = 1 - 2 * share
    past = np.clip(t - share, 0, inner)
    return 0.5 * np.minimum(t, share) ** 2 / share + past - 0.5 * past**2 / inner


def _first_guess(share: float, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Solve for small angles, where a sine is its angle."""
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
    """How far beside its chord a curve ends, in lengths of the curve."""
    _, _, weights = _basis(share)
    return np.sin(_directions(share, first, last, skew)) @ weights


def _directions(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray) -> np.ndarray:
    """Direction against the chord at the nodes of integration, (..., nodes)."""
    even, odd, _ = _basis(share)
    mean = (np.asarray(last) - first) / (1 - share)
    return np.asarray(first)[..., None] + mean[..., None] * even + np.asarray(skew)[..., None] * odd


def _shape(share: float, first: np.ndarray, last: np.ndarray, skew: np.ndarray) -> tuple[np.ndarray, ...]:
    """Length and the two inner curvatures of a combination of unit chord."""
    _, _, weights = _basis(share)
    length = 1 / (np.cos(_directions(share, first, last, skew)) @ weights)
    mean = (np.asarray(last) - first) / (1 - share)
    return length, (mean + skew) / length, (mean - skew) / length


def _energy(share: float, length: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Integral of the squared, piecewise linear curvature."""
    outer = share / 3 * (before**2 + after**2)
    return length * (outer + (1 - 2 * share) / 3 * (before**2 + before * after + after**2))
