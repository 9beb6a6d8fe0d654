"""Sorts the points of a raw cloud into squares on disk and finds the rail points square by square.

The files are read once; memory holds one square and its margin (docs/classification.md).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..classify.guide import MIDDLE_M, Guide
from ..classify.level import on_one_level
from ..classify.settings import MARGIN_M, Settings, Way
from ..classify.square import Classified, classify_square
from ..classify.tops import LOW_M
from ..classify.ways import any_sharp, blunt_among, search_alike, searched_alone
from ..clouds.passes import sources_of
from ..clouds.points import Request, read_each, strips_of
from ..clouds.readers import CloudHeader, read_points
from ..errors import CloudError, NoRailPointsError, ParameterError
from ..frame import LocalFrame
from ..learned.model import Classifier, label_square
from ..progress import SILENT, Progress, counted
from ..rails import ENOUGH_CELLS_PER_M, SearchFigures
from ..run.tasks import Context, Runner, Task
from ..standards import LAST_CLASS
from ..tiles.grid import Key, Square, Tiling
from ..tiles.store import SortedFile, append, counts_of, files_of, read_stored, sources_among

POINT = np.dtype([("xyz", "<f8", 3), ("number", "<i8"), ("mark", "<u4")])
"""A point on disk: coordinates in units of the CRS, its number among all points of all files, and its mark, see
`passes.marks_of`, or its class."""

SEARCH_S = 1e-6
"""Run time of the search per point, in seconds; a network takes ten times as long."""

FEW_IN_SQUARE, MANY_SQUARES = 20, 100
"""Chunks of points that are spread over more squares than this, with fewer points in each, are not in the unit that the
file states: a square of 41 m with rails has thousands of points, and each square becomes a file."""


@dataclass(frozen=True)
class Found:
    """The rail points of a square: `xyz`, (k, 3) in units of the CRS, and their numbers among all points of all files.

    `marks`, (k,), tell their passes apart, as in `passes.marks_of`. `fills`: they are those of blunt sources, while
    others of the cloud are sharp.
    """

    xyz: np.ndarray
    number: np.ndarray
    marks: np.ndarray
    figures: SearchFigures
    fills: bool = False


def find_rail_points(
    request: Request, settings: Settings, folder: Path, runner: Runner, progress: Progress = SILENT
) -> Iterator[Found]:
    """Find the points on railheads, square by square, in the searched classes and the extent of a request.

    Yields squares with rails only, in the same order with any runner, which executes one task per file and one per
    square and decides whether errors of single ones end the run. The caller removes the folder, empty at first, that
    gets the points of the squares, 36 bytes each and a third more for those near borders. Raises CloudError if a file
    is damaged (if the runner tolerates that, all of them) or its points are too far apart, and NoRailPointsError if the
    extent contains no points.
    """
    reading, searching = progress.divide((1.0, 3.0))
    request.announce(progress)
    sorted_files = sort_files(request, settings, folder, runner, reading)
    counts = counts_of(sorted_files)
    if not counts:
        raise _nothing_to_search(request, settings.guide)
    progress.status("Searching for rails")
    search = Search(sorted_files, request.zero, settings, runner, searching, request.is_of_images())
    for found in search.all():
        if found.figures != SearchFigures():
            yield found


@dataclass
class Search:
    """The search of a cloud whose points are sorted into squares, as a sharp or a blunt one, or source by source."""

    sorted_files: Sequence[SortedFile]
    zero: LocalFrame
    settings: Settings
    runner: Runner
    progress: Progress
    of_images: bool = False
    searched: int = 0

    def all(self) -> Iterator[Found]:
        """Search all squares: if some of its sources are blunt and others sharp, each kind in its own way."""
        counts, sources = counts_of(self.sorted_files), sources_among(self.sorted_files)
        alone = searched_alone({one: _fullest(own) for one, own in sources.items()}, self._seen)
        blunt = blunt_among(alone)
        if not blunt:
            yield from search_alike(_fullest(counts), self._alike, self.of_images, any_sharp(alone))
            return
        for way in (Way.SHARP, Way.BLUNT):
            is_blunt = way is Way.BLUNT
            own = frozenset(one for one in sources if (one in blunt) == is_blunt)
            keys = _fullest(sum((Counter(sources[one]) for one in own), Counter()))
            tasks = {key: self._task(key, way, own) for key in keys}
            for _, found in self.runner.run(tasks, self.progress.span(0.5 * is_blunt, 0.5 + 0.5 * is_blunt)):
                yield replace(found, fills=True, figures=found.figures.filling) if is_blunt else found

    def _seen(self, parts: Sequence[tuple[int, Key]]) -> Iterator[tuple[int, SearchFigures]]:
        """Search squares for the rails of one source each, as if it were sharp."""
        tasks = {part: self._task(part[1], Way.SHARP, frozenset(part[:1])) for part in parts}
        for (source, _), found in self.runner.run(tasks, self.progress.span(0.0, 0.0)):
            yield source, found.figures

    def _alike(self, keys: Sequence[Key], way: Way) -> Iterator[Found]:
        """Search squares for the rails of all sources."""
        count = len(counts_of(self.sorted_files))
        start, self.searched = self.searched, min(self.searched + len(keys), count)
        tasks = {key: self._task(key, way) for key in keys}
        for _, found in self.runner.run(tasks, self.progress.span(start / count, self.searched / count)):
            yield found

    def _task(self, key: Key, way: Way, sources: frozenset[int] | None = None) -> Task:
        """Make the task that searches a square for the rails of some sources, or of all."""
        weight = SEARCH_S * sum(one.counts.get(key, 0) for one in self.sorted_files)
        square = Square.on_grid(key, self.settings.side_m, self.zero)
        settings = replace(self.settings.at(key), way=way)
        arguments = (square, files_of(key, self.sorted_files), settings, sources)
        return Task(f"Searching square {key}", _search, arguments, weight=weight)


def _fullest(counts: Mapping[Key, int]) -> list[Key]:
    """List squares in the order of their numbers of points, the largest first."""
    return sorted(counts, key=lambda key: (-counts[key], key))


def _nothing_to_search(request: Request, guide: Guide | None) -> NoRailPointsError:
    where = request.where
    if guide is not None:
        return NoRailPointsError(
            f"The {where} has no point within {guide.distance_m:g} m of the guide: check the guide's place and "
            "coordinate system."
        )
    return NoRailPointsError(f"The {where} contains no points that are neither noise nor withheld: choose another.")


def guide_of(request: Request, lines: Sequence[np.ndarray], distance_m: float, only: bool) -> Guide:
    """Return the guide along lines, (k, 2) or (k, 3) in units of the CRS; one that comes nowhere near is refused."""
    low, high = box_of(request, [header.extent for header in request.headers])
    flat = [request.zero.to_local(np.column_stack([line[:, :2], np.zeros(len(line))]))[:, :2] for line in lines]
    guide = Guide.through(flat, distance_m, only, (*low, *high))
    if not len(guide.xy):
        raise ParameterError(
            f"The guide has no line within {distance_m:g} m of the cloud: check its place and coordinate system."
        )
    return guide


def box_of(request: Request, extents: Sequence[Sequence[float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners, (2,) metres each, of the box around extents in units of the CRS.

    Headers may state an extent that is not a number; nothing is outside of that.
    """
    found = np.array(extents, dtype=float)
    if not np.isfinite(found).all():
        return np.full(2, -np.inf), np.full(2, np.inf)
    corners = [[*found[:, :2].min(axis=0), 0.0], [*found[:, 2:].max(axis=0), 0.0]]
    low, high = request.zero.to_local(np.array(corners))[:, :2]
    return low, high


