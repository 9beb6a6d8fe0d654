"""Local frames: every computation runs in metres from a local origin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

ORIGIN_STEP = 100.0
"""Local origins are multiples of this number of CRS units, so that neighbouring clouds mostly share an origin."""


@dataclass(frozen=True)
class LocalFrame:
    """Conversion between the coordinates of a cloud and metres from a local origin.

    Attributes
    ----------
    origin : (3,) array
        Local origin in units of the CRS.
    horizontal_unit_m, vertical_unit_m : float
        Length of the CRS's units in metres, in plan and in height.
    crs_wkt : str or None
        Coordinate system of the cloud, as WKT or as a code such as EPSG:32643; None if it is unknown.

    Examples
    --------
    >>> frame = LocalFrame(np.array([1000.0, 2000.0, 0.0]), horizontal_unit_m=0.3048, vertical_unit_m=0.3048)
    >>> local = frame.to_local([[1010.0, 2000.0, 100.0]])
    >>> local.round(3).tolist()
    [[3.048, 0.0, 30.48]]
    >>> frame.to_crs(local).round(3).tolist()
    [[1010.0, 2000.0, 100.0]]
    """

    origin: np.ndarray
    horizontal_unit_m: float = 1.0
    vertical_unit_m: float = 1.0
    crs_wkt: str | None = None

    def to_local(self, xyz_crs: np.ndarray) -> np.ndarray:
        """Convert (n, 3) or (3,) coordinates of the cloud to local metres."""
        local = np.asarray(xyz_crs, dtype=float) - self.origin
        local *= self._metres  # without another copy
        return local

    def to_crs(self, xyz_local: np.ndarray) -> np.ndarray:
        """Convert (n, 3) or (3,) local metres to coordinates of the cloud."""
        return np.asarray(xyz_local, dtype=float) / self._metres + self.origin

    def shift_to(self, other: LocalFrame) -> np.ndarray:
        """Return the vector, (3,) metres, to add to local coordinates of this frame to get those of another.

        Both frames must share the plan coordinate system. Their units of height may differ: a raster, for example,
        does not record one.
        """
        return self.origin * self._metres - other.origin * other._metres

    def with_origin(self, xyz_local: np.ndarray) -> LocalFrame:
        """Return this frame with its origin moved to a place, (3,) local metres."""
        return replace(self, origin=self.to_crs(xyz_local))

    @property
    def _metres(self) -> np.ndarray:
        return np.array([self.horizontal_unit_m, self.horizontal_unit_m, self.vertical_unit_m])
