"""Seams: the lines of neighbouring stretches become lines that run through.

Every stretch knows its lines as far as `HALO_M` beyond its border, so that neighbours show the same rails there. The
stretches are laid down one after another, and each adds what those before it do not show yet. Where a piece goes on in
another, the one fades into the other over the length that both show: no step is left, whatever their margins differ by.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from .points import LocalFrame
from .polyline import interpolate, project, resample
from .rails import RailLine, Support, length_along
from .stretches import HALO_M, Key, Stretch, around

SAME_RAIL_M = 0.03
"""Lines this close together are one rail: two rails lie a head apart at least, and copies of one a few millimetres."""

SHORTEST_MATCH_M = 1.0
"""Lines that are close together for a shorter length merely cross or part."""

STATION_M = 0.25
"""Spacing of the stations at which lines are compared."""

HOLE_M = 3 * STATION_M
"""Near a corner of squares, two stretches may show a rail up to so far apart before a third takes notice."""

TIP_M = SHORTEST_MATCH_M + 2 * STATION_M
"""A piece begins within this distance of the tip that it goes on from, even if they match for too short a length."""

LONGEST_SHARED_M = 3 * HALO_M
"""Two stretches show a rail that crosses their border for twice `HALO_M`, and for half as much again askew."""


@dataclass(frozen=True)
class StretchRails:
    """What one stretch gives.

    Attributes
    ----------
    stretch : Stretch
    rails : tuple of RailLine
        In its local metres, cut `HALO_M` outside its border; those with no length inside it are left out.
    nodes : (n, 2) array
        Places where rails end on each other.
    """

    stretch: Stretch
    rails: tuple[RailLine, ...]
    nodes: np.ndarray


def trim(rails: Sequence[RailLine], stretch: Stretch) -> StretchRails:
    """Cut the lines of a stretch where they are no longer good."""
    parts: list[RailLine] = []
    for rail in rails:
        stations, t = resample(rail.xyz[:, :2], STATION_M)
        inside = stretch.holds(stations, HALO_M)
        if inside.all():
            found = [(rail, stretch.holds(stations))]
        else:
            found = [
                (rail.between(t[first], t[last]), stretch.holds(stations[first : last + 1]))
                for first, last in runs(inside)
                if last > first
            ]
        parts += [part for part, own in found if own.any()]
    places = np.concatenate([rail.xyz[:, :2] for rail in rails]) if rails else np.empty((0, 2))
    unique, counts = np.unique(places, axis=0, return_counts=True)
    return StretchRails(stretch, tuple(parts), unique[counts > 1])


def join(results: Iterable[StretchRails], frame: LocalFrame) -> list[RailLine]:
    """Make whole lines of those of all stretches, in the local metres of `frame`.

    A single stretch's lines stay as they are; in other cases lines are the same whatever order the stretches come in.
    """
    ordered = sorted(results, key=lambda result: result.stretch.key)
    if len(ordered) == 1 and not np.isfinite(ordered[0].stretch.side_m):
        return list(ordered[0].rails)
    table, nodes = _Table(), []
    for result in ordered:
        shift = result.stretch.shift_to(frame)
        table.lay(result.stretch, [replace(rail, xyz=rail.xyz + shift) for rail in result.rails], shift[:2])
        nodes.append(result.nodes + shift[:2])
    return _reconnected(table.lines(), np.concatenate(nodes))


@dataclass
class _Piece:
    """A part of a stretch's rail that no earlier stretch shows, from chainage `start` to `end`.

    `links` names for either end, 0 and 1, the piece and the end that it goes on in.
    """

    rail: RailLine
    start: float
    end: float
    links: dict[int, tuple[int, int]]

    def tip(self, side: int) -> np.ndarray:
        """Place of one end, (2,)."""
        along = length_along(self.rail.xyz[:, :2])
        return interpolate(self.rail.xyz[:, :2], along, np.array([self.end if side else self.start]))[0]


class _Table:
    """Where stretches are laid down."""

    def __init__(self) -> None:
        self._pieces: list[_Piece] = []
        self._rails: dict[Key, list[RailLine]] = {}
        self._numbers: dict[Key, list[int]] = {}

    def lay(self, stretch: Stretch, rails: Sequence[RailLine], corner: np.ndarray) -> None:
        """Add the rails of one more stretch, whose corner is given in the common frame."""
        keys = [key for key in around(stretch.key) if key in self._rails]
        earlier = [rail for key in keys for rail in self._rails[key]]
        tips = [
            (number, side)
            for key in keys
            for number in self._numbers[key]
            for side in (0, 1)
            if side not in self._pieces[number].links
        ]
        places = np.array([self._pieces[number].tip(side) for number, side in tips]).reshape(-1, 2)
        near = ~stretch.holds(places - corner, -2 * HALO_M) & stretch.holds(places - corner, 2 * HALO_M)
        tips, places = [tip for tip, close in zip(tips, near) if close], places[near]
        self._rails[stretch.key], self._numbers[stretch.key] = list(rails), []
        known = [rail.xyz[:, :2] for rail in earlier]
        for rail in rails:
            for start, end in _new_runs(rail, known, stretch, corner):
                first = len(self._pieces)
                self._add(rail, start, end, stretch, corner, tips, places)
                self._numbers[stretch.key] += range(first, len(self._pieces))

    def _add(
        self,
        rail: RailLine,
        start: float,
        end: float,
        stretch: Stretch,
        corner: np.ndarray,
        tips: list[tuple[int, int]],
        places: np.ndarray,
    ) -> None:
        """Add a piece, and link those of its ends that lie within the rail to the tips they go on from."""
        number = len(self._pieces)
        self._pieces.append(_Piece(rail, start, end, {}))
        ahead = _prolonged(rail.xyz[:, :2])
        feet = project([ahead], places, SAME_RAIL_M)
        near = [(tips[point], t - HOLE_M) for point, t in zip(feet.point, feet.t)]
        length = float(length_along(ahead)[-1]) - 2 * HOLE_M
        inner = [side for side, is_inner in enumerate((start > 0, end < length)) if is_inner]
        ends = rail.xyz[[0, -1], :2] - corner
        cut = np.flatnonzero(~stretch.holds(ends, HALO_M - STATION_M)).tolist()
        for side in [*inner, *(side for side in cut if side not in inner)]:
            self._connect(number, side, near)
        piece = self._pieces[number]
        if len(inner) == 2 and not piece.links:
            self._pieces.pop()
        elif len(inner) == 1 and inner[0] not in piece.links:
            # A branch hides in the line it leaves, which alone the earlier stretch shows.
            self._give_rest(piece, inner[0], length)

    def _connect(self, number: int, side: int, tips: list[tuple[tuple[int, int], float]]) -> None:
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
            lines.append(united([self._cut(number, entered) for number, entered in chain]))
        return lines

    def _chain(self, first: int, entered: int) -> list[tuple[int, int]]:
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
                part = _faded(part, side, self._pieces[other].rail)
        return part.reversed() if entered else part


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """First and last number of each run of marked items."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]


