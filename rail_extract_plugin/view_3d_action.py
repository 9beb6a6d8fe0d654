"""The menu entry "Show Lines in 3D": a 3D map view that opens on the lines of the selected layer."""

from __future__ import annotations

from math import isfinite
from typing import Any

from qgis.core import QgsVector3D, QgsVectorLayer

NAME = "Show Lines in 3D"

TILT_DEG = 45.0
"""Angle between the view and the vertical: plan and heights are both seen."""
ROOM = 1.5
"""Factor by which the extent is enlarged: less of the front than of the middle fits into an inclined view."""


def show_in_3d(iface: Any) -> None:
    """Open a 3D map view above the lines of the selected layer, with its ground below, if `compat.OPENS_3D_VIEWS`."""
    layer = iface.activeLayer()
    heights = _heights(layer) if isinstance(layer, QgsVectorLayer) else []
    if not heights:
        iface.messageBar().pushWarning(NAME, "Select a layer of 3D lines first, such as rails or centerlines.")
        return
    extent = iface.mapCanvas().mapSettings().layerExtentToOutputExtent(layer, layer.extent())
    extent.scale(ROOM)
    view = iface.createNewMapCanvas3D(layer.name())
    # A new view looks at height zero. In the mountains its camera would be below the lines.
    settings, camera = view.mapSettings(), view.cameraController()
    settings.setTerrainElevationOffset(min(heights))
    view.scene().setViewFrom2DExtent(extent)
    middle = QgsVector3D(extent.center().x(), extent.center().y(), min(heights))
    camera.setLookingAtPoint(settings.mapToWorldCoordinates(middle), camera.distance(), TILT_DEG, 0.0)


def _heights(layer: QgsVectorLayer) -> list[float]:
    """Return the lowest height of each feature that has any; a layer in memory does not know its own."""
    shapes = (feature.geometry().constGet() for feature in layer.getFeatures() if feature.hasGeometry())
    return [height for height in (shape.boundingBox3D().zMinimum() for shape in shapes) if isfinite(height)]
