"""Sentences for those who see a dialog: parameters by their labels, not by the names that scripts use."""

from __future__ import annotations

import re
from collections.abc import Sequence

from qgis.core import QgsApplication, QgsProcessingParameterDefinition

WITH_DIALOGS = "desktop"
"""What QGIS calls the platform of its windows."""

NAME = r"(?<![\w./\\])[A-Z][A-Z_]+(?![\w/\\]|\.\w)"
"""A word in capitals that is no part of a path."""


def for_reader(sentence: str, definitions: Sequence[QgsProcessingParameterDefinition]) -> str:
    """Word a sentence about parameters as the platform's users know them."""
    return with_labels(sentence, definitions) if QgsApplication.platform() == WITH_DIALOGS else sentence


def with_labels(sentence: str, definitions: Sequence[QgsProcessingParameterDefinition]) -> str:
    """Put the labels, in quotes, in place of the names of parameters."""
    labels = {definition.name(): definition.description() for definition in definitions}
    return re.sub(NAME, lambda name: f'"{labels[name[0]]}"' if name[0] in labels else name[0], sentence)
