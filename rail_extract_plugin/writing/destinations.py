"""Checks of destinations: whether the outputs can be written there."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from qgis.core import (
    QgsDataSourceUri,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
)

from ...core.disk import check_closed
from ...core.errors import RailExtractError

TABLE = "ogr:"
"""Prefix of destinations that are a table of a file."""


def check_writable(value: Any, context: QgsProcessingContext) -> None:
    """Check before the run that an output can be written.

    Parameters
    ----------
    value : str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of a destination parameter.
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        The file or its folder is not writable.
    """
    path = _output_file(value, context)
    if path is None:
        return
    try:
        if path.is_dir():
            raise RailExtractError(f"The output {path} is a folder: give the name of a file in it.")
        _try_writing(path)
        if plain_file(value, context) and path.exists():
            path.replace(path)  # refused on Windows while another program has it open
            check_closed(path)
    except OSError as error:
        raise RailExtractError(
            f"The output {path} can't be written ({error.strerror}): choose another place."
        ) from error


def _try_writing(path: Path) -> None:
    """Open a file, or create one in its folder; from Python 3.14, path.exists() would hide a name that is too long."""
    try:
        path.stat()
    except FileNotFoundError:
        TemporaryFile(dir=path.absolute().parent).close()
    else:
        path.open("r+b").close()


def check_distinct(outputs: Mapping[str, Any], context: QgsProcessingContext) -> None:
    """Check that no two outputs overwrite each other.

    Parameters
    ----------
    outputs : mapping of str to value
        Destinations by name.
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        Two outputs are the same file or the same table of a file.
    """
    seen: list[tuple[str, str, str]] = []
    for name, value in outputs.items():
        path = _output_file(value, context)
        if path is None:
            continue
        file, table = os.path.normcase(path.resolve()), _table(_text(value, context))
        for other, other_file, other_table in seen:
            if file == other_file and (not table or not other_table or table == other_table):
                raise RailExtractError(f"{other} and {name} are the same file: give each its own name.")
        seen.append((name, file, table))


def is_wanted(value: Any, context: QgsProcessingContext) -> bool:
    """Return whether a destination names anything; the batch dialog gives an empty definition for a skipped output."""
    return bool(_text(value, context))


def _text(value: Any, context: QgsProcessingContext) -> str:
    """Return a destination as a user writes it; empty if there is none."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    return value or ""


def plain_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """Return the file of a destination given as a path; None for memory layers, databases and tables of a file."""
    text = _text(value, context)
    is_file = text and text != QgsProcessing.TEMPORARY_OUTPUT and not re.match(r"\w{2,}:", text)
    return Path(text) if is_file else None


def _output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """Return the file of a destination; None for memory layers and databases."""
    text = _text(value, context)
    return plain_file(_uri(text).database() if text.startswith(TABLE) else text, context)


def _table(text: str) -> str:
    """Return the table that a destination names in a file; empty if it is the file itself."""
    return _uri(text).table() if text.startswith(TABLE) else ""


def _uri(text: str) -> QgsDataSourceUri:
    return QgsDataSourceUri(text[len(TABLE) :])
