"""The inputs of Fit Alignment: tracks with their cant, and a corrected table of elements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from qgis.core import NULL, QgsFeatureRequest, QgsProcessingFeatureSource

from ...core.alignment.cant_of_rails import cant_of_rails
from ...core.alignment.elements import Alignment
from ...core.alignment.measured import Track, with_stations
from ...core.errors import RailExtractError
from ...core.frame import LocalFrame
from ...core.progress import Progress
from ..systems import system
from .area_points import check_same_plane
from .element_tables import read_elements
from .line_layers import GEOMETRY_AS_IT_IS, read_centerlines, read_rails

QUALITY_NEEDS = ("track_id", "chainage_m", "cant_mm")
"""Fields of the track geometry that state the cant."""


def read_tracks(
    source: QgsProcessingFeatureSource,
    quality: QgsProcessingFeatureSource | None,
    rails: QgsProcessingFeatureSource | None,
    progress: Progress,
) -> tuple[list[Track], LocalFrame]:
    """Read centerlines with their cant: from the track geometry, else from the rails.

    Raises
    ------
    RailExtractError
        A layer has no lines, lacks a field, or states the cant of other tracks.
    """
    lines, frame = read_centerlines(source, progress)
    if quality is not None:
        stations = _stations(quality)
        if not any(line.track_id in stations for line in lines):
            raise RailExtractError("QUALITY has no stations of the tracks in INPUT: give the track geometry of INPUT.")
        none = np.zeros((0, 3))
        return [with_stations(line.track_id, line.xyz, stations.get(line.track_id, none)) for line in lines], frame
    shapes = _rails(rails, frame, progress) if rails is not None else []
    return [
        Track(line.track_id, line.xyz, cant_of_rails(line.xyz, shapes), np.zeros(len(line.xyz), dtype=bool))
        for line in lines
    ], frame


def _stations(source: QgsProcessingFeatureSource) -> dict[int, np.ndarray]:
    """Return chainage, cant and whether a gap is bridged of the stations of each track, (n, 3); NaN without cant."""
    _check_fields(source, QUALITY_NEEDS, "QUALITY", "the track geometry of Extract rails or Measure track geometry")
    found: dict[int, list[tuple[float, float, float]]] = {}
    for row in _rows(source, (*QUALITY_NEEDS, "bridged")):
        if row["track_id"] is not None and row["chainage_m"] is not None:
            cant = np.nan if row["cant_mm"] is None else float(row["cant_mm"]) / 1000.0
            found.setdefault(int(row["track_id"]), []).append((float(row["chainage_m"]), cant, row["bridged"] or 0))
    return {number: np.array(sorted(rows)) for number, rows in found.items()}


def _rails(source: QgsProcessingFeatureSource, frame: LocalFrame, progress: Progress) -> list[np.ndarray]:
    """Return the lines of rails in the frame of the tracks."""
    rails, theirs = read_rails(source, progress, "RAILS")
    check_same_plane("RAILS", theirs.crs_wkt, "INPUT", frame)
    check_same_plane("INPUT", frame.crs_wkt, "RAILS", theirs)
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


def _check_fields(source: QgsProcessingFeatureSource, names: Sequence[str], layer: str, remedy: str) -> None:
    """Refuse a layer that lacks a field."""
    lacking = next((name for name in names if source.fields().lookupField(name) < 0), None)
    if lacking:
        raise RailExtractError(f"{layer} has no field {lacking}: give {remedy}.")


def _rows(source: QgsProcessingFeatureSource, names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the values of fields, None where they are empty or do not exist."""
    at = {name: source.fields().lookupField(name) for name in names}
    made = []
    for feature in source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS):
        values = feature.attributes()
        row = {name: values[number] if number >= 0 else None for name, number in at.items()}
        made.append({name: None if value == NULL else value for name, value in row.items()})
    return made
