"""What lies on and beside a fitted line: two rails on a bed over 70 m, a better place, or another track."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .cross_sections import STATION_M
from .guide_line import Corridor
from .ridges import HALF_M, Shape, binned, fit, windows
from .search import STEP_M

LONG = 7
"""Sections that are looked at as one: one section may be hidden, or mislead."""

WIDE_M = 5.6
"""Distance from the line up to which places are compared: tracks of one line are rarely farther apart."""

APART_M, REPEATED_M, TRACKS_APART_M = 0.4, 1.1, 2.8
"""Places this far apart are others, those less far apart than a gauge have no rail of the line, and two tracks are at
least this far apart."""


@dataclass(frozen=True)
class Beside:
    """Places `across`, (c,), to the left of a line and on it, for the `LONG` sections around each section.

    `gain`, `flaw` and `most`, (n, c), are those of `ridges.Fit`.
    """

    across: np.ndarray
    gain: np.ndarray
    flaw: np.ndarray
    most: np.ndarray

    @property
    def score(self) -> np.ndarray:
        """Gain of two rails, less the flaws of the bed, (n, c)."""
        return self.gain - self.flaw

    @property
    def on(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gain, flaw and expected gain on the line, (n,) each."""
        middle = len(self.across) // 2
        return self.gain[:, middle], self.flaw[:, middle], self.most[:, middle]

    @property
    def rival(self) -> np.ndarray:
        """Best score of a place that excludes the line, because two tracks are never so close, (n,)."""
        return self._best(APART_M, TRACKS_APART_M)

    @property
    def repeated(self) -> np.ndarray:
        """Best score of a place that the line's own rails can't make, as the furrows of a field do, (n,)."""
        return self._best(APART_M, REPEATED_M)

    def _best(self, low_m: float, high_m: float) -> np.ndarray:
        """Return the best score of places between two distances, (n,)."""
        apart = np.abs(self.across)
        return self.score[:, (apart > low_m) & (apart < high_m)].max(axis=1)


def look_beside(corridor: Corridor, shape: Shape, sections: int) -> Beside:
    """Compare the places beside a line, whose corridor reaches `WIDE_M` and half the width of a bed farther.

    Stones and sleepers differ from section to section, so that averaging removes more of them over many.
    """
    half, places = int(round(HALF_M / STEP_M)), 2 * int(round(WIDE_M / STEP_M)) + 1
    width = 2 * half + 1
    bins = places + width - 1
    low_m = -(places // 2 + half + 0.5) * STEP_M
    count, height = binned(
        corridor.section_of(STATION_M), corridor.across, corridor.height, sections, low_m, bins, STEP_M
    )
    total = _around(count * height)
    count = _around(count)
    height = total / np.maximum(count, 1)
    u = (np.arange(width) - half) * STEP_M
    long = replace(shape, rough_m=shape.rough_m / np.sqrt(LONG))
    found = fit(windows(count, width), windows(height, width), u, long, passes=3)
    return Beside((np.arange(places) - places // 2) * STEP_M, found.gain, found.flaw, found.most)


def _around(values: np.ndarray) -> np.ndarray:
    """Return the sums over the `LONG` sections around each, (n, k); there are fewer at the ends."""
    padded = np.pad(values, ((LONG // 2 + 1, LONG // 2), (0, 0)))
    total = np.cumsum(padded, axis=0, dtype=np.float64)
    return (total[LONG:] - total[:-LONG]).astype(values.dtype)
