"""A run on a small part of a cloud, the one that the map shows: it takes seconds, and nothing of it is kept.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsLayerTree,
    QgsMapLayer,
    QgsPointXY,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProject,
    QgsRectangle,
    QgsUnitTypes,
)
from qgis.gui import QgsMapCanvas

from ...core.standards import SEARCHED_CLASSES
from ..reading.clouds import cloud_source
from ..systems import system

if TYPE_CHECKING:
    from ...core.clouds.points import Request

TEXT = "Try the visible part"
TIP = (
    "Runs on at most 100 m of the cloud, in the middle of what the map shows, or on a first part if the map shows "
    "nothing of it. The lines go with the next run; files, standard and report stay as they are."
)

SIDE_M = 100.0
"""Side of the square that is tried: a hundred metres of track take some seconds."""

SHOWN = ("RAILS", "CENTERLINES")
"""Outputs that are shown."""

PREVIEW = "rail_extract/preview"
"""Property of the group of layers."""


def limited(given: dict[str, Any], outputs: Sequence[str], extent: str) -> dict[str, Any]:
    """Return the values of a run, limited to an extent and to lines that are not kept."""
    project = QgsProject.instance()
    lines = {name: QgsProcessingOutputLayerDefinition(QgsProcessing.TEMPORARY_OUTPUT, project) for name in SHOWN}
    return {**given, **dict.fromkeys(outputs), **lines, "EXTENT": extent}


def visible_part(value: Any, canvas: QgsMapCanvas) -> str:
    """Return the extent to try of the cloud that a parameter names; raises CloudError if it names none."""
    from ...core.clouds.points import ask

    layer = QgsProject.instance().mapLayer(value) if isinstance(value, str) else None
    source = cloud_source(layer or value, QgsProcessingContext())
    request = ask(source.paths, SEARCHED_CLASSES, source.crs_wkt)
    crs = system(request.zero.crs_wkt)
    seen = _seen(canvas, crs)
    boxes = [QgsRectangle(*header.extent) for header in request.headers]
    shown = next((box.intersect(seen) for box in boxes if seen is not None and box.intersects(seen)), None)
    middle = shown.center() if shown is not None else _some_place(request)
    side = SIDE_M * QgsUnitTypes.fromUnitToUnitFactor(QgsUnitTypes.DistanceUnit.DistanceMeters, crs.mapUnits())
    side = side if crs.isValid() else SIDE_M
    box = QgsRectangle.fromCenterAndSize(middle, side, side)
    box = box if shown is None else box.intersect(shown)
    text = ",".join(f"{value:.3f}" for value in (box.xMinimum(), box.xMaximum(), box.yMinimum(), box.yMaximum()))
    return f"{text} [{crs.authid()}]" if crs.authid() else text


def _some_place(request: Request) -> QgsPointXY:
    """Return the place of a point of a cloud, in the middle of those that are read first."""
    xyz = next(request.read(request.headers[0]))[0]
    return QgsPointXY(*xyz[len(xyz) // 2, :2])


def _seen(canvas: QgsMapCanvas, crs: QgsCoordinateReferenceSystem) -> QgsRectangle | None:
    """Return what a map shows, in another coordinate system; None if it shows nothing, or nothing of that system."""
    if not canvas.layers():
        return None
    transform = QgsCoordinateTransform(canvas.mapSettings().destinationCrs(), crs, QgsProject.instance())
    with suppress(QgsCsException):
        return transform.transformBoundingBox(canvas.extent())
    return None


def name_preview(layer: QgsMapLayer) -> None:
    """Say of the group of a layer that it is a preview."""
    group = QgsProject.instance().layerTreeRoot().findLayer(layer.id()).parent()
    group.setName(f"Preview of {group.name()}")
    group.setCustomProperty(PREVIEW, True)


def drop_previews() -> None:
    """Remove the layers of previews from the project."""
    root = QgsProject.instance().layerTreeRoot()
    for group in [one for one in root.children() if QgsLayerTree.isGroup(one) and one.customProperty(PREVIEW)]:
        QgsProject.instance().removeMapLayers(group.findLayerIds())
        root.removeChildNode(group)
