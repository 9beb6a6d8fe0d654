"""Seams: the lines of neighbouring squares become continuous lines (docs/method.md section 7.2).

The lines of a square are valid up to `HALO_M` beyond its border, so that neighbours show the same rails there. Squares
are added one after another, and each contributes the pieces of its rails that no earlier square shows. Where one piece
continues in another, the first blends into the second over the length that both show, so that no step remains however
the two differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree

from ..frame import LocalFrame
from ..lines.finishing import SAME_RAIL_M, united
from ..polyline import Polyline, interpolate, project, runs
from ..rails import RailLine
from ..tiles.grid import HALO_M, Key, Square, around

CUT_STEP_M = 0.25
"""Spacing of the stations at which lines are cut and compared."""

MIN_MATCH_M = 1.0
"""Lines that are close together over a shorter length only cross or diverge."""

HOLE_STATIONS = 3
"""Near a corner of squares, two of them may show a rail this far apart before a third notices, stations."""
HOLE_M = HOLE_STATIONS * CUT_STEP_M
"""Longest hole that can remain near a corner between the parts of a rail that two squares show; a longer one is filled
by a third square."""

NO_KINDS = np.empty((0, 3))
"""Lengths by strip where there is a single one."""

NO_STRIPS = np.empty((0, 7))
"""Offsets of strips where there is a single one."""

PieceEnd = tuple[int, int]
"""Number of a piece and one of its ends: 0 for the start, 1 for the end."""

LINK_M = MIN_MATCH_M + 2 * CUT_STEP_M
"""A piece continues an open end up to this distance away, even if the match between them is too short to count."""

MAX_SHARED_M = 3 * HALO_M
"""Two squares share 2 `HALO_M` of a rail that crosses their border, and half as much again if it crosses obliquely."""


@dataclass(frozen=True)
class SquareRails:
    """The result of one square: rails in its local metres, cut `HALO_M` outside its border.

    Rails without any length inside are left out. `nodes`, (n, 2), are places where rails end on each other, `strips`,
    (k, 7), offsets of strips at places inside as in `strips.rows_of`, and `blunt` says whether the square shows blunt
    heads; None without lines. `kinds`, (n, 3), has the number of each of several strips and the lengths of the lines on
    which it shows sharp and blunt heads, metres, where it is not known which are blunt.
    """

    square: Square
    rails: tuple[RailLine, ...]
    nodes: np.ndarray
    strips: np.ndarray = field(default_factory=NO_STRIPS.copy)
    blunt: bool | None = None
    kinds: np.ndarray = field(default_factory=NO_KINDS.copy)


def trim(rails: Sequence[RailLine], square: Square, strips: np.ndarray = NO_STRIPS) -> SquareRails:
    """Cut the lines of a square, in its local metres, where they stop being valid, and keep the strips inside."""
    parts: list[RailLine] = []
    for rail in rails:
        cut = rail.line.resampled(CUT_STEP_M)
        stations, t = cut.xy, cut.t
        valid = square.holds(stations, HALO_M)
        if valid.all():
            found = [(rail, square.holds(stations))]
        else:
            found = [
                (rail.between(t[first], t[last]), square.holds(stations[first : last + 1]))
                for first, last in runs(valid)
                if last > first
            ]
        parts += [part for part, inside in found if inside.any()]
    places = np.concatenate([rail.xyz[:, :2] for rail in rails]) if rails else np.empty((0, 2))
    unique, counts = np.unique(places, axis=0, return_counts=True)
    return SquareRails(square, tuple(parts), unique[counts > 1], strips[square.holds(strips[:, :2])])


def rows_in_frame(part: SquareRails, frame: LocalFrame) -> np.ndarray:
    """Return the offsets of strips in a square, (k, 7), with their places in the frame of the cloud."""
    rows = part.strips.copy()
    rows[:, :2] += part.square.frame.shift_to(frame)[:2]
    return rows


@dataclass
class RailPiece:
    """The part of a square's rail that no earlier square shows, in the common frame, between two chainages of the rail.

    `links` has, for each end, 0 or 1, the end of another piece that continues this one; ends that nothing continues are
    missing.
    """

    rail: RailLine
    start: float
    end: float
    links: dict[int, PieceEnd] = field(default_factory=dict)

    def place(self, side: int) -> np.ndarray:
        """Return the position of one end, (2,)."""
        return self.rail.line.at(np.array([self.chainage(side)]))[0, :2]

    def chainage(self, side: int) -> float:
        """Return the chainage of one end."""
        return self.end if side else self.start

    def move_end(self, side: int, chainage: float) -> None:
        """Move one end along the rail."""
        self.start, self.end = (self.start, chainage) if side else (chainage, self.end)


def parts_near(rails: Sequence[RailLine], square: Square, corner: np.ndarray, margin_m: float) -> list[np.ndarray]:
    """Cut out the parts of rails, (n, 2) each, in a square or at most `margin_m` outside.

    Given is the corner of the square, (2,), in the frame of the rails.
    """
    parts = []
    for rail in rails:
        line = rail.xyz[:, :2]
        for first, last in runs(square.holds(line - corner, margin_m)):
            part = line[max(first - 1, 0) : last + 2]
            if len(part) > 1:
                parts.append(part)
    return parts


def new_parts(
    rail: RailLine, known: Sequence[np.ndarray], cut: np.ndarray, square: Square, corner: np.ndarray
) -> list[tuple[float, float]]:
    """Find the parts of a square's rail, from chainage to chainage, that lines of earlier squares do not show.

    Given are these lines, (n, 2) each, whether the rail was `cut` at its start and at its end, and the corner of the
    square, (2,), in the frame of the rail.
    """
    line = rail.line.resampled(CUT_STEP_M)
    stations, t = line.xy, line.t
    seen = np.zeros(len(t), dtype=bool)
    shared = np.flatnonzero(~square.holds(stations - corner, -HALO_M))
    seen[shared[project(known, stations[shared], SAME_RAIL_M).point]] = True
    seen = _without_short_matches(_without_holes(seen, t), t)
    new = ~seen
    if seen.any():
        # One station at a cut end may be unmatched: rounding decides whether the other line reaches as far.
        first, last = np.flatnonzero(seen)[[0, -1]]
        new[:first] &= first > 1 or not cut[0]
        new[last + 1 :] &= last + 2 < len(t) or not cut[1]
    return [(float(t[max(first - 1, 0)]), float(t[min(last + 1, len(t) - 1)])) for first, last in runs(new)]


def _without_holes(seen: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Mark short holes between marked stations as well: one known line ends there and the next begins."""
    filled = seen.copy()
    for first, last in runs(~seen):
        filled[first : last + 1] = first > 0 and last + 1 < len(t) and t[last + 1] - t[first - 1] <= HOLE_M
    return filled


