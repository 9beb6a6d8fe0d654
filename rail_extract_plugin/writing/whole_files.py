"""Writes vector files under a temporary name and moves them when complete; an existing file stays until then."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from osgeo import gdal
from qgis.core import (
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
)

from ...core.disk import Destination, scratch_folder
from ...core.errors import RailExtractError
from ...core.files.geopackage import tables_in
from ..dialog.parameter_values import ParameterValues
from .destinations import appends, output_file, table_of

Write = Callable[[Any], tuple[str, int]]


def write_whole(
    value: Any,
    context: QgsProcessingContext,
    destination: Destination | None,
    write: Write,
    system_wkt: str | None = None,
) -> str:
    """Write a layer in a temporary folder next to its destination, and move its files there when complete.

    The other tables of a GeoPackage stay, and so do the features of a layer to which new ones are added. Memory layers,
    and tables in databases on servers, are written directly. `write` writes to such a value, and returns the layer's id
    and number of features; `system_wkt` is the coordinate system that the file is to state, where QGIS can write only
    part of it. Returns the layer's id, empty if the user skipped the output. Raises RailExtractError if the files
    cannot be written completely.
    """
    if destination is None:
        return write(value)[0]
    table, stem = table_of(value, context), destination.file.stem
    if table or (not appends(value) and (system_wkt or tables_in(destination.file) - {stem})):
        layer_id = _write_table(value, destination, table or stem, write, None if appends(value) else system_wkt)
        name = f"|layername={table or stem}"
    else:
        with destination.replacing(edit=appends(value)) as new:
            layer_id = _write_file(value, new, write)
        name = layer_id.rsplit(new.name, 1)[1]
    return _renamed(layer_id, f"{destination.path}{name}", context)


def _write_table(value: Any, destination: Destination, table: str, write: Write, system_wkt: str | None) -> str:
    """Write a table of a file that may have others; returns the layer's id before its files are moved.

    The table is written in a file of its own first: QGIS takes the coordinate system from the first table of a file.
    """
    keep = bool(tables_in(destination.file) - {table}) or appends(value)
    with destination.replacing(edit=keep) as new, scratch_folder(new.parent.parent) as aside:
        alone = aside / f"{table}{new.suffix}"
        if appends(value):
            _copy_table(new, alone, table)
        layer_id = _write_file(value, alone, write)
        _copy_table(alone, new, table, system_wkt)
    return layer_id


def write_each(writers: Mapping[str, Callable[[], dict[str, str]]], values: ParameterValues) -> dict[str, str]:
    """Write the outputs of a run one after the other; if one fails, the others are still written.

    A writer returns the path or id by the name of its output, or nothing if skipped. Raises RailExtractError with what
    could not be written, why, and which files are complete.
    """
    written: dict[str, str] = {}
    failures: dict[str, Exception] = {}
    for name, write in writers.items():
        try:
            written.update(write())
        except (RailExtractError, QgsProcessingException) as error:
            failures[name] = error
    if failures:
        whole = [name for name in written if output_file(values.parameters[name], values.context)]
        raise RailExtractError(_explain(failures, whole))
    return written


def _explain(failures: Mapping[str, Exception], whole: Sequence[str]) -> str:
    """Return the first reason, the outputs that failed and the outputs that are complete."""
    first = str(next(iter(failures.values())))
    if not whole:
        return first
    return f"{first} Not written: {', '.join(failures)}. Complete: {', '.join(whole)}."


def _redirected(value: Any, sink: str) -> Any:
    """Return the same destination for another file or layer."""
    if not isinstance(value, QgsProcessingOutputLayerDefinition):
        return sink
    other = QgsProcessingOutputLayerDefinition(value)
    other.sink = QgsProperty.fromValue(sink)
    return other


def _write_file(value: Any, file: Path, write: Write) -> str:
    """Write a layer to another file than its own; returns the layer's id."""
    before = _count(file)
    try:
        layer_id, count = write(_redirected(value, str(file)))
    except (RailExtractError, QgsProcessingException) as error:
        # Without the traceback, which would keep the file open: Windows could not delete it.
        raise RailExtractError(str(error).replace(str(file), file.name)) from None
    found = _count(file) - before
    if found < count:  # GDAL does not report errors on closing
        raise RailExtractError(
            f"The output can't be written ({found} of {count} features were written): check the free disk space."
        )
    return layer_id


def _count(file: Path) -> int:
    """Count the features of a file, with GDAL: a QGIS layer would build its coordinate system in this thread."""
    try:
        dataset = gdal.OpenEx(str(file), gdal.OF_VECTOR) if file.exists() else None
        return dataset.GetLayer(0).GetFeatureCount() if dataset else 0
    except RuntimeError:  # raised by newer GDAL
        return 0


def _copy_table(source: Path, target: Path, table: str, system_wkt: str | None = None) -> None:
    """Copy a table of a file into another file, in place of the table of this name; it may state another system.

    Raises OSError if the other file cannot be written.
    """
    gdal.ErrorReset()
    mode = "overwrite" if target.exists() else None
    try:
        options = gdal.VectorTranslateOptions(
            accessMode=mode, layers=[table], layerName=table, dstSRS=system_wkt, reproject=False
        )
        copied = gdal.VectorTranslate(str(target), str(source), options=options)
        del copied  # closes the file
        failed = gdal.GetLastErrorType() >= gdal.CE_Failure
    except RuntimeError as error:
        raise OSError(str(error)) from error
    if failed:
        raise OSError(gdal.GetLastErrorMsg())


def _renamed(layer_id: str, other_id: str, context: QgsProcessingContext) -> str:
    """Make QGIS load the layer from its final path."""
    waiting = context.layersToLoadOnCompletion()
    context.setLayersToLoadOnCompletion({other_id if key == layer_id else key: waiting[key] for key in waiting})
    return other_id
