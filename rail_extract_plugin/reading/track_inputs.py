"""What Measure Track Geometry takes: centerlines, their rails and the points of these, in one local frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from qgis.core import QgsProcessingFeatureSource

from ...core.errors import RailExtractError
from ...core.frame import LocalFrame
from ...core.progress import Progress
from ...core.rails import Centerline, RailLine, TrackGeometry
from ...core.squares.spool import SpooledPoints
from ...core.standards import RAIL_CLASS
from .area_points import Area, check_same_plane, spool_points_in
from .clouds import Bounds, CloudSource
from .line_layers import read_centerlines, read_rails

MARGIN_M = 1.0
"""Points further outside the rails' extent say nothing about them: more than ten times the width of a head."""

SQUARE_M = 500.0
"""Side of the squares that points are taken by, about that of the stretches of Extract Rails."""

SURE_GAUGE_MM = 1.0
"""Difference between two mean gauges of a track that noise does not make, but another width of the railhead does."""


@dataclass(frozen=True)
class TrackInputs:
    """Lines and points in one local frame.

    Attributes
    ----------
    centerlines : tuple of Centerline
    rails : tuple of RailLine
    clouds : tuple of SpooledPoints
        One for each class of the rails; none where no cloud was given.
    frame : LocalFrame
        Turns local metres into the centerlines' coordinates.
    """

    centerlines: tuple[Centerline, ...]
    rails: tuple[RailLine, ...]
    clouds: tuple[SpooledPoints, ...]
    frame: LocalFrame


def read_inputs(
    centerlines: QgsProcessingFeatureSource,
    rails: QgsProcessingFeatureSource,
    cloud: CloudSource | None,
    folder: Path,
    progress: Progress,
) -> TrackInputs:
    """Read lines, and put the points of the rails' classes around them into a folder, sorted into squares.

    Raises
    ------
    CrsError
        The coordinate systems differ, or are in degrees.
    NoRailPointsError
        The cloud has no points of a rail's class there.
    RailExtractError
        A layer holds no line.
    """
    tracks, frame = read_centerlines(centerlines, progress.span(0.0, 0.1))
    lines, rail_frame = read_rails(rails, progress.span(0.1, 0.2), "RAILS", RAIL_CLASS)
    check_same_plane("RAILS", rail_frame.crs_wkt, "INPUT", frame)
    check_same_plane("INPUT", frame.crs_wkt, "RAILS", rail_frame)
    lines = _moved(lines, rail_frame, frame)
    if cloud is None:
        progress.info("Without POINTS, each rail's sigma_mm and points are taken as even along it.")
        return TrackInputs(tracks, lines, (), frame)
    classes = tuple(sorted({rail.class_code for rail in lines}))
    area = Area("rails", classes, _bounds(lines, frame), frame)
    clouds = tuple(spool_points_in(area, cloud, SQUARE_M, folder, progress.span(0.2, 1.0)).values())
    theirs = clouds[0].frame
    tracks, lines = _moved(tracks, frame, theirs), _moved(lines, frame, theirs)
    return TrackInputs(tracks, lines, clouds, frame.with_origin(theirs.shift_to(frame)))


def check_gauges(tracks: TrackInputs, measured: Sequence[TrackGeometry], progress: Progress) -> None:
    """Warn of tracks without two rails, and of a gauge that contradicts the fields: then the head width is another.

    Raises
    ------
    RailExtractError
        No centerline has rails on both sides.
    """
    found = np.array([_mean(track.gauge_mm) for track in measured])
    lonely = [str(track.track_id) for track, gauge in zip(measured, found) if np.isnan(gauge)]
    if len(lonely) == len(measured):
        raise RailExtractError("RAILS lie beside none of the lines of INPUT: give the rails that these run between.")
    if lonely:
        progress.warning(f"Tracks {', '.join(lonely)} have no rails on both sides: their gauge and cant stay empty.")
    off = found - [line.gauge_mm for line in tracks.centerlines]
    off = off[np.isfinite(off)]
    if len(off) and abs(np.median(off)) > SURE_GAUGE_MM:
        progress.warning(
            f"The gauge is {np.median(off):+.1f} mm off what gauge_mm of the centerlines says: check HEAD_WIDTH."
        )


def _mean(values: np.ndarray) -> float:
    """Mean of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _moved(lines: Sequence, frame: LocalFrame, other: LocalFrame) -> tuple:
    shift = frame.shift_to(other)
    return tuple(replace(line, xyz=line.xyz + shift) for line in lines)


def _bounds(rails: Sequence[RailLine], frame: LocalFrame) -> Bounds:
    """Smallest x, smallest y, largest x, largest y around rails, in units of the coordinate system."""
    xyz = np.concatenate([rail.xyz for rail in rails])
    (west, south, _), (east, north, _) = frame.to_crs(
        np.array([xyz.min(axis=0) - MARGIN_M, xyz.max(axis=0) + MARGIN_M])
    ).tolist()
    return west, south, east, north
