"""Whether outputs can be written where the user wants them."""

from __future__ import annotations

import re
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

from ..core.errors import RailExtractError


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
    if path.is_dir():
        raise RailExtractError(f"The output {path} is a folder: give the name of a file in it.")
    try:
        if path.exists():
            path.open("r+b").close()
        else:
            TemporaryFile(dir=path.absolute().parent).close()
    except OSError as error:
        raise RailExtractError(
            f"The output {path} can't be written ({error.strerror}): choose another place."
        ) from error


def _output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """File behind a destination; None for memory layers and databases."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    text = value or ""
    if text.startswith("ogr:"):
        text = QgsDataSourceUri(text[len("ogr:") :]).database()
    is_file = text and text != QgsProcessing.TEMPORARY_OUTPUT and not re.match(r"\w{2,}:", text)
    return Path(text) if is_file else None
