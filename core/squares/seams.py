"""Seams: the lines of neighbouring stretches become lines that run through.

Every stretch knows its lines as far as `HALO_M` beyond its border, so that neighbours show the same rails there. The
stretches are laid down one after another, and each adds what those before it do not show yet. Where a piece goes on in
another, the one fades into the other over the length that both show: no step is left, whatever their margins differ by.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..frame import LocalFrame
from ..lines.uniting import SAME_RAIL_M, closed_ring
from ..polyline import interpolate, length_along, project
from ..rails import RailLine
from .laying import Table
from .pieces import STATION_M, SquareRails


def join(results: Iterable[SquareRails], frame: LocalFrame) -> list[RailLine]:
    """Make whole lines of those of all stretches, in the local metres of `frame`.

    A single stretch's lines stay as they are, but for rings, which close; in other cases lines are the same whatever
    order the stretches come in.
    """
    ordered = sorted(results, key=lambda result: result.stretch.key)
    if len(ordered) == 1 and not np.isfinite(ordered[0].stretch.side_m):
        return [closed_ring(rail) for rail in ordered[0].rails]
    table, nodes = Table(), []
    for result in ordered:
        shift = result.stretch.frame.shift_to(frame)
        table.lay(result.stretch, [replace(rail, xyz=rail.xyz + shift) for rail in result.rails], shift[:2])
        nodes.append(result.nodes + shift[:2])
    return _reconnected(table.lines(), np.concatenate(nodes))


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
