"""From a signal to its structure: its noise, a first partition into polynomials, and the search for parts and joints.

By an information criterion, changes are tried in turn: parts and joints that go, change or come.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..progress import SILENT, Progress
from ..standards import LEAST_ERROR_M
from .chain import NOTHING, Chain, Held, Samples, Span, assembled, fitted, residuals, start_of
from .noise import Noise, estimated, independent_m

NOISE_ROUNDS, SETTLED = 8, 1.15
"""Largest number of partitions for the noise, and the growth of the noise below which it is known."""

LIKELY = 2.0
"""Standard errors by which the last partition has to show misalignment: to miss it is worse than to see some where
there is none, because the search then bends a track with it."""

SMOOTHED_M = 12.0
"""Distance over which the errors of a smoothed line hang together, metres: about that of the rails of Extract rails."""

SINGLE_SHARE = 0.25
"""Share of the least error of a smoothed line by which its points err within less than `SMOOTHED_M`: lines of Extract
rails are off by 0.2 to 0.4 mm over a few metres, and an arc of 10 m would be made of less."""

FLOOR_M = 0.00005
"""Least standard deviation of a point, metres: below it, coordinates are rounded."""

LEAST_PRICE = 8.0
"""Least cost of a parameter in units of chi-square: with it, noise alone bends a line in one of a hundred cases."""

FINAL_STEPS, FINAL_ROUNDS = 12, 20
"""Gauss-Newton steps of a last fit of a chain as a whole, and how often it is repeated at most."""

STILL_M = 0.0005
"""The last fit ends when no joint moves farther, metres: chi-square hardly shows where a weak joint lies, and a fit
that goes on from the table of this one must find it in the same place."""

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
class SignalKind:
    """A kind of signal.

    `order` is how many times the bend is integrated, `degrees` are those of the polynomials in the first partition, and
    `ramps` says whether the bend may change linearly. `least_m` is the least standard deviation of the errors, metres;
    `shown_m` is that of `Rules`, where the line was smoothed.
    """

    order: int
    degrees: tuple[int, ...]
    ramps: bool
    least_m: float = 0.0
    shown_m: float = 0.0

    def shown(self, noise: Noise) -> float:
        """Return the distance from a curve that no survey shows, metres; 0 where single points scatter."""
        return self.shown_m if noise.white_m < SMOOTH * self.shown_m else 0.0


SMOOTH = 0.2
"""Share of `SignalKind.shown_m` below which single points scatter only if the line was smoothed: errors of several
lengths hang together then, and what the search takes for its noise is less than these."""

PLAN, HEIGHT = SignalKind(2, (1, 2, 3), True, LEAST_ERROR_M), SignalKind(2, (1, 2), False, LEAST_ERROR_M)
CANT = SignalKind(1, (0, 1), False, shown_m=math.sqrt(2.0) * LEAST_ERROR_M)
"""Kinds of signals. Where single points scatter by less than any survey, the line was smoothed, and what their errors
lack is shared by neighbours: the bends of a smooth error would be taken for elements. Cant is the difference of two
heights."""


@dataclass(frozen=True)
class Signal:
    """A signal along a track, (n,) arrays: distance and value, metres, and how much each point counts.

    `share` is 1 for a measured point, 0 in a bridged gap.
    """

    s: np.ndarray
    y: np.ndarray
    share: np.ndarray
    kind: SignalKind

    @property
    def step_m(self) -> float:
        """Mean distance between the points."""
        return float(self.s[-1] - self.s[0]) / max(len(self.s) - 1, 1)

    def blocks(self, noise: Noise) -> Blocks:
        """Return the signal as means, with the noise."""
        return Blocks.of(self.s, self.y, self.share, noise)


def noise_of(signal: Signal, tolerance_m: float, progress: Progress = SILENT) -> tuple[Noise, list[Polynomial]]:
    """Return the noise of a signal, with misalignment up to a tolerance, and the partition for it.

    The finer a partition is, the less is left as noise. From the errors of single points upwards, the noise is raised
    until a partition leaves no more than it was made for. Misalignment raises it at every step; where there is none,
    the first partition remains.
    """
    used = signal.share > 0
    s, y = signal.s[used], signal.y[used]
    noise = Noise(max(independent_m(s, y), FLOOR_M))
    sigma, tried = noise.effective_m(signal.step_m), []
    for share in progress.split(NOISE_ROUNDS):
        fine = signal.blocks(noise).fine
        of_block = sigma * math.sqrt(len(fine.s) / len(s))
        pieces = partition(fine.s, fine.y, of_block, signal.kind.degrees, (s[0], s[-1]), share)
        rests = _residuals(pieces, s, y)
        found = estimated(rests, signal.step_m, FLOOR_M)
        noise = Noise(found.white_m, min(found.shared_m, tolerance_m), found.length_m)
        tried.append((rests, pieces))
        left = noise.effective_m(signal.step_m)
        if left < SETTLED * sigma:
            break
        sigma = left
    if estimated(rests, signal.step_m, FLOOR_M, LIKELY).shared_m:
        return _at_least(noise, signal.kind.least_m, signal.step_m), pieces
    rests, pieces = tried[0]
    return _at_least(estimated(rests, signal.step_m, FLOOR_M, np.inf), signal.kind.least_m, signal.step_m), pieces


def _at_least(noise: Noise, least_m: float, step_m: float) -> Noise:
    """Return a noise whose standard deviation is at least `least_m`; neighbours share what is added.

    Misalignment that is less than this counts as errors of single points that bend long elements as much.
    """
    lack = least_m**2 - noise.white_m**2 - noise.shared_m**2
    if lack <= 0.0:
        return noise
    if lack <= noise.shared_m**2:
        return Noise(noise.white_m, math.sqrt(noise.shared_m**2 + lack), noise.length_m)
    return Noise(max(noise.effective_m(step_m), SINGLE_SHARE * least_m), math.sqrt(lack), SMOOTHED_M)


def _residuals(pieces: list[Polynomial], s: np.ndarray, y: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """Return the residuals of the polynomials of a partition, and their degrees."""
    made = []
    for piece in pieces:
        first, last = np.searchsorted(s, [piece.start, piece.end])
        if last - first > piece.degree + 1:
            x = (s[first:last] - piece.start) / max(piece.end - piece.start, 1.0)
            base = np.linalg.qr(np.vander(x, piece.degree + 1))[0]
            y_piece = y[first:last] - y[first]
            made.append((y_piece - base @ (base.T @ y_piece), piece.degree))
    return made


def find_structure(
    signal: Signal, tolerance_m: float, least_m: float, jumps: bool, progress: Progress = SILENT
) -> tuple[Chain, Noise]:
    """Return the chain that explains a signal, and the noise that is left; see `noise_of`.

    Parts and ramps have a least length, metres. Where the bend cannot change linearly, it may always jump.
    """
    first, second = progress.divide([1.0, 4.0])
    noise, pieces = noise_of(signal, tolerance_m, first)
    sigma = noise.effective_m(signal.step_m)
    price = max(math.log(len(signal.s) * (noise.white_m / sigma) ** 2), LEAST_PRICE)
    rules = Rules(signal.kind.ramps, jumps or not signal.kind.ramps, least_m, price, signal.kind.shown(noise))
    chain = _from_pieces(pieces, signal.kind.order, rules)
    return searched(chain, signal.blocks(noise), rules, second), noise


def _from_pieces(pieces: Sequence[Polynomial], order: int, rules: Rules) -> Chain:
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


def refitted(chain: Chain, signal: Signal, noise: Noise, least_m: float, held: Held = NOTHING) -> Chain:
    """Return a chain that is fitted as a whole, until its joints rest."""
    blocks = signal.blocks(noise)
    for _ in range(FINAL_ROUNDS):
        before, chain = chain, fitted(chain, blocks.near(chain), least_m, FINAL_STEPS, held)[0]
        if np.abs(chain.knots - before.knots).max() < STILL_M:
            break
    return chain


def started(chain: Chain, signal: Signal, noise: Noise) -> np.ndarray:
    """Return the value at the start of a chain, and with order 2 the slope there, (order,)."""
    return start_of(chain, signal.blocks(noise).near(chain))


BLOCK_M = 4.0
"""Distance between the places where a piece may begin, metres: the search moves the ends afterwards."""

SCALE_M = 300.0
"""Unit of length inside, metres, so that powers of the distance are neither tiny nor huge."""

PIECE_PENALTY, DEGREE_PENALTY = 1.0, 0.5
"""Cost of a piece, and of each degree, in units of the logarithm of the number of points: half of the information
criterion on purpose, because it is easier for the search to unite pieces than to find a missing one."""

LONGEST_M = 1500.0
"""Starts farther behind are dropped, metres; the search unites the pieces of a longer element."""


@dataclass(frozen=True)
class Polynomial:
    """A piece of the signal between two distances, metres, and the degree of its polynomial."""

    start: float
    end: float
    degree: int


def partition(
    s: np.ndarray,
    y: np.ndarray,
    sigma: float,
    degrees: Sequence[int],
    ends: tuple[float, float],
    progress: Progress = SILENT,
) -> list[Polynomial]:
    """Divide a signal into polynomials between two ends; its errors have a standard deviation, metres.

    Each of the degrees that a piece may have is one more than the one before.
    """
    count = max(int(round((ends[1] - ends[0]) / BLOCK_M)), 1)
    bounds = np.linspace(*ends, count + 1)
    firsts = np.searchsorted(s, bounds)
    firsts[-1] = len(s)
    log_n = math.log(max(len(s), 2))
    costs = [(PIECE_PENALTY + DEGREE_PENALTY * degree) * log_n for degree in degrees]
    best, came = np.full(count + 1, np.inf), np.zeros((count + 1, 2), dtype=int)
    best[0] = 0.0
    starts, factors = np.zeros(0, dtype=int), np.zeros((0, degrees[-1] + 1, degrees[-1] + 2))
    rest = np.zeros(0)
    for block in progress.follow(range(count)):
        starts = np.append(starts, block)
        factors = np.concatenate([factors, np.zeros((1, *factors.shape[1:]))])
        rest = np.append(rest, 0.0)
        origin = s[np.minimum(firsts[starts], len(s) - 2)], y[np.minimum(firsts[starts], len(s) - 2)]
        for k in range(firsts[block], firsts[block + 1]):
            _take(factors, rest, (s[k] - origin[0]) / SCALE_M, (y[k] - origin[1]) / sigma)
        rss = _nested(factors, rest, degrees)
        total = best[starts, None] + rss + costs
        at, which = np.unravel_index(np.argmin(total), total.shape)
        best[block + 1], came[block + 1] = total[at, which], (starts[at], which)
        behind = bounds[block + 1] - bounds[starts]
        hopeless = best[starts] + rss[:, -1] + costs[0] > best[block + 1] + costs[-1]
        kept = ~hopeless & (behind < LONGEST_M)
        starts, factors, rest = starts[kept], factors[kept], rest[kept]
    return _traced(came, bounds, degrees)


def _take(factors: np.ndarray, rest: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Add a point to the triangular factors of all starts, by Givens rotations.

    Sums of powers would cancel: y reaches 10 km, and its errors are millimetres.
    """
    size = factors.shape[1]
    row = np.empty((len(x), size + 1))
    row[:, :size] = np.vander(x, size, increasing=True)
    row[:, size] = y
    for i in range(size):
        radius = np.hypot(factors[:, i, i], row[:, i])
        safe = np.where(radius > 0, radius, 1.0)
        cos, sin = np.where(radius > 0, factors[:, i, i], 1.0) / safe, row[:, i] / safe
        upper, lower = factors[:, i, i:].copy(), row[:, i:]
        factors[:, i, i:] = cos[:, None] * upper + sin[:, None] * lower
        row[:, i:] = cos[:, None] * lower - sin[:, None] * upper
    rest += row[:, size] ** 2


