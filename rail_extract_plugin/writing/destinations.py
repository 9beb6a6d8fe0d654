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
    QgsProperty,
)

from ...core.disk import Destination
from ...core.errors import RailExtractError

TABLE = "ogr:"
"""Prefix of destinations that are a table of a file."""


def destinations(values: Mapping[str, Any], context: QgsProcessingContext) -> dict[str, Destination]:
    """Check before the run that the outputs can be written, and remember what they replace.

    Parameters
    ----------
    values : mapping of str to str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of each destination parameter.
    context : QgsProcessingContext

    Returns
    -------
    dict of str to Destination
        The outputs that go into files.

    Raises
    ------
    RailExtractError
        A file cannot be written, or two outputs overwrite each other.
    """
    files = {name: output_file(value, context) for name, value in values.items()}
    found = {name: Destination.at(file) for name, file in files.items() if file is not None}
    _check_distinct({name: (found[name].file, outputoutput_table(values[name], context)) for name in found})
    return found


def _check_distinct(outputs: Mapping[str, tuple[Path, str]]) -> None:
    """Check that no two outputs are the same file, or the same table of a file."""
    seen: list[tuple[str, str, str]] = []
    for name, (path, table) in outputs.items():
        file = os.path.normcase(path)
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


def output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """Return the file of a destination; None for memory layers and databases."""
    text = _text(value, context)
    return plain_file(_uri(text).database() if text.startswith(TABLE) else text, context)


def output_table(text: str) -> str:
    """Return the table that a destination names in a file; empty if it is the file itself."""
    return _uri(text).table() if text.startswith(TABLE) else ""


def _uri(text: str) -> QgsDataSourceUri:
    return QgsDataSourceUri(text[len(TABLE) :])