def _prolonged(line: np.ndarray) -> np.ndarray:
    """Let a line, (n, 2) or (n, 3), run on straight for `HOLE_M` at both ends."""
    along = length_along(line[:, :2])
    inner = interpolate(line, along, np.array([TIP_M, along[-1] - TIP_M]).clip(0.0, along[-1]))
    out = np.array([line[0] - inner[0], line[-1] - inner[1]])
    out *= HOLE_M / np.hypot(*out[:, :2].T)[:, None]
    return np.concatenate([line[:1] + out[0], line, line[-1:] + out[1]])


def _new_runs(
    rail: RailLine, known: Sequence[np.ndarray], stretch: Stretch, corner: np.ndarray
) -> list[tuple[float, float]]:
    """Chainages of a rail between which none of the known lines, (n, 2) arrays, shows it."""
    stations, t = resample(rail.xyz[:, :2], STATION_M)
    seen = np.zeros(len(t), dtype=bool)
    shared = np.flatnonzero(~stretch.holds(stations - corner, -HALO_M))
    if len(shared) and known:
        seen[shared[project(known, stations[shared], SAME_RAIL_M).point]] = True
    seen = _without_short(_closed(seen, t), t)
    new = ~seen
    if seen.any():
        # A single station may be missing where a line was cut: rounding decides whether the other reaches as far.
        first, last = np.flatnonzero(seen)[[0, -1]]
        cut = ~stretch.holds(stations[[0, -1]] - corner, HALO_M - STATION_M)
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


