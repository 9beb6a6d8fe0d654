"""Saves the layers of a run as one GeoPackage with their styles and a project."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from qgis.core import QgsMapLayerStyle, QgsProject, QgsVectorFileWriter, QgsVectorLayer

from ...core.disk import Destination
from ...core.errors import RailExtractError

PROJECT = "Rail Extract"
"""Name of the project in the file, and of the group of its layers."""


def save_all(layers: Sequence[QgsVectorLayer], path: Path) -> None:
    """Write layers, the topmost first, with styles and aliases of their fields, and a project that shows them.

    An existing file stays until the new one is complete.

    Raises
    ------
    RailExtractError
        The file cannot be written.
    """
    with Destination.at(path).replacing() as new:
        project = QgsProject()
        project.setTitle(PROJECT)
        group = project.layerTreeRoot().addGroup(PROJECT)
        for number, layer in enumerate(layers):
            saved = _saved(layer, _table(layer), new, is_first=number == 0)
            project.addMapLayer(saved, False)
            group.addLayer(saved)
            project.setCrs(saved.crs())
        written = project.write(f"geopackage:{new}?projectName={PROJECT}")
        project.clear()  # closes the file
        if not written:
            raise RailExtractError(f"The project can't be written to {path.name}: check the free disk space.")


def _table(layer: QgsVectorLayer) -> str:
    """Return the name of a layer's table: that of its output, without the cloud."""
    return layer.name().partition(":")[0].strip().lower().replace(" ", "_")


def _saved(layer: QgsVectorLayer, table: str, path: Path, is_first: bool) -> QgsVectorLayer:
    """Write a layer to a table, and return the layer of the table, with style and properties, as its default."""
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName, options.layerName = "GPKG", table
    actions = QgsVectorFileWriter.ActionOnExistingFile
    options.actionOnExistingFile = actions.CreateOrOverwriteFile if is_first else actions.CreateOrOverwriteLayer
    context = QgsProject.instance().transformContext()
    code, message, *_ = QgsVectorFileWriter.writeAsVectorFormatV3(layer, str(path), context, options)
    if code != QgsVectorFileWriter.WriterError.NoError:
        raise RailExtractError(f"{path.name} can't be written ({message}): choose another folder.")
    saved = QgsVectorLayer(f"{path}|layername={table}", layer.name(), "ogr")
    style = QgsMapLayerStyle()
    style.readFromLayer(layer)
    style.writeToLayer(saved)
    for key in layer.customPropertyKeys():
        saved.setCustomProperty(key, layer.customProperty(key))
    saved.saveStyleToDatabase(table, layer.name(), True, "")
    return saved
