"""Pieces of rails: what a square contributes, which parts of it are new, and how a piece blends into the next.

See docs/method.md section 7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..frame import LocalFrame
from ..lines.finishing import SAME_RAIL_M
from ..polyline import Polyline, interpolate, project, runs
from ..rails import RailLine
from ..tiles.grid import HALO_M, Square

CUT_STEP_M = 0.25
"""Spacing of the stations at which lines are cut and compared."""

MIN_MATCH_M = 1.0
"""Lines that are close together over a shorter length only cross or diverge."""

HOLE_STATIONS = 3
"""Near a corner of squares, two of them may show a rail this far apart before a third notices, stations."""
HOLE_M = HOLE_STATIONS * CUT_STEP_M
"""Longest hole that can remain near a corner between the parts of a rail that two squares show; a longer one is filled
by a third square."""

NO_STRIPS = np.empty((0, 7))
"""Offsets of strips where there is a single one."""

PieceEnd = tuple[int, int]
"""Number of a piece and one of its ends: 0 for the start, 1 for the end."""


@dataclass(frozen=True)
class SquareRails:
    """The result of one square: rails in its local metres, cut `HALO_M` outside its border.

    Rails without any length inside are left out. `nodes`, (n, 2), are places where rails end on each other, `strips`,
    (k, 7), offsets of strips at places inside as in `strips.rows_of`, and `blunt` says whether the square shows blunt
    heads; None without lines.
    """

    square: Square
    rails: tuple[RailLine, ...]
    nodes: np.ndarray
    strips: np.ndarray = field(default_factory=NO_STRIPS.copy)
    blunt: bool | None = None


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
class Piece:
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
