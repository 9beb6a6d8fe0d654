"""The one place where errors become sentences.

PyQt ends QGIS if an exception leaves a method that QGIS calls, and shows a traceback in other places. Every such method
of an algorithm therefore catches whatever is raised and passes it to `sentence_for`.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence

from qgis.core import Qgis, QgsApplication, QgsMessageLog, QgsProcessingException, QgsProcessingParameterDefinition

from ...core.errors import Cancelled, RailExtractError
from ..dialog.guide import tracker
from ..dialog.passwords import masked
from ..dialog.wording import for_user

LOG = "Rail Extract"
"""Tab of QGIS's log panel."""

COMMAND_LINE = "qgis_process"
"""QGIS's name for the platform of its command line."""


def sentence_for(error: BaseException, definitions: Sequence[QgsProcessingParameterDefinition]) -> str:
    """Return the sentence that a user reads about an error; the traceback of an unforeseen one goes into the log.

    Some libraries raise errors that are not an `Exception`: lazrs raises one on damaged files.
    """
    if isinstance(error, RailExtractError):
        return for_user(str(error), definitions)
    if isinstance(error, QgsProcessingException):
        return masked(str(error))
    if isinstance(error, (Cancelled, KeyboardInterrupt)):
        return str(error) or "Cancelled; nothing was written."
    if isinstance(error, MemoryError):
        return "Not enough memory: choose a smaller extent."
    _log(error)
    text = masked(": ".join(filter(None, (type(error).__name__, " ".join(str(error).split())))))
    where = f" at {tracker()}" if tracker() else ""
    return f"Rail Extract failed unexpectedly ({text}): report this{where} with the traceback from the log."


def _log(error: BaseException) -> None:
    """Write a traceback into the log panel; a command line has none, so there it goes to the error output."""
    lines = traceback.format_exception(type(error), error, error.__traceback__)
    own = [] if sys.version_info >= (3, 11) else getattr(error, "__notes__", [])  # newer Pythons write them themselves
    text = masked("".join([*lines, *own]))
    QgsMessageLog.logMessage(text, LOG, Qgis.MessageLevel.Critical)
    if QgsApplication.platform() == COMMAND_LINE:
        print(text, file=sys.stderr)
