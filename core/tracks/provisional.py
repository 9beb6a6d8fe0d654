"""Provisional centerline of a track, parallel to its rails, through its sections and from one to the next.

From its stations both rails are met; see docs/method.md section 8.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..rails import RailLine
from .chaining import Chain, RailAhead, rails_ahead, runs_on
from .pairing import RailPair

PROVISIONAL_STEP_M = 0.25
"""Spacing of the vertices: in a tram curve of 25 m the chords deviate by 0.3 mm."""


def provisional_centerline(rails: Sequence[RailLine], chain: Chain, half_m: float, reach_m: float) -> np.ndarray:
    """Draw a line half a spacing from a rail of the track, and straight where there is no rail.

    Parameters
    ----------
    rails : sequence of RailLine
    chain : Chain
    half_m : float
        Half the distance between the rail lines.
    reach_m : float
        Length over which a rail that does not reach the next section is followed.

    Returns
    -------
    (n, 2) array
    """
    left, right = rails_ahead(rails, chain.pairs[-1], 1)
    back_left, back_right = rails_ahead(rails, chain.pairs[0], 0)
    pieces = [_longer(back_right, back_left, half_m, chain.behind_m)[::-1], _inside(rails, chain.pairs[0], half_m)]
    for before, after in zip(chain.pairs, chain.pairs[1:]):
        pieces += [*_between(rails, before, after, half_m, reach_m), _inside(rails, after, half_m)]
    return _joined([*pieces, _longer(left, right, half_m, chain.ahead_m)])


def _joined(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Join consecutive pieces, which may overlap where they meet, into one line, (n, 2)."""
    kept: list[np.ndarray] = []
    for piece in pieces:
        if kept:
            place, last = kept[-1][-2:]
            piece = piece[np.argmax(np.append((piece - last) @ (last - place) > 0, True)) :]
        if len(piece) > 1:
            kept.append(piece)
    return np.concatenate(kept)


def _inside(rails: Sequence[RailLine], pair: RailPair, half_m: float) -> np.ndarray:
    """Follow the left rail of a section."""
    length = abs(pair.left_span[1] - pair.left_span[0])
    return RailAhead.of(rails[pair.left], pair.left_span, 1).at(_steps(-length, 0.0), -half_m)


def _between(
    rails: Sequence[RailLine], before: RailPair, after: RailPair, half_m: float, reach_m: float
) -> Iterator[np.ndarray]:
    """Follow a rail that leads from one section to the next, or one rail from each of them."""
    left, right = rails_ahead(rails, before, 1)
    if before.left == after.left and runs_on(before.left_span, after.left_span):
        yield _followed(left, -half_m, abs(after.left_span[0] - before.left_span[1]))
    elif before.right == after.right and runs_on(before.right_span, after.right_span):
        yield _followed(right, half_m, abs(after.right_span[0] - before.right_span[1]))
    else:
        back_left, back_right = rails_ahead(rails, after, 0)
        apart = np.hypot(*(_middle(left, right) - _middle(back_left, back_right)))
        yield _longer(left, right, half_m, min(apart, reach_m))
        yield _longer(back_right, back_left, half_m, min(apart, reach_m))[::-1]


def _longer(left: RailAhead, right: RailAhead, half_m: float, reach_m: float) -> np.ndarray:
    """Follow the longer one of two rails, left and right as seen outwards."""
    ahead, beside = (left, -half_m) if left.beyond_m >= right.beyond_m else (right, half_m)
    return _followed(ahead, beside, min(ahead.beyond_m, reach_m))


def _followed(ahead: RailAhead, left_m: float, length_m: float) -> np.ndarray:
    """Follow a rail outwards at an offset to its left; nothing is drawn over less than a step."""
    return ahead.at(_steps(0.0, length_m), left_m) if length_m > PROVISIONAL_STEP_M else np.empty((0, 2))


def _middle(left: RailAhead, right: RailAhead) -> np.ndarray:
    """Return the place midway between both rails at the end of a section, (2,)."""
    return (left.at(np.zeros(1)) + right.at(np.zeros(1)))[0] / 2


def _steps(start: float, end: float) -> np.ndarray:
    """Return at least three distances from the start to the end."""
    return np.linspace(start, end, max(int(np.ceil(abs(end - start) / PROVISIONAL_STEP_M)), 2) + 1)
