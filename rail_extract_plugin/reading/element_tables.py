"""Element tables read from layers: those of Fit Alignment and Import Alignment, also edited ones."""

from __future__ import annotations

from qgis.core import QgsCoordinateReferenceSystem, QgsFeatureRequest, QgsProcessingFeatureSource

from ...core.alignment.elements import Alignment
from ...core.alignment.table import alignments, check_table, frame_of, read_table
from ...core.fields import ELEMENT_FIELDS
from ...core.frame import LocalFrame
from ...core.progress import SILENT, Progress
from .line_layers import GEOMETRY_AS_IT_IS, system_of, value_of


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
    check_table(known, name)
    columns = [one.name for one in ELEMENT_FIELDS if one.name in known]
    features = progress.follow(source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS), source.featureCount())
    rows = read_table([{column: value_of(feature, column) for column in columns} for feature in features], name)
    frame = frame_of(rows, system_of(crs, progress), name)
    return alignments(rows, frame, progress), frame
