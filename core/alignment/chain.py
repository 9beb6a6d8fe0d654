"""Chains: signals whose bend is constant or changes linearly, their least squares fit, and the data that they fit.

The bend is the second derivative of the lateral position or of the height, or the first derivative of the cant. Parts F
with constant bend follow each other; between two of them is a joint [p, q] over which the bend changes linearly, or
jumps if q = p. A part F may have no length: then two ramps meet. With k the bends of the parts,

    y(s) = offset + slope s + k[0] s² / 2 + sum over the joints of (k[j + 1] - k[j]) G(s; p[j], q[j])

where G is the second integral of a ramp from 0 to 1. With `order` 1, slope s is absent, and the bends count once less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

JUMP_M = 1e-6
"""A jump is computed as a ramp of this length, metres, far below any effect."""

LONGEST_SHIFT_M = 50.0
"""Expected largest shift of a joint in a step, metres: it keeps a joint in place that the data do not see."""

ROOM_SHARE = 0.45
"""Share of the room to its neighbours that a joint may take in a step, so that two cannot pass each other."""


@dataclass(frozen=True)
class Samples:
    """The signal as means over blocks.

    Attributes
    ----------
    s, y : (n,) array
        Mean distance and mean signal of a block, metres.
    spread : (n,) array
        Variance of the distance within the block, square metres: the mean of a bent signal is off by half of it times
        the bend.
    root : (n,) array
        Square root of the weight of the block, 1/m: of its points' number over their variance.
    """

    s: np.ndarray
    y: np.ndarray
    spread: np.ndarray
    root: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Samples:
        return Samples(self.s[which], self.y[which], self.spread[which], self.root[which])


@dataclass(frozen=True)
class Chain:
    """Parts of constant bend and the joints between them, from `start` to `end`.

    Attributes
    ----------
    start, end : float
        Distances, metres.
    bends : (m,) array
        Bend of each part, 1/m.
    curved : tuple of bool
        Whether the bend of the part is free; else it is 0.
    p, q : (m - 1,) array
        Start and end of each joint, metres. Equal values are one unknown; a value equal to `start` or `end` is fixed.
    order : int
        How many times the bend is integrated.
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


def columns(chain: Chain, samples: Samples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the columns of the model.

    Returns
    -------
    base : (n, order + m) array
        Of offset, slope and the bends of all parts.
    by_p, by_q : (n, m - 1) array
        Derivatives of G with respect to the ends of each joint.
    """
    x = (samples.s - chain.start)[:, None]
    d = np.maximum(chain.q - chain.p, JUMP_M)
    ahead = x - (chain.p - chain.start)
    u = np.clip(ahead, 0.0, d)
    v = np.maximum(ahead - d, 0.0)
    half_spread = 0.5 * samples.spread[:, None]
    if chain.order == 1:
        g = u * u / (2.0 * d) + v
        by_p = -0.5 * (ahead > 0.5 * d)
        by_q = by_p
        whole = [np.ones_like(x), x]
    else:
        ratio = u / d
        g = u * u * ratio / 6.0 + v * (0.5 * d + 0.5 * v) + half_spread * ratio
        third, half_v = u * ratio * ratio / 6.0, 0.5 * v
        by_p = third - 0.5 * u * ratio - half_v
        by_q = -third - half_v
        whole = [np.ones_like(x), x, 0.5 * x * x + half_spread]
    g = np.concatenate([whole[-1], g, np.zeros_like(x)], axis=1)
    return np.concatenate([*whole[:-1], g[:, :-1] - g[:, 1:]], axis=1), by_p, by_q


def fitted(chain: Chain, samples: Samples, least_m: float, steps: int) -> tuple[Chain, float]:
    """Fit bends and joints by Gauss-Newton steps; return the best chain and its weighted sum of squared residuals.

    Parameters
    ----------
    chain : Chain
    samples : Samples
    least_m : float
        Least length of a part or a ramp, metres.
    steps : int
    """
    best, best_rss = chain, np.inf
    for step in range(steps + 1):
        base, by_p, by_q = columns(chain, samples)
        free = np.concatenate([np.ones(chain.order, dtype=bool), chain.curved])
        unknown = chain.unknown
        change = np.diff(chain.bends)
        knot_columns = np.zeros((len(samples.s), int(unknown.max(initial=-1)) + 1))
        for j in range(len(change)):
            for by, number in ((by_p, unknown[2 * j]), (by_q, unknown[2 * j + 1])):
                if number >= 0:
                    knot_columns[:, number] += change[j] * by[:, j]
        linear = int(free.sum())
        matrix = np.column_stack([base[:, free], knot_columns, samples.y]) * samples.root[:, None]
        factor = np.linalg.qr(matrix, mode="r")
        rss = float(factor[linear:, -1] @ factor[linear:, -1])
        values = np.zeros(len(free))
        values[free] = _solved(factor[:linear, :linear], factor[:linear, -1])
        chain = replace(chain, bends=values[chain.order :])
        if rss < best_rss:
            best, best_rss = chain, rss
        if step == steps or not knot_columns.shape[1]:
            break
        if step == 0 and not change.any():
            continue
        lower = factor[linear:-1, linear:-1]
        normal = lower.T @ lower + np.eye(len(lower)) / LONGEST_SHIFT_M**2
        shift = np.linalg.solve(normal, lower.T @ factor[linear:-1, -1])
        chain = _moved(chain, unknown, shift, least_m)
    return best, best_rss


def residuals(chain: Chain, samples: Samples) -> np.ndarray:
    """Return the weighted residuals of a chain, (n,), with the best offset and slope, in order of `s`."""
    base = columns(chain, samples)[0]
    rest = (samples.y - base[:, chain.order :] @ chain.bends) * samples.root
    loose = base[:, : chain.order] * samples.root[:, None]
    rest = rest - loose @ np.linalg.lstsq(loose, rest, rcond=None)[0]
    return rest[np.argsort(samples.s)]


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
