"""A whole cloud in memory, classified square by square."""

from __future__ import annotations

import numpy as np

from ..progress import SILENT, Progress
from .figures import Figures
from .settings import MARGIN_M, Settings
from .square import Classified, classify_square


def classify_cloud(xyz: np.ndarray, settings: Settings, progress: Progress = SILENT) -> Classified:
    """Find the points on railheads in a cloud of any size.

    Parameters
    ----------
    xyz : (n, 3) array
        Metres from the zero of the coordinate system, so that the squares do not depend on how files are cut.
    settings : Settings
    progress : Progress

    Returns
    -------
    Classified
        Of the whole cloud; `drawn` in the metres of `xyz`.
    """
    rail = np.zeros(len(xyz), dtype=bool)
    places, figures = [np.empty((0, 2))], Figures()
    members = _by_square(xyz, settings.side_m)
    for key in progress.follow(sorted(members)):
        corner = np.array([*key, 0]) * settings.side_m
        number = _with_margin(xyz, members, key, settings.side_m)
        found = classify_square(xyz[number] - corner, settings)
        rail[number[found.rail]] = True
        places.append(found.drawn + corner[:2])
        figures += found.figures
    return Classified(rail, np.concatenate(places), figures)


def _by_square(xyz: np.ndarray, side_m: float) -> dict[tuple[int, int], np.ndarray]:
    """Numbers of the points of each square, by its column and row."""
    if not len(xyz):
        return {}
    column, row = (np.floor(values / side_m).astype(np.int64) for values in xyz.T[:2])
    first_column, first_row, width = int(column.min()), int(row.min()), int(np.ptp(column)) + 1
    key = (row - first_row) * width + column - first_column
    order = np.argsort(key, kind="stable")
    keys, first = np.unique(key[order], return_index=True)
    places = ((first_column + one % width, first_row + one // width) for one in keys.tolist())
    return dict(zip(places, np.split(order, first[1:])))


def _with_margin(
    xyz: np.ndarray, members: dict[tuple[int, int], np.ndarray], key: tuple[int, int], side_m: float
) -> np.ndarray:
    """Numbers of the points of a square, and of those of its neighbours that lie in its margin."""
    parts = [members[key]]
    for up in (-1, 0, 1):
        for right in (-1, 0, 1):
            part = members.get((key[0] + right, key[1] + up))
            if part is not None and (up, right) != (0, 0):
                parts.append(part[_within_margin(xyz[part], np.array(key) * side_m, side_m)])
    return np.concatenate(parts)


def _within_margin(xyz: np.ndarray, corner: np.ndarray, side_m: float) -> np.ndarray:
    """Return which points lie in the margin of a square or inside, (k,) bool."""
    step = xyz[:, :2] - corner
    return np.all((step >= -MARGIN_M) & (step < side_m + MARGIN_M), axis=1)
