"""What the points of one section of a track show: its stations, its platforms and wires, and parts of objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..run.tasks import Context
from ..tiles.store import read_stored
from .frame import Course
from .outline import Outline
from .parts import AROUND_M, OTHER, PLATFORM, WIRE, Inside, Parts, parts_of
from .platforms import Edge, edges_of, on_platforms, platforms_of
from .sweep import HALO_M, POINT, SECTION_M
from .vehicles import own_vehicle
from .wires import LIVE_M, Nodes, nodes_of, wire_points

BANDS_M = (0.380, 1.170, 3.250, 4.310, 7.000)
"""Upper ends of the height bands: feet of profiles and platforms, bodies, upper corners, roofs, pantographs."""

THIRD = 3
"""The third nearest point of a station and band counts: one or two stray points do not."""

MOST_POINTS = 2_000_000
"""Points of a section above which only the deepest of each cell of a centimetre is kept near the profile."""

FINE_M = 0.01
"""Side of these cells: a surface that is fitted has hundreds of them."""


@dataclass(frozen=True)
class Rules:
    """What is measured.

    Attributes
    ----------
    outline : Outline
    margin_m : float
        By which the profile is grown.
    widening : (n, 2) array
        On the left and on the right of the stations of the track.
    step_m : float
        Step of the stations of the result.
    """

    outline: Outline
    margin_m: float
    widening: np.ndarray
    step_m: float


@dataclass(frozen=True)
class Points:
    """Points of a section in the frame of their track; (n,) arrays.

    Attributes
    ----------
    s, v, w : array
    depth : array
        Penetration of the profile, margin and widening included.
    code : uint8 array
    is_own : bool array
        Whether a point is in the section itself, not in the halo.
    """

    s: np.ndarray
    v: np.ndarray
    w: np.ndarray
    depth: np.ndarray
    code: np.ndarray
    is_own: np.ndarray

    def kept(self, which: np.ndarray) -> Points:
        """Return some of the points."""
        return Points(*(column[which] for column in vars(self).values()))


@dataclass(frozen=True)
class Least:
    """The three least values of each station, side and band.

    Attributes
    ----------
    cell : (m,) int array
        Number: station times ten, plus band, plus five on the right.
    aside_m, margin_m : (m, 3) arrays
        Distances from the middle and margins, rising; inf where there are fewer points.
    """

    cell: np.ndarray
    aside_m: np.ndarray
    margin_m: np.ndarray

    @classmethod
    def joined(cls, parts: Sequence[Least]) -> Least:
        """Return the least values of several parts."""
        cell = np.repeat(np.concatenate([one.cell for one in parts]), THIRD)
        aside, margin = (
            np.concatenate([getattr(one, name).ravel() for one in parts]) for name in ("aside_m", "margin_m")
        )
        return cls(np.unique(cell), _three(cell, aside), _three(cell, margin))


@dataclass(frozen=True)
class Section:
    """What a section shows.

    Attributes
    ----------
    least : Least
    vehicle : tuple of tuple of float
        Start of the part of the track, v and w of the middles of cells that the own vehicle fills.
    """

    least: Least
    edges: tuple[Edge, ...]
    nodes: Nodes
    parts: Parts
    vehicle: tuple[tuple[float, float, float], ...]


def measure_section(
    courses: Sequence[Course], section: int, files: Sequence[Sequence[str]], rules: Rules, context: Context
) -> Section:
    """Measure a section; a task.

    Given are the track and those around it, and the files of the section before, the section, and the one after it.
    """
    course, own = courses[0], (section * SECTION_M, (section + 1) * SECTION_M)
    points = read_points(course, section, files, rules)
    context.progress.check()
    is_vehicle, cells = own_vehicle(points.s, points.v, points.w)
    points = points.kept(~is_vehicle)
    nodes = nodes_of(points.s, points.v, points.w, lambda s: course.at(s, course.curvature))
    context.progress.check()
    edges = edges_of(points.s, points.v, points.w)
    context.progress.check()
    kind = _kinds(points, edges, nodes)
    return Section(
        least_of(points.kept(points.is_own & (kind != WIRE)), rules),
        tuple(edge for edge in edges if own[0] <= edge.s < own[1]),
        nodes.part((nodes.s >= own[0]) & (nodes.s < own[1])),
        parts_of(_near(points, kind, nodes), courses, own, rules.outline, partial(depth_of, course, rules)),
        cells,
    )


def _kinds(points: Points, edges: Sequence[Edge], nodes: Nodes) -> np.ndarray:
    """Return what points are of, (n,); see `parts.OTHER`."""
    kind = np.full(len(points.s), OTHER, dtype=np.int8)
    kind[on_platforms(platforms_of(0, edges), points.s, points.v, points.w)] = PLATFORM
    kind[wire_points(nodes, points.s, points.v, points.w)] = WIRE
    return kind


def _near(points: Points, kind: np.ndarray, nodes: Nodes) -> Inside:
    """Return the points near the profile."""
    near = np.flatnonzero(points.depth > -AROUND_M)
    s, v, w = points.s[near], points.v[near], points.w[near]
    away = nodes.away(s, v, w) - LIVE_M
    return Inside(
        np.column_stack([s, v, w]), points.depth[near], points.code[near], kind[near], points.is_own[near], away
    )


def read_points(course: Course, section: int, files: Sequence[Sequence[str]], rules: Rules) -> Points:
    """Read the points of a section with its halo, in an order that does not depend on the files."""
    parts = []
    for off, own in zip((-1, 0, 1), files):
        stored = read_stored(own, POINT)
        s = stored["s"].astype(float)
        near = {-1: s >= SECTION_M - HALO_M, 0: np.ones(len(s), dtype=bool), 1: s < HALO_M}[off]
        columns = [stored[name][near] for name in ("v", "w", "code")]
        parts.append((s[near] + (section + off) * SECTION_M, *columns, np.full(int(near.sum()), off == 0)))
    s, v, w, code, is_own = (np.concatenate(column) for column in zip(*parts))
    order = np.lexsort((code, w, v, s))
    s, v, w, code, is_own = (column[order] for column in (s, v, w, code, is_own))
    v, w = v.astype(float), w.astype(float)
    points = Points(s, v, w, depth_of(course, rules, np.column_stack([s, v, w])), code, is_own)
    return points if len(s) <= MOST_POINTS else points.kept(_deepest_of_cells(points))


def depth_of(course: Course, rules: Rules, place: np.ndarray) -> np.ndarray:
    """Return the penetration of points, (n, 3): the distance to the widened profile, plus the margin."""
    s, v, w = place.T
    sides = course.at(s, rules.widening)
    narrowed = np.sign(v) * np.maximum(np.abs(v) - np.where(v > 0, sides[:, 0], sides[:, 1]), 0.0)
    depth = rules.outline.distance(np.column_stack([narrowed, w])) + rules.margin_m
    return np.where(w >= rules.outline.floor_m, depth, -np.inf)


def _deepest_of_cells(points: Points) -> np.ndarray:
    """Return the numbers of the deepest point of each fine cell, rising."""
    cell = np.floor(np.column_stack([points.s, points.v, points.w]) / FINE_M).astype(np.int64)
    cell -= cell.min(axis=0)
    size = cell.max(axis=0) + 1
    number = (cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]
    order = np.lexsort((-points.depth, number))
    first = np.append(True, np.diff(number[order]) != 0)
    return np.sort(order[first])


def least_of(points: Points, rules: Rules) -> Least:
    """Return the three least distances and margins of each station, side and band."""
    band = np.searchsorted(BANDS_M, points.w)
    counts = (points.w >= rules.outline.floor_m) & (band < len(BANDS_M))
    station = np.rint(points.s / rules.step_m).astype(np.int64)
    cell = (2 * len(BANDS_M) * station + len(BANDS_M) * (points.v < 0) + band)[counts]
    aside, margin = np.abs(points.v[counts]), -points.depth[counts]
    return Least(np.unique(cell), _three(cell, aside), _three(cell, margin))


def _three(cell: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return the three least values of each cell in the order of the cells, (m, 3)."""
    order = np.lexsort((value, cell))
    cell, value = cell[order], value[order]
    first = np.flatnonzero(np.append(True, np.diff(cell) != 0)) if len(cell) else np.empty(0, dtype=np.int64)
    found = np.full((len(first), THIRD), np.inf)
    for rank in range(THIRD):
        at = np.minimum(first + rank, len(cell) - 1)
        same = cell[at] == cell[first]
        found[same, rank] = value[at[same]]
    return found