def report(figures: SearchFigures, request: Request, progress: Progress) -> None:
    """Inform the user of what was found in the cloud of a request, and of what to doubt."""
    if figures.across_m > figures.along_m:
        progress.warning(
            f"The guide crosses the tracks: {figures.across_m:.0f} m of the rails near it run across it, and "
            f"{figures.along_m:.0f} m along it. Draw it along the tracks."
        )
    elif not figures.points and figures.along_m:
        progress.warning(
            f"No track has the guide within {MIDDLE_M:g} m of its middle: draw the guide along the middle of the "
            "track, or search for all tracks near it."
        )
        return
    if not figures.points:
        progress.warning(
            "No rail was found: check the rail standard and the unit of the coordinates. A cloud that contains only "
            "rail points needs no classification."
        )
        return
    verb = "is" if figures.thin == 1 else "are"
    paved = "has" if figures.paved == 1 else "have"
    progress.info(
        f"Found {counted(figures.points, 'rail point')}: {figures.paired_m:,.0f} m of rails with a partner and "
        f"{figures.single_m:,.0f} m of single rails. Of {counted(figures.squares, 'square')} with rails, "
        f"{figures.thin:,} {verb} thin and {figures.paved:,} {paved} rails in pavement."
    )
    if figures.cells_per_m < ENOUGH_CELLS_PER_M:
        progress.warning(
            f"The rails have {figures.cells_per_m:.1f} cells with points per metre; below {ENOUGH_CELLS_PER_M:.0f}, "
            "lines are less accurate and may have gaps: use a denser cloud."
        )
    if figures.blunt_m and not figures.sharp_m:
        progress.warning(
            f"Heads are blunt on {figures.blunt_m:.0f} m of rail: the cloud blurs what it shows by "
            f"{100 * figures.blur_m:.0f} cm{_as_from_images(request)}, so that a head is a round ridge. A ridge "
            "counts as a rail only if it is long and has a partner at the distance of the gauge."
        )
    if figures.filled_m:
        progress.warning(
            f"{figures.filled_m:.0f} m of rails stand hardly {100 * LOW_M:.0f} cm out of their bed: boards and edges "
            "are as low, so look at what was found."
        )


