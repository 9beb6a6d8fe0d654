"""A whole raw cloud in memory, classified square by square."""

from __future__ import annotations

import numpy as np

from ..classify.settings import MARGIN_M, Settings
from ..classify.square import Classified, classify_square
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from ..squares.grid import Square, around, points_by_square


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
    zero = LocalFrame(np.zeros(3))
    rail = np.zeros(len(xyz), dtype=bool)
    figures = SearchFigures()
    members = points_by_square(xyz, settings.side_m)
    for key in progress.follow(list(members)):
        square = Square.on_grid(key, settings.side_m, zero)
        around_it = [members[one] for one in around(key) if one in members]
        number = np.concatenate([part[square.holds(square.frame.to_local(xyz[part]), MARGIN_M)] for part in around_it])
        found = classify_square(square.frame.to_local(xyz[number]), settings.at(key))
        rail[number[found.rail]] = True
        figures += found.figures
    return Classified(rail, figures)
