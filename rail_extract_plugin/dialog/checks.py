"""Checks of parameter values before a run: those that QGIS makes, explained, and those that need no file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
)

from ...core.design_numbers import number_in
from .definitions import UNBOUNDED
from .parameter_values import ParameterValues

EXPECTED = {
    QgsProcessingParameterExtent: "four numbers: xmin,xmax,ymin,ymax",
    QgsProcessingParameterFeatureSource: "a vector layer, or a vector file that can be read",
    QgsProcessingParameterRasterLayer: "a raster layer, or a raster file that can be read",
}


def check_values(definitions: Sequence[QgsProcessingParameterDefinition], values: ParameterValues) -> None:
    """Check the values of the parameters that several algorithms share; gauges are checked where they are read.

    Parameters
    ----------
    definitions : sequence of QgsProcessingParameterDefinition
        The algorithm's parameters.
    values : ParameterValues

    Raises
    ------
    RailExtractError
        A number is NaN, EXTENT has no area, RAIL_CLASSES is not a list of classes, or ENGINE cannot run on DEVICE.
    """
    names = {definition.name() for definition in definitions}
    for definition in definitions:
        if isinstance(definition, QgsProcessingParameterNumber):
            values.optional_number(definition.name())
    if "EXTENT" in names:
        values.extent(QgsCoordinateReferenceSystem())
    if "RAIL_CLASSES" in names:
        values.class_codes()
    if "ENGINE" in names:
        values.engine()


def explain_invalid(
    definition: QgsProcessingParameterDefinition, value: Any, context: QgsProcessingContext
) -> str | None:
    """Return what is wrong with a value and what to enter instead, or None if QGIS accepts the value.

    Parameters
    ----------
    definition : QgsProcessingParameterDefinition
    value : object
        As the user entered it; None means the default.
    context : QgsProcessingContext
    """
    given = definition.defaultValue() if value is None else value
    if definition.checkValueIsAcceptable(given, context) and not _is_no_number(definition, given):
        return None
    shown = "empty" if given in (None, "") else given
    return f"{definition.name()} can't be {shown}: give {_expected(definition)}."


def _is_no_number(definition: QgsProcessingParameterDefinition, given: Any) -> bool:
    """Return whether a text is given for a number: QGIS leaves out that of an optional one without a word."""
    number = number_in(given) if isinstance(given, str) else None
    return isinstance(definition, QgsProcessingParameterNumber) and number is not None and math.isnan(number)


def _expected(definition: QgsProcessingParameterDefinition) -> str:
    if isinstance(definition, QgsProcessingParameterNumber):
        lowest, highest = definition.minimum(), definition.maximum()
        return f"{lowest:g} or more" if highest == UNBOUNDED else f"a number from {lowest:,.10g} to {highest:,.10g}"
    if isinstance(definition, QgsProcessingParameterEnum):
        return f"one of its {len(definition.options())} choices, such as {definition.options()[0]}"
    known = next((text for kind, text in EXPECTED.items() if isinstance(definition, kind)), None)
    first_sentence = definition.help().split(". ")[0].rstrip(".")
    return known or first_sentence[:1].lower() + first_sentence[1:]