def _nested(factors: np.ndarray, rest: np.ndarray, degrees: Sequence[int]) -> np.ndarray:
    """Return the sums of squared residuals of each start, one column per degree."""
    last = factors[:, :, -1] ** 2
    return np.column_stack([rest + last[:, degree + 1 :].sum(axis=1) for degree in degrees])


def _traced(came: np.ndarray, ends: np.ndarray, degrees: Sequence[int]) -> list[Polynomial]:
    """Return the pieces of the cheapest partition, from the start."""
    pieces, block = [], len(ends) - 1
    while block > 0:
        start, which = came[block]
        pieces.append(Polynomial(float(ends[start]), float(ends[block]), degrees[which]))
        block = start
    return pieces[::-1]


@dataclass(frozen=True)
class Blocks:
    """A signal as means over fine and coarse blocks, the first of which begins at `first`, metres; noise of points."""

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
    """What a chain may be made of: whether the bend may change linearly, and whether it may jump.

    `least_m` is the least length of a part or a ramp, and `price` the cost of a parameter, in units of chi-square.
    `shown_m` is the distance of a signal from its curve that no survey shows, metres: up to there, fewer parameters are
    better.
    """

    ramps: bool
    jumps: bool
    least_m: float
    price: float
    shown_m: float = 0.0


