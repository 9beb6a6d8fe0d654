"""What the points of one section of a track show: its stations, its platforms and wires, and parts of objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..progress import SILENT, Progress
from ..run.tasks import Context
from ..tiles.store import read_stored
from .frame import Course
from .parts import OTHER, PLATFORM, WIRE, Part, Points, parts_of
from .platforms import edges_of, on_platforms
from .settings import Settings
from .sweep import HALO_M, POINT, SECTION_M
from .vehicles import own_vehicle
from .wires import LIVE_M, away, nodes_of

BANDS_M = (0.380, 1.170, 3.250, 4.310, 7.000)
"""Upper ends of the height bands: feet of profiles and platforms, bodies, upper corners, roofs, pantographs."""

THIRD = 3
"""The third nearest point of a station and band counts: one or two stray points do not."""

MOST_POINTS, FINE_M = 2_000_000, 0.01
"""Points of a section above which only the deepest of each cell is kept, with their number, and the side of these
cells: a surface that is fitted has hundreds of them."""

PIECE_M = 10.0
"""Length of the pieces in which points are put in order, so that a run is cancelled between them."""

Least = tuple[np.ndarray, np.ndarray]
"""Numbers of cells and the `THIRD` least values in each, rising. A cell is a station, side and band: ten times the
station, plus the band, plus five on the right."""


@dataclass(frozen=True)
class Section:
    """What a section shows: least distances from the middle and margins, metres, and parts of objects.

    `edges` and `nodes` are rows of `platforms.edges_of` and of `wires.nodes_of`; `has_vehicle` says whether the vehicle
    of the scanner was left out.
    """

    aside: Least
    margin: Least
    edges: np.ndarray
    nodes: np.ndarray
    parts: list[Part]
    has_vehicle: bool


def measure_section(
    courses: Sequence[Course], section: int, files: Sequence[Sequence[str]], settings: Settings, context: Context
) -> Section:
    """Measure a section; a task.

    Given are the track and those around it, and the files of the section before, the section, and the one after it.
    """
    course, ends = courses[0], (section * SECTION_M, (section + 1) * SECTION_M)
    points = read_points(course, section, files, settings, context.progress)
    is_vehicle = own_vehicle(points.place)
    points = points.kept(~is_vehicle)
    context.progress.check()
    nodes, edges = nodes_of(points.place, course), edges_of(points.place)
    context.progress.check()
    points.kind[on_platforms(edges, points.place)] = PLATFORM
    points.kind[away(nodes, points.place) <= LIVE_M / 2] = WIRE
    parts = parts_of(points, nodes, courses, ends, settings, context.progress)
    edges, nodes = (one[(one[:, 0] >= ends[0]) & (one[:, 0] < ends[1])] for one in (edges, nodes))
    s, v, w = points.place.T
    band = np.searchsorted(BANDS_M, w)
    beside = points.is_own & (points.kind != WIRE) & (w >= settings.outline.floor_m) & (band < len(BANDS_M))
    cell = 2 * len(BANDS_M) * np.rint(s / settings.step_m).astype(np.int64) + len(BANDS_M) * (v < 0) + band
    aside, margin = (least_three(cell[beside], one[beside]) for one in (np.abs(v), -points.depth))
    return Section(aside, margin, edges, nodes, parts, bool(is_vehicle.any()))


def read_points(
    course: Course, section: int, files: Sequence[Sequence[str]], settings: Settings, progress: Progress = SILENT
) -> Points:
    """Read the points of a section with its halo, in an order that does not depend on the files."""
    columns = []
    for off, own in zip((-1, 0, 1), files):
        stored = read_stored(own, POINT)
        s = stored["s"].astype(float) + off * SECTION_M
        near = (s >= -HALO_M) & (s < SECTION_M + HALO_M) & (np.abs(stored["v"]) <= settings.reach_m)
        is_own = np.full(int(near.sum()), off == 0)
        columns.append((s[near] + section * SECTION_M, *(stored[name][near] for name in ("v", "w", "code")), is_own))
    s, v, w, code, is_own = (np.concatenate(column) for column in zip(*columns))
    piece = np.floor(s / PIECE_M).astype(np.int64)
    order = np.argsort(piece, kind="stable")
    parts = []
    for some in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1):
        progress.check()
        some = some[np.lexsort((code[some], w[some], v[some], s[some]))]
        place = np.column_stack([s[some], v[some].astype(float), w[some].astype(float)])
        alone, others = np.ones(len(some), dtype=np.int64), np.full(len(some), OTHER, dtype=np.int8)
        points = Points(place, settings.depth(course, place), code[some], is_own[some], others, alone)
        parts.append(points if len(s) <= MOST_POINTS else _thinned(points))
    return Points(*(np.concatenate(column) for column in zip(*(vars(one).values() for one in parts))))


def _thinned(points: Points) -> Points:
    """Return the deepest point of each fine cell, with the number of points that it stands for."""
    cell = np.floor(points.place / FINE_M).astype(np.int64)
    cell -= cell.min(axis=0)
    order = np.argsort(-points.depth, kind="stable")
    number = np.ravel_multi_index(tuple(cell[order].T), tuple(cell.max(axis=0) + 1))
    _, first, count = np.unique(number, return_index=True, return_counts=True)
    rank = np.argsort(order[first])
    return replace(points.kept(order[first][rank]), number=count[rank])


def least_three(cell: np.ndarray, value: np.ndarray) -> Least:
    """Return the least values of each cell."""
    order = np.lexsort((value, cell))
    cell, value = cell[order], value[order]
    kept = np.append(np.ones(min(len(cell), THIRD), dtype=bool), cell[THIRD:] != cell[:-THIRD])
    return cell[kept], value[kept]


def third_least(parts: Sequence[Least], size: int) -> np.ndarray:
    """Return the third least values of cells, (size,), NaN where there are fewer, given the least ones of sections."""
    found = np.full(size, np.nan)
    if parts:
        cell, value = least_three(*(np.concatenate(column) for column in zip(*parts)))
        at = np.flatnonzero(cell[THIRD - 1 :] == cell[: len(cell) - THIRD + 1]) + THIRD - 1
        at = at[cell[at] < size]
        found[cell[at]] = np.where(np.isfinite(value[at]), value[at], np.nan)
    return found
