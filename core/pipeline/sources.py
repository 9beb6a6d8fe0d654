"""Where rail points come from: classified clouds, raw clouds in which they are found, or seeds from which they grow."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from ..checks.standard import warn_of_gauge, warn_of_raw
from ..classify.settings import Settings
from ..clouds.header import CloudHeader
from ..clouds.points import AIRBORNE, Request, read_each
from ..disk import scratch_folder, writing
from ..errors import CloudError, NoRailPointsError, RailExtractError
from ..grow.heads import GrowSettings
from ..labelling.finding import find_rail_points, report
from ..labelling.growing import grow_points
from ..parameters import Parameters
from ..progress import Progress
from ..rails import SearchFigures
from ..run.tasks import Context, Runner
from ..squares.steps import square_side
from ..standards import RAIL_CLASS
from ..tiles.grid import SortedPoints, parted
from ..tiles.store import Census, SpooledFile, gather, spool_file

READING = 0.25
"""Run time of sorting rail points relative to that of the walk, for the progress."""

FINDING = 5.0
"""The same of finding them in a raw cloud, which has 10 to 100 times as many points."""


class Source(Protocol):
    """A cloud whose rail points can be sorted into squares."""

    @property
    def run_time(self) -> float:
        """Run time relative to that of the walk."""

    def sort(
        self, folder: Path, parameters: Parameters, runner: Runner, progress: Progress
    ) -> AbstractContextManager[SortedPoints]:
        """Sort the points into squares on disk, in a folder that the caller removes."""


@dataclass(frozen=True)
class Classified:
    """The points of the classes in a request."""

    request: Request
    run_time = READING

    @contextmanager
    def sort(self, folder: Path, parameters: Parameters, runner: Runner, progress: Progress) -> Iterator[SortedPoints]:
        """See `Source`; points that were sorted in this folder before are not read again."""
        side_m = square_side(parameters)
        is_warned = warn_of_gauge(self.request, parameters, progress)
        self.request.announce(progress)
        arguments = [(side_m, folder)] * len(self.request.headers)
        files = read_each(self.request, _sort_file, arguments, runner, progress)
        yield SortedPoints(gather(self.request, side_m, files), is_warned=is_warned)


def _sort_file(request: Request, header: CloudHeader, side_m: float, folder: Path, context: Context) -> SpooledFile:
    """Sort the points of one file; a task."""
    try:
        return spool_file(request, header, side_m, folder, context.progress)
    except OSError as error:
        raise CloudError(
            f"{header.path.name} can't be read ({error.strerror}): check the disk or the network drive."
        ) from error


@dataclass(frozen=True)
class Raw:
    """The rails of a raw cloud, given a request for `standards.SEARCHED_CLASSES`.

    They are found by the network whose weights are given, or else by their shape.
    """

    request: Request
    weights: Path | None = None
    run_time = FINDING

    @contextmanager
    def sort(self, folder: Path, parameters: Parameters, runner: Runner, progress: Progress) -> Iterator[SortedPoints]:
        """See `Source`; the points become those of `RAIL_CLASS`."""
        census, side_m, blunt_marks = Census(), square_side(parameters), set[int]()
        with scratch_folder(folder) as sorted_points:
            try:
                figures = self._find(census, blunt_marks, side_m, sorted_points, parameters, runner, progress)
            except NoRailPointsError:
                warn_of_raw(self.request, SearchFigures(), parameters, progress)
                raise
            is_warned = warn_of_raw(self.request, figures, parameters, progress)
            points = _gathered(self.request, side_m, sorted_points, census, figures, blunt_marks)
            yield replace(points, only_pairs=figures.blunt_m > 0, is_warned=is_warned)

    def _find(
        self,
        census: Census,
        blunt_marks: set[int],
        side_m: float,
        folder: Path,
        parameters: Parameters,
        runner: Runner,
        progress: Progress,
    ) -> SearchFigures:
        """Find the points on rails and add them to those of the squares, and the marks of blunt ones among sharp."""
        settings = Settings(parameters.gauges_m, parameters.head_width_m, weights=self.weights)
        figures = SearchFigures()
        with writing(folder), scratch_folder(folder) as squares:
            for found in find_rail_points(self.request, settings, squares, runner, progress):
                if found.fills:
                    blunt_marks.update(found.marks.tolist())
                census.add(RAIL_CLASS, found.xyz, found.marks, self.request.zero, side_m, folder)
                figures += found.figures
        if not figures.points:
            raise self._nothing_found(runner.failures)
        report(figures, self.request, progress)
        return figures

    def _nothing_found(self, failures: Sequence[str]) -> RailExtractError:
        if failures:
            return RailExtractError(
                f"No rail was found, and a part of the cloud could not be searched; the last error was: {failures[-1]}"
            )
        airborne = f" For an airborne cloud, use {AIRBORNE}." if self.request.is_airborne else ""
        return NoRailPointsError(
            "No rail was found in the raw cloud: check the rail standard and the unit of the coordinates, or classify "
            f"the rail points yourself.{airborne}"
        )


@dataclass(frozen=True)
class Grown:
    """The rails of a raw cloud that grow from seeds, (k, 2) arrays in units of the CRS: places on heads, or lines."""

    request: Request
    seeds: Sequence[np.ndarray]
    run_time = FINDING

    @contextmanager
    def sort(self, folder: Path, parameters: Parameters, runner: Runner, progress: Progress) -> Iterator[SortedPoints]:
        """See `Source`; the points become those of `RAIL_CLASS`."""
        settings = GrowSettings(parameters.gauge_m, parameters.head_width_m)
        census, side_m = Census(), square_side(parameters)
        with scratch_folder(folder) as sorted_points:

            def keep(points: np.ndarray) -> None:
                with writing(sorted_points):
                    census.add(RAIL_CLASS, points["xyz"], points["mark"], self.request.zero, side_m, sorted_points)

            with writing(sorted_points), scratch_folder(sorted_points) as squares:
                _, figures = grow_points(self.request, self.seeds, settings, squares, keep, progress)
            yield _gathered(self.request, side_m, sorted_points, census, figures)


def _gathered(
    request: Request,
    side_m: float,
    folder: Path,
    census: Census,
    figures: SearchFigures,
    blunt_marks: Collection[int] = (),
) -> SortedPoints:
    """Return the points that were found in a raw cloud, and which are blunt among sharp ones, by their marks."""
    (source,) = gather(request, side_m, [SpooledFile(str(folder), census.report())])
    if blunt_marks:
        source = replace(source, found=True)
        return SortedPoints(parted(source, {source.passes[mark] for mark in blunt_marks}), figures)
    # Narrow heads may have no edges either: a scanner on the ground has dense squares, and beams from the air are wide.
    blunt = True if figures.blunt_m or figures.is_from_air else None
    return SortedPoints([replace(source, found=True, blunt=blunt)], figures)
