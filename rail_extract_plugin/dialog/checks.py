"""Checks of parameter values before a run: those that QGIS makes, explained, and those that need no file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from qgis.core import (
    QgsProcessingContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterNumber,
)

from ...core.design_numbers import number_in
from ...core.jobs.declaration import Number, Parameter
from .parameter_values import ParameterValues


def check_values(definitions: Sequence[QgsProcessingParameterDefinition], values: ParameterValues) -> None:
    """Check the values of the parameters that several algorithms share; gauges are checked where they are read.

    Raises RailExtractError if a number is NaN, EXTENT has no area, RAIL_CLASSES is not a list of classes, or ENGINE
    cannot run on DEVICE.
    """
    names = {definition.name() for definition in definitions}
    for one in values.job.parameters:
        if isinstance(one, Number):
            values[one.name]
    if "EXTENT" in names:
        values.extent(None)
    if "RAIL_CLASSES" in names:
        values.class_codes()
    if "ENGINE" in names:
        values.engine()


def explain_invalid(
    parameter: Parameter, definition: QgsProcessingParameterDefinition, value: Any, context: QgsProcessingContext
) -> str | None:
    """Return what is wrong with a value and what to enter instead, or None if QGIS accepts the value.

    A value of None means the default.
    """
    given = definition.defaultValue() if value is None else value
    if definition.checkValueIsAcceptable(given, context) and not _is_no_number(definition, given):
        return None
    return parameter.refusal(given)


def _is_no_number(definition: QgsProcessingParameterDefinition, given: Any) -> bool:
    """Return whether a text is given for a number: for an optional number, QGIS drops it without a word."""
    number = number_in(given) if isinstance(given, str) else None
    return isinstance(definition, QgsProcessingParameterNumber) and number is not None and math.isnan(number)
