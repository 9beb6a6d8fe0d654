"""A whole raw cloud in memory, classified square by square."""

from __future__ import annotations

import numpy as np

from ...core.classify.settings import MARGIN_M, Settings
from ...core.classify.square import Classified
from ...core.labelling.finding import search_square
from ...core.progress import SILENT, Progress
from ...core.rails import SearchFigures
from ...core.squares.grid import points_by_square, unique_keys
from ...core.tasks import Context, Once


def classify_cloud(xyz: np.ndarray, settings: Settings, progress: Progress = SILENT) -> Classified:
    """Find the points on railheads in a cloud of any size.

    Parameters
    ----------
    xyz : (n, 3) array
        Metres from the zero of the coordinate system, so that the squares do not depend on how files are cut. With a
        guide, those that it holds.
    settings : Settings
    progress : Progress

    Returns
    -------
    Classified
        Of the whole cloud.
    """
    rail = np.zeros(len(xyz), dtype=bool)
    figures = SearchFigures()
    keys, _ = unique_keys(xyz, settings.side_m)
    context = Context({}, Once(), progress)
    around_them = points_by_square(xyz, settings.side_m, MARGIN_M)
    for key in progress.follow(keys):
        number = around_them[key]
        corner = np.array([*np.multiply(key, settings.side_m), 0.0])
        found = search_square(xyz[number] - corner, settings.at(key), context)
        rail[number[found.rail]] = True
        figures += found.figures
    return Classified(rail, figures)
