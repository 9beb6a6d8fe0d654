"""Stretches of track that continue each other: a rail that breaks off does not end the track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .pairing import OVERLAP_M, RailPair
from .polyline import interpolate
from .rails import RailLine, length_along

DIRECTION_M = 1.0
"""Length over which a stretch's direction at its end is measured."""

SINE_CONTINUATION = np.sin(np.radians(10.0))
"""Stretches that continue each other point at each other within this angle, like the ends of rails."""

MISS_M = 0.05
"""Stretches may in addition miss each other by the tolerance of the gauge."""


@dataclass(frozen=True)
class _Ends:
    """Both ends of all stretches; number 2 k is the start of stretch k and 2 k + 1 its end.

    Attributes
    ----------
    xy : (2 n, 2) array
        Midway between the rails.
    outward : (2 n, 2) array
        Unit vectors out of the stretch.
    """

    xy: np.ndarray
    outward: np.ndarray

    @classmethod
    def of(cls, rails: Sequence[RailLine], pairs: Sequence[RailPair]) -> _Ends:
        seen = [
            (_place(rails[pair.left], pair.left_span, end) + _place(rails[pair.right], pair.right_span, end)) / 2
            for pair in pairs
            for end in (0, 1)
        ]
        xy, inner = np.array(seen).transpose(1, 0, 2)
        outward = xy - inner
        return cls(xy, outward / np.linalg.norm(outward, axis=1, keepdims=True))


def _place(rail: RailLine, span: tuple[float, float], end: int) -> np.ndarray:
    """Where a span starts (`end` 0) or ends (1), and a little inside of that; (2, 2)."""
    inward = np.sign(span[1 - end] - span[end]) * DIRECTION_M
    return interpolate(rail.xyz[:, :2], length_along(rail.xyz[:, :2]), np.array([span[end], span[end] + inward]))


def chain_pairs(
    rails: Sequence[RailLine], pairs: Sequence[RailPair], max_gap_m: float
) -> tuple[tuple[RailPair, ...], ...]:
    """Put stretches of track in a row where they continue each other across at most `max_gap_m`.

    Of several continuations the straightest and nearest wins.

    Returns
    -------
    tuple of tuple of RailPair
        One row a track, its stretches all seen in one direction and in the order they are met.
    """
    if not pairs:
        return ()
    partner = _partners(_Ends.of(rails, pairs), max_gap_m)
    loose = [end for end in range(2 * len(pairs)) if end not in partner]
    rows, done = [], set()
    for start in loose + list(range(0, 2 * len(pairs), 2)):  # what no loose end leads to is a ring
        row, end = [], start
        while end is not None and end // 2 not in done:
            done.add(end // 2)
            row.append(pairs[end // 2].reversed() if end % 2 else pairs[end // 2])
            end = partner.get(end ^ 1)
        if row:
            rows.append(tuple(row))
    return tuple(rows)


def _partners(ends: _Ends, max_gap_m: float) -> dict[int, int]:
    """Say which end continues in which; holds both directions."""
    a, b = cKDTree(ends.xy).query_pairs(max_gap_m + 2 * OVERLAP_M, output_type="ndarray").T
    gap = ends.xy[b] - ends.xy[a]
    ahead, miss = _along_and_beside(gap, ends.outward[a])
    ahead_back, miss_back = _along_and_beside(-gap, ends.outward[b])
    turn, _ = _along_and_beside(ends.outward[a], -ends.outward[b])
    nearest, furthest = np.minimum(ahead, ahead_back), np.maximum(ahead, ahead_back)
    fits = (a // 2 != b // 2) & (turn > np.sqrt(1 - SINE_CONTINUATION**2))
    fits &= (nearest >= -2 * OVERLAP_M) & (furthest <= max_gap_m)
    fits &= np.maximum(miss, miss_back) <= MISS_M + SINE_CONTINUATION * np.abs(nearest)
    cost = miss + miss_back + np.arccos(np.clip(turn, -1, 1)) * DIRECTION_M + 0.1 * np.abs(nearest)
    partner: dict[int, int] = {}
    for first, second in np.column_stack([a, b])[fits][np.argsort(cost[fits], kind="stable")].tolist():
        if first not in partner and second not in partner:
            partner[first], partner[second] = second, first
    return partner


def _along_and_beside(vectors: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split vectors, (n, 2), into their length along unit directions and the size of what is across."""
    along = np.einsum("ij,ij->i", vectors, directions)
    return along, np.abs(vectors[:, 0] * directions[:, 1] - vectors[:, 1] * directions[:, 0])
