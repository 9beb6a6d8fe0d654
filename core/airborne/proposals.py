"""Guides for a cloud without any: it is searched square by square, finds are chained, and fits along them decide."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import Request
from ..errors import NoRailPointsError, ParameterError
from ..frame import LocalFrame
from ..polyline import Polyline, runs
from ..progress import counted
from ..squares.grid import Key, Tiling
from ..squares.store import SortedFile, append, counts_of, files_of, read_stored
from ..tasks import READ_S, Context, Task, in_listed_order
from .chaining import MIN_LENGTH_M, chains
from .files import survey_files
from .remarks import WIDE_FOOTPRINT_M, refuse_mobile
from .ridges import Shape
from .run import Run
from .search import TILE_M, Finds, search
from .spooling import density_of
from .survey import AirborneTrack, Guide, Survey

SIDE_M = 200.0
"""Side of the squares that are searched: with 40 points per square metre, the points of one take 30 MB."""

TILING = Tiling(SIDE_M, TILE_M)
"""Its margin is a tile: that of a find at the border reaches as far."""

SEARCH_S = 3e-5
"""Run time of the search per point, in seconds."""

REACH_M = 1.0
"""Distance from a chain within which its track is fitted: finds are 0.3 m off at most, and arcs between them 0.5 m."""

APART_M = 0.6
"""Proposals closer than this are the same track."""

STEP_M = 20.0
"""Distance between the vertices of a proposal: few to move by hand, and enough for any curve."""

LEAST_SCORE = 60.0
"""Proposals with a smaller score are left out: on little more than half of their stations, two rails are seen."""


@dataclass(frozen=True)
class ProposedGuide:
    """A line along which a track seems to lie; fields as in `fields.PROPOSED_FIELDS`.

    Attributes
    ----------
    xyz : (n, 3) array
        Local metres.
    """

    xyz: np.ndarray
    guide_id: int
    score: float
    length_m: float


@dataclass(frozen=True)
class Proposals:
    """What the search has found.

    Attributes
    ----------
    guides : tuple of ProposedGuide
    density : float
        Points per square metre.
    """

    guides: tuple[ProposedGuide, ...]
    frame: LocalFrame
    density: float

    @property
    def length_m(self) -> float:
        """Length of all."""
        return sum(one.length_m for one in self.guides)

    @property
    def summary(self) -> str:
        """What was found and what to do next, in a sentence for a log."""
        if not self.guides:
            return "No track was found in the cloud: draw guides, or take them from OpenStreetMap."
        return (
            f"Proposed {counted(len(self.guides), 'guide')}, {self.length_m:,.0f} m in all: delete or move what is "
            "wrong, add what is missing, and run again with them as the guide."
        )


def propose_guides(run: Run) -> Proposals:
    """Search a cloud for tracks.

    Raises
    ------
    CloudError
        A file is damaged, or the cloud is one of mobile lidar.
    DiskError
        The disk is full.
    NoRailPointsError
        The cloud has no points of these classes.
    ParameterError
        The footprint is too wide.
    """
    zero, footprint_m = run.request.zero, run.parameters.footprint_m
    if footprint_m > WIDE_FOOTPRINT_M:
        raise ParameterError(
            f"With a footprint of {footprint_m:g} m, tracks can't be told from roads: draw guides, or take "
            f"them from OpenStreetMap. The search takes up to {WIDE_FOOTPRINT_M:g} m."
        )
    reading, searching, *fitting = run.progress.divide((2.0, 8.0, 1.0, 1.0))
    run.progress.status("Reading the points")
    run.progress.reading()
    files = _sorted(replace(run, progress=reading))
    run.progress.status("Searching for tracks")
    finds, density = _found(replace(run, progress=searching), files)
    refuse_mobile(density)
    flat = [np.column_stack([line, np.zeros(len(line))]) for line in chains(finds)]
    if not flat:
        return Proposals((), zero, density)
    near = replace(run, parameters=replace(run.parameters, reach_m=REACH_M))
    guides = [Guide(number, zero.to_crs(line)[:, :2]) for number, line in enumerate(flat, start=1)]
    survey = survey_files(replace(near, folder=run.folder / "first", progress=fitting[0]), guides)
    guides = list(_with_neighbours(survey))
    if guides:
        survey = survey_files(replace(near, folder=run.folder / "second", progress=fitting[1]), guides)
    return Proposals(tuple(_distinct(survey)), survey.frame, density)


def _with_neighbours(survey: Survey) -> Iterator[Guide]:
    """Yield guides along the lines that were seen, and along the tracks beside them that have no guide yet."""
    tracks = {track.guide_id: track for track in survey.tracks}
    known: list[np.ndarray] = []
    lines, beside = [], []
    for line in sorted(survey.lines, key=lambda one: -one.seen_m):
        coarse = Polyline(Polyline(line.xyz[:, :2]).resampled(STEP_M).xyz)
        if _is_new(coarse.xy, known):
            known.append(line.xyz[:, :2])
            lines.append(coarse.xy)
            beside += [coarse.xy + one.left_m * coarse.normals for one in tracks[line.guide_id].others]
    for xy in beside:
        if _is_new(xy, known):
            known.append(Polyline(xy).resampled(1.0).xyz)
            lines.append(xy)
    for number, xy in enumerate(lines, start=1):
        yield Guide(number, survey.frame.to_crs(np.column_stack([xy, np.zeros(len(xy))]))[:, :2])


def _is_new(xy: np.ndarray, known: list[np.ndarray]) -> bool:
    """Return whether most of a line lies apart from others."""
    if not known:
        return True
    return bool(np.median(cKDTree(np.concatenate(known)).query(xy)[0]) > APART_M)


def _sorted(run: Run) -> list[SortedFile]:
    """Sort the points of all files into squares on disk."""
    request, folder = run.request, run.folder
    tasks = {
        number: Task(header.path.name, sort_file, (request, number, folder), weight=READ_S * (header.point_count + 1))
        for number, header in enumerate(request.headers)
    }
    found = [one for _, one in sorted(run.runner.run(tasks, run.progress), key=lambda pair: pair[0])]
    if not any(one.counts for one in found):
        raise NoRailPointsError(
            f"The {request.where} has no points of class {', '.join(map(str, request.class_codes))}: set the classes."
        )
    return found


def sort_file(request: Request, number: int, folder: Path, context: Context) -> SortedFile:
    """Sort the points of a file into squares and their surroundings; a task."""
    mine, counts = SortedFile.new_folder(folder), Counter[Key]()
    for xyz, _, _, _ in request.read(request.headers[number], context.progress):
        local = request.zero.to_local(xyz)
        for key, chosen in TILING.sort(local).items():
            counts[key] += len(chosen)
            append(mine, key, (local[chosen] - [*(np.array(key) * SIDE_M), 0.0]).astype("<f4"))
    return SortedFile(str(mine), counts)


def _found(run: Run, files: Sequence[SortedFile]) -> tuple[Finds, float]:
    """Search all squares, and return their finds and the median density."""
    shape = Shape.expected(run.parameters.spacing_of(), run.parameters.footprint_m)
    counts = counts_of(files)
    tasks = {
        key: Task(f"The square {key}", search_square, (files_of(key, files), key, shape), weight=SEARCH_S * counts[key])
        for key in sorted(counts)
    }
    rows, densities = [], []
    for found, density in in_listed_order(tasks, run.runner.run(tasks, run.progress)):
        rows += found
        densities.append(density)
    return Finds.joined(rows), float(np.median(densities))


def search_square(
    files: Sequence[str], key: Key, shape: Shape, context: Context
) -> tuple[list[tuple[float, float, float, float]], float]:
    """Search a square, and return its finds and its points per square metre; a task."""
    local = read_stored(files, np.dtype("<f4")).reshape(-1, 3).astype(np.float64)
    corner = np.array(key) * SIDE_M
    found = search(local, np.zeros(2), SIDE_M, shape, context.progress)
    for file in files:
        Path(file).unlink(missing_ok=True)
    moved = [(x + corner[0], y + corner[1], direction, score) for x, y, direction, score in found]
    return moved, float(np.median(density_of(local[:, :2])))


def _distinct(survey: Survey) -> Iterator[ProposedGuide]:
    """Yield the lines that were seen, the longest first, each track once."""
    tracks = {track.guide_id: track for track in survey.tracks}
    known: list[np.ndarray] = []
    number = 0
    for line in sorted(survey.lines, key=lambda one: -one.seen_m):
        away = np.ones(len(line.xyz), dtype=bool)
        if known:
            away = cKDTree(np.concatenate(known)).query(line.xyz[:, :2])[0] > APART_M
        for first, last in runs(away):
            part = Polyline(line.xyz[first : last + 1])
            if part.length_m < MIN_LENGTH_M:
                continue
            score = _score(tracks[line.guide_id], part)
            if score >= LEAST_SCORE:
                number += 1
                drawn = part.resampled(STEP_M)
                yield ProposedGuide(drawn.xyz, number, score, Polyline(drawn.xyz).length_m)
        known.append(line.xyz[:, :2])


def _score(track: AirborneTrack, part: Polyline) -> float:
    """Return the share of the stations along a part of a line on which the track is seen, per cent."""
    near = cKDTree(part.xy).query(track.xyz[:, :2])[0] < STEP_M / 2
    return 100 * float(track.seen[near].mean())
