"""Chains: signals whose bend is constant or changes linearly, their least squares fit, and the data that they fit.

The bend is the second derivative of the lateral position or of the height, or the first derivative of the cant. Parts F
with constant bend follow each other; between two of them is a joint [p, q] over which the bend changes linearly, or
jumps if q = p. A part F may have no length: then two ramps meet. With k the bends of the parts,

    y(s) = offset + slope s + k[0] s² / 2 + sum over the joints of (k[j + 1] - k[j]) G(s; p[j], q[j])

where G is the second integral of a ramp from 0 to 1. With `order` 1, slope s is absent, and the bends count once less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Optional

import numpy as np
from scipy.linalg.lapack import dgeqrf, dtbtrs

JUMP_M = 1e-6
"""A jump is computed as a ramp of this length, metres, far below any effect."""

LONGEST_SHIFT_M = 50.0
"""Expected largest shift of a joint in a step, metres: it keeps a joint in place that the data do not see."""

LEAST_GAIN = 0.05
"""Fall of chi-square below which a further step is not worth it."""

ROOM_SHARE = 0.45
"""Share of the room to its neighbours that a joint may take in a step, so that two cannot pass each other."""


@dataclass(frozen=True)
class Samples:
    """The signal as means over blocks, (n,) arrays: mean distance and mean signal, metres.

    `spread` is the variance of the distance within the block: the mean of a bent signal is off by half of it times the
    bend. `variance` is that of what is independent in the mean, both square metres. `factor`, (b, n), is the Cholesky
    factor of the covariance of the means, in the lower form of banded matrices, metres; None if neighbours share no
    errors.
    """

    s: np.ndarray
    y: np.ndarray
    spread: np.ndarray
    variance: np.ndarray
    factor: Optional[np.ndarray] = None

    def __getitem__(self, which: np.ndarray | slice) -> Samples:
        return Samples(self.s[which], self.y[which], self.spread[which], self.variance[which])

    def whitened(self, columns: np.ndarray) -> np.ndarray:
        """Return columns, (n, k), in which the errors of the signal are independent with standard deviation 1."""
        if self.factor is None:
            return columns / np.sqrt(self.variance)[:, None]
        return dtbtrs(self.factor, columns, uplo="L")[0]


@dataclass(frozen=True)
class Chain:
    """Parts of constant bend and the joints between them, from `start` to `end`; lengths in metres.

    `bends`, (m,), is the bend of each part, 1/m; where it is not `curved`, it is 0. `p` and `q`, (m - 1,), are start
    and end of each joint: equal values are one unknown; a value equal to `start` or `end` is fixed. `order` is how many
    times the bend is integrated.
    """

    start: float
    end: float
    bends: np.ndarray
    curved: tuple[bool, ...]
    p: np.ndarray
    q: np.ndarray
    order: int = 2

    @property
    def knots(self) -> np.ndarray:
        """Ends of the chain and of all its joints in order, (2 m,)."""
        inner = np.column_stack([self.p, self.q]).ravel()
        return np.concatenate([[self.start], inner, [self.end]])

    @property
    def unknown(self) -> np.ndarray:
        """Number of the unknown of each knot but the ends, (2 m - 2,); -1 where it is fixed."""
        knots = self.knots
        number = np.cumsum(np.diff(knots) > 0)[:-1] - 1
        fixed = (knots[1:-1] == self.start) | (knots[1:-1] == self.end)
        return np.where(fixed, -1, number)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.order + sum(self.curved) + int(self.unknown.max(initial=-1)) + 1

    @property
    def extents(self) -> tuple[np.ndarray, np.ndarray]:
        """Start and end of each part, (m,) each."""
        return np.append(self.start, self.q), np.append(self.p, self.end)

    def with_knots(self, inner: np.ndarray) -> Chain:
        """Return the chain with other joints, (2 m - 2,)."""
        return replace(self, p=inner[0::2], q=inner[1::2])


@dataclass(frozen=True)
class Held:
    """What is held in a fit: bends of parts, 1/m, and starts and lengths of elements, metres, by their numbers.

    A start one past the last stands for the end.
    """

    bends: Mapping[int, float] = field(default_factory=dict)
    starts: Mapping[int, float] = field(default_factory=dict)
    lengths: Mapping[int, float] = field(default_factory=dict)


NOTHING = Held()


@dataclass(frozen=True)
class Span:
    """A part of a chain that is to be assembled, or a ramp between two parts, from `start` to `end`, metres.

    `curved` says whether the bend of a part is free; `bend` is that of a part or at the end of a ramp, `before` that at
    the start of a ramp.
    """

    start: float
    end: float
    is_ramp: bool
    curved: bool = True
    bend: float = 0.0
    before: float = 0.0


def assembled(spans: Sequence[Span], order: int) -> Chain:
    """Return the chain of spans that follow each other: parts meet in jumps, and ramps in a part without length."""
    curved: list[bool] = []
    bends: list[float] = []
    p: list[float] = []
    q: list[float] = []
    was_ramp = False
    for span in spans:
        if span.is_ramp:
            if was_ramp or not curved:
                curved.append(True)
                bends.append(span.before)
            p.append(span.start)
            q.append(span.end)
        else:
            if curved and not was_ramp:
                p.append(span.start)
                q.append(span.start)
            curved.append(span.curved)
            bends.append(span.bend)
        was_ramp = span.is_ramp
    if was_ramp:
        curved.append(True)
        bends.append(spans[-1].bend)
    return Chain(spans[0].start, spans[-1].end, np.array(bends), tuple(curved), np.array(p), np.array(q), order)


def columns(chain: Chain, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns of offset, slope and bends, (n, order + m), and of the ends of all joints, (n, 2 m - 2)."""
    count = len(chain.bends)
    x = (samples.s - chain.start)[:, None]
    d = np.maximum(chain.q - chain.p, JUMP_M)
    ahead = x - (chain.p - chain.start)
    u = np.minimum(np.maximum(ahead, 0.0), d)
    v = np.maximum(ahead - d, 0.0)
    ratio = u / d
    base, by = np.empty((len(x), chain.order + count + 1)), np.empty((len(x), 2 * count - 2))
    base[:, 0] = 1.0
    if chain.order == 1:
        g = 0.5 * u * ratio + v
        by[:, 0::2] = by[:, 1::2] = -0.5 * (ahead > 0.5 * d)
        base[:, 1] = x[:, 0]
    else:
        half_spread = 0.5 * samples.spread[:, None]
        g = u * u * ratio / 6.0 + 0.5 * v * (d + v) + half_spread * ratio
        third, half = u * ratio * ratio / 6.0, 0.5 * v
        by[:, 0::2] = third - 0.5 * u * ratio - half
        by[:, 1::2] = -third - half
        base[:, 1] = x[:, 0]
        base[:, 2] = (0.5 * x * x + half_spread)[:, 0]
    base[:, chain.order + 1 : -1] = g
    base[:, -1] = 0.0
    base[:, chain.order : -1] -= base[:, chain.order + 1 :]
    return base[:, :-1], by


