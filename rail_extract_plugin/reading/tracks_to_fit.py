"""The inputs of Fit Alignment: tracks with their cant, and a corrected table of elements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from qgis.core import NULL, QgsFeatureRequest, QgsProcessingFeatureSource

from ...core.alignment.cant_of_rails import cant_of_rails
from ...core.alignment.elements import Alignment
from ...core.alignment.measured import STATION_NEEDS, Track, stations_by_track, with_cant
from ...core.frame import LocalFrame
from ...core.progress import Progress
from ..systems import system
from .area_points import check_same_plane
from .element_tables import read_elements
from .line_layers import GEOMETRY_AS_IT_IS, read_centerlines, read_rails


def read_tracks(
    source: QgsProcessingFeatureSource,
    quality: QgsProcessingFeatureSource | None,
    rails: QgsProcessingFeatureSource | None,
    progress: Progress,
    name: str = "INPUT",
) -> tuple[list[Track], LocalFrame]:
    """Read centerlines with their cant: from the track geometry, else from the rails.

    Parameters
    ----------
    source, quality, rails : QgsProcessingFeatureSource
    progress : Progress
    name : str
        Name of the parameter of the centerlines, for messages.

    Raises
    ------
    RailExtractError
        A layer has no lines, lacks a field, or states the cant of other tracks.
    """
    lines, frame = read_centerlines(source, progress, name)
    if quality is not None:
        stations = stations_by_track(_rows(quality, (*STATION_NEEDS, "bridged")), quality.fields().names(), "QUALITY")
        return with_cant([(line.track_id, line.xyz) for line in lines], stations, "QUALITY", name), frame
    shapes = _rails(rails, frame, progress, name) if rails is not None else []
    return [
        Track(line.track_id, line.xyz, cant_of_rails(line.xyz, shapes), np.zeros(len(line.xyz), dtype=bool))
        for line in lines
    ], frame


def _rails(source: QgsProcessingFeatureSource, frame: LocalFrame, progress: Progress, name: str) -> list[np.ndarray]:
    """Return the lines of rails in the frame of the tracks."""
    rails, theirs = read_rails(source, progress, "RAILS")
    check_same_plane("RAILS", theirs.crs_wkt, name, frame)
    check_same_plane(name, frame.crs_wkt, "RAILS", theirs)
    return [rail.xyz + theirs.shift_to(frame) for rail in rails]


def read_fixed(source: QgsProcessingFeatureSource, frame: LocalFrame) -> dict[int | None, Alignment]:
    """Read a corrected element table: alignments by their track. Its places are not used.

    Raises
    ------
    RailExtractError
        It is not an element table, or a row is wrong.
    """
    crs = source.sourceCrs() if source.sourceCrs().isValid() else system(frame.crs_wkt or "")
    return {one.track_id: one for one in read_elements(source, crs, name="FIXED")[0]}


def _rows(source: QgsProcessingFeatureSource, names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the values of fields, None where they are empty or do not exist."""
    at = {name: source.fields().lookupField(name) for name in names}
    made = []
    for feature in source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS):
        values = feature.attributes()
        row = {name: values[number] if number >= 0 else None for name, number in at.items()}
        made.append({name: None if value == NULL else value for name, value in row.items()})
    return made
