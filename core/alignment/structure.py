"""The search for the structure of a signal: which parts and joints it has, by an information criterion."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..progress import SILENT, Progress
from .chain import Chain, Samples, Span, assembled, fitted, residuals
from .moves import richer, simpler
from .noise import Noise
from .partition import Piece

FINE_M, COARSE = 2.0, 5
"""Length of a block near joints, metres, and how many of them are one block far from joints."""

NEAR_M = 40.0
"""Distance from a joint within which blocks are fine, metres."""

AROUND = 2
"""Parts on either side of the one that is looked at, which are fitted with it."""

SHOULDER_M = 150.0
"""Length of the outermost parts of a window, metres: more of them does not change what is in its middle."""

SCREEN_STEPS, FIT_STEPS = 3, 6
"""Gauss-Newton steps for a first look at a candidate, and for one that may be accepted."""

HANGING = 3.7
"""Residuals hang together if the sum of some neighbours exceeds this many times its standard error."""

SAME_M = 12.0
"""Joints closer than this are the same for the memory of accepted states, metres."""


@dataclass(frozen=True)
class Blocks:
    """A signal as means over fine and coarse blocks.

    Attributes
    ----------
    fine, coarse : Samples
    first : float
        Distance at which the first block begins, metres.
    noise : Noise
        Of the points.
    """

    fine: Samples
    coarse: Samples
    first: float
    noise: Noise

    @classmethod
    def of(cls, s: np.ndarray, y: np.ndarray, share: np.ndarray, noise: Noise) -> Blocks:
        """Average a signal whose points count as `share`, (n,), of one; those with 0 are left out."""
        used = share > 0
        s, y, weight = s[used], y[used], share[used] / noise.white_m**2
        half_step = 0.5 * (s[-1] - s[0]) / max(len(s) - 1, 1)  # else micrometres decide about points between two blocks
        number = ((s - s[0] + half_step) // FINE_M).astype(int)
        return cls(_averaged(s, y, weight, number), _averaged(s, y, weight, number // COARSE), float(s[0]), noise)

    def near(self, chain: Chain) -> Samples:
        """Return the samples for a chain: fine ones near its joints, coarse ones elsewhere."""
        size = FINE_M * COARSE
        knots = chain.knots
        fine, coarse = (self._inside(samples, chain) for samples in (self.fine, self.coarse))
        where_fine, where_coarse = (
            np.abs(knots[:, None] - (self.first + size * (np.floor((one.s - self.first) / size) + 0.5))).min(axis=0)
            for one in (fine, coarse)
        )
        a, b = fine[where_fine < NEAR_M], coarse[where_coarse >= NEAR_M]
        both = [np.concatenate([getattr(a, name), getattr(b, name)]) for name in ("s", "y", "spread", "variance")]
        order = np.argsort(both[0])
        s, y, spread, variance = (values[order] for values in both)
        return Samples(s, y, spread, variance, self.noise.factor(s, spread, variance))

    @staticmethod
    def _inside(samples: Samples, chain: Chain) -> Samples:
        first, last = np.searchsorted(samples.s, [chain.start, chain.end])
        return samples[slice(first, last)]


def _averaged(s: np.ndarray, y: np.ndarray, weight: np.ndarray, number: np.ndarray) -> Samples:
    """Return weighted means over blocks."""
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    total = np.add.reduceat(weight, starts)
    mean = np.add.reduceat(weight * s, starts) / total
    away = s - np.repeat(mean, np.diff(starts, append=len(s)))
    spread = np.add.reduceat(weight * away**2, starts) / total
    return Samples(mean, np.add.reduceat(weight * y, starts) / total, spread, 1.0 / total)


@dataclass(frozen=True)
class Rules:
    """What a chain may be made of.

    Attributes
    ----------
    ramps, jumps : bool
        Whether the bend may change linearly, and whether it may jump.
    least_m : float
        Least length of a part or a ramp, metres.
    price : float
        Cost of a parameter, in units of chi-square.
    """

    ramps: bool
    jumps: bool
    least_m: float
    price: float


def from_pieces(pieces: Sequence[Piece], order: int, rules: Rules) -> Chain:
    """Return a chain with the pieces of a partition: those of highest degree are ramps if there are ramps."""
    spans = [Span(one.start, one.end, one.degree > order, one.degree == order) for one in pieces]
    chain = assembled(spans, order)
    return chain if rules.jumps or order == 1 else _without_jumps(chain, rules.least_m)


def _without_jumps(chain: Chain, least_m: float) -> Chain:
    """Return a chain with a short ramp in place of each jump."""
    starts, ends = chain.extents
    room = 0.4 * np.minimum(ends[:-1] - starts[:-1], ends[1:] - starts[1:])
    half = np.where(chain.p == chain.q, np.minimum(0.5 * least_m, room), 0.0)
    return replace(chain, p=chain.p - half, q=chain.q + half)


def searched(chain: Chain, blocks: Blocks, rules: Rules, progress: Progress = SILENT) -> Chain:
    """Improve the structure of a chain until no change in any window lowers the criterion.

    Parameters
    ----------
    chain : Chain
    blocks : Blocks
        With their noise, so that sums of squared residuals are chi-squares.
    rules : Rules
    progress : Progress
    """
    waiting = deque(range(len(chain.bends)))
    accepted: set[tuple] = set()
    done = 0
    while waiting:
        progress.check()
        m = waiting.popleft()
        if m >= len(chain.bends):
            continue
        lo, hi = _window(chain, m)
        part = _cut(chain, lo, hi, m)
        better, is_changed = _improved(part, m - lo, blocks, rules, accepted)
        done += 1
        progress.set_fraction(done / (done + len(waiting)))
        chain = _replaced(chain, lo, hi, better)
        if not is_changed:
            continue
        grown = len(better.bends) - len(part.bends)
        shifted = [one + grown * (one > hi) for one in waiting if not lo <= one <= hi]
        around = range(max(lo, 0), min(hi + grown, len(chain.bends) - 1) + 1)
        waiting = deque([*around, *shifted])
    return chain


def _window(chain: Chain, m: int) -> tuple[int, int]:
    """Return the first and the last part of the window around part `m`; both have a length."""
    starts, ends = chain.extents
    lo, hi = max(m - AROUND, 0), min(m + AROUND, len(chain.bends) - 1)
    while lo > 0 and starts[lo] == ends[lo]:
        lo -= 1
    while hi < len(chain.bends) - 1 and starts[hi] == ends[hi]:
        hi += 1
    return lo, hi


def _cut(chain: Chain, lo: int, hi: int, m: int) -> Chain:
    """Return the parts `lo` to `hi` of a chain, the outermost ones shortened unless they are `m`."""
    starts, ends = chain.extents
    start = float(starts[lo]) if lo == m else max(float(starts[lo]), float(ends[lo]) - SHOULDER_M)
    end = float(ends[hi]) if hi == m else min(float(ends[hi]), float(starts[hi]) + SHOULDER_M)
    return replace(
        chain,
        start=start,
        end=end,
        bends=chain.bends[lo : hi + 1],
        curved=chain.curved[lo : hi + 1],
        p=chain.p[lo:hi],
        q=chain.q[lo:hi],
    )


def _replaced(chain: Chain, lo: int, hi: int, part: Chain) -> Chain:
    """Return a chain with the parts `lo` to `hi` replaced."""
    return replace(
        chain,
        bends=np.concatenate([chain.bends[:lo], part.bends, chain.bends[hi + 1 :]]),
        curved=(*chain.curved[:lo], *part.curved, *chain.curved[hi + 1 :]),
        p=np.concatenate([chain.p[:lo], part.p, chain.p[hi:]]),
        q=np.concatenate([chain.q[:lo], part.q, chain.q[hi:]]),
    )


def _improved(part: Chain, m: int, blocks: Blocks, rules: Rules, accepted: set[tuple]) -> tuple[Chain, bool]:
    """Return a window refitted, after the best change of its structure if one pays, and whether one does."""
    samples = blocks.near(part)
    if len(samples.s) <= part.size:
        return part, False
    now, rss = fitted(part, samples, rules.least_m, FIT_STEPS)
    cost = rss + rules.price * now.size
    candidates = list(simpler(now, m, rules.ramps, rules.jumps))
    if _hang_together(now, samples):
        candidates += richer(now, m, rules.ramps, rules.jumps, rules.least_m)
    ranked = []
    for candidate in candidates:
        fit, rss = fitted(candidate, samples, rules.least_m, SCREEN_STEPS)
        ranked.append((rss + rules.price * fit.size, fit))
    ranked.sort(key=lambda one: one[0])
    for screened, candidate in ranked[:3]:
        if screened > cost + 0.5 * abs(cost):
            break
        fit, rss = fitted(candidate, samples, rules.least_m, FIT_STEPS)
        if rss + rules.price * fit.size < cost - 1e-6 and _is_new(fit, accepted):
            return fit, True
    return now, False


def _is_new(chain: Chain, accepted: set[tuple]) -> bool:
    """Return whether a state was not accepted before, and remember it: the search cannot go round in circles."""
    state = (
        chain.curved,
        tuple((chain.knots // SAME_M).astype(int)),
        tuple(chain.p == chain.q),
        tuple(np.diff(chain.knots) == 0.0),
    )
    if state in accepted:
        return False
    accepted.add(state)
    return True


def _hang_together(chain: Chain, samples: Samples) -> bool:
    """Return whether the residuals of a fitted chain are more than noise."""
    rest = residuals(chain, samples)
    total = np.concatenate([[0.0], np.cumsum(rest)])
    return any(
        np.abs(total[width:] - total[:-width]).max() > HANGING * math.sqrt(width)
        for width in (4, 8, 16, 32, 64)
        if width < len(total)
    )
