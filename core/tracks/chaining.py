"""Chains of sections of track that continue each other: a rail that breaks off does not end the track.

See docs/method.md section 8.5.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from ..rails import RailLine
from .pairing import LEFT, MAX_OVERLAP_M, MIN_SECTION_M, RIGHT, RailPair
from .parallels import MAX_TURN

DIRECTION_M = 1.0
"""Length over which the direction of a section at its end is measured."""

MIN_RADIUS_M = 25.0
"""Radius of the tightest tram curve in which a track may turn in a gap."""

MAX_HIDDEN_M = 30.0
"""Length over which one rail alone leads its track: a coach of 27 m standing next to it hides the other rail."""


@dataclass(frozen=True)
class _Ends:
    """Places from which tracks may continue.

    Place 2 k in `owner`, (n,), is the start of section k, and 2 k + 1 its end; `xy`, (n, 2), is midway between the
    rails, or half their distance from the one that continues, and `outward`, (n, 2), holds unit vectors out of the
    section.
    """

    owner: np.ndarray
    xy: np.ndarray
    outward: np.ndarray

    @classmethod
    def of(
        cls, rails: Sequence[RailLine], pairs: Sequence[RailPair], reach_m: float, linked: set[tuple[int, int]]
    ) -> _Ends:
        """List the ends of all sections, in order, and then the ends of rails up to `reach_m` beyond sections.

        From the ends that are `linked`, given with the number of the rail, the rail leads to another section; there it
        is not followed.
        """
        own, farther = [], []
        for end in range(2 * len(pairs)):
            pair = pairs[end // 2]
            left, right = rails_ahead(rails, pair, end % 2)
            inside = np.array([-DIRECTION_M, 0.0])
            own.append((end, (left.at(inside) + right.at(inside)) / 2))
            half = 0.5 * np.hypot(*(left.at(inside) - right.at(inside))[1]) * (1 if end % 2 else -1)
            for rail, ahead, beside in ((pair.left, left, -half), (pair.right, right, half)):
                beyond = min(ahead.beyond_m, reach_m)
                if beyond > MAX_OVERLAP_M and (end, rail) not in linked:
                    farther.append((end, ahead.at(beyond + inside, beside)))
        owner, places = zip(*own, *farther)
        inner, xy = np.array(places).transpose(1, 0, 2)
        outward = xy - inner
        return cls(np.array(owner), xy, outward / np.linalg.norm(outward, axis=1, keepdims=True))


@dataclass(frozen=True)
class TrackChain:
    """A track: its sections in order, all in the same direction.

    One rail alone may be followed `behind_m` back from the first section, and `ahead_m` on from the last.
    """

    pairs: tuple[RailPair, ...]
    behind_m: float
    ahead_m: float


def single_rail_limit(max_gap_m: float) -> float:
    """Return the length over which one rail alone may lead from one section of track to another."""
    return max(MAX_HIDDEN_M, max_gap_m)


def chain_pairs(
    rails: Sequence[RailLine], pairs: Sequence[RailPair], max_gap_m: float, tolerance_m: float = 0.05
) -> tuple[TrackChain, ...]:
    """Chain sections of track that continue each other.

    Either a rail leads from one to the next, or they point at each other across at most `max_gap_m` without any rail.
    Of several continuations, one along both rails wins, then the straightest and nearest. `tolerance_m` is that of the
    gauge.
    """
    if not pairs:
        return ()
    links = tuple(_rail_links(pairs, single_rail_limit(max_gap_m)))
    partner = _partners(rails, pairs, links, max_gap_m, tolerance_m)
    # At the end of a track, one rail may break off while the other is too short beyond it to be paired again.
    alone_m = dict.fromkeys(range(2 * len(pairs)), max_gap_m + MIN_SECTION_M)
    for link in links:
        for end in (link.first, link.second):
            alone_m[end] = min(alone_m[end], max(link.length_m, 0.0))
    loose = [end for end in alone_m if end not in partner]
    chains: list[TrackChain] = []
    done: set[int] = set()
    for start in loose + list(range(0, 2 * len(pairs), 2)):  # sections that no loose end leads to form rings
        row, last = _follow(pairs, partner, start, done)
        if row:
            behind, ahead = (alone_m[end] if end not in partner else 0.0 for end in (start, last))
            chains.append(TrackChain(tuple(row), behind, ahead))
    return tuple(chains)


def _follow(
    pairs: Sequence[RailPair], partner: dict[int, int], start: int, done: set[int]
) -> tuple[list[RailPair], int]:
    """List the sections from an end on, up to one that is `done`, and the last end; adds them to `done`."""
    row: list[RailPair] = []
    end: int | None = start
    last = start
    while end is not None and end // 2 not in done:
        done.add(end // 2)
        row.append(pairs[end // 2].reversed() if end % 2 else pairs[end // 2])
        last = end ^ 1
        end = partner.get(last)
    return row, last


def _partners(
    rails: Sequence[RailLine],
    pairs: Sequence[RailPair],
    links: Sequence[_RailLink],
    max_gap_m: float,
    tolerance_m: float,
) -> dict[int, int]:
    """Decide which end continues in which; the result contains both directions."""
    linked = {(end, link.rail) for link in links for end in (link.first, link.second)}
    ends = _Ends.of(rails, pairs, single_rail_limit(max_gap_m), linked)
    along_rails = np.sort(np.array([(link.first, link.second) for link in links], dtype=int).reshape(-1, 2))
    along_rails, rail_count = np.unique(along_rails, axis=0, return_counts=True)
    across_gaps = _facing(ends, max_gap_m, tolerance_m)
    places = np.concatenate([along_rails, across_gaps])
    rail_count = np.append(rail_count, np.zeros(len(across_gaps), dtype=int))
    partner: dict[int, int] = {}
    for first, second in ends.owner[places[np.lexsort((_cost(ends, places), -rail_count))]].tolist():
        if first not in partner and second not in partner:
            partner[first], partner[second] = second, first
    return partner


@dataclass(frozen=True)
class _RailLink:
    """Two ends of sections, `first` and `second`, between which a rail continues with the track on the same side."""

    first: int
    second: int
    rail: int
    length_m: float


def _rail_links(pairs: Sequence[RailPair], max_m: float) -> Iterator[_RailLink]:
    """Find the ends between which a rail continues over at most `max_m`; one link for each rail that does."""
    sections = defaultdict(list)
    for number, pair in enumerate(pairs):
        for rail, span, side in ((pair.left, pair.left_span, RIGHT), (pair.right, pair.right_span, LEFT)):
            backward = span[0] > span[1]
            ends = (2 * number + backward, 2 * number + (not backward))
            sections[rail, -side if backward else side].append((min(span), max(span), *ends))
    for (rail, _), along in sections.items():
        along.sort()
        for (_, end_m, _, end), (start_m, _, start, _) in zip(along, along[1:]):
            if -2 * MAX_OVERLAP_M <= start_m - end_m <= max_m:
                yield _RailLink(end, start, rail, start_m - end_m)


def _facing(ends: _Ends, max_gap_m: float, tolerance_m: float) -> np.ndarray:
    """Find the pairs of places that point at each other, (n, 2) indices."""
    overlap_m = MIN_SECTION_M + 2 * MAX_OVERLAP_M  # two rails that continue may overlap
    places = cKDTree(ends.xy).query_pairs(max(max_gap_m, overlap_m), output_type="ndarray")
    places = places[ends.owner[places[:, 0]] // 2 != ends.owner[places[:, 1]] // 2]
    ahead, miss, turn = _across(ends, places)
    fits = (ahead.min(axis=0) >= -overlap_m) & (ahead.max(axis=0) <= max_gap_m)
    open_m = np.maximum(ahead.min(axis=0), 0.0)
    fits &= turn <= MAX_TURN + open_m / MIN_RADIUS_M
    fits &= miss.max(axis=0) <= tolerance_m + np.sin(MAX_TURN) * open_m
    return places[fits]


def _cost(ends: _Ends, places: np.ndarray) -> np.ndarray:
    """Return how unlike one track pairs of places, (n, 2), are, in metres, (n,)."""
    ahead, miss, turn = _across(ends, places)
    return miss.sum(axis=0) + turn * DIRECTION_M + 0.1 * np.abs(ahead).min(axis=0)


def _across(ends: _Ends, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compare pairs of places: distance ahead and offset, (2, n), of each from the other, and angle between, (n,)."""
    a, b = places.T
    gap = ends.xy[b] - ends.xy[a]
    seen = np.array([_along_and_beside(gap, ends.outward[a]), _along_and_beside(-gap, ends.outward[b])])
    cosine, sine = _along_and_beside(ends.outward[a], -ends.outward[b])
    return seen[:, 0], seen[:, 1], np.arctan2(sine, cosine)


