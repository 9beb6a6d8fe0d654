"""Whether the smoothing in plan leaves lines within reach of their railheads."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..lines.paek import filled
from ..lines.smoothing import STATIONS_PER_SIGMA, smooth_line
from ..polyline import interpolate, is_closed, length_along
from ..progress import Progress
from ..rails import RailLine

REACH_HEADS = 0.5
"""Displacement, in head widths, from which points bring a line back to within a centimetre, for it still lies over the
head. On a head of 72 mm in an arc of 15 m, 40 mm are brought back, and 90 mm are not."""

SHARPEST_M = 10.0
"""Radius of a tram's sharpest curve; what bends more sharply is no rail's curve."""

END_SHIFT = 0.26
"""Where a line ends in an arc of radius R, PAEK draws it aside by this times sigma² / R (docs/method.md section 5.4);
where the arc begins at a straight, by half as much."""


def warn_if_out_of_reach(
    rails: Sequence[RailLine], head_width_m: float, smoothing_m: float, progress: Progress
) -> None:
    """Tell the user that the smoothing cuts curves so far that points can't bring the lines back onto their heads."""
    limit_m = REACH_HEADS * head_width_m
    if END_SHIFT * smoothing_m**2 / SHARPEST_M <= limit_m:
        return
    largest_m = max((displacement(rail.xyz[:, :2], smoothing_m) for rail in rails), default=0.0)
    if largest_m > limit_m:
        best_m = math.floor(10 * smoothing_m * math.sqrt(limit_m / largest_m)) / 10
        progress.warning(
            f"SMOOTHING_XY of {smoothing_m:g} m draws lines in curves up to {1000 * largest_m:.0f} mm aside, farther "
            f"than points can bring them back: set it to {best_m:g} m or less."
        )


def displacement(line: np.ndarray, smoothing_m: float) -> float:
    """Measure how far PAEK draws a line aside at most, metres: lines that follow their rails show what it did to them.

    Parameters
    ----------
    line : (n, 2) array
    smoothing_m : float
        Sigma of PAEK.
    """
    t = length_along(line)
    stations = filled(t, smoothing_m / STATIONS_PER_SIGMA)
    smoothed = smooth_line(line, smoothing_m, stations, closed=is_closed(line))
    return float(np.hypot(*(smoothed - interpolate(line, t, stations)).T).max())
