"""Gauge and cant between lines at places across a track."""

from __future__ import annotations

import numpy as np

from .pieces import Pieces, nearest

ASTRAY_M = 0.10
"""Distance from its expected place, relative to the track, at which a line is not the rail of the track."""


def spacing_and_cant(left: np.ndarray, right: np.ndarray, pieces: Pieces) -> np.ndarray:
    """Measure the distance in space of the two rails of a track, and the height of the left one above the right one.

    Parameters
    ----------
    left, right : (n, 2) array
        Where the two rails are expected, metres.
    pieces : Pieces
        Of all rails.

    Returns
    -------
    (n, 2) array
        Metres; NaN where a rail is missing.
    """
    sides = []
    for place in (left, right):
        feet, _ = nearest(np.column_stack([place, np.zeros(len(place))]), pieces)
        astray = ~(np.linalg.norm(feet[:, :2] - place, axis=1) <= ASTRAY_M)
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    plan = np.hypot(step[:, 0], step[:, 1])
    return np.column_stack([np.hypot(plan, np.nan_to_num(step[:, 2])), step[:, 2]])
