"""Whether outputs can be written where the user wants them."""

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
"""Begins destinations that are a table of a file."""


def check_writable(value: Any, context: QgsProcessingContext) -> None:
    """Refuse an output that could not be written, before the work begins.

    Parameters
    ----------
    value : str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of a destination parameter.
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        The file or its folder does not let itself be written.
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
    """Open a file, or make one beside where it will be; path.exists() would hide a name too long from Python 3.14."""
    try:
        path.stat()
    except FileNotFoundError:
        TemporaryFile(dir=path.absolute().parent).close()
    else:
        path.open("r+b").close()


def check_distinct(outputs: Mapping[str, Any], context: QgsProcessingContext) -> None:
    """Refuse two outputs, values by name, that would overwrite each other.

    Raises
    ------
    RailExtractError
        Two are the same file, or the same table of one.
    """
    seen: list[tuple[str, str, str]] = []
    for name, value in outputs.items():
        path = _output_file(value, context)
        if path is None:
            continue
        file, table = os.path.normcase(path.resolve()), _table(_text(value, context))
        for other, other_file, other_table in seen:
            if file == other_file and (not table or not other_table or table == other_table):
                raise RailExtractError(f"{other} and {name} are one file: give each a name of its own.")
        seen.append((name, file, table))


def is_wanted(value: Any, context: QgsProcessingContext) -> bool:
    """Return whether a destination names anything; the batch dialog gives an empty definition for a skipped output."""
    return bool(_text(value, context))


def _text(value: Any, context: QgsProcessingContext) -> str:
    """Destination as a user writes it; empty where there is none."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    return value or ""


def plain_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """File that a destination names by its path; None for memory layers, databases and tables of a file."""
    text = _text(value, context)
    is_file = text and text != QgsProcessing.TEMPORARY_OUTPUT and not re.match(r"\w{2,}:", text)
    return Path(text) if is_file else None


def _output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """File behind a destination; None for memory layers and databases."""
    text = _text(value, context)
    return plain_file(_uri(text).database() if text.startswith(TABLE) else text, context)


def _table(text: str) -> str:
    """Table that a destination names in a file; empty where it is the file itself."""
    return _uri(text).table() if text.startswith(TABLE) else ""


def _uri(text: str) -> QgsDataSourceUri:
    return QgsDataSourceUri(text[len(TABLE) :])