def searched(chain: Chain, blocks: Blocks, rules: Rules, progress: Progress = SILENT) -> Chain:
    """Improve the structure of a chain until no change in any window lowers the criterion; blocks have their noise."""
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
    if is_within(now, samples, rules.shown_m):
        fewer = [fitted(one, samples, rules.least_m, FIT_STEPS) for one in candidates if one.size < now.size]
        within = [one for one in fewer if is_within(one[0], samples, rules.shown_m)]
        return (min(within, key=lambda one: one[1])[0], True) if within else (now, False)
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


def is_within(chain: Chain, samples: Samples, limit_m: float) -> bool:
    """Return whether all samples lie within a distance of the curve of a fitted chain."""
    plain = replace(samples, factor=None)
    return bool((np.abs(residuals(chain, plain)) * np.sqrt(plain.variance) <= limit_m).all())


def _hang_together(chain: Chain, samples: Samples) -> bool:
    """Return whether the residuals of a fitted chain are more than noise."""
    rest = residuals(chain, samples)
    total = np.concatenate([[0.0], np.cumsum(rest)])
    return any(
        np.abs(total[width:] - total[:-width]).max() > HANGING * math.sqrt(width)
        for width in (4, 8, 16, 32, 64)
        if width < len(total)
    )


RAMP_M = 8.0
"""Length of a ramp that replaces a jump, metres; the fit lengthens it."""

