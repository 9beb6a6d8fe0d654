"""Where the rails of a track lead: along matched stretches, and from one to the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..rails import RailLine
from .chaining import Chain
from .leads import Lead, leads, runs_on
from .pairing import RailPair

STEP_M = 0.25
"""Vertex distance of the guide: chords of a tram's curve of 25 m keep to 0.3 mm."""


def guide_line(rails: Sequence[RailLine], chain: Chain, half_m: float, reach_m: float) -> np.ndarray:
    """Follow a track half a spacing beside a rail, and straight where there is none; (n, 2).

    Parameters
    ----------
    rails : sequence of RailLine
    chain : Chain
    half_m : float
        Half the distance between the rail lines.
    reach_m : float
        How far beyond a stretch a rail is followed that does not reach the next.
    """
    left, right = leads(rails, chain.pairs[-1], 1)
    back_left, back_right = leads(rails, chain.pairs[0], 0)
    pieces = [_longer(back_right, back_left, half_m, chain.behind_m)[::-1], _inside(rails, chain.pairs[0], half_m)]
    for before, after in zip(chain.pairs, chain.pairs[1:]):
        pieces += [*_between(rails, before, after, half_m, reach_m), _inside(rails, after, half_m)]
    return _joined([*pieces, _longer(left, right, half_m, chain.ahead_m)])


def _joined(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Put pieces in a row that may overlap where they meet; (n, 2)."""
    kept: list[np.ndarray] = []
    for piece in pieces:
        if kept:
            place, last = kept[-1][-2:]
            piece = piece[np.argmax(np.append((piece - last) @ (last - place) > 0, True)) :]
        if len(piece) > 1:
            kept.append(piece)
    return np.concatenate(kept)


def _inside(rails: Sequence[RailLine], pair: RailPair, half_m: float) -> np.ndarray:
    """Follow the left rail of a matched stretch."""
    length = abs(pair.left_span[1] - pair.left_span[0])
    return Lead.of(rails[pair.left], pair.left_span, 1).at(_steps(-length, 0.0), -half_m)


def _between(
    rails: Sequence[RailLine], before: RailPair, after: RailPair, half_m: float, reach_m: float
) -> Iterator[np.ndarray]:
    """Follow a rail that leads from one stretch to the next, or one out of the first and one into the second."""
    left, right = leads(rails, before, 1)
    if before.left == after.left and runs_on(before.left_span, after.left_span):
        yield _followed(left, -half_m, abs(after.left_span[0] - before.left_span[1]))
    elif before.right == after.right and runs_on(before.right_span, after.right_span):
        yield _followed(right, half_m, abs(after.right_span[0] - before.right_span[1]))
    else:
        back_left, back_right = leads(rails, after, 0)
        apart = np.hypot(*(_middle(left, right) - _middle(back_left, back_right)))
        yield _longer(left, right, half_m, min(apart, reach_m))
        yield _longer(back_right, back_left, half_m, min(apart, reach_m))[::-1]


def _longer(left: Lead, right: Lead, half_m: float, reach_m: float) -> np.ndarray:
    """Follow the one of two rails, left and right as seen outwards, that reaches further."""
    lead, beside = (left, -half_m) if left.beyond_m >= right.beyond_m else (right, half_m)
    return _followed(lead, beside, min(lead.beyond_m, reach_m))


def _followed(lead: Lead, left_m: float, length_m: float) -> np.ndarray:
    """Follow a rail outwards on its left; what is shorter than a step has no direction, and is left out."""
    return lead.at(_steps(0.0, length_m), left_m) if length_m > STEP_M else np.empty((0, 2))


def _middle(left: Lead, right: Lead) -> np.ndarray:
    return (left.at(np.zeros(1)) + right.at(np.zeros(1)))[0] / 2


def _steps(start: float, end: float) -> np.ndarray:
    """Distances from the start to the end, at least three."""
    return np.linspace(start, end, max(int(np.ceil(abs(end - start) / STEP_M)), 2) + 1)