def _faded(part: RailLine, side: int, into: RailLine) -> RailLine:
    """Let one end of a line fade into the line it goes on in, over twice `HALO_M`.

    Where the other does not show it for so long, as near a corner of squares, it is taken to be as far off as there.
    """
    xyz = (part.xyz if side else part.xyz[::-1]).copy()
    along = length_along(xyz[:, :2])
    share = 1.0 - np.clip((along[-1] - along) / min(2 * HALO_M, along[-1]), 0.0, 1.0)
    last = np.flatnonzero(share > 0)
    ahead = into.xyz
    feet = project([ahead[:, :2]], xyz[last, :2], SAME_RAIL_M)
    if not len(feet.point):
        ahead = _prolonged(into.xyz)
        feet = project([ahead[:, :2]], xyz[last, :2], SAME_RAIL_M)
    if len(feet.point):
        order = np.argsort(feet.point)
        shown = last[feet.point[order]]
        target = interpolate(ahead, length_along(ahead[:, :2]), feet.t[order])
        off = interpolate(target - xyz[shown], along[shown], along[last])
        xyz[last] += (3 * share[last] ** 2 - 2 * share[last] ** 3)[:, None] * off
    return replace(part, xyz=xyz if side else xyz[::-1])


def united(parts: Sequence[RailLine]) -> RailLine:
    """Make one line of pieces that begin where the one before ends."""
    if len(parts) == 1:
        only = parts[0]
        return only if only.points == int(only.points) else _with_figures(parts, only.xyz)
    xyz = np.concatenate([parts[0].xyz[:1], *(part.xyz[1:] for part in parts)])
    return _with_figures(parts, xyz)


def _with_figures(parts: Sequence[RailLine], xyz: np.ndarray) -> RailLine:
    """Give a line made of pieces their figures, as if it had been measured as one."""
    lengths = [length_along(part.xyz[:, :2])[-1] for part in parts]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    points = np.array([part.points for part in parts], dtype=float)
    squares = np.array([part.resid_mm**2 for part in parts])
    supports = [part.support for part in parts if part.support is not None]
    support, sigma_mm = None, parts[0].sigma_mm
    if len(supports) == len(parts):
        support = Support(
            np.concatenate([one.t + start for one, start in zip(supports, starts)]),
            np.concatenate([one.points for one in supports]),
            np.concatenate([one.sigma_m for one in supports]),
        )
        sigma_mm = 1000 * support.rms_m if len(support.t) else sigma_mm
    gaps = _merged_gaps(np.concatenate([part.gaps + start for part, start in zip(parts, starts)]))
    return replace(
        parts[0],
        xyz=xyz,
        points=int(round(points.sum())),
        resid_mm=float(np.sqrt((points * squares).sum() / max(points.sum(), 1.0))),
        sigma_mm=sigma_mm,
        bridged_m=float(np.sum(gaps[:, 1] - gaps[:, 0])),
        gaps=gaps,
        support=support,
    )


def _merged_gaps(gaps: np.ndarray) -> np.ndarray:
    """Unite gaps, (k, 2) in order, that touch."""
    if len(gaps) < 2:
        return gaps
    apart = gaps[1:, 0] > gaps[:-1, 1] + SAME_RAIL_M
    return np.column_stack([gaps[np.append(True, apart), 0], gaps[np.append(apart, True), 1]])


def _reconnected(lines: Sequence[RailLine], nodes: np.ndarray) -> list[RailLine]:
    """Bring ends that lay on another line, before that one faded or was cut, onto it again."""
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
        away, near = tree.query(place, k=min(8, len(vertices)), distance_upper_bound=STATION_M + SAME_RAIL_M)
        others = [(gap, index) for gap, index in zip(away, near) if np.isfinite(gap) and owner[index] != number]
        if not others or others[0][0] == 0.0:
            continue
        through = int(owner[others[0][1]])
        lines[number], lines[through] = _set_on(lines[number], side, lines[through])
    return lines


def _set_on(branch: RailLine, side: int, through: RailLine) -> tuple[RailLine, RailLine]:
    """Move the end of a branch onto a through line, which gets a vertex there, if it lies on it."""
    place = branch.xyz[side]
    feet = project([through.xyz[:, :2]], place[None, :2], SAME_RAIL_M)
    if not len(feet.t):
        return branch, through
    along = length_along(through.xyz[:, :2])
    vertex = interpolate(through.xyz, along, feet.t)[0]
    nearest = int(np.argmin(np.abs(along - feet.t[0])))
    if abs(along[nearest] - feet.t[0]) <= SAME_RAIL_M:
        vertex = through.xyz[nearest]
    else:
        through = replace(through, xyz=np.insert(through.xyz, np.searchsorted(along, feet.t[0]), vertex, axis=0))
    xyz = branch.xyz.copy()
    xyz[side] = vertex
    return replace(branch, xyz=xyz), through
