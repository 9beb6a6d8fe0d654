"""How far tracks fitted in airborne clouds lie from the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...core.polyline import length_along

RIGHT_M, CERTAIN = 0.10, 1.96
"""A station within this distance is right, and one within as many standard errors is inside its 95 % interval."""

END_SAMPLES = 4
"""Stations beside the first and last samples of the truth are beyond its ends."""


@dataclass(frozen=True)
class Stationwise:
    """Figures of stations, one row each.

    Attributes
    ----------
    seen : (n,) bool array
    across_m, height_m : (n,) arrays
        Distance to the left of the true track and above it; NaN where it is not seen.
    within : (n,) bool array
        Whether the truth lies in the 95 % interval.
    beside_m : (n,) array
        Distance of the true track from the next one.
    flagged : (n,) bool array
        Whether the station is said to be at a switch.
    along_m : (n,) array
        Chainage along the true track.
    """

    seen: np.ndarray
    across_m: np.ndarray
    height_m: np.ndarray
    within: np.ndarray
    beside_m: np.ndarray
    flagged: np.ndarray
    along_m: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Stationwise:
        return Stationwise(*(values[which] for values in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence[Stationwise]) -> Stationwise:
        """Return all rows of several."""
        return cls(*(np.concatenate(columns) for columns in zip(*(vars(part).values() for part in parts))))

    @property
    def right(self) -> np.ndarray:
        """Which stations are seen and right, (n,) bool."""
        return self.seen & (np.abs(np.nan_to_num(self.across_m, nan=np.inf)) < RIGHT_M)

    def shares(self) -> tuple[float, float, float, float, float]:
        """Return the share seen, of these right, rms across in mm, sd of the height in mm, and share within."""
        seen, right = self.seen, self.right
        if not right.any():
            return float(seen.mean()) if len(seen) else np.nan, 0.0, np.nan, np.nan, 0.0
        rms = np.sqrt(np.mean(self.across_m[right] ** 2))
        share = right.sum() / seen.sum()
        return (
            float(seen.mean()),
            float(share),
            1000 * float(rms),
            1000 * float(self.height_m[right].std()),
            float(self.within[seen].mean()),
        )


def compare_stations(
    xyz: np.ndarray,
    seen: np.ndarray,
    sigma_m: np.ndarray,
    flagged: np.ndarray,
    truth: np.ndarray,
    others: Sequence[np.ndarray] = (),
) -> Stationwise:
    """Compare stations, (n, 3), with the true track, (m, 3) dense samples, beside other true tracks."""
    nearest = cKDTree(truth[:, :2]).query(xyz[:, :2])[1]
    inside = (nearest >= END_SAMPLES) & (nearest < len(truth) - END_SAMPLES)
    xyz, seen, sigma_m, flagged, nearest = xyz[inside], seen[inside], sigma_m[inside], flagged[inside], nearest[inside]
    ahead = truth[nearest + 1, :2] - truth[nearest - 1, :2]
    ahead /= np.hypot(*ahead.T)[:, None]
    step = xyz - truth[nearest]
    across = ahead[:, 0] * step[:, 1] - ahead[:, 1] * step[:, 0]
    along = (ahead * step[:, :2]).sum(axis=1)
    gradient = (truth[nearest + 1, 2] - truth[nearest - 1, 2]) / np.hypot(
        *(truth[nearest + 1, :2] - truth[nearest - 1, :2]).T
    )
    height = step[:, 2] - along * gradient
    beside = np.min(
        [cKDTree(other[:, :2]).query(truth[nearest, :2])[0] for other in others] or [np.full(len(nearest), np.inf)],
        axis=0,
    )
    across, height = np.where(seen, across, np.nan), np.where(seen, height, np.nan)
    within = seen & (np.abs(across) < CERTAIN * sigma_m)
    return Stationwise(seen, across, height, within, beside, flagged, length_along(truth[:, :2])[nearest])
