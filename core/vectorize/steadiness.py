"""How well two lines fit into one rail, seen over a long way."""

from __future__ import annotations

import numpy as np

from ..lines.ends import STEP_M, stretch

COARSE_M = 1.0
"""Spacing of the points that stand for a stretch of such a length: directions between nearer ones show the stairs."""


def unsteadiness(one: np.ndarray, other: np.ndarray, length_m: float) -> float:
    """Tell how far two lines stray from one curve of constant curvature through both, metres rms.

    Both are given from the ends at which they face each other, and seen as far as `length_m`. Their headings are summed
    up along the way, which unrolls tight curves as well.
    """
    coarse = int(round(COARSE_M / STEP_M))
    points = np.concatenate([stretch(one, length_m)[::coarse][::-1], stretch(other, length_m)[::coarse]])
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
