"""Saves the layers of a run as one GeoPackage with their styles and a project."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path

from qgis.core import QgsDataProvider, QgsMapLayerStyle, QgsProject, QgsVectorFileWriter, QgsVectorLayer

from ...core.disk import Destination
from ...core.errors import RailExtractError

PROJECT = "Rail Extract"
"""Name of the project in the file, and of the group of its layers."""


def save_all(layers: Sequence[QgsVectorLayer], path: Path, report: Path | None = None) -> Path | None:
    """Write layers, the topmost first, with styles and aliases of their fields, and a project that shows them.

    An existing file stays until the new one is complete. The report of the run is copied to a file beside; its path is
    returned. Raises RailExtractError if the file cannot be written, or a layer is being edited.
    """
    edited = next((layer.name() for layer in layers if layer.isModified()), None)
    if edited:
        raise RailExtractError(f'"{edited}" has edits that are not saved: save or discard them, then save all layers.')
    tables = _tables(layers)
    with Destination.at(path).replacing() as new:
        project = QgsProject()
        project.setTitle(PROJECT)
        group = project.layerTreeRoot().addGroup(PROJECT)
        for number, layer in enumerate(layers):
            saved = _saved(layer, tables[layer.id()], new, is_first=number == 0)
            project.addMapLayer(saved, False)
            group.addLayer(saved)
            project.setCrs(saved.crs())
        written = project.write(f"geopackage:{new}?projectName={PROJECT}")
        project.clear()  # closes the file
        if not written:
            raise RailExtractError(f"The project can't be written to {path.name}: check the free disk space.")
    if report is None or not report.is_file():
        return None
    copied = path.with_name(f"{path.stem} report.html")
    Destination.at(copied).write_text(report.read_text(encoding="utf-8"))
    return copied


def move_to(layers: Sequence[QgsVectorLayer], path: Path) -> None:
    """Have layers of the project read and write their tables in a file that `save_all` has written."""
    tables = _tables(layers)
    for layer in layers:
        crs, source = layer.crs(), f"{path}|layername={tables[layer.id()]}"
        layer.setDataSource(source, layer.name(), "ogr", QgsDataProvider.ProviderOptions())
        layer.setCrs(crs)
        layer.triggerRepaint()


def _tables(layers: Sequence[QgsVectorLayer]) -> dict[str, str]:
    """Return the name of the table of each layer, by its id: the name of its output, without the cloud."""
    tables: dict[str, str] = {}
    for layer in layers:
        name = layer.name().partition(":")[0].strip().lower().replace(" ", "_")
        numbered = (name if number == 1 else f"{name}_{number}" for number in count(1))
        tables[layer.id()] = next(one for one in numbered if one not in tables.values())
    return tables


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
