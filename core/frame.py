"""Local metres: the coordinates in which all computation happens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ORIGIN_STEP = 100.0
"""The local origin lies on multiples of this, in CRS units, so that nearby clouds mostly get the same."""


@dataclass(frozen=True)
class LocalFrame:
    """The way between a cloud's coordinates and metres from a local origin.

    Attributes
    ----------
    origin : (3,) array
        In units of the CRS.
    horizontal_unit_m, vertical_unit_m : float
        Metres in one unit of the CRS, in plan and in height.
    crs_wkt : str or None
        Coordinate system of the cloud, as WKT or a code like EPSG:32643; None where it is unknown.
    """

    origin: np.ndarray
    horizontal_unit_m: float = 1.0
    vertical_unit_m: float = 1.0
    crs_wkt: str | None = None

    def to_local(self, xyz_crs: np.ndarray) -> np.ndarray:
        """Turn (n, 3) coordinates of the cloud into local metres."""
        return (np.asarray(xyz_crs, dtype=float) - self.origin) * self._metres

    def to_crs(self, xyz_local: np.ndarray) -> np.ndarray:
        """Turn (n, 3) local metres into coordinates of the cloud."""
        return np.asarray(xyz_local, dtype=float) / self._metres + self.origin

    @property
    def _metres(self) -> np.ndarray:
        return np.array([self.horizontal_unit_m, self.horizontal_unit_m, self.vertical_unit_m])