def _along_and_beside(vectors: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split vectors, (n, 2), into their component along unit directions and the absolute component across."""
    along = np.einsum("ij,ij->i", vectors, directions)
    return along, np.abs(vectors[:, 0] * directions[:, 1] - vectors[:, 1] * directions[:, 0])


@dataclass(frozen=True)
class RailAhead:
    """A rail in plan, seen outwards from the end of a section at chainage `end_m`.

    `sense` is 1 if chainages increase outwards, otherwise -1.
    """

    line: Polyline
    end_m: float
    sense: int

    @classmethod
    def of(cls, rail: RailLine, span: tuple[float, float], end: int) -> RailAhead:
        """Return a rail seen from the start (`end` 0) or from the end (1) of a section, given by its chainages."""
        return cls(Polyline(rail.xyz[:, :2]), span[end], 1 if span[end] > span[1 - end] else -1)

    @property
    def beyond_m(self) -> float:
        """Length of the rail beyond the section."""
        return float(self.line.length_m - self.end_m if self.sense > 0 else self.end_m)

    def at(self, ahead_m: np.ndarray, left_m: float = 0.0) -> np.ndarray:
        """Return places along the rail, (n, 2), beyond the end of the section, and offset to the left as seen outwards.

        Negative distances are inside the section.
        """
        places = self.line.at(self.end_m + self.sense * ahead_m)
        return places + left_m * Polyline(places).normals if left_m else places


def rails_ahead(rails: Sequence[RailLine], pair: RailPair, end: int) -> tuple[RailAhead, RailAhead]:
    """Return the left and the right rail of a section, seen from its start (`end` 0) or its end (1).

    Left and right refer to the direction of the section.
    """
    return RailAhead.of(rails[pair.left], pair.left_span, end), RailAhead.of(rails[pair.right], pair.right_span, end)


def runs_on(span: tuple[float, float], following: tuple[float, float]) -> bool:
    """Return whether a rail leads forwards from one section to the following one, both given by chainages along it."""
    sense = span[1] - span[0]
    return sense * (following[1] - following[0]) > 0 and sense * (following[1] - span[1]) > 0


MEETING_STEP_M = 0.25
"""Spacing of the stations at which both rails are met, and of the vertices of the provisional line: in a tram curve of
25 m the chords deviate by 0.3 mm."""


def provisional_centerline(rails: Sequence[RailLine], chain: TrackChain, half_m: float, reach_m: float) -> np.ndarray:
    """Draw a line, (n, 2), half a spacing from a rail of the track, and straight where there is no rail.

    A rail that does not reach the next section is followed for `reach_m` at most.
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
    return ahead.at(_steps(0.0, length_m), left_m) if length_m > MEETING_STEP_M else np.empty((0, 2))


def _middle(left: RailAhead, right: RailAhead) -> np.ndarray:
    """Return the place midway between both rails at the end of a section, (2,)."""
    return (left.at(np.zeros(1)) + right.at(np.zeros(1)))[0] / 2


def _steps(start: float, end: float) -> np.ndarray:
    """Return at least three distances from the start to the end."""
    return np.linspace(start, end, max(int(np.ceil(abs(end - start) / MEETING_STEP_M)), 2) + 1)
