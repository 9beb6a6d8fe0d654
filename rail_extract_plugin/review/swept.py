"""The profile that an object is in, as a cross-section shows it: with widening and margin, leaning with the track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from qgis.core import QgsGeometry, QgsPointXY

from ...core.jobs.result import ShownProfile

ARC_PARTS = 8
"""Parts of a quarter of a circle in the outline: within a centimetre of it for the largest margin."""

LEAST_WIDENING_M = 0.0005
"""Widening below this is none: the layer states tenths of millimetres."""


@dataclass(frozen=True)
class Pose:
    """Where the frame of the track is in a section: its roll, radians, and the middle between both rail tops, (2,)."""

    roll: float
    middle: np.ndarray

    @classmethod
    def of(cls, cant_m: float, spacing_m: float, place: np.ndarray, mark: np.ndarray) -> Pose:
        """Return that in which a place, v and w, is where the section shows it."""
        level = cls(float(np.arcsin(np.clip(cant_m / spacing_m, -1.0, 1.0))), np.zeros(2))
        return cls(level.roll, mark - level.seen(place[None])[0])

    def seen(self, vw: np.ndarray) -> np.ndarray:
        """Return where places, (n, 2), are in the section: to the right and up."""
        v, w = vw.T
        cos, sin = np.cos(self.roll), np.sin(self.roll)
        return self.middle + np.column_stack([w * sin - v * cos, v * sin + w * cos])


class Swept:
    """The profile of a run, grown by its margin on all sides but downwards."""

    def __init__(self, profile: ShownProfile) -> None:
        self._profile, self.spacing_m = profile, profile.spacing_m
        corners = [QgsPointXY(v, w) for v, w in profile.points]
        grown = QgsGeometry.fromPolygonXY([corners])
        if profile.margin_m:
            grown = grown.buffer(profile.margin_m, ARC_PARTS)
            grown.convertToSingleType()
        self._ring = np.array([(corner.x(), corner.y()) for corner in grown.asPolygon()[0]])
        self._ring[:, 1] = np.maximum(self._ring[:, 1], min(w for _, w in profile.points))

    def outline(self, left_m: float, right_m: float) -> np.ndarray:
        """Return v and w of the closed outline, (n, 2), widened on both sides."""
        v, w = self._ring.T
        return np.column_stack([v + np.where(v > 0, left_m, 0.0) - np.where(v < 0, right_m, 0.0), w])

    def legend(self, left_m: float, right_m: float) -> str:
        """Say what the outline is; the widening on the left comes first."""
        margin_mm, is_wide = 1000 * self._profile.margin_m, max(left_m, right_m) >= LEAST_WIDENING_M
        margin = f"margin {margin_mm:.0f} mm" if margin_mm else ""
        wide = f"widening {1000 * left_m:.0f} and {1000 * right_m:.0f} mm" if is_wide else ""
        return ", ".join(filter(None, (f"profile {self._profile.name}", margin, wide)))
