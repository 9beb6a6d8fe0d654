"""The words for choices: lists, help and messages show them in QGIS's windows; values and scripts have the ids."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, combinations

from qgis.core import QgsProcessingParameterEnum

from ...core.parameters import ALIGNED, AS_THEY_ARE, CLOTHOIDS, GEOMETRY, JUMPS, LEARNED, OVERLAP, SYNTHETIC
from ...core.standards import CUSTOM, DETECT

WORDS = {
    "STANDARD": {
        DETECT: "Detect from the points",
        CUSTOM: "Custom: gauge and railhead width of the advanced parameters",
    },
    "METHOD": {GEOMETRY: "The shape of rails", LEARNED: "A trained classifier"},
    "STRIPS": {AS_THEY_ARE: "Use them as they are", ALIGNED: "Align them"},
    "LEAVE_OUT": {OVERLAP: "Overlap of strips", SYNTHETIC: "Synthetic points"},
    "MODEL": {"AUTO": "Automatic", "base": "Network of the paper", "fast": "Smaller, faster network"},
    "ENGINE": {"AUTO": "PyTorch if it is installed", "TORCH": "PyTorch", "OPENCV": "OpenCV"},
    "DEVICE": {"AUTO": "GPU if there is one", "CPU": "Processor", "CUDA": "Nvidia GPU"},
    "DIRECTION": {"INCREASING": "Increase", "DECREASING": "Decrease"},
    "FORMAT": {
        **{"HECTOMETRES": "12.3+45.67", "KILOMETRES": "12+345.67"},
        **{"GERMAN": "12,3 + 46", "MILES": "7 mi 1181.39 yd"},
    },
    "TRANSITIONS": {JUMPS: "Clothoids, or none", CLOTHOIDS: "Clothoids everywhere"},
    "VERTICAL_CURVES": {"CIRCLES": "Circles, as for railways", "PARABOLAS": "Parabolas, as for roads"},
    "PROFILE": {
        **{"EBO_G1": "Reference line G1 (EBO annex 7)", "EBO_G2": "Reference line G2 (EBO annex 8)"},
        "EBO_LIMIT_LARGE": "Limit of the free space, through tracks (EBO annex 1)",
        "EBO_LIMIT_SMALL": "Limit of the free space, other tracks (EBO annex 1)",
        **{"EBO_MAIN": "Structure gauge, main tracks (EBO)", "EBO_OTHER": "Structure gauge, other tracks (EBO)"},
        "EBO_MAIN_15KV": "Structure gauge, main tracks at 15 kV (EBO)",
        "EBO_MAIN_25KV": "Structure gauge, main tracks at 25 kV (EBO)",
        **{"US_WA": "Washington", "US_WA_TUNNEL": "Washington, tunnels and bridges"},
        CUSTOM: "Custom: profile from a file",
    },
    "WIDENING": {"NONE": "None", "EBO": "By the German regulations (EBO)"},
    "TRAINS": {"MARK": "Name them, do not count them", "LEAVE_OUT": "Leave them out"},
    "TORCH": {"NONE": "Do not install", "CPU": "For the processor (CPU)", "CUDA": "For an Nvidia GPU"},
}
"""Words by id, by parameter."""


def word(parameter: str, choice: str) -> str:
    """Return the words for a choice; its id if there are none."""
    return WORDS.get(parameter, {}).get(choice, choice)


def in_words(definition: QgsProcessingParameterEnum) -> list[tuple[str, str | list[str]]]:
    """Return the words and the values of a list; where several may be chosen, each selection is an entry."""
    name, options = definition.name(), definition.options()
    if not definition.allowMultiple():
        return [(word(name, one), one) for one in options]
    selections = chain.from_iterable(combinations(options, count) for count in range(len(options) + 1))
    return [(_joined([word(name, one) for one in chosen]), list(chosen)) for chosen in selections]


def _joined(words: Sequence[str]) -> str:
    return " and ".join([*words[:1], *(one[:1].lower() + one[1:] for one in words[1:])]) or "None"
