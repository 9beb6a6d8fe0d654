"""Lines that meet in nodes: what vectorization makes and smoothing keeps together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .ends import cut_back, turned


@dataclass(frozen=True)
class LineNetwork:
    """Polylines in the plane and the nodes in which they meet.

    A line end is addressed by the number 2 i for the start of line i and 2 i + 1 for its end.

    Attributes
    ----------
    lines : tuple of (n, 2) arrays
        Vertices in local metres; the first and the last are copies of their nodes.
    nodes : (k, 2) array
    ends : (m, 2) int array
        Node at the start and at the end of each line. Every line end is a node; a node of degree 1 is a free end; a
        closed loop starts and ends in one node.
    passes : (p, 3) int array
        Node, line and vertex number wherever a line runs through a node in which others end or which others cross.
    """

    lines: tuple[np.ndarray, ...]
    nodes: np.ndarray
    ends: np.ndarray
    passes: np.ndarray = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))

    def degrees(self) -> np.ndarray:
        """Count the line ends at each node, a passing line counting as two, (k,)."""
        ending = np.bincount(self.ends.ravel(), minlength=len(self.nodes))
        passing = np.bincount(self.passes[:, 0], minlength=len(self.nodes))
        return ending + 2 * passing

    def lengths(self) -> np.ndarray:
        """Measure each line, (m,) metres."""
        return np.array([np.hypot(*np.diff(line, axis=0).T).sum() for line in self.lines], dtype=float)

    def from_end(self, end: int) -> np.ndarray:
        """Vertices of the line seen from one of its ends."""
        return turned(self.lines[end // 2], end)

    def select(self, keep: np.ndarray) -> LineNetwork:
        """Keep the lines marked in `keep`, (m,) bool, and forget nodes and passes that nothing else touches."""
        number = np.cumsum(keep) - 1
        passes = self.passes[keep[self.passes[:, 1]]]
        passes = np.column_stack([passes[:, 0], number[passes[:, 1]], passes[:, 2]])
        lines = tuple(line for line, kept in zip(self.lines, keep) if kept)
        return LineNetwork(lines, self.nodes, self.ends[keep], passes).tidy()

    def span(self, end: int, count: int) -> tuple[int, int]:
        """Return the first of the `count` vertices next to a line end, and the one after the last."""
        length = len(self.lines[end // 2])
        return (length - count, length) if end % 2 else (0, count)

    def meets(self, number: int, first: int, last: int) -> bool:
        """Return whether other lines meet line `number` at its vertices `first` to `last` - 1."""
        return bool(self._passing(number, first, last).any())

    def with_piece(self, number: int, first: int, last: int, vertices: np.ndarray) -> LineNetwork:
        """Redraw a line between two of its vertices; passes keep their places, those between the two are dropped.

        Parameters
        ----------
        number : int
            Line to edit.
        first, last : int
            Its vertices next to the new ones; both stay.
        vertices : (n, 2) array
            What replaces the vertices between them, in the line's direction.
        """
        return self._spliced(number, first + 1, last, vertices)

    def with_end(self, end: int, vertices: np.ndarray, replaced: int, at: tuple[int, int] | None = None) -> LineNetwork:
        """Give a line a new end with a node of its own; passes at replaced vertices are dropped, others stay in place.

        Parameters
        ----------
        end : int
            Line end to edit.
        vertices : (n, 2) array
            New vertices seen from this end, before those that stay.
        replaced : int
            Number of vertices, seen from this end, that the new ones replace.
        at : tuple of int, optional
            Line and vertex where the edited line is to end; the vertex is put before the new ones. Without it the line
            ends in the first new vertex, freely.
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
        """Remove lengths from line ends; each end that is cut becomes free."""
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

    def parted(self) -> tuple[LineNetwork, dict[int, int]]:
        """Cut all lines at the nodes that they pass, and say which ends belong together, as `weld` takes it."""
        lines, ends, partner = [], [], {}
        for number, (line, own) in enumerate(zip(self.lines, self.ends.tolist())):
            passes = self.passes[self.passes[:, 1] == number]
            passes = passes[np.argsort(passes[:, 2], kind="stable")]
            vertices, nodes = [0, *passes[:, 2].tolist(), len(line) - 1], [own[0], *passes[:, 0].tolist(), own[1]]
            for piece in range(len(nodes) - 1):
                if piece:
                    partner[2 * len(lines)], partner[2 * len(lines) - 1] = 2 * len(lines) - 1, 2 * len(lines)
                lines.append(line[vertices[piece] : vertices[piece + 1] + 1])
                ends.append(nodes[piece : piece + 2])
        return LineNetwork(tuple(lines), self.nodes, np.array(ends, dtype=np.int64).reshape(-1, 2)), partner

    def weld(self, partner: Mapping[int, int], bridges: Mapping[int, np.ndarray] | None = None) -> LineNetwork:
        """Make one line of lines that continue each other.

        Parameters
        ----------
        partner : mapping of end to end
            Which line end continues in which; holds both directions. Ends that share a node are welded in it.
        bridges : mapping of end to (n, 2) array, optional
            Points between an end and its partner, in this direction, for ends that lie apart; both directions.
        """
        bridges = bridges or {}
        lines, ends, passes = [], [], []
        place: dict[int, tuple[int, int, bool]] = {}
        for start in _starts(partner, len(self.lines)):
            if start // 2 in place:
                continue
            pieces, count, end = [], 0, start
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

    def _moved_passes(self, place: Mapping[int, tuple[int, int, bool]]) -> list[tuple[int, int, int]]:
        """Say where the passes of welded lines are now, given each line's new number, first vertex and sense."""
        moved = []
        for node, line, vertex in self.passes.tolist():
            number, first, turned = place[line]
            moved.append((node, number, first + (len(self.lines[line]) - 1 - vertex if turned else vertex)))
        return moved

    def tidy(self) -> LineNetwork:
        """Forget passes in which no second line takes part, and nodes that no line touches; number the rest anew."""
        keep = self.degrees()[self.passes[:, 0]] > 2
        used = np.zeros(len(self.nodes), dtype=bool)
        used[self.ends.ravel()] = True
        used[self.passes[keep, 0]] = True
        number = np.cumsum(used) - 1
        passes = self.passes[keep].copy()
        passes[:, 0] = number[passes[:, 0]]
        return LineNetwork(self.lines, self.nodes[used], number[self.ends], passes)


def _starts(partner: Mapping[int, int], count: int) -> list[int]:
    """List ends to begin welding at: first the loose ones, then any, so that only closed loops are left for these."""
    loose = [end for end in range(2 * count) if end not in partner]
    return loose + list(range(0, 2 * count, 2))
