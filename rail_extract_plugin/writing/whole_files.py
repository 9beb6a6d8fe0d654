"""Vector files that take their name when they are whole: what was there before stays until then."""

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
    """Write a layer in a folder beside its destination, and move its files there when they are complete.

    Memory layers and tables in databases and existing files are written where they belong.

    Parameters
    ----------
    value : str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of the destination parameter.
    context : QgsProcessingContext
    write : callable
        Writes to such a value, and gives the layer's id and the number of its features, or an empty id.

    Returns
    -------
    str
        The layer's id, empty where the user skipped the output.

    Raises
    ------
    RailExtractError
        The files can't be written, or not completely.
    """
    path = plain_file(value, context)
    if path is None:
        return write(value)[0]
    # With the rights of any new folder: its files keep them on Windows, where a temporary one is its maker's alone.
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
        # What a traceback refers to keeps the file open, and Windows does not remove it then.
        raise error.with_traceback(None) from error.__cause__
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return _renamed(layer_id, str(path) + layer_id.rsplit(path.name, 1)[1], context)


def write_each(
    writers: Mapping[str, Callable[[], dict[str, str]]], parameters: dict[str, Any], context: QgsProcessingContext
) -> dict[str, str]:
    """Write the outputs of a run one after the other; where one fails, the others are not lost.

    Parameters
    ----------
    writers : mapping of str to callable
        By the output's name what writes it, and gives the path or id by that name, or nothing if it is skipped.
    parameters : dict
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        Some could not be written; says which, why, and which files are whole.
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
    """Give the first reason, and say which outputs are missing and which are whole."""
    first = str(next(iter(failures.values())))
    if not whole:
        return first
    return f"{first} Not written: {', '.join(failures)}. Written and whole: {', '.join(whole)}."


def _redirected(value: Any, path: Path) -> Any:
    """Give the same value for another file."""
    if not isinstance(value, QgsProcessingOutputLayerDefinition):
        return str(path)
    other = QgsProcessingOutputLayerDefinition(value)
    other.sink = QgsProperty.fromValue(str(path))
    return other


def _check_count(layer_id: str, count: int) -> None:
    """Refuse a file that holds fewer features than were written: GDAL does not tell what fails on closing."""
    found = _count(layer_id.partition("|layername=")[0])
    if found < count:
        raise RailExtractError(
            f"The output can't be written ({found} of {count} features arrived): check the disk's free space."
        )


def _count(path: str) -> int:
    """Count the features of a file; with GDAL alone, for a layer would bring its coordinate system to this thread."""
    try:
        dataset = gdal.OpenEx(path, gdal.OF_VECTOR)
        return dataset.GetLayer(0).GetFeatureCount() if dataset else 0
    except RuntimeError:  # newer GDAL raises this
        return 0


def _renamed(layer_id: str, other_id: str, context: QgsProcessingContext) -> str:
    """Have QGIS load the layer from where it is now."""
    waiting = context.layersToLoadOnCompletion()
    context.setLayersToLoadOnCompletion({other_id if key == layer_id else key: waiting[key] for key in waiting})
    return other_id
