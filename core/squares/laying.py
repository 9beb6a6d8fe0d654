"""Stretches are laid down one after another, and each adds those parts of rails that none before it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..lines.uniting import HOLE_M, SAME_RAIL_M, closed_ring, faded, prolonged, united
from ..polyline import interpolate, length_along, project, resample, runs
from ..rails import RailLine
from .grid import HALO_M, Key, Square, around
from .pieces import STATION_M

SHORTEST_MATCH_M = 1.0
"""Lines that are close together for a shorter length merely cross or part."""

TIP_M = SHORTEST_MATCH_M + 2 * STATION_M
"""A piece begins within this distance of the tip that it goes on from, even if they match for too short a length."""

LONGEST_SHARED_M = 3 * HALO_M
"""Two stretches show a rail that crosses their border for twice `HALO_M`, and for half as much again askew."""

Tip = tuple[int, int]
"""Number of a piece, and which of its ends: 0 or 1."""


@dataclass
class _Piece:
    """A part of a stretch's rail that no earlier stretch shows, from chainage `start` to `end`.

    `links` names for either end, 0 and 1, the piece and the end that it goes on in.
    """

    rail: RailLine
    start: float
    end: float
    links: dict[int, Tip]

    def tip(self, side: int) -> np.ndarray:
        """Place of one end, (2,)."""
        along = length_along(self.rail.xyz[:, :2])
        return interpolate(self.rail.xyz[:, :2], along, np.array([self.end if side else self.start]))[0]


class Table:
    """Where stretches are laid down."""

    def __init__(self) -> None:
        self._pieces: list[_Piece] = []
        self._rails: dict[Key, list[RailLine]] = {}
        self._numbers: dict[Key, list[int]] = {}

    def lay(self, stretch: Square, rails: Sequence[RailLine], corner: np.ndarray) -> None:
        """Add the rails of one more stretch, whose corner is given in the common frame, (2,)."""
        earlier = [key for key in around(stretch.key) if key in self._rails]
        known = _near([rail for key in earlier for rail in self._rails[key]], stretch, corner)
        tips, places = self._open_tips([number for key in earlier for number in self._numbers[key]], stretch, corner)
        first = len(self._pieces)
        for rail in rails:
            ahead = prolonged(rail.xyz[:, :2])
            feet = project([ahead], places, SAME_RAIL_M)
            near = [(tips[point], t - HOLE_M) for point, t in zip(feet.point, feet.t)]
            cut = ~stretch.holds(rail.xyz[[0, -1], :2] - corner, HALO_M - STATION_M)
            for start, end in _new_runs(rail, known, cut, stretch, corner):
                self._add(rail, start, end, cut, near)
        self._rails[stretch.key], self._numbers[stretch.key] = list(rails), list(range(first, len(self._pieces)))

    def _open_tips(self, numbers: Sequence[int], stretch: Square, corner: np.ndarray) -> tuple[list[Tip], np.ndarray]:
        """List the ends of pieces that nothing goes on from yet, near the border of a stretch, and their places."""
        tips = [(number, side) for number in numbers for side in (0, 1) if side not in self._pieces[number].links]
        places = np.array([self._pieces[number].tip(side) for number, side in tips]).reshape(-1, 2)
        near = ~stretch.holds(places - corner, -2 * HALO_M) & stretch.holds(places - corner, 2 * HALO_M)
        return [tip for tip, close in zip(tips, near) if close], places[near]

    def _add(self, rail: RailLine, start: float, end: float, cut: np.ndarray, tips: list[tuple[Tip, float]]) -> None:
        """Add a piece, and link those of its ends that were cut to the tips on its rail, given with their chainages."""
        number, piece = len(self._pieces), _Piece(rail, start, end, {})
        self._pieces.append(piece)
        length = float(length_along(rail.xyz[:, :2])[-1])
        inner = [side for side, is_inner in enumerate((start > 0, end < length)) if is_inner]
        for side in [*inner, *(side for side in np.flatnonzero(cut).tolist() if side not in inner)]:
            self._connect(number, side, tips)
        if len(inner) == 2 and not piece.links:
            self._pieces.pop()
        elif len(inner) == 1 and inner[0] not in piece.links:
            # A branch hides in the line it leaves, which alone the earlier stretch shows.
            self._give_rest(piece, inner[0], length)

    def _connect(self, number: int, side: int, tips: list[tuple[Tip, float]]) -> None:
        """Link one end of a new piece to the nearest tip on its rail, if there is one."""
        piece = self._pieces[number]
        place = piece.end if side else piece.start
        free = [(abs(t - place), t, tip) for tip, t in tips if tip[1] not in self._pieces[tip[0]].links]
        away, chainage, tip = min(free, default=(np.inf, np.inf, None))
        if away <= TIP_M:
            piece.links[side] = tip
            self._pieces[tip[0]].links[tip[1]] = (number, side)
            length = length_along(piece.rail.xyz[:, :2])[-1]
            self._move_end(piece, side, float(np.clip(chainage, 0.0, length)))

    def _give_rest(self, piece: _Piece, side: int, length: float) -> None:
        """Let a piece reach to the end of its rail, if what others show of that is short."""
        rest = length - piece.end if side else piece.start
        if rest <= LONGEST_SHARED_M:
            self._move_end(piece, side, length * side)

    @staticmethod
    def _move_end(piece: _Piece, side: int, chainage: float) -> None:
        piece.start, piece.end = (piece.start, chainage) if side else (chainage, piece.end)

    def lines(self) -> list[RailLine]:
        """Chain the pieces up."""
        done: set[int] = set()
        loose = [number for number, piece in enumerate(self._pieces) if len(piece.links) < 2]
        lines = []
        for first in [*loose, *range(len(self._pieces))]:
            if first in done:
                continue
            chain = self._chain(first, 0 if 0 not in self._pieces[first].links else 1)
            done.update(number for number, _ in chain)
            lines.append(closed_ring(united([self._cut(number, entered) for number, entered in chain])))
        return lines

    def _chain(self, first: int, entered: int) -> list[Tip]:
        """Follow the links from a piece that is entered at one of its ends; gives pieces and where they are entered."""
        chain = [(first, entered)]
        while True:
            number, entered = chain[-1]
            following = self._pieces[number].links.get(1 - entered)
            if following is None or following[0] == first:
                return chain
            chain.append(following)

    def _cut(self, number: int, entered: int) -> RailLine:
        """Cut a piece out of its rail, faded into those laid after it, and turn it the way the chain runs."""
        piece = self._pieces[number]
        part = piece.rail.between(piece.start, piece.end)
        for side, (other, _) in piece.links.items():
            if other > number:
                part = faded(part, side, self._pieces[other].rail)
        return part.reversed() if entered else part


def _near(rails: Sequence[RailLine], stretch: Square, corner: np.ndarray) -> list[np.ndarray]:
    """Cut out of rails what a stretch may show as well, (n, 2) arrays."""
    parts = []
    for rail in rails:
        line = rail.xyz[:, :2]
        for first, last in runs(stretch.holds(line - corner, HALO_M + TIP_M)):
            part = line[max(first - 1, 0) : last + 2]
            if len(part) > 1:
                parts.append(part)
    return parts


def _new_runs(
    rail: RailLine, known: Sequence[np.ndarray], cut: np.ndarray, stretch: Square, corner: np.ndarray
) -> list[tuple[float, float]]:
    """Chainages of a rail between which none of the known lines shows it; `cut` marks its ends that were cut."""
    stations, t = resample(rail.xyz[:, :2], STATION_M)
    seen = np.zeros(len(t), dtype=bool)
    shared = np.flatnonzero(~stretch.holds(stations - corner, -HALO_M))
    seen[shared[project(known, stations[shared], SAME_RAIL_M).point]] = True
    seen = _without_short(_closed(seen, t), t)
    new = ~seen
    if seen.any():
        # A single station may be missing where a line was cut: rounding decides whether the other reaches as far.
        first, last = np.flatnonzero(seen)[[0, -1]]
        new[:first] &= first > 1 or not cut[0]
        new[last + 1 :] &= last + 2 < len(t) or not cut[1]
    return [(float(t[max(first - 1, 0)]), float(t[min(last + 1, len(t) - 1)])) for first, last in runs(new)]


def _closed(seen: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Mark short runs between marked ones as well: where one known line ends, the next has begun."""
    closed = seen.copy()
    for first, last in runs(~seen):
        closed[first : last + 1] = (
            first > 0 and last + 1 < len(t) and t[min(last + 1, len(t) - 1)] - t[first - 1] <= HOLE_M
        )
    return closed


def _without_short(marked: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unmark short runs, unless they are most of the line."""
    kept = np.zeros(len(marked), dtype=bool)
    for first, last in runs(marked):
        kept[first : last + 1] = t[last] - t[first] >= min(SHORTEST_MATCH_M, 0.5 * t[-1])
    return kept