@dataclass(frozen=True)
class Unknowns:
    """What a fit of a chain finds.

    `free`, (order + m,), says whether the values at the start and the bends are found; the other `bends`, (m,), are 0
    or held, 1/m. `knots`, (2 m - 2,), is the number of the unknown of each knot but the ends; -1 where it is fixed or
    held.
    """

    free: np.ndarray
    bends: np.ndarray
    knots: np.ndarray

    @classmethod
    def of(cls, chain: Chain, held: Held = NOTHING) -> Unknowns:
        """Return the unknowns of a chain whose elements are its parts, if something is held."""
        bends, knots = np.zeros(len(chain.bends)), chain.unknown
        free = np.array((True,) * chain.order + chain.curved)
        for part, bend in held.bends.items():
            bends[part], free[chain.order + part] = bend, False
        for start in held.starts:
            knots[2 * start - 2 : 2 * start] = -1
        moving = knots >= 0
        knots[moving] = np.unique(knots[moving], return_inverse=True)[1]
        return cls(free, bends, knots)

    @cached_property
    def chosen(self) -> np.ndarray:
        """Which knots each unknown moves, (2 m - 2, u)."""
        return (self.knots[:, None] == np.arange(self.knots.max(initial=-1) + 1)).astype(float)

    def with_solution(self, chain: Chain, solution: np.ndarray) -> Chain:
        """Return a chain with the bends that were found."""
        values = np.zeros(len(self.free))
        values[self.free] = solution
        return replace(chain, bends=values[chain.order :] + self.bends)

    def matrix(self, chain: Chain, samples: Samples) -> np.ndarray:
        """Return the whitened derivatives by values and bends, then by knots, and what they explain as last column."""
        base, by = columns(chain, samples)
        by_knots = (by * np.repeat(np.diff(chain.bends), 2)) @ self.chosen
        rest = samples.y - base[:, chain.order :] @ self.bends
        return samples.whitened(np.concatenate([base[:, self.free], by_knots, rest[:, None]], axis=1))