SPLITS = (0.2, 0.4, 0.6, 0.8)
"""Where a ramp or a part is divided, as shares of its length."""


def simpler(chain: Chain, m: int, ramps: bool, jumps: bool) -> Iterator[Chain]:
    """Yield chains with as many parameters as a chain or fewer, changed at part `m` or at the joint after it."""
    last = len(chain.bends) - 1
    starts, ends = chain.extents
    if 0 < m < last:
        yield from _joined(chain, m, float(starts[m]), float(ends[m]), ramps, jumps)
    if m < last:
        for curved in {chain.curved[m], chain.curved[m + 1]}:
            yield _united(chain, m, curved)
        if jumps and chain.q[m] > chain.p[m]:
            middle = 0.5 * (chain.p[m] + chain.q[m])
            yield _with_joint(chain, m, middle, middle)
    if chain.curved[m] and ends[m] > starts[m]:
        yield _with_curved(chain, m, False)
    if ramps and 0 < m < last and starts[m] < ends[m]:
        middle = 0.5 * (starts[m] + ends[m])
        if chain.q[m - 1] > chain.p[m - 1] and chain.q[m] > chain.p[m]:
            q, p = chain.q.copy(), chain.p.copy()
            q[m - 1] = p[m] = middle
            yield replace(_with_curved(chain, m, True), p=p, q=q)


def richer(chain: Chain, m: int, ramps: bool, jumps: bool, least_m: float) -> Iterator[Chain]:
    """Yield chains with more parameters, changed at part `m` or at the joint after it."""
    starts, ends = chain.extents
    start, end = float(starts[m]), float(ends[m])
    length = end - start
    if not chain.curved[m]:
        yield _with_curved(chain, m, True)
    if m < len(chain.p):
        yield from _richer_joint(chain, m, ramps, least_m)
    for share in SPLITS if length > 3.0 * least_m else ():
        middle = start + share * length
        half = 0.5 * max(least_m, min(0.1 * length, 20.0))
        widths = ([0.0] if jumps else []) + ([half] if ramps else [])
        for width in widths:
            if start + least_m < middle - width and middle + width < end - least_m:
                yield _split(chain, m, [(middle - width, middle + width)])
    if length > 6.0 * least_m:
        for share in (0.3, 0.6):
            a, b = start + (share - 0.1) * length, start + (share + 0.2) * length
            quarter = 0.25 * (b - a) if ramps else 0.0
            yield _split(chain, m, [(a, a + quarter), (b - quarter, b)])


