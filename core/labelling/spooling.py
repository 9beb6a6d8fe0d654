"""Rail points found in a raw cloud, or grown from seeds, sorted into the squares of the extraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..classify.settings import Settings
from ..clouds.points import AIRBORNE, Request
from ..disk import writing
from ..errors import NoRailPointsError, RailExtractError
from ..grow.settings import GrowSettings
from ..progress import Progress
from ..rails import SearchFigures
from ..scratch import scratch_folder
from ..squares.spool import Census, SpooledFile, SpooledPoints, gather
from ..standards import RAIL_CLASS
from ..tasks import Runner
from .finding import find_rail_points, report
from .growing import grow_points


def spool_found(
    request: Request, settings: Settings, side_m: float, folder: Path, runner: Runner, progress: Progress
) -> tuple[SpooledPoints, SearchFigures]:
    """Find the rail points of a raw cloud and sort them into the squares of the extraction, as class `RAIL_CLASS`.

    Parameters
    ----------
    request : Request
        Files, `standards.SEARCHED_CLASSES` classes and extent.
    settings : Settings
    side_m : float
        Side of the squares of the extraction.
    folder : Path
        Folder to write to; the caller removes it.
    runner : Runner
    progress : Progress

    Raises
    ------
    NoRailPointsError
        No rail was found, or the extent contains no points.
    RailExtractError
        No rail was found, and a part of the cloud could not be searched; or see `find_rail_points`.
    """
    census, figures = Census(), SearchFigures()
    with writing(folder), scratch_folder(folder) as squares:
        for found in find_rail_points(request, settings, squares, runner, progress):
            census.add(RAIL_CLASS, found.xyz, found.marks, request.zero, side_m, folder)
            figures += found.figures
    if not figures.points:
        if runner.failures:
            raise RailExtractError(
                "No rail was found, and a part of the cloud could not be searched; the last error was: "
                f"{runner.failures[-1]}"
            )
        raise NoRailPointsError(
            "No rail was found in the raw cloud: check the rail standard and the unit of the coordinates, or classify "
            "the rail points yourself." + (f" For an airborne cloud, use {AIRBORNE}." if request.is_airborne else "")
        )
    report(figures, request, progress)
    return _gathered(request, side_m, folder, census, figures), figures


def spool_grown(
    request: Request,
    seeds: Sequence[np.ndarray],
    settings: GrowSettings,
    side_m: float,
    folder: Path,
    progress: Progress,
) -> tuple[SpooledPoints, SearchFigures]:
    """Follow rails from seeds and sort their points into the squares of the extraction, as class `RAIL_CLASS`.

    Parameters
    ----------
    seeds : sequence of (k, 2) array
        See `growing.grow_files`.
    settings : GrowSettings
    request, side_m, folder, progress
        See `spool_found`.

    Raises
    ------
    RailExtractError
        See `growing.grow_files`.
    """
    census = Census()

    def keep(points: np.ndarray) -> None:
        with writing(folder):
            census.add(RAIL_CLASS, points["xyz"], points["mark"], request.zero, side_m, folder)

    with writing(folder), scratch_folder(folder) as scratch:
        _, figures = grow_points(request, seeds, settings, scratch, keep, progress)
    return _gathered(request, side_m, folder, census, figures), figures


def _gathered(request: Request, side_m: float, folder: Path, census: Census, figures: SearchFigures) -> SpooledPoints:
    """Return the points that were sorted."""
    (source,) = gather(request, side_m, [SpooledFile(str(folder), census.report())])
    return replace(source, found=True, blunt=True if figures.blunt_m else None)  # narrow ones may have no edges either
