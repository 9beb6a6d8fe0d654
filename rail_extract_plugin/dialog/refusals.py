"""What QGIS itself refuses, said so that a user knows what to do."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
)

from .definitions import UNBOUNDED

EXPECTED = {
    QgsProcessingParameterExtent: "four numbers: xmin,xmax,ymin,ymax",
    QgsProcessingParameterFeatureSource: "a vector layer, or a vector file that can be read",
    QgsProcessingParameterRasterLayer: "a raster layer, or a raster file that can be read",
}


def explain_refused(
    definition: QgsProcessingParameterDefinition, value: Any, context: QgsProcessingContext
) -> str | None:
    """Say what is wrong with a value and what to give instead; None where QGIS accepts it.

    Parameters
    ----------
    definition : QgsProcessingParameterDefinition
    value : object
        As the user gave it; None stands for the default.
    context : QgsProcessingContext
    """
    given = definition.defaultValue() if value is None else value
    if definition.checkValueIsAcceptable(given, context):
        return None
    shown = "empty" if given in (None, "") else given
    return f"{definition.name()} can't be {shown}: give {_expected(definition)}."


def _expected(definition: QgsProcessingParameterDefinition) -> str:
    if isinstance(definition, QgsProcessingParameterNumber):
        lowest, highest = definition.minimum(), definition.maximum()
        return f"{lowest:g} or more" if highest == UNBOUNDED else f"a number from {lowest:g} to {highest:g}"
    if isinstance(definition, QgsProcessingParameterEnum):
        return f"one of its {len(definition.options())} choices, such as {definition.options()[0]}"
    known = next((text for kind, text in EXPECTED.items() if isinstance(definition, kind)), None)
    first_sentence = definition.help().split(". ")[0].rstrip(".")
    return known or first_sentence[:1].lower() + first_sentence[1:]
