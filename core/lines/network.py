"""Lines that meet in nodes: what vectorization makes, and smoothing and refinement move."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from .ends import Bridge, cut_back, turned


@dataclass(frozen=True)
class LineNetwork:
    """Polylines in plan, (n, 2) local metres each, and the nodes, (k, 2), in which they meet.

    A line end has the number 2 i for the start of line i and 2 i + 1 for its end; `ends`, (m, 2), are the nodes there,
    of which the first and the last vertex are copies. Every line end is a node. A node of degree 1 is a free end; a
    closed line starts and ends in the same node. `passes`, (p, 3), are node, line and vertex number wherever a line
    passes through a node in which others end or which others cross.
    """

    lines: tuple[np.ndarray, ...]
    nodes: np.ndarray
    ends: np.ndarray
    passes: np.ndarray = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))

    def degrees(self) -> np.ndarray:
        """Count the line ends at each node, (k,); a line that passes counts twice."""
        ending = np.bincount(self.ends.ravel(), minlength=len(self.nodes))
        passing = np.bincount(self.passes[:, 0], minlength=len(self.nodes))
        return ending + 2 * passing

    def lengths(self) -> np.ndarray:
        """Measure each line, (m,) metres."""
        return np.array([np.hypot(*np.diff(line, axis=0).T).sum() for line in self.lines], dtype=float)

    def from_end(self, end: int) -> np.ndarray:
        """Return the vertices of a line from one of its ends inward."""
        return turned(self.lines[end // 2], end)

    def select(self, keep: np.ndarray) -> LineNetwork:
        """Keep the lines marked in `keep`, (m,) bool, and drop nodes and passes that belong to no other line."""
        number = np.cumsum(keep) - 1
        passes = self.passes[keep[self.passes[:, 1]]]
        passes = np.column_stack([passes[:, 0], number[passes[:, 1]], passes[:, 2]])
        lines = tuple(line for line, kept in zip(self.lines, keep) if kept)
        return LineNetwork(lines, self.nodes, self.ends[keep], passes).tidy()

    def span(self, end: int, count: int) -> tuple[int, int]:
        """Return the range of the `count` vertices next to a line end: its first vertex, and one more than its last."""
        length = len(self.lines[end // 2])
        return (length - count, length) if end % 2 else (0, count)

    def meets(self, number: int, first: int, last: int) -> bool:
        """Return whether other lines meet a line at one of its vertices `first` to `last` - 1."""
        return bool(self._passing(number, first, last).any())

    def with_end(self, end: int, vertices: np.ndarray, replaced: int, at: tuple[int, int] | None = None) -> LineNetwork:
        """Give line end `end` other `vertices`, (n, 2) from the end inward, for the `replaced` ones next to it.

        The end has a node of its own; passes at replaced vertices are dropped, others stay in place. With `at`, a line
        and a vertex, the edited line ends there: the vertex is put before the new ones; otherwise the first of these is
        a free end.
        """
        start, passes = vertices, self.passes
        if at is not None:
            start = np.concatenate([self.lines[at[0]][[at[1]]], vertices])
            passes = np.concatenate([passes, [[len(self.nodes), *at]]])
        ends = self.ends.copy()
        ends.flat[end] = len(self.nodes)
        network = LineNetwork(self.lines, np.concatenate([self.nodes, start[:1]]), ends, passes)
        return network._spliced(end // 2, *self.span(end, replaced), turned(start, end))

    def cut_back(self, cuts_m: Mapping[int, float]) -> LineNetwork:
        """Remove lengths from line ends, given by end; each end that is cut becomes free."""
        network = self
        for end, length_m in cuts_m.items():
            if length_m > 0:
                line = network.from_end(end)
                rest = cut_back(line, length_m)
                network = network.with_end(end, rest[:1], len(line) - len(rest) + 1)
        return network

    def _spliced(self, number: int, first: int, last: int, vertices: np.ndarray) -> LineNetwork:
        """Replace the vertices `first` to `last` - 1 of a line."""
        line, lines, passes = self.lines[number], list(self.lines), self.passes.copy()
        lines[number] = np.concatenate([line[:first], vertices, line[last:]])
        passes[self._passing(number, last, len(line)), 2] += len(lines[number]) - len(line)
        return LineNetwork(tuple(lines), self.nodes, self.ends, passes[~self._passing(number, first, last)])

    def _passing(self, number: int, first: int, last: int) -> np.ndarray:
        """Mark the passes of a line at its vertices `first` to `last` - 1, (p,) bool."""
        _, line, vertex = self.passes.T
        return (line == number) & (vertex >= first) & (vertex < last)

    def weld(self, partner: Mapping[int, int], bridges: Mapping[int, np.ndarray] | None = None) -> LineNetwork:
        """Join lines that continue each other into one.

        `partner` has the line end in which each end continues, in both directions; ends that share a node are joined in
        it. `bridges` has the points, (n, 2), from an end to its partner for ends that are apart, in both directions.
        """
        bridges = bridges or {}
        lines: list[np.ndarray] = []
        ends: list[tuple[int, int]] = []
        passes: list[tuple[int, int, int]] = []
        place: dict[int, tuple[int, int, bool]] = {}
        for start in _starts(partner, len(self.lines)):
            if start // 2 in place:
                continue
            pieces: list[np.ndarray] = []
            count, last = 0, start
            end: int | None = start
            while end is not None and end // 2 not in place:
                vertices = self.from_end(end)
                shared = count > 0 and end not in bridges
                if shared:
                    vertices = vertices[1:]
                    passes.append((self.ends.flat[end], len(lines), count - 1))
                place[end // 2] = (len(lines), count - shared, bool(end % 2))
                last, end = end ^ 1, partner.get(end ^ 1)
                new = [vertices, bridges[last]] if last in bridges else [vertices]
                pieces, count = pieces + new, count + sum(map(len, new))
            closed = end is not None
            if closed and last in bridges:
                pieces.append(pieces[0][:1])
            lines.append(np.concatenate(pieces))
            ends.append((self.ends.flat[start], self.ends.flat[start if closed else last]))
        passes += self._moved_passes(place)
        welded_ends, welded_passes = np.array(ends, dtype=np.int64), np.array(passes, dtype=np.int64)
        return LineNetwork(tuple(lines), self.nodes, welded_ends.reshape(-1, 2), welded_passes.reshape(-1, 3)).tidy()

    def bridged(
        self, joins: Mapping[tuple[int, int], Bridge], cuts_m: Mapping[int, float], dropped: Collection[int] = ()
    ) -> LineNetwork:
        """Join pairs of line ends by bridges, each from the first end to the second, and leave out the `dropped` lines.

        `cuts_m` are the lengths cut off ends before the bridges were found; an end that is not joined becomes free.
        """
        cuts_m, partner, points = dict(cuts_m), {}, {}
        keep = ~np.isin(np.arange(len(self.lines)), list(dropped))
        number = np.cumsum(keep) - 1
        for ends, found in joins.items():
            for end, more_m in zip(ends, found.cuts_m):
                cuts_m[end] = cuts_m.get(end, 0.0) + more_m
            one, other = (2 * int(number[end // 2]) + end % 2 for end in ends)
            partner[one], partner[other] = other, one
            points[one], points[other] = found.points, found.points[::-1]
        return self.cut_back(cuts_m).select(keep).weld(partner, points)

    def _moved_passes(self, place: Mapping[int, tuple[int, int, bool]]) -> list[tuple[int, int, int]]:
        """List the passes of joined lines, given each line's new number, first vertex there, and direction."""
        moved = []
        for node, line, vertex in self.passes.tolist():
            number, first, is_reversed = place[line]
            moved.append((node, number, first + (len(self.lines[line]) - 1 - vertex if is_reversed else vertex)))
        return moved

    def tidy(self) -> LineNetwork:
        """Drop passes of a single line and nodes of no line, and renumber the nodes."""
        keep = self.degrees()[self.passes[:, 0]] > 2
        used = np.zeros(len(self.nodes), dtype=bool)
        used[self.ends.ravel()] = True
        used[self.passes[keep, 0]] = True
        number = np.cumsum(used) - 1
        passes = self.passes[keep].copy()
        passes[:, 0] = number[passes[:, 0]]
        return LineNetwork(self.lines, self.nodes[used], number[self.ends], passes)


def _starts(partner: Mapping[int, int], count: int) -> list[int]:
    """List the ends at which joining begins: those without a partner, then any, so that closed loops come last."""
    loose = [end for end in range(2 * count) if end not in partner]
    return loose + list(range(0, 2 * count, 2))
