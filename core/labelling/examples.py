"""Labelled blocks from the files of a classified cloud of any size, for training."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..classify.settings import Settings
from ..clouds.points import Request
from ..disk import writing
from ..errors import NoRailPointsError, ParameterError
from ..learned.examples import Examples, save_index, write_square
from ..progress import SILENT, Progress
from ..run.loop import Runner
from ..scratch import scratch_folder
from ..tiles.grid import Square
from ..tiles.store import files_of, read_stored
from .finding import POINT, sort_files


def write_examples(
    request: Request, rail_classes: Sequence[int], settings: Settings, folder: Path, progress: Progress = SILENT
) -> Examples:
    """Cut a labelled cloud into blocks on disk; memory holds one square.

    Parameters
    ----------
    request : Request
        Files, `standards.SEARCHED_CLASSES` classes and extent.
    rail_classes : sequence of int
        Classes of the rail points; all other points are examples of what is not on rails.
    settings : Settings
    folder : Path
        Existing folder for the blocks; complete once it holds the checksums.
    progress : Progress

    Raises
    ------
    NoRailPointsError
        No point of the rail classes stands out of the bed.
    ParameterError
        All points are of the rail classes.
    CloudError, DiskError
        See `finding.find_rail_points`.
    """
    starts = np.cumsum([header.point_count for header in request.headers])
    reading, cutting = progress.divide((1.0, 1.0))
    census = np.zeros(2, dtype=np.int64)
    with writing(folder), scratch_folder(folder) as squares:
        sorted_files = sort_files(request, settings, squares, Runner(), reading, with_class=True)
        keys = sorted({key for one in sorted_files for key in one.counts})
        entries = []
        for file, key in enumerate(cutting.follow(keys)):
            points = read_stored(files_of(key, sorted_files), POINT)
            rail = np.isin(points["mark"], rail_classes)
            tile = np.searchsorted(starts, points["number"], side="right")
            census += np.bincount(rail, minlength=2)
            xyz = Square.on_grid(key, settings.side_m, request.zero).frame.to_local(points["xyz"])
            entries.append(write_square(folder, file, key, settings.side_m, xyz, rail, tile))
        index = np.concatenate(entries) if entries else np.empty(0)
        _check(census, index, rail_classes)
        save_index(folder, index)
    return Examples.load(folder)


def _check(census: np.ndarray, index: np.ndarray, rail_classes: Sequence[int]) -> None:
    """Refuse labels from which nothing can be learned.

    Raises
    ------
    NoRailPointsError, ParameterError
    """
    named = ", ".join(map(str, rail_classes))
    others, rails = census
    if not rails:
        raise NoRailPointsError(
            f"The cloud has no points of class {named} to learn from: classify its rails, or set the rail classes."
        )
    if not others:
        raise ParameterError(
            f"All points of the cloud are of class {named}: give the whole cloud, with the points around the rails."
        )
    if not index["rail"].any():
        raise NoRailPointsError(
            f"No point of class {named} is 0.055 to 0.4 m above the bed, where railheads are: check the labels and the "
            "unit of the coordinates."
        )
