"""Writes vector files under a temporary name and renames them when complete; an existing file stays until then."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from uuid import uuid4

from osgeo import gdal
from qgis.core import (
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
)

from ...core.disk import take_names
from ...core.errors import RailExtractError
from .destinations import plain_file

PREFIX = "rail_extract_"


def write_whole(value: Any, context: QgsProcessingContext, write: Callable[[Any], tuple[str, int]]) -> str:
    """Write a layer in a temporary folder next to its destination, and move its files there when complete.

    Memory layers, and tables in databases and existing files, are written directly.

    Parameters
    ----------
    value : str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of the destination parameter.
    context : QgsProcessingContext
    write : callable
        Writes to such a destination, and returns the layer's id and number of features; an empty id if skipped.

    Returns
    -------
    str
        The layer's id; empty if the user skipped the output.

    Raises
    ------
    RailExtractError
        The files cannot be written completely.
    """
    path = plain_file(value, context)
    if path is None:
        return write(value)[0]
    # An ordinary folder: files keep its access rights on Windows, where only its creator may read a temporary folder.
    folder = path.absolute().with_name(PREFIX + uuid4().hex[:8])
    try:
        folder.mkdir()
        layer_id, count = write(_redirected(value, folder / path.name))
        _check_count(layer_id, count)
        take_names(path, {file: path.with_name(file.name) for file in folder.iterdir()})
    except OSError as error:
        raise RailExtractError(
            f"The output {path} can't be written ({error.strerror}): choose another place."
        ) from error
    except (RailExtractError, QgsProcessingException) as error:
        # The traceback would keep the file open, and Windows could not delete it.
        raise error.with_traceback(None) from error.__cause__
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return _renamed(layer_id, str(path) + layer_id.rsplit(path.name, 1)[1], context)


def write_each(
    writers: Mapping[str, Callable[[], dict[str, str]]], parameters: dict[str, Any], context: QgsProcessingContext
) -> dict[str, str]:
    """Write the outputs of a run one after the other; if one fails, the others are still written.

    Parameters
    ----------
    writers : mapping of str to callable
        Function that writes an output, by its name; returns the path or id by that name, or nothing if skipped.
    parameters : dict
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        An output could not be written; the message states which, why, and which files are complete.
    """
    written: dict[str, str] = {}
    failures: dict[str, Exception] = {}
    for name, write in writers.items():
        try:
            written.update(write())
        except (RailExtractError, QgsProcessingException) as error:
            failures[name] = error
    if failures:
        raise RailExtractError(_explain(failures, [name for name in written if plain_file(parameters[name], context)]))
    return written


def _explain(failures: Mapping[str, Exception], whole: Sequence[str]) -> str:
    """Return the first reason, the outputs that failed and the outputs that are complete."""
    first = str(next(iter(failures.values())))
    if not whole:
        return first
    return f"{first} Not written: {', '.join(failures)}. Complete: {', '.join(whole)}."


def _redirected(value: Any, path: Path) -> Any:
    """Return the same destination for another file."""
    if not isinstance(value, QgsProcessingOutputLayerDefinition):
        return str(path)
    other = QgsProcessingOutputLayerDefinition(value)
    other.sink = QgsProperty.fromValue(str(path))
    return other


def _check_count(layer_id: str, count: int) -> None:
    """Check that a file has all its features, because GDAL does not report errors on closing."""
    found = _count(layer_id.partition("|layername=")[0])
    if found < count:
        raise RailExtractError(
            f"The output can't be written ({found} of {count} features were written): check the free disk space."
        )


def _count(path: str) -> int:
    """Count the features of a file, with GDAL: a QGIS layer would build its coordinate system in this thread."""
    try:
        dataset = gdal.OpenEx(path, gdal.OF_VECTOR)
        return dataset.GetLayer(0).GetFeatureCount() if dataset else 0
    except RuntimeError:  # raised by newer GDAL
        return 0


def _renamed(layer_id: str, other_id: str, context: QgsProcessingContext) -> str:
    """Make QGIS load the layer from its final path."""
    waiting = context.layersToLoadOnCompletion()
    context.setLayersToLoadOnCompletion({other_id if key == layer_id else key: waiting[key] for key in waiting})
    return other_id