def _without_short_matches(seen: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unmark short runs unless they cover most of the line."""
    kept = np.zeros(len(seen), dtype=bool)
    for first, last in runs(seen):
        kept[first : last + 1] = t[last] - t[first] >= min(MIN_MATCH_M, 0.5 * t[-1])
    return kept


def blended(part: RailLine, side: int, following: RailLine) -> RailLine:
    """Blend one end of a line into the line that continues it, over twice `HALO_M`.

    Where the other line is shorter than that, as near a corner of squares, its last known offset is used. The end is
    the start (`side` 0) or the end (1).
    """
    xyz = (part.xyz if side else part.xyz[::-1]).copy()
    along = Polyline(xyz).t
    share = 1.0 - np.clip((along[-1] - along) / min(2 * HALO_M, along[-1]), 0.0, 1.0)
    last = np.flatnonzero(share > 0)
    target_line = following.line
    feet = target_line.feet(xyz[last, :2], SAME_RAIL_M)
    if not len(feet.point):
        target_line = extended(following.xyz)
        feet = target_line.feet(xyz[last, :2], SAME_RAIL_M)
    if len(feet.point):
        order = np.argsort(feet.point)
        shown = last[feet.point[order]]
        target = target_line.at(feet.t[order])
        offset = interpolate(target - xyz[shown], along[shown], along[last])
        xyz[last] += smooth_step(share[last])[:, None] * offset
    return replace(part, xyz=xyz if side else xyz[::-1])


def extended(xyz: np.ndarray) -> Polyline:
    """Extend a line, (n, 2) or (n, 3), by `HOLE_M` at both ends, with the curvature it has there."""
    line = Polyline(xyz)
    out = np.arange(1, HOLE_STATIONS + 1) * CUT_STEP_M
    ends = [
        3 * xyz[end] - 3 * line.at(abs(side - out)) + line.at(abs(side - 2 * out))
        for end, side in ((0, 0.0), (-1, line.length_m))
    ]
    return Polyline(np.concatenate([ends[0][::-1], xyz, ends[1]]))


def smooth_step(share: np.ndarray) -> np.ndarray:
    """Return the weight of a blend for a share between 0 and 1: it starts and ends without a bend."""
    return 3 * share**2 - 2 * share**3


def join(results: Iterable[SquareRails], frame: LocalFrame) -> list[RailLine]:
    """Join the lines of all squares into whole lines, in local metres of `frame`.

    The result does not depend on the order of the squares. If the cloud is not divided, only rings change: they are
    closed.
    """
    ordered = sorted(results, key=lambda result: result.square.key, reverse=True)
    if len(ordered) == 1 and ordered[0].square.is_whole_plane:
        return [closed_ring(rail) for rail in ordered[0].rails]
    joiner, nodes = _Joiner(), []
    while ordered:
        result = ordered.pop()  # and forget it: memory holds all lines here
        shift = result.square.frame.shift_to(frame)
        joiner.add(result.square, [replace(rail, xyz=rail.xyz + shift) for rail in result.rails], shift[:2])
        nodes.append(result.nodes + shift[:2])
    return _reattached(joiner.lines(), np.concatenate(nodes))


class _Joiner:
    """Collects the new parts of the rails of square after square, and links parts that continue each other."""

    def __init__(self) -> None:
        self._pieces: list[RailPiece] = []
        self._rails: dict[Key, list[RailLine]] = {}
        self._numbers: dict[Key, list[int]] = {}

    def add(self, square: Square, rails: Sequence[RailLine], corner: np.ndarray) -> None:
        """Add the rails of a square whose corner, (2,), and rails are given in the common frame."""
        earlier = [key for key in around(square.key) if key in self._rails]
        known = parts_near([rail for key in earlier for rail in self._rails[key]], square, corner, HALO_M + LINK_M)
        ends, places = self._open_ends([number for key in earlier for number in self._numbers[key]], square, corner)
        count_before = len(self._pieces)
        for rail in rails:
            feet = extended(rail.xyz[:, :2]).feet(places, SAME_RAIL_M)
            on_rail = [(ends[point], t - HOLE_M) for point, t in zip(feet.point, feet.t)]
            cut = ~square.holds(rail.xyz[[0, -1], :2] - corner, HALO_M - CUT_STEP_M)
            for start, end in new_parts(rail, known, cut, square, corner):
                self._add_piece(rail, start, end, cut, on_rail)
        self._rails[square.key], self._numbers[square.key] = list(rails), list(range(count_before, len(self._pieces)))

    def _open_ends(
        self, numbers: Sequence[int], square: Square, corner: np.ndarray
    ) -> tuple[list[PieceEnd], np.ndarray]:
        """List the ends of pieces that nothing continues yet, near the border of a square, and their places, (n, 2)."""
        ends = [(number, side) for number in numbers for side in (0, 1) if side not in self._pieces[number].links]
        places = np.array([self._pieces[number].place(side) for number, side in ends]).reshape(-1, 2)
        near = ~square.holds(places - corner, -2 * HALO_M) & square.holds(places - corner, 2 * HALO_M)
        return [end for end, close in zip(ends, near) if close], places[near]

    def _add_piece(
        self, rail: RailLine, start: float, end: float, cut: np.ndarray, on_rail: list[tuple[PieceEnd, float]]
    ) -> None:
        """Add a piece and link its cut ends to the open ends on its rail, given with their chainages."""
        number, piece = len(self._pieces), RailPiece(rail, start, end)
        self._pieces.append(piece)
        length = rail.line.length_m
        inner = [side for side, is_inner in enumerate((start > 0, end < length)) if is_inner]
        for side in [*inner, *(side for side in np.flatnonzero(cut).tolist() if side not in inner)]:
            self._link(number, side, on_rail)
        if len(inner) == 2 and not piece.links:
            self._pieces.pop()
        elif len(inner) == 1 and inner[0] not in piece.links:
            # The earlier square shows only the line that a branch leaves, and the branch is hidden in it.
            _extend_to_end_of_rail(piece, inner[0], length)

    def _link(self, number: int, side: int, on_rail: list[tuple[PieceEnd, float]]) -> None:
        """Link one end of a new piece to the nearest open end on its rail, if there is one."""
        piece = self._pieces[number]
        free = [
            (abs(t - piece.chainage(side)), t, end) for end, t in on_rail if end[1] not in self._pieces[end[0]].links
        ]
        if not free:
            return
        away, chainage, end = min(free)
        if away <= LINK_M:
            piece.links[side] = end
            self._pieces[end[0]].links[end[1]] = (number, side)
            length = piece.rail.line.length_m
            piece.move_end(side, float(np.clip(chainage, 0.0, length)))

    def lines(self) -> list[RailLine]:
        """Return the lines that the linked pieces form."""
        done: set[int] = set()
        loose = [number for number, piece in enumerate(self._pieces) if len(piece.links) < 2]
        lines = []
        for first in [*loose, *range(len(self._pieces))]:
            if first in done:
                continue
            chain = self._chain(first, 0 if 0 not in self._pieces[first].links else 1)
            done.update(number for number, _ in chain)
            lines.append(closed_ring(united([self._part(number, entered) for number, entered in chain])))
        return lines

    def _chain(self, first: int, entered: int) -> list[PieceEnd]:
        """Follow the links from a piece; returns each piece and the end at which it is entered."""
        chain = [(first, entered)]
        while True:
            number, entered = chain[-1]
            following = self._pieces[number].links.get(1 - entered)
            if following is None or following[0] == first:
                return chain
            chain.append(following)

    def _part(self, number: int, entered: int) -> RailLine:
        """Cut a piece out of its rail, blended into the pieces added after it, in the direction of its chain."""
        piece = self._pieces[number]
        part = piece.rail.between(piece.start, piece.end)
        for side, (other, _) in piece.links.items():
            if other > number:
                part = blended(part, side, self._pieces[other].rail)
        return part.reversed() if entered else part


def _extend_to_end_of_rail(piece: RailPiece, side: int, length: float) -> None:
    """Extend a piece to the end of its rail if the remaining part, which other squares show, is short."""
    rest = length - piece.end if side else piece.start
    if rest <= MAX_SHARED_M:
        piece.move_end(side, length * side)


def closed_ring(line: RailLine) -> RailLine:
    """Make the ends of a ring coincide: their difference is spread over twice `HALO_M` on either side."""
    along = line.line.t
    offset = line.xyz[-1] - line.xyz[0]
    if along[-1] <= 4 * HALO_M or np.hypot(*offset[:2]) > SAME_RAIL_M:
        return line
    share = 1.0 - np.clip(np.minimum(along, along[-1] - along) / (2 * HALO_M), 0.0, 1.0)
    half = np.copysign(0.5, 0.5 * along[-1] - along) * smooth_step(share)
    xyz = line.xyz + half[:, None] * offset
    xyz[-1] = xyz[0]
    return replace(line, xyz=xyz)


def _reattached(lines: Sequence[RailLine], nodes: np.ndarray) -> list[RailLine]:
    """Move ends back onto the line on which they ended before that line was cut or blended."""
    lines = list(lines)
    if not len(nodes) or not lines:
        return lines
    ends = [(number, side) for number in range(len(lines)) for side in (0, -1)]
    places = np.array([lines[number].xyz[side, :2] for number, side in ends])
    at_node = np.isfinite(cKDTree(nodes).query(places, distance_upper_bound=SAME_RAIL_M)[0])
    vertices = np.concatenate([line.xyz[:, :2] for line in lines])
    owner = np.repeat(np.arange(len(lines)), [len(line.xyz) for line in lines])
    tree = cKDTree(vertices)
    for (number, side), place in zip([end for end, node in zip(ends, at_node) if node], places[at_node]):
        away, near = tree.query(place, k=min(8, len(vertices)), distance_upper_bound=CUT_STEP_M + SAME_RAIL_M)
        others = [(gap, index) for gap, index in zip(away, near) if np.isfinite(gap) and owner[index] != number]
        if not others or others[0][0] == 0.0:
            continue
        through = int(owner[others[0][1]])
        lines[number], lines[through] = _attached(lines[number], side, lines[through])
    return lines


def _attached(branch: RailLine, side: int, through: RailLine) -> tuple[RailLine, RailLine]:
    """Move the end of a branch onto a through line and give that line a vertex there, if the end is close to it."""
    place = branch.xyz[side]
    feet = through.line.feet(place[None, :2], SAME_RAIL_M)
    if not len(feet.t):
        return branch, through
    along = through.line.t
    vertex = through.line.at(feet.t)[0]
    nearest = int(np.argmin(np.abs(along - feet.t[0])))
    if abs(along[nearest] - feet.t[0]) <= SAME_RAIL_M:
        vertex = through.xyz[nearest]
    else:
        through = replace(through, xyz=np.insert(through.xyz, np.searchsorted(along, feet.t[0]), vertex, axis=0))
    xyz = branch.xyz.copy()
    xyz[side] = vertex
    return replace(branch, xyz=xyz), through
