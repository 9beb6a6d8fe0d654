"""The words for choices: lists, help and messages show them in QGIS's windows; values and scripts have the ids."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, combinations

from qgis.core import QgsProcessingParameterEnum

from ...core.parameters import ALIGNED, AS_THEY_ARE, CLOTHOIDS, GEOMETRY, JUMPS, LEARNED, OVERLAP, SYNTHETIC
from ...core.standards import CUSTOM, DETECT
from ..i18n import tr

WORDS = {
    "STANDARD": {
        DETECT: tr("Detect from the points"),
        CUSTOM: tr("Custom: gauge and railhead width of the advanced parameters"),
    },
    "METHOD": {GEOMETRY: tr("The shape of rails"), LEARNED: tr("A trained classifier")},
    "STRIPS": {AS_THEY_ARE: tr("Use them as they are"), ALIGNED: tr("Align them")},
    "LEAVE_OUT": {OVERLAP: tr("Overlap of strips"), SYNTHETIC: tr("Synthetic points")},
    "MODEL": {"AUTO": tr("Automatic"), "base": tr("Network of the paper"), "fast": tr("Smaller, faster network")},
    "ENGINE": {"AUTO": tr("The faster one"), "TORCH": tr("PyTorch"), "OPENCV": tr("OpenCV")},
    "DEVICE": {"AUTO": tr("GPU if there is one"), "CPU": tr("Processor"), "CUDA": tr("Nvidia GPU")},
    "DIRECTION": {"INCREASING": tr("Increase"), "DECREASING": tr("Decrease")},
    "FORMAT": {
        **{"HECTOMETRES": tr("12.3+45.67"), "KILOMETRES": tr("12+345.67")},
        **{"GERMAN": tr("12,3 + 46"), "MILES": tr("7 mi 1181.39 yd")},
    },
    "TRANSITIONS": {JUMPS: tr("Clothoids, or none"), CLOTHOIDS: tr("Clothoids everywhere")},
    "VERTICAL_CURVES": {"CIRCLES": tr("Circles, as for railways"), "PARABOLAS": tr("Parabolas, as for roads")},
    "TORCH": {"NONE": tr("Do not install"), "CPU": tr("For the processor (CPU)"), "CUDA": tr("For an Nvidia GPU")},
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
    return tr(" and ").join([*words[:1], *(one[:1].lower() + one[1:] for one in words[1:])]) or tr("None")
