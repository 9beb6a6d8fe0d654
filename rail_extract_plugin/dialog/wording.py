"""Messages in the user's terms: QGIS's windows show labels of parameters and words for choices instead of ids."""

from __future__ import annotations

import re
from collections.abc import Sequence

from qgis.core import QgsApplication, QgsProcessingParameterDefinition

from ...core.jobs.declaration import NAME
from .choices import WORDS
from .passwords import masked

Definitions = Sequence[QgsProcessingParameterDefinition]

WITH_DIALOGS = "desktop"
"""QGIS's name for the platform with windows."""

OVERLONG, SHOWN = r"\S{500,}", 100
"""A word longer than the name of any file, and how many of its characters are shown: a window grows with its text."""


def for_user(sentence: str, definitions: Definitions) -> str:
    """Return the sentence without passwords, and with labels and words for ids if this QGIS has windows."""
    sentence = re.sub(OVERLONG, lambda word: f"{word[0][:SHOWN]}…", masked(sentence))
    return with_labels(sentence, definitions) if QgsApplication.platform() == WITH_DIALOGS else sentence


def with_labels(sentence: str, definitions: Definitions, about: str = "") -> str:
    """Replace the names of parameters with their labels, and the ids of choices with their words, both in quotes.

    An id is a choice of the parameter that was named last, or of the one that the sentence is about; without either it
    is a word as any other, such as CPU.
    """
    labels = {definition.name(): definition.description() for definition in definitions}
    named = about

    def in_words(found: re.Match[str]) -> str:
        nonlocal named
        if found[0] in labels:
            named = found[0]
            return f'"{labels[named]}"'
        words = [WORDS[one][found[0]] for one in (named, about) if found[0] in WORDS.get(one, {})]
        return f'"{words[0]}"' if words else found[0]

    return re.sub(NAME, in_words, sentence)
