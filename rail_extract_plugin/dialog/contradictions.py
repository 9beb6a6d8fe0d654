"""What of an algorithm's values contradicts itself or others, told before any file is read."""

from __future__ import annotations

from collections.abc import Sequence

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterNumber,
)

from .values import Values


def refuse_contradictions(definitions: Sequence[QgsProcessingParameterDefinition], values: Values) -> None:
    """Check the values that several algorithms share; gauges are checked where they are read.

    Parameters
    ----------
    definitions : sequence of QgsProcessingParameterDefinition
        The algorithm's parameters.
    values : Values
        What the user filled in.

    Raises
    ------
    RailExtractError
        A number is NaN, EXTENT has no area, RAIL_CLASSES is no list of classes, or ENGINE can't run on DEVICE.
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
