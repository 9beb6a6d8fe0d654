"""From a signal to its structure: the noise, a first partition into polynomials, and the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..progress import SILENT, Progress
from .chain import NOTHING, Chain, Held, Span, assembled, fitted, start_of
from .noise import Noise, estimated, independent_m
from .structure import Blocks, Rules, searched

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

LEAST_ERROR_M = 0.001
"""Least standard deviation of a line across and in height, metres: no survey of a track is better. Where single points
scatter by less, the line was smoothed, and what their errors lack is shared by neighbours: the bends of a smooth error
would be taken for elements."""

PLAN, HEIGHT = SignalKind(2, (1, 2, 3), True, LEAST_ERROR_M), SignalKind(2, (1, 2), False, LEAST_ERROR_M)
CANT = SignalKind(1, (0, 1), False, shown_m=math.sqrt(2.0) * LEAST_ERROR_M)
"""Kinds of signals. Cant is the difference of two heights."""


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
