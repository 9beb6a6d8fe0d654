"""Stretches of track that continue each other: a rail that breaks off does not end the track."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..rails import RailLine
from .leads import leads
from .pairing import LEFT, MIN_LENGTH_M, OVERLAP_M, RIGHT, RailPair

DIRECTION_M = 1.0
"""Length over which a stretch's direction at its end is measured."""

CONTINUATION = np.radians(10.0)
"""Stretches that continue each other point at each other within this angle, like the ends of rails; besides they may
miss each other by the tolerance of the gauge."""

TIGHTEST_M = 25.0
"""Radius of the tightest tram curve, along which a track turns in a gap."""

HIDDEN_M = 30.0
"""For so long one rail alone tells where its track runs: a coach of 27 m that stands beside hides the other one."""


@dataclass(frozen=True)
class _Ends:
    """Places from which tracks may go on.

    Attributes
    ----------
    owner : (n,) int array
        End that a place belongs to: number 2 k is the start of stretch k and 2 k + 1 its end.
    xy : (n, 2) array
        Midway between the rails, or half their distance beside the one that runs on.
    outward : (n, 2) array
        Unit vectors out of the stretch.
    """

    owner: np.ndarray
    xy: np.ndarray
    outward: np.ndarray

    @classmethod
    def of(
        cls, rails: Sequence[RailLine], pairs: Sequence[RailPair], reach_m: float, led: set[tuple[int, int]]
    ) -> _Ends:
        """Find the ends of all stretches, in order, then up to `reach_m` beyond those of rails that lead to no other.

        `led` holds the ends, with the rail's number, that do lead on.
        """
        own, farther = [], []
        for end in range(2 * len(pairs)):
            pair = pairs[end // 2]
            left, right = leads(rails, pair, end % 2)
            inside = np.array([-DIRECTION_M, 0.0])
            own.append((end, (left.at(inside) + right.at(inside)) / 2))
            half = 0.5 * np.hypot(*(left.at(inside) - right.at(inside))[1]) * (1 if end % 2 else -1)
            for rail, lead, beside in ((pair.left, left, -half), (pair.right, right, half)):
                beyond = min(lead.beyond_m, reach_m)
                if beyond > OVERLAP_M and (end, rail) not in led:
                    farther.append((end, lead.at(beyond + inside, beside)))
        owner, places = zip(*own, *farther)
        inner, xy = np.array(places).transpose(1, 0, 2)
        outward = xy - inner
        return cls(np.array(owner), xy, outward / np.linalg.norm(outward, axis=1, keepdims=True))


@dataclass(frozen=True)
class Chain:
    """A track: its stretches, all seen in one direction and in the order they are met.

    Attributes
    ----------
    pairs : tuple of RailPair
    ahead_m, behind_m : float
        How far one rail alone may be followed past the last stretch, and back from the first.
    """

    pairs: tuple[RailPair, ...]
    behind_m: float
    ahead_m: float


def reach_alone(max_gap_m: float) -> float:
    """How far one rail alone may lead from one stretch of track to another."""
    return max(HIDDEN_M, max_gap_m)


def chain_pairs(
    rails: Sequence[RailLine], pairs: Sequence[RailPair], max_gap_m: float, tolerance_m: float = 0.05
) -> tuple[Chain, ...]:
    """Put stretches of track in a row where they continue each other.

    A rail leads from one to the next, or they point at each other across at most `max_gap_m` without any rail. Of
    several continuations that along both rails wins, then the straightest and nearest.
    """
    if not pairs:
        return ()
    led = tuple(_led(pairs, reach_alone(max_gap_m)))
    partner = _partners(rails, pairs, led, max_gap_m, tolerance_m)
    # At a track's end a rail may break off whose partner comes back too briefly to be matched.
    alone_m = dict.fromkeys(range(2 * len(pairs)), max_gap_m + MIN_LENGTH_M)
    for link in led:
        for end in (link.first, link.second):
            alone_m[end] = min(alone_m[end], max(link.length_m, 0.0))
    loose = [end for end in alone_m if end not in partner]
    chains, done = [], set()
    for start in loose + list(range(0, 2 * len(pairs), 2)):  # what no loose end leads to is a ring
        row, end = [], start
        while end is not None and end // 2 not in done:
            done.add(end // 2)
            row.append(pairs[end // 2].reversed() if end % 2 else pairs[end // 2])
            last, end = end ^ 1, partner.get(end ^ 1)
        if row:
            behind, ahead = (alone_m[end] if end not in partner else 0.0 for end in (start, last))
            chains.append(Chain(tuple(row), behind, ahead))
    return tuple(chains)


def _partners(
    rails: Sequence[RailLine], pairs: Sequence[RailPair], led: Sequence[_Led], max_gap_m: float, tolerance_m: float
) -> dict[int, int]:
    """Say which end continues in which; holds both directions."""
    leading = {(end, link.rail) for link in led for end in (link.first, link.second)}
    ends = _Ends.of(rails, pairs, reach_alone(max_gap_m), leading)
    links = np.sort(np.array([(link.first, link.second) for link in led], dtype=int).reshape(-1, 2))
    links, count = np.unique(links, axis=0, return_counts=True)
    pointed = _pointed(ends, max_gap_m, tolerance_m)
    links = np.concatenate([links, pointed])
    rails_leading = np.append(count, np.zeros(len(pointed), dtype=int))
    partner: dict[int, int] = {}
    for first, second in ends.owner[links[np.lexsort((_cost(ends, links), -rails_leading))]].tolist():
        if first not in partner and second not in partner:
            partner[first], partner[second] = second, first
    return partner


@dataclass(frozen=True)
class _Led:
    """Two ends, `first` and `second`, between which a rail runs on with the track on the same side."""

    first: int
    second: int
    rail: int
    length_m: float


def _led(pairs: Sequence[RailPair], longest_m: float) -> Iterator[_Led]:
    """Find the ends between which a rail runs on, up to `longest_m`; twice where both rails do."""
    stretches = defaultdict(list)
    for number, pair in enumerate(pairs):
        for rail, span, side in ((pair.left, pair.left_span, RIGHT), (pair.right, pair.right_span, LEFT)):
            backward = span[0] > span[1]
            ends = (2 * number + backward, 2 * number + (not backward))
            stretches[rail, -side if backward else side].append((min(span), max(span), *ends))
    for (rail, _), along in stretches.items():
        along.sort()
        for (_, end_m, _, end), (start_m, _, start, _) in zip(along, along[1:]):
            if -2 * OVERLAP_M <= start_m - end_m <= longest_m:
                yield _Led(end, start, rail, start_m - end_m)


def _pointed(ends: _Ends, max_gap_m: float, tolerance_m: float) -> np.ndarray:
    """Find the pairs of places that point at each other, (n, 2) numbers."""
    overlap_m = MIN_LENGTH_M + 2 * OVERLAP_M  # two rails that run on may do so side by side
    places = cKDTree(ends.xy).query_pairs(max(max_gap_m, overlap_m), output_type="ndarray")
    places = places[ends.owner[places[:, 0]] // 2 != ends.owner[places[:, 1]] // 2]
    ahead, miss, turn = _across(ends, places)
    fits = (ahead.min(axis=0) >= -overlap_m) & (ahead.max(axis=0) <= max_gap_m)
    open_m = np.maximum(ahead.min(axis=0), 0.0)
    fits &= turn <= CONTINUATION + open_m / TIGHTEST_M
    fits &= miss.max(axis=0) <= tolerance_m + np.sin(CONTINUATION) * open_m
    return places[fits]


def _cost(ends: _Ends, places: np.ndarray) -> np.ndarray:
    """Say how little pairs of places, (n, 2), look like one track, metres."""
    ahead, miss, turn = _across(ends, places)
    return miss.sum(axis=0) + turn * DIRECTION_M + 0.1 * np.abs(ahead).min(axis=0)


def _across(ends: _Ends, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """See pairs of places from each other: how far ahead, how far beside, (2, n) each, and the angle between, (n,)."""
    a, b = places.T
    gap = ends.xy[b] - ends.xy[a]
    seen = np.array([_along_and_beside(gap, ends.outward[a]), _along_and_beside(-gap, ends.outward[b])])
    cosine, sine = _along_and_beside(ends.outward[a], -ends.outward[b])
    return seen[:, 0], seen[:, 1], np.arctan2(sine, cosine)


def _along_and_beside(vectors: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split vectors, (n, 2), into their length along unit directions and the size of what is across."""
    along = np.einsum("ij,ij->i", vectors, directions)
    return along, np.abs(vectors[:, 0] * directions[:, 1] - vectors[:, 1] * directions[:, 0])
