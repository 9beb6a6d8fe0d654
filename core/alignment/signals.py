"""From a signal to its structure: the noise, a first partition, and the search."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..progress import SILENT, Progress
from .chain import NOTHING, Chain, Held, fitted, start_of
from .noise import Noise, estimated, independent_m
from .partition import Piece, partition
from .structure import Blocks, Rules, from_pieces, searched

NOISE_ROUNDS, SETTLED = 8, 1.15
"""Largest number of partitions for the noise, and the growth of the noise below which it is known."""

SHORT_M, RAISED = 10.0, 2.0
"""Mean length of a piece, metres, below which a partition follows the noise, because no track is built of such
elements, and the factor by which the noise is then raised."""

LIKELY = 2.0
"""Standard errors by which the last partition has to show misalignment: to miss it is worse than to see some where
there is none, because the search then bends a track with it."""

SMOOTHED_M = 12.0
"""Distance over which the errors of a smoothed line hang together, metres: about that of the rails of Extract rails."""

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
class Kind:
    """A kind of signal.

    Attributes
    ----------
    order : int
        How many times the bend is integrated.
    degrees : tuple of int
        Of the polynomials in the first partition.
    ramps : bool
        Whether the bend may change linearly.
    least_m : float
        Least standard deviation of the errors, metres.
    """

    order: int
    degrees: tuple[int, ...]
    ramps: bool
    least_m: float = 0.0


LEAST_ERROR_M = 0.001
"""Least standard deviation of a line across and in height, metres: no survey of a track is better. Where single points
scatter by less, the line was smoothed, and what their errors lack is shared by neighbours: the bends of a smooth error
would be taken for elements."""

PLAN, HEIGHT = Kind(2, (1, 2, 3), True, LEAST_ERROR_M), Kind(2, (1, 2), False, LEAST_ERROR_M)
CANT = Kind(1, (0, 1), False)


@dataclass(frozen=True)
class Signal:
    """A signal along a track.

    Attributes
    ----------
    s, y : (n,) array
        Distance and value, metres.
    share : (n,) array
        How much each point counts, 1 for a measured one, 0 in a bridged gap.
    kind : Kind
    """

    s: np.ndarray
    y: np.ndarray
    share: np.ndarray
    kind: Kind

    @property
    def step_m(self) -> float:
        """Mean distance between the points."""
        return float(self.s[-1] - self.s[0]) / max(len(self.s) - 1, 1)

    def blocks(self, noise: Noise) -> Blocks:
        """Return the signal as means, with the noise."""
        return Blocks.of(self.s, self.y, self.share, noise)


def noise_of(signal: Signal, tolerance_m: float, progress: Progress = SILENT) -> tuple[Noise, list[Piece]]:
    """Return the noise of a signal, and the partition for it.

    The finer a partition is, the less is left as noise. From the errors of single points upwards, the noise is raised
    until a partition leaves no more than it was made for. Misalignment raises it at every step; where there is none,
    the first partition remains.

    Parameters
    ----------
    signal : Signal
    tolerance_m : float
        Largest standard deviation of the misalignment.
    progress : Progress
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
        is_short = s[-1] - s[0] < SHORT_M * len(pieces)
        left = noise.effective_m(signal.step_m)
        if left < SETTLED * sigma and not is_short:
            break
        sigma = max(left, RAISED * sigma) if is_short else left
    if estimated(rests, signal.step_m, FLOOR_M, LIKELY).shared_m:
        return _at_least(noise, signal.kind.least_m), pieces
    rests, pieces = tried[0]
    return _at_least(estimated(rests, signal.step_m, FLOOR_M, np.inf), signal.kind.least_m), pieces


def _at_least(noise: Noise, least_m: float) -> Noise:
    """Return a noise whose standard deviation is at least `least_m`; neighbours share what is added."""
    lack = least_m**2 - noise.white_m**2 - noise.shared_m**2
    if lack <= 0.0:
        return noise
    length_m = SMOOTHED_M if lack > noise.shared_m**2 else noise.length_m
    return Noise(noise.white_m, math.sqrt(noise.shared_m**2 + lack), length_m)


def _residuals(pieces: list[Piece], s: np.ndarray, y: np.ndarray) -> list[tuple[np.ndarray, int]]:
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
    """Return the chain that explains a signal, and the noise that is left.

    Parameters
    ----------
    signal : Signal
    tolerance_m : float
        See `noise_of`.
    least_m : float
        Least length of a part or a ramp, metres.
    jumps : bool
        Whether the bend may jump; where it cannot change linearly, it always may.
    progress : Progress
    """
    first, second = progress.divide([1.0, 4.0])
    noise, pieces = noise_of(signal, tolerance_m, first)
    sigma = noise.effective_m(signal.step_m)
    price = max(math.log(len(signal.s) * (noise.white_m / sigma) ** 2), LEAST_PRICE)
    rules = Rules(signal.kind.ramps, jumps or not signal.kind.ramps, least_m, price)
    chain = from_pieces(pieces, signal.kind.order, rules)
    return searched(chain, signal.blocks(noise), rules, second), noise


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