def _as_from_images(request: Request) -> str:
    """Say that a cloud seems to be matched from images, if it does."""
    if not request.is_of_images():
        return ""
    return " (it seems to be matched from images, for no point has an intensity, a GPS time or a second return)"


def sort_files(
    request: Request, settings: Settings, folder: Path, runner: Runner, progress: Progress, with_class: bool = False
) -> list[SortedFile]:
    """Sort the points of all files into squares, one file per task; with their classes as marks."""
    starts = np.cumsum([0, *(header.point_count for header in request.headers[:-1])])
    arguments = [(start, settings, str(folder), with_class) for start in starts.tolist()]
    return read_each(request, _sort_file, arguments, runner, progress)


def _sort_file(
    request: Request,
    header: CloudHeader,
    first: int,
    settings: Settings,
    folder: str,
    with_class: bool,
    context: Context,
) -> SortedFile:
    """Append the points of a file that are to be searched to the files of their squares; a task."""
    mine, tiling = SortedFile.new_folder(Path(folder)), Tiling(settings.side_m, MARGIN_M)
    counts: dict[Key, int] = {}
    sources: dict[int, Counter[Key]] = {}
    if settings.guide is not None and not settings.guide.reaches(*box_of(request, [header.extent])):
        return SortedFile(str(mine), counts)
    for points in read_searched(request, header.path, first, context.progress, with_class):
        places = request.zero.to_local(points["xyz"])
        if settings.guide is not None:
            held = settings.guide.holds(places[:, :2])
            points, places = points[held], places[held]
        keys, square = tiling.keys(places)
        if len(keys) > MANY_SQUARES and len(points) < FEW_IN_SQUARE * len(keys):
            raise CloudError(
                f"The points of {header.path.name} are too far apart for rails: if the coordinates are in centimetres "
                "or millimetres, assign a coordinate system that says so."
            )
        for key, count in zip(keys, np.bincount(square).tolist()):
            counts[key] = counts.get(key, 0) + count
        if not with_class:
            _count_sources(sources_of(points["mark"]), keys, square, sources)
        for key, numbers in tiling.sort(places).items():
            append(mine, key, points.take(numbers))  # which is four times as fast as an index
    return SortedFile(str(mine), counts, sources)


def _count_sources(own: np.ndarray, keys: Sequence[Key], square: np.ndarray, total: dict[int, Counter[Key]]) -> None:
    """Count points by source, (n,), and by the number of their square among keys, (n,)."""
    for source in np.unique(own).tolist():
        counts = np.bincount(square[own == source], minlength=len(keys)).tolist()
        total.setdefault(source, Counter()).update({key: count for key, count in zip(keys, counts) if count})


def read_searched(
    request: Request, path: Path, first: int, progress: Progress, with_class: bool = False
) -> Iterator[np.ndarray]:
    """Yield the points of a file that are to be searched, (n,) arrays of POINT; `first` is the number of its first."""
    wanted = np.zeros(LAST_CLASS + 1, dtype=bool)
    wanted[list(request.class_codes)] = True
    for xyz, codes, marks, valid in read_points(path, progress, request.leave_out):
        kept = np.flatnonzero(valid & wanted[codes] & request.holds(xyz))
        points = np.empty(len(kept), POINT)
        points["xyz"], points["number"] = xyz[kept], kept + first
        points["mark"] = (codes if with_class else marks)[kept]
        first += len(xyz)
        yield points


def _search(
    square: Square, files: Sequence[str], settings: Settings, sources: frozenset[int] | None, context: Context
) -> Found:
    """Find the rail points of a square, those of some sources if they are given; a task."""
    context.progress.check()
    points = read_stored(files, POINT)
    if sources is not None:
        points = points[np.isin(sources_of(points["mark"]), sorted(sources))]
    xyz = square.frame.to_local(points["xyz"])
    found = search_square(on_one_level(xyz, strips_of(xyz, points["mark"])), settings, context)
    points = points[found.rail]
    return Found(points["xyz"].copy(), points["number"].copy(), points["mark"].copy(), found.figures)


def search_square(xyz: np.ndarray, settings: Settings, context: Context) -> Classified:
    """Find the points on railheads in a square by the method of the settings; see `classify_square`."""
    if settings.weights is None:
        return classify_square(xyz, settings)
    classifier = context.network(Classifier.of, settings.weights)
    return label_square(xyz, settings, classifier, context.progress)
