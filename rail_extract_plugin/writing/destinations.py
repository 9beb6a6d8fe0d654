"""Checks of destinations: whether the outputs can be written there."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsDataSourceUri,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProviderRegistry,
    QgsVectorDataProvider,
    QgsVectorLayer,
)

from ...core.disk import Destination
from ...core.errors import RailExtractError
from ..dialog.parameter_values import destination_text
from ..systems import prepare_system
from .databases import POSTGIS, check_database

TABLE = "ogr:"
"""Prefix of destinations that are a table of a file."""


PROVIDER = re.compile("(.{3,}?):.*", re.DOTALL)
"""What QGIS's sinks take for the name of a data provider: all that comes before a colon, even in the path of a file."""

PAGE = "html"
PAGES = ("", ".html", ".htm")
"""Suffixes of reports."""

EXCHANGED = (".dxf", ".csv")
"""Suffixes of files for other programs, which QGIS's sinks do not write; see `core.files.exchange`."""

RESERVED = "gpkg"
"""No table of a GeoPackage that holds data may begin with it."""

ESCAPE = "%[0-9A-Fa-f]{2}"
"""SQLite decodes these in the path of a GeoPackage that GDAL opens for reading."""


def destinations(values: Mapping[str, Any], context: QgsProcessingContext) -> dict[str, Destination]:
    """Check before the run that outputs can be written, remember what they replace, and return those that are files.

    Raises RailExtractError if a file cannot be written, or two outputs overwrite each other.
    """
    files: dict[Path, Destination] = {}
    found: dict[str, Destination] = {}
    for name, value in values.items():
        check_database(name, destination_text(value, context))
        path = output_file(value, context)
        if path is not None:
            if appends(value):
                _prepare_layer(name, path, table_of(value, context))
            escape = re.search(ESCAPE, str(path)) if path.suffix.lower() == ".gpkg" else None
            if escape:
                raise RailExtractError(
                    f"The output {path} can't be opened after it is written, because {escape[0]} stands for another "
                    "character in the path of a GeoPackage: choose another name."
                )
            if path.suffix.lower() == ".gpkg" and (table_of(value, context) or path.stem).lower().startswith(RESERVED):
                raise RailExtractError(
                    f"{name} can't be a table with a name that begins with {RESERVED}, which is reserved in a "
                    "GeoPackage: choose another name."
                )
            destination = Destination.at(path)
            found[name] = files.setdefault(destination.file, destination)
    _check_distinct({name: (found[name].file, table_of(values[name], context)) for name in found})
    return found


def check_layer_name(name: str, value: Any, context: QgsProcessingContext) -> None:
    """Check before the run that QGIS can write a layer of this name.

    Raises RailExtractError where no provider has the name before a colon, which QGIS reads as one of a data provider.
    """
    text = destination_text(value, context)
    file, found = output_file(value, context), PROVIDER.fullmatch(text)
    if file is not None and file.suffix.lower() in EXCHANGED:
        return  # not written by QGIS
    if found and found[1] not in (*QgsProviderRegistry.instance().providerList(), POSTGIS):
        raise RailExtractError(
            f"{name} can't be written to {text}, because QGIS takes what comes before the colon for a data provider: "
            "choose a file without a colon in its path."
        )


def check_page_name(name: str, value: Any, context: QgsProcessingContext) -> None:
    """Check before the run that a report does not replace a file of another kind, such as the cloud that is read."""
    path = output_file(value, context)
    if path is not None and path.suffix.lower() not in PAGES:
        raise RailExtractError(f"{name} can't be {path.name}: let it end in .html.")


def _prepare_layer(name: str, path: Path, table: str) -> None:
    """Check that features can be added to a layer, and build its coordinate system in this thread (see `systems`)."""
    if path.suffix.lower() in EXCHANGED:
        raise RailExtractError(
            f"Nothing can be added to {path.name}, because DXF and CSV files are written as a whole: give {name} a new "
            "file, or a layer of a GeoPackage."
        )
    source = f"{path}|layername={table}" if table else str(path)
    layer = QgsVectorLayer(source, name, "ogr")
    if (
        not layer.dataProvider()
        or not layer.dataProvider().capabilities() & QgsVectorDataProvider.Capability.AddFeatures
    ):
        raise RailExtractError(f"Nothing can be added to {source}: choose another layer for {name}.")
    prepare_system(layer.crs().toWkt() or None)


def _check_distinct(outputs: Mapping[str, tuple[Path, str]]) -> None:
    """Check that no two outputs are the same file, or the same table of a file."""
    seen: list[tuple[str, str, str]] = []
    for name, (path, table) in outputs.items():
        file = os.path.normcase(path)
        for other, other_file, other_table in seen:
            if file == other_file and (not table or not other_table or table == other_table):
                raise RailExtractError(f"{other} and {name} are the same file: give each its own name.")
        seen.append((name, file, table))


def appends(value: Any) -> bool:
    """Return whether features are to be added to an existing layer."""
    return isinstance(value, QgsProcessingOutputLayerDefinition) and value.useRemapping()


def output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """Return the file of a destination; None for memory layers and databases on servers."""
    path, _ = _file_and_table(value, context)
    is_file = path and path != QgsProcessing.TEMPORARY_OUTPUT and not re.match(r"\w{2,}:", path)
    return Path(path) if is_file and not (appends(value) and not Path(path).is_file()) else None


def table_of(value: Any, context: QgsProcessingContext) -> str:
    """Return the table that a destination names in a file; empty if it is the file itself."""
    return _file_and_table(value, context)[1]


def _file_and_table(value: Any, context: QgsProcessingContext) -> tuple[str, str]:
    """Return path and table of a destination; an existing layer is named as in QGIS's layer properties."""
    text = destination_text(value, context)
    if text.startswith(TABLE):
        return _uri(text).database(), _uri(text).table()
    if appends(value):
        parts = QgsProviderRegistry.instance().decodeUri("ogr", text)
        return parts.get("path") or text, parts.get("layerName") or ""
    return text, ""


def _uri(text: str) -> QgsDataSourceUri:
    return QgsDataSourceUri(text[len(TABLE) :])
