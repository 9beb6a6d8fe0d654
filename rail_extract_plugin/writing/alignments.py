"""Writes fitted alignments: elements as curves with their table, and deviations as points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsFeature,
    QgsGeometry,
    QgsLineString,
    QgsPoint,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsWkbTypes,
)

from ...core.fields import DEVIATION_FIELDS, ELEMENT_FIELDS
from .layers import LayerKind, feature_of, write_features

if TYPE_CHECKING:
    from ...core.alignment.elements import Alignment
    from ...core.alignment.fit import Fit
    from ...core.frame import LocalFrame

ELEMENTS, DEVIATIONS = LayerKind(ELEMENT_FIELDS, "elements"), LayerKind(DEVIATION_FIELDS, "deviations")


def write_elements(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    fits: Sequence[Fit],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the elements of alignments, each with its exact curve.

    Parameters
    ----------
    fits : sequence of Fit
    algorithm, name, frame, parameters, context
        See `layers.write_lines`.
    """
    made = (feature for fit in fits for feature in element_features(fit.alignment))
    shape = QgsWkbTypes.Type.LineStringZ
    return write_features(algorithm, name, ELEMENTS, shape, made, frame, parameters, context)


def element_features(alignment: Alignment) -> Iterator[QgsFeature]:
    """Yield the elements of an alignment as features in the coordinates of its frame."""
    from ...core.alignment.table import rows

    for element, row in zip(alignment.elements, rows(alignment)):
        drawn = alignment.drawn(max(element.s_from, alignment.s_from), min(element.s_to, alignment.s_to))
        line = QgsLineString(*alignment.frame.to_crs(drawn).T.tolist())
        yield feature_of(QgsGeometry(line), [row[column.name] for column in ELEMENT_FIELDS], ELEMENT_FIELDS)


def write_deviations(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    fits: Sequence[Fit],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the deviations of tracks from their alignments.

    Parameters
    ----------
    fits : sequence of Fit
    algorithm, name, frame, parameters, context
        See `layers.write_lines`.
    """
    made = (feature for fit in fits for feature in _deviations(fit, frame))
    return write_features(algorithm, name, DEVIATIONS, QgsWkbTypes.Type.PointZ, made, frame, parameters, context)


def _deviations(fit: Fit, frame: LocalFrame) -> Iterator[QgsFeature]:
    """Yield the deviations of a track as points on its design."""
    found = fit.deviations
    columns = (found.s, found.slew_mm, found.lift_mm, found.cant_diff_mm)
    for place, *values in zip(frame.to_crs(found.xyz).tolist(), *columns):
        yield feature_of(QgsGeometry(QgsPoint(*place)), [found.track_id, *values], DEVIATION_FIELDS)


def figures_of_fits(fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the number of elements, and the root mean square of the slews in millimetres, as outputs."""
    squares = sum(float((fit.deviations.slew_mm**2).sum()) for fit in fits)
    count = sum(len(fit.deviations.s) for fit in fits)
    return {
        "ELEMENT_COUNT": sum(len(fit.alignment.elements) for fit in fits),
        "RMS": round(math.sqrt(squares / count), 3),
    }
