"""Check that the smoothing in plan leaves lines close enough to their railheads for the points to correct them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..lines.smoothing import END_SHIFT, STATIONS_PER_SIGMA, filled, smooth_line
from ..polyline import interpolate, is_closed, length_along
from ..progress import Progress
from ..rails import RailLine

MAX_SHIFT_HEADS = 0.5
"""Largest displacement, in head widths, that points correct to within a centimetre, because the line is still above the
head. For a head of 72 mm in an arc of 15 m radius, 40 mm are corrected and 90 mm are not."""

MIN_RADIUS_M = 10.0
"""Radius of the tightest tram curve; a line that bends more sharply is not following a rail."""


def warn_if_out_of_reach(
    rails: Sequence[RailLine], head_width_m: float, smoothing_m: float, progress: Progress
) -> None:
    """Warn the user if the smoothing displaces lines in curves by more than the points can correct.

    Parameters
    ----------
    rails : sequence of RailLine
    head_width_m : float
    smoothing_m : float
        Sigma of PAEK in plan.
    progress : Progress
        Receives the warning.
    """
    limit_m = MAX_SHIFT_HEADS * head_width_m
    if END_SHIFT * smoothing_m**2 / MIN_RADIUS_M <= limit_m:
        return
    largest_m = max((displacement(rail.xyz[:, :2], smoothing_m) for rail in rails), default=0.0)
    if largest_m > limit_m:
        best_m = math.floor(10 * smoothing_m * math.sqrt(limit_m / largest_m)) / 10
        progress.warning(
            f"SMOOTHING_XY of {smoothing_m:g} m displaces lines in curves by up to {1000 * largest_m:.0f} mm, more "
            f"than points can correct: set it to {best_m:g} m or less."
        )


def displacement(line: np.ndarray, smoothing_m: float) -> float:
    """Return the largest displacement of a line by PAEK, metres.

    Applied to a line that follows its rail, it shows how far the line was displaced before.

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