def fitted(chain: Chain, samples: Samples, least_m: float, steps: int, held: Held = NOTHING) -> tuple[Chain, float]:
    """Fit what is not held by Gauss-Newton steps; return the best chain and its weighted sum of squared residuals.

    Parts and ramps keep at least the least length. A chain that has as many parameters as there are samples, or more,
    stays as it is; its sum is infinite.
    """
    best, best_rss = chain, np.inf
    if len(samples.s) <= chain.size:
        return best, best_rss
    unknowns = Unknowns.of(chain, held)
    linear = int(unknowns.free.sum())
    for step in range(steps + 1):
        matrix = unknowns.matrix(chain, samples)
        factor = np.triu(dgeqrf(matrix)[0][: matrix.shape[1]])
        rest = factor[linear:, -1]
        rss, was_flat = float(rest @ rest), not chain.bends.any()
        chain = unknowns.with_solution(chain, _solved(factor[:linear, :linear], factor[:linear, -1]))
        gain = best_rss - rss
        if gain > 0:
            best, best_rss = chain, rss
        if step == steps or not len(unknowns.knots) or (gain < LEAST_GAIN and step > 1):
            break
        if was_flat:
            continue
        lower = factor[linear:-1, linear:-1]
        normal = lower.T @ lower + np.eye(len(lower)) / LONGEST_SHIFT_M**2
        shift = np.linalg.solve(normal, lower.T @ rest[:-1])
        chain = _moved(chain, unknowns.knots, shift, least_m)
    return best, best_rss


def residuals(chain: Chain, samples: Samples) -> np.ndarray:
    """Return the whitened residuals of a chain, (n,), with the best offset and slope, in order of `s`."""
    loose, rest, start = _started(chain, samples)
    return rest - loose @ start


def start_of(chain: Chain, samples: Samples) -> np.ndarray:
    """Return the value at the start of a chain, and with order 2 the slope there, (order,)."""
    return _started(chain, samples)[2]


def _started(chain: Chain, samples: Samples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return whitened columns of offset and slope, (n, order), the whitened rest, (n,), and the values at the start."""
    base = columns(chain, samples)[0]
    rest = samples.y - base[:, chain.order :] @ chain.bends
    both = samples.whitened(np.column_stack([base[:, : chain.order], rest]))
    return both[:, :-1], both[:, -1], np.linalg.lstsq(both[:, :-1], both[:, -1], rcond=None)[0]


def _solved(upper: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve a triangular system; a column that nothing determines gets 0."""
    diagonal = np.abs(np.diag(upper))
    if diagonal.min(initial=1.0) < 1e-12 * diagonal.max(initial=1.0):
        return np.linalg.lstsq(upper, right, rcond=1e-12)[0]
    return np.linalg.solve(upper, right)


def _moved(chain: Chain, unknown: np.ndarray, shift: np.ndarray, least_m: float) -> Chain:
    """Return the chain with joints shifted, as far as there is room."""
    knots = chain.knots
    gaps = np.diff(knots)
    number = np.cumsum(gaps > 0)
    room = np.full(int(number[-1]), 0.0)
    room[number[gaps > 0] - 1] = np.maximum(gaps[gaps > 0] - least_m, 0.0) * ROOM_SHARE
    mine = number[:-1]
    inner = knots[1:-1].copy()
    moving = unknown >= 0
    at = mine[moving]
    inner[moving] += np.clip(shift[unknown[moving]], -room[at - 1], room[np.minimum(at, len(room) - 1)])
    return chain.with_knots(inner)
