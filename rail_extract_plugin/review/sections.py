"""The cross-section of a finding: its plane, the rails of the run, and the points, which are read in the background."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from qgis.core import QgsProject, QgsTask, QgsVectorLayer

from ...core.errors import Cancelled, RailExtractError
from ..feedback import TaskProgress
from ..writing.layers import vertices_of
from ..writing.run import RUN, RunCloud, cloud_of
from .findings import Review

if TYPE_CHECKING:
    from ...core.clouds.sections import Section

REACH_M = 2.0
"""Distance from the place up to which points are shown: both rails of any track, and what lies next to them."""

THICKNESS_M = 0.5
"""Points up to this far ahead and behind are shown: fewer than this would not show the heads in sparse clouds."""


@dataclass(frozen=True)
class Picture:
    """What a cross-section shows, metres to the right and up as seen along the track.

    Attributes
    ----------
    points : (n, 2) array or None
        None until they are read.
    rails : (k, 2) array
    head_width_m : float
    note : str
        What is missing, and why.
    """

    points: np.ndarray | None
    rails: np.ndarray
    head_width_m: float
    note: str = ""


class Sections:
    """The cross-sections of a layer of findings.

    Parameters
    ----------
    layer : QgsVectorLayer
    found : sequence of Review
    """

    def __init__(self, layer: QgsVectorLayer, found: Sequence[Review]) -> None:
        self.cloud = cloud_of(layer)
        self._units_m = np.array(self.cloud.units_m if self.cloud else (1.0, 1.0, 1.0))
        self._planes: dict[int, Section] = {one.feature.id(): self._plane(one) for one in found}
        self._run = layer.customProperty(RUN)
        self.points: dict[int, np.ndarray] = {}
        self.note = "" if self.cloud else "The layer does not state its cloud: only rails are shown."
        if self.cloud and not all(Path(path).exists() for path in self.cloud.paths):
            self.note = f"{self.cloud.name} is not at its place any more: only rails are shown."

    @property
    def places(self) -> dict[int, np.ndarray]:
        """Places of the sections by the id of the finding, metres from the zero of the coordinate system."""
        return {number: plane.place for number, plane in self._planes.items()}

    def picture(self, review: Review) -> Picture:
        """Return what the section of a finding shows."""
        plane, width_m = self._planes[review.feature.id()], self.cloud.head_width_m if self.cloud else 0.07
        rails, points = self._rails(plane, review, width_m), self.points.get(review.feature.id())
        shown = None
        if points is not None:
            seen = plane.seen(points)
            shown = seen[np.abs(seen[:, 0]) <= THICKNESS_M, 1:]
        level = np.array([0.0, _level(rails, shown)])
        return Picture(None if shown is None else shown - level, np.nan_to_num(rails - level), width_m, self.note)

    def _plane(self, review: Review) -> Section:
        from ...core.clouds.sections import section_at

        return section_at(np.nan_to_num(vertices_of(review.feature)) * self._units_m, review.worst_share)

    def _rails(self, plane: Section, review: Review, width_m: float) -> np.ndarray:
        """Return where the rails of the run cross a plane, or where gauge and cant put them, (k, 2)."""
        crossings = [plane.crossings(line * self._units_m) for line in _rails_of_run(self._run)]
        near = [places[np.abs(places[:, 0]) <= REACH_M] for places in crossings]
        if any(map(len, near)):
            return np.concatenate(near)
        gauge, cant = review.value("gauge_mm"), review.value("cant_mm")
        if gauge is None:
            return np.empty((0, 2))
        half_m, rise_m = 0.5 * (gauge / 1000 + width_m), 0.0005 * (cant or 0.0)
        return np.array([[-half_m, rise_m], [half_m, -rise_m]])


class ReadingTask(QgsTask):
    """Reads the points of all sections from the cloud, in a thread of QGIS.

    Parameters
    ----------
    cloud : RunCloud
    places : mapping of int to (3,) array
    done : callable
        Called in the main thread with the points by id, and with a sentence if they could not be read.
    """

    def __init__(
        self, cloud: RunCloud, places: Mapping[int, np.ndarray], done: Callable[[dict[int, np.ndarray], str], None]
    ) -> None:
        super().__init__("Rail Extract: cross-sections", QgsTask.Flag.CanCancel)
        self._cloud, self._places, self._done = cloud, dict(places), done
        self._points: dict[int, np.ndarray] = {}
        self._error = ""

    def run(self) -> bool:
        """Read the points; no exception may leave this method."""
        try:
            from ...core.clouds.points import ask
            from ...core.clouds.sections import points_near

            request = ask(self._cloud.paths, self._cloud.class_codes, self._cloud.crs_wkt)
            found = points_near(request, list(self._places.values()), REACH_M, TaskProgress(self))
            self._points = dict(zip(self._places, found))
        except Cancelled:
            return False
        except RailExtractError as error:
            self._error = str(error)
        except Exception as error:
            self._error = f"The points can't be read ({type(error).__name__}: {error})."
        return True

    def finished(self, result: bool) -> None:
        """Pass the points on, in the main thread."""
        if result:
            self._done(self._points, self._error)


def _level(rails: np.ndarray, points: np.ndarray | None) -> float:
    """Return the height of the middle of the picture: that of the rails or, without heights, of the points."""
    for heights in (rails[:, 1], np.empty(0) if points is None else points[:, 1]):
        if np.isfinite(heights).any():
            return float(np.nanmedian(heights))
    return 0.0


def _rails_of_run(run: str | None) -> list[np.ndarray]:
    """Return the rails that the same run has loaded, (n, 3) each."""
    layers = QgsProject.instance().mapLayers().values()
    mine = [
        layer
        for layer in layers
        if run and layer.customProperty(RUN) == run and isinstance(layer, QgsVectorLayer)
        if layer.fields().lookupField("rail_id") >= 0 and layer.fields().lookupField("resid_mm") >= 0
    ]
    return [vertices_of(feature) for layer in mine for feature in layer.getFeatures() if feature.hasGeometry()]
