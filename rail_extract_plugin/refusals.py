"""What QGIS itself refuses, said so that a user knows what to do."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
)

LAYERS = {QgsProcessingParameterFeatureSource: "vector", QgsProcessingParameterRasterLayer: "raster"}


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
        return f"a number from {definition.minimum():g} to {definition.maximum():g}"
    if isinstance(definition, QgsProcessingParameterEnum):
        return f"one of its {len(definition.options())} choices, such as {definition.options()[0]}"
    kind = next((kind for one, kind in LAYERS.items() if isinstance(definition, one)), None)
    return f"a {kind} layer, or a {kind} file that can be read" if kind else f"what it asks for: {definition.help()}"
