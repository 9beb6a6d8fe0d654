"""Element tables read from layers: those of Fit Alignment and Import Alignment, also edited ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from qgis.core import NULL, QgsCoordinateReferenceSystem, QgsFeatureRequest, QgsProcessingFeatureSource

from ...core.alignment.elements import Alignment
from ...core.alignment.table import alignments
from ...core.errors import RailExtractError
from ...core.fields import ELEMENT_FIELDS
from ...core.frame import ORIGIN_STEP, LocalFrame
from ...core.progress import SILENT, Progress
from .line_layers import GEOMETRY_AS_IT_IS, system_of

KEY_FIELDS = ("layout", "s_from", "s_to")
"""Fields by which an element table is recognized."""


def read_elements(
    source: QgsProcessingFeatureSource,
    crs: QgsCoordinateReferenceSystem,
    progress: Progress = SILENT,
    name: str = "INPUT",
) -> tuple[list[Alignment], LocalFrame]:
    """Read the alignments of an element table; its geometries are not used.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    crs : QgsCoordinateReferenceSystem
        Of x and y; a table without geometries has none of its own.
    progress : Progress
    name : str
        Name of the layer's parameter, for messages.

    Raises
    ------
    CrsError
        The table is in degrees.
    ParameterError
        An element lacks a value or states an impossible one.
    RailExtractError
        The layer is not an element table.
    """
    known = [one.name() for one in source.fields()]
    if not set(KEY_FIELDS) <= set(known):
        raise RailExtractError(
            f"{name} is not an element table, because it lacks the fields {', '.join(KEY_FIELDS)}: give the output "
            "ELEMENTS of Fit alignment or Import alignment."
        )
    columns = [one.name for one in ELEMENT_FIELDS if one.name in known]
    features = progress.follow(source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS), source.featureCount())
    rows = [{column: _plain(feature[column]) for column in columns} for feature in features]
    starts = [(row["x"], row["y"]) for row in rows if _is_number(row.get("x")) and _is_number(row.get("y"))]
    if not starts:
        raise RailExtractError(f"{name} has no element in plan with x and y: give a table with layout H.")
    crs_wkt, horizontal_unit_m, vertical_unit_m = system_of(crs, progress)
    origin = np.append(np.round(np.median(starts, axis=0) / ORIGIN_STEP) * ORIGIN_STEP, 0.0)
    frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)
    return alignments(rows, frame), frame


def _plain(value: Any) -> Any:
    return None if value == NULL else value


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and bool(np.isfinite(value))
