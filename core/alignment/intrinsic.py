"""The plan of a track as a signal of one variable: lateral position along the line.

The direction of a chord is that of the curve at its middle. Its sum along the line, y, therefore has the curvature as
its second derivative, for any turn: a line is a polynomial of degree 1 in y, an arc of degree 2, a clothoid of degree 3.
Lateral errors of the points appear in y as they are.
"""

from __future__ import annotations

import numpy as np

from ..polyline import length_along

SPACING_M = 1.0
"""Least mean distance of the points, metres: of closer points, errors of 2 mm would lengthen the line by 1 in 10,000."""


def thinned(line: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Average the vertices of a line that are closer than `SPACING_M`.

    Parameters
    ----------
    line : (n, 3) array
        Vertices, metres, no two in the same place.
    values : (n, m) array
        Further values at the vertices.

    Returns
    -------
    points : (k, 3) array
        The first and the last vertex are kept.
    values : (k, m) array
    counts : (k,) int array
        Vertices in each point.
    """
    s = length_along(line[:, :2])
    number = np.floor(s / SPACING_M + 0.5).astype(int)
    number[-1] = max(number[-1], number[-2] + 1)
    number[0] = -1 if number[1] == 0 else 0
    starts = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    counts = np.diff(starts, append=len(s))
    both = np.add.reduceat(np.column_stack([line, values]), starts) / counts[:, None]
    return both[:, :3], both[:, 3:], counts


def lateral_signal(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distance along a line and the lateral signal y at its points.

    Parameters
    ----------
    xy : (n, 2) array
        Points, metres.

    Returns
    -------
    s, y : (n,) array
        Metres; both start at 0.
    """
    step = np.diff(xy, axis=0)
    h = np.hypot(*step.T)
    theta = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    s = np.concatenate([[0.0], np.cumsum(h)])
    return s, np.concatenate([[0.0], np.cumsum((theta - theta[0]) * h)])
