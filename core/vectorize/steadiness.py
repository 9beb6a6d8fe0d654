"""How well two lines fit together as one rail, judged over a long distance."""

from __future__ import annotations

import numpy as np

from ..lines.ends import STEP_M, even_points

COARSE_M = 1.0
"""Spacing of the points that are compared: directions between closer ones show the stairs."""


def unsteadiness(one: np.ndarray, other: np.ndarray, length_m: float) -> float:
    """Measure how far two lines are off one curve of constant curvature through both, metres rms.

    Headings are summed along the way, which unrolls tight curves as well.

    Parameters
    ----------
    one, other : (n, 2) arrays
        Both lines, from the ends that face each other inward.
    length_m : float
        Length of each that counts.
    """
    coarse = int(round(COARSE_M / STEP_M))
    points = np.concatenate([even_points(one, length_m)[::coarse][::-1], even_points(other, length_m)[::coarse]])
    if len(points) < 4:
        return 0.0
    way = np.diff(points, axis=0)
    way = way[np.abs(way).max(axis=1) > 0]
    length = np.hypot(*way.T)
    heading = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    along = np.concatenate([[0.0], np.cumsum(length)])
    aside = np.concatenate([[0.0], np.cumsum(length * (heading - heading.mean()))])
    along = along / along[-1]
    return float(np.sqrt(np.mean((aside - np.polyval(np.polyfit(along, aside, 2), along)) ** 2)))