def _richer_joint(chain: Chain, m: int, ramps: bool, least_m: float) -> Iterator[Chain]:
    """Yield chains in which the joint after part `m` has more parameters."""
    starts, ends = chain.extents
    p, q = float(chain.p[m]), float(chain.q[m])
    if not ramps:
        return
    if p == q:
        room = 2.0 * min(p - starts[m], ends[m + 1] - p) - 2.0 * least_m
        for length in (RAMP_M, 0.5 * room):
            if least_m < length <= room:
                yield _with_joint(chain, m, p - 0.5 * length, p + 0.5 * length)
        return
    if q - p > 2.0 * least_m:
        for share in SPLITS:
            middle = p + share * (q - p)
            yield _between(chain, m, middle, middle)
    if q - p > 3.0 * least_m:
        third = (q - p) / 3.0
        yield _between(chain, m, p + third, q - third)
    if q - p > 2.0 * least_m:
        middle, half = 0.5 * (p + q), 0.5 * least_m
        yield _with_joint(chain, m, middle - half, middle + half)


def _joined(chain: Chain, m: int, start: float, end: float, ramps: bool, jumps: bool) -> Iterator[Chain]:
    """Yield chains without part `m`, with one ramp or one jump in its place."""
    p, q = np.delete(chain.p, m), np.delete(chain.q, m - 1)
    bends, curved = np.delete(chain.bends, m), (*chain.curved[:m], *chain.curved[m + 1 :])
    shorter = replace(chain, bends=bends, curved=curved, p=p, q=q)
    if ramps and q[m - 1] > p[m - 1]:
        yield shorter
    if jumps:
        middle = 0.5 * (start + end)
        yield _with_joint(shorter, m - 1, middle, middle)


def _united(chain: Chain, m: int, curved: bool) -> Chain:
    """Return a chain in which parts `m` and `m + 1` are one."""
    starts, ends = chain.extents
    weights = np.maximum((ends - starts)[m : m + 2], 1e-3)
    bends = np.delete(chain.bends, m + 1)
    bends[m] = np.average(chain.bends[m : m + 2], weights=weights) if curved else 0.0
    flags = (*chain.curved[:m], curved, *chain.curved[m + 2 :])
    return replace(chain, bends=bends, curved=flags, p=np.delete(chain.p, m), q=np.delete(chain.q, m))


def _with_curved(chain: Chain, m: int, curved: bool) -> Chain:
    bends = chain.bends.copy()
    bends[m] = bends[m] if curved else 0.0
    return replace(chain, bends=bends, curved=(*chain.curved[:m], curved, *chain.curved[m + 1 :]))


def _with_joint(chain: Chain, j: int, p: float, q: float) -> Chain:
    """Return a chain with another joint `j`."""
    ps, qs = chain.p.copy(), chain.q.copy()
    ps[j], qs[j] = p, q
    return replace(chain, p=ps, q=qs)


def _between(chain: Chain, m: int, start: float, end: float) -> Chain:
    """Return a chain with a further curved part inside the joint after part `m`."""
    p, q = float(chain.p[m]), float(chain.q[m])
    share = (0.5 * (start + end) - p) / (q - p)
    bend = (1.0 - share) * chain.bends[m] + share * chain.bends[m + 1]
    return replace(
        chain,
        bends=np.insert(chain.bends, m + 1, bend),
        curved=(*chain.curved[: m + 1], True, *chain.curved[m + 1 :]),
        p=np.insert(chain.p, m + 1, end),
        q=np.insert(chain.q, m, start),
    )


def _split(chain: Chain, m: int, joints: list[tuple[float, float]]) -> Chain:
    """Return a chain with further joints inside part `m`; the parts between them are curved."""
    count = len(joints)
    return replace(
        chain,
        bends=np.insert(chain.bends, m, np.full(count, chain.bends[m])),
        curved=(*chain.curved[:m], *(True,) * (count + 1), *chain.curved[m + 1 :]),
        p=np.insert(chain.p, m, [p for p, _ in joints]),
        q=np.insert(chain.q, m, [q for _, q in joints]),
    )
