"""What lies beside a fitted line: a better place means that the line is wrong, another track may have no guide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .corridor import Corridor
from .ridges import HALF_M, Shape, binned, fit, windows

LENGTH_M, STEP_M = 50.0, 0.05
"""Length of the sections that are looked at as one, and the distance of the places."""

WIDE_M = 5.6
"""Distance from the line up to which places are compared: tracks of one line are rarely farther apart."""

SAME_M, APART_M, TRACKS_APART_M = 0.2, 0.4, 2.8
"""Places this close are the same, those this far apart are others, and two tracks are at least this far apart."""


@dataclass(frozen=True)
class Beside:
    """Scores of places beside a line, by sections of `LENGTH_M`.

    Attributes
    ----------
    across : (c,) array
        Distances to the left.
    score : (sections, c) array
        Gain of two rails there, less the flaws of the bed.
    """

    across: np.ndarray
    score: np.ndarray

    @property
    def own(self) -> np.ndarray:
        """Score of the line itself, (sections,)."""
        return self.score[:, np.abs(self.across) < SAME_M].max(axis=1)

    @property
    def rival(self) -> np.ndarray:
        """Best score of a place that excludes the line, because two tracks are never so close, (sections,)."""
        apart = np.abs(self.across)
        return self.score[:, (apart > APART_M) & (apart < TRACKS_APART_M)].max(axis=1)


def look_beside(corridor: Corridor, shape: Shape) -> Beside:
    """Compare the places beside a line, whose corridor reaches `WIDE_M` and half the width of a bed farther."""
    half, places = int(round(HALF_M / STEP_M)), 2 * int(round(WIDE_M / STEP_M)) + 1
    width = 2 * half + 1
    bins = places + width - 1
    low_m = -(places // 2 + half + 0.5) * STEP_M
    section = ((corridor.t - corridor.start_m) / LENGTH_M).astype(np.int64)
    total = int(section.max(initial=0)) + 1
    count, height = binned(section, corridor.across, corridor.height, total, low_m, bins, STEP_M)
    u = (np.arange(width) - half) * STEP_M
    found = fit(windows(count, width), windows(height, width), u, shape, passes=3)
    return Beside((np.arange(places) - places // 2) * STEP_M, found.gain - found.flaw)
