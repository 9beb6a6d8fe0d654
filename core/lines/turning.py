"""The last check of every line: none turns too sharply for a rail (docs/method.md section 5.8)."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ..polyline import project, resample, runs

TURN_M, MAX_TURN_DEG = 1.0, 10.0
"""A line that turns by more than this within this length is not a rail there: at the least radius, 20 m, a rail turns
by 3 degrees per metre. The rest is for jogs of a centimetre where lines were brought together in a node."""

STEP_M, ROUGH_STEP_M = 0.1, 0.5
"""Spacing of the stations between which directions are measured, and that on lines that are smoothed by less than
`SMOOTHED_M`: these still have the stairs of the raster, 2 cm high."""

SMOOTHED_M = 0.4
"""Sigma of PAEK from which stairs turn a line by less than a degree."""

ON_ITSELF_M, ON_ITSELF_SHARE = 0.1, 0.5
"""A part of a line that is this close to a longer part, over this share of its length, is the same rail drawn twice:
the line has turned back onto itself."""


def parts_without_turns(line: np.ndarray, min_length_m: float, smoothing_m: float) -> list[tuple[float, float]]:
    """Return the parts of a line, (n, 2), between the places where it turns too sharply for a rail.

    Parameters
    ----------
    line : (n, 2) array
    min_length_m : float
        Shorter parts are left out.
    smoothing_m : float
        Sigma of PAEK that smoothed the line.

    Returns
    -------
    list of tuple of float
        Chainages of start and end, in order; a line without such a place is a single part, however short. A part that
        runs back over a longer one is left out.
    """
    stations, t = resample(line, STEP_M if smoothing_m >= SMOOTHED_M else ROUGH_STEP_M)
    bends = _bends(stations, t)
    if not bends:
        return [(0.0, float(t[-1]))]
    borders = [0.0, *(border for bend in bends for border in bend), float(t[-1])]
    parts = [(start, end) for start, end in zip(borders[::2], borders[1::2]) if end - start >= min_length_m]
    drawn = {part: stations[(t >= part[0]) & (t <= part[1])] for part in parts}
    kept: list[tuple[float, float]] = []
    for part in sorted(parts, key=lambda part: part[0] - part[1]):
        again = project([drawn[other] for other in kept], drawn[part], ON_ITSELF_M)
        if len(again.point) < ON_ITSELF_SHARE * len(drawn[part]):
            kept.append(part)
    return sorted(kept)


def turn_deg(line: np.ndarray) -> float:
    """Return the largest angle by which a line, (n, 2), turns within `TURN_M`, degrees."""
    return float(np.degrees(_turns(*resample(line, STEP_M)).max()))


def _turns(stations: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return the range of the directions within `TURN_M` of line around each section between stations, radians."""
    ahead = np.diff(stations, axis=0)
    direction = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    sections = int(round(TURN_M / t[1])) + 1
    return maximum_filter1d(direction, sections) - minimum_filter1d(direction, sections)


def _bends(stations: np.ndarray, t: np.ndarray) -> list[tuple[float, float]]:
    """Return the chainages of the start and the end of the sections that turn too much."""
    sharp = _turns(stations, t) > np.radians(MAX_TURN_DEG)
    return [(float(t[first]), float(t[last + 1])) for first, last in runs(sharp)]
