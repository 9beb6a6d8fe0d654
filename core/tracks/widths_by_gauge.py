"""Width of the railheads where it depends on the gauge: each rail has that of the track in which it runs.

See docs/method.md section 6.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rails import RailLine
from ..standards import Gauge
from .parallels import find_parallels


def width_at(spacing_m: float, gauges: Sequence[Gauge]) -> float:
    """Return the width of the railheads of a track whose rails are at a distance, that of the nearest gauge, metres.

    Examples
    --------
    >>> width_at(1.061, [(1.435, 0.072), (1.0, 0.066)])
    0.066
    """
    return min(gauges, key=lambda one: abs(sum(one) - spacing_m))[1]


def widths_by_gauge(rails: Sequence[RailLine], gauges: Sequence[Gauge], tolerance_m: float) -> np.ndarray:
    """Return the width of the head of each rail, (n,) metres: that of the gauge at which it runs for the most part.

    Parameters
    ----------
    rails : sequence of RailLine
    gauges : sequence of Gauge
        The first one decides where a rail has no partner, or is common to tracks of two gauges over the same length.
    tolerance_m : float
        Largest deviation of a track from its gauge.
    """
    widths_m = np.array([width_m for _, width_m in gauges])
    if not len(rails) or np.all(widths_m == widths_m[0]):
        return np.full(len(rails), widths_m[0])
    found = find_parallels(rails, max(map(sum, gauges)) + tolerance_m)
    off_m = np.abs(np.abs(found.left_m)[:, None] - np.array([sum(one) for one in gauges]))
    at_gauge = off_m.min(axis=1) <= tolerance_m
    nearest = off_m.argmin(axis=1)[at_gauge]
    stations = np.zeros((len(rails), len(gauges)))
    for sides in (found.a, found.b):
        np.add.at(stations, (sides[at_gauge], nearest), 1)
    return widths_m[stations.argmax(axis=1)]
