"""Messages in the user's terms: in QGIS's windows a parameter is called by its label, not by its name in scripts."""

from __future__ import annotations

import re
from collections.abc import Sequence

from qgis.core import QgsApplication, QgsProcessingParameterDefinition

from .passwords import masked

WITH_DIALOGS = "desktop"
"""QGIS's name for the platform with windows."""

NAME = r"(?<![\w./\\])[A-Z][A-Z_]+(?![\w/\\]|\.\w)"
"""A word in capitals that is not part of a path."""


OVERLONG, SHOWN = r"\S{500,}", 100
"""A word longer than the name of any file, and how many of its characters are shown: a window grows with its text."""


def for_user(sentence: str, definitions: Sequence[QgsProcessingParameterDefinition]) -> str:
    """Return the sentence without passwords, and with labels for parameter names if this QGIS has windows."""
    sentence = re.sub(OVERLONG, lambda word: f"{word[0][:SHOWN]}…", masked(sentence))
    return with_labels(sentence, definitions) if QgsApplication.platform() == WITH_DIALOGS else sentence


def with_labels(sentence: str, definitions: Sequence[QgsProcessingParameterDefinition]) -> str:
    """Replace the names of parameters with their labels in quotes."""
    labels = {definition.name(): definition.description() for definition in definitions}
    return re.sub(NAME, lambda name: f'"{labels[name[0]]}"' if name[0] in labels else name[0], sentence)
