"""Tracks that jobs read: centerlines and rails with their points, tracks with their cant, and designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..alignment.elements import Alignment
from ..alignment.measured import Track, cant_of_rails, stations_by_track, with_cant
from ..errors import RailExtractError
from ..files.table import alignments, check_table, frame_of, read_table
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine, TrackGeometry
from ..standards import RAIL_CLASS
from ..tiles.store import SpooledPoints
from .clouds import Area, Bounds, spool_points_in
from .lines import system_of, way
from .values import Values

MARGIN_M = 1.0
"""Margin around the rails' extent within which points are read: more than ten times the railhead width."""

SQUARE_M = 500.0
"""Side of the squares in which points are processed: about that of the squares of Extract Rails."""

MAX_GAUGE_NOISE_MM = 1.0
"""A larger difference between two mean gauges of a track is not noise but due to a different railhead width."""


@dataclass(frozen=True)
class TrackInputs:
    """Lines and points in one local frame; there is a cloud for each class of the rails, none without a cloud."""

    centerlines: tuple[Centerline, ...]
    rails: tuple[RailLine, ...]
    clouds: tuple[SpooledPoints, ...]
    frame: LocalFrame


def read_inputs(values: Values, folder: Path, progress: Progress) -> TrackInputs:
    """Read INPUT and RAILS, and sort the points of POINTS around the rails into squares in a folder."""
    centerlines, rails = values.lines("INPUT", progress.span(0.0, 0.1)), values.lines("RAILS", progress.span(0.1, 0.2))
    tracks, lines, frame = centerlines.centerlines(), rails.rails(progress, RAIL_CLASS), centerlines.frame
    shift = way("RAILS", rails.frame, "INPUT", frame)
    lines = tuple(replace(line, xyz=line.xyz + shift) for line in lines)
    if not values.filled("POINTS"):
        progress.info("Without POINTS, sigma_mm and points of each rail are taken as uniform along it.")
        return TrackInputs(tracks, lines, (), frame)
    classes = tuple(sorted({rail.class_code for rail in lines}))
    area = Area("rails", classes, _bounds(lines, frame), frame)
    clouds = tuple(spool_points_in(area, values.cloud("POINTS"), SQUARE_M, folder, progress.span(0.2, 1.0)).values())
    theirs = clouds[0].frame
    tracks, lines = _moved(tracks, frame, theirs), _moved(lines, frame, theirs)
    return TrackInputs(tracks, lines, clouds, frame.with_origin(theirs.shift_to(frame)))


def check_gauges(tracks: TrackInputs, measured: Sequence[TrackGeometry], progress: Progress) -> None:
    """Warn of tracks without two rails, and of a gauge that contradicts the fields because the head width is wrong.

    Takes one measurement for each centerline; raises RailExtractError if no centerline has rails on both sides.
    """
    found = np.array([_mean(track.gauge_mm) for track in measured])
    lonely = [str(track.track_id) for track, gauge in zip(measured, found) if np.isnan(gauge)]
    if len(lonely) == len(measured):
        raise RailExtractError("None of RAILS is next to a line of INPUT: give the rails of these tracks.")
    if lonely:
        progress.warning(f"Tracks {', '.join(lonely)} do not have rails on both sides: their gauge and cant are empty.")
    off = found - [line.gauge_mm for line in tracks.centerlines]
    off = off[np.isfinite(off)]
    if len(off) and abs(np.median(off)) > MAX_GAUGE_NOISE_MM:
        progress.warning(
            f"The gauge differs by {np.median(off):+.1f} mm from gauge_mm of the centerlines: check HEAD_WIDTH."
        )


def with_measured_gauge(centerlines: Sequence[Centerline], measured: Sequence[TrackGeometry]) -> tuple[Centerline, ...]:
    """Return centerlines with mean and standard deviation of the measured gauge, where it is known."""
    return tuple(
        replace(line, gauge_mm=_mean(track.gauge_mm), gaugesd_mm=float(np.nanstd(track.gauge_mm)))
        if np.isfinite(track.gauge_mm).any()
        else line
        for line, track in zip(centerlines, measured)
    )


def _mean(values: np.ndarray) -> float:
    """Return the mean of the finite values; NaN if there are none."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _moved(lines: Sequence, frame: LocalFrame, other: LocalFrame) -> tuple:
    shift = frame.shift_to(other)
    return tuple(replace(line, xyz=line.xyz + shift) for line in lines)


def _bounds(rails: Sequence[RailLine], frame: LocalFrame) -> Bounds:
    """Return the west, south, east and north limits of rails, with a margin, in units of the coordinate system."""
    xyz = np.concatenate([rail.xyz for rail in rails])
    (west, south, _), (east, north, _) = frame.to_crs(
        np.array([xyz.min(axis=0) - MARGIN_M, xyz.max(axis=0) + MARGIN_M])
    ).tolist()
    return west, south, east, north


def read_tracks(values: Values, name: str, progress: Progress) -> tuple[list[Track], LocalFrame]:
    """Read centerlines with their cant: from QUALITY, else from RAILS."""
    read = values.lines(name, progress)
    lines, frame = [(line.track_id, line.xyz) for line in read.centerlines()], read.frame
    if values.filled("QUALITY"):
        return with_cant(lines, stations_by_track(*values.rows("QUALITY", SILENT), "QUALITY"), "QUALITY", name), frame
    shapes = []
    if values.filled("RAILS"):
        rails = values.lines("RAILS", progress)
        shift = way("RAILS", rails.frame, name, frame)
        shapes = [xyz + shift for _, _, xyz in rails.parts]
    none = [np.zeros(len(xyz), dtype=bool) for _, xyz in lines]
    return [Track(one, xyz, cant_of_rails(xyz, shapes), own) for (one, xyz), own in zip(lines, none)], frame


def read_elements(values: Values, name: str, crs_wkt: str | None, progress: Progress = SILENT) -> list[Alignment]:
    """Read the alignments of an element table; its geometries are not used.

    `crs_wkt` is the coordinate system of a table that has none.
    """
    table, fields = values.rows(name, progress)
    check_table(fields, name)
    rows = read_table(table, name)
    return alignments(rows, frame_of(rows, system_of(values.system(name) or crs_wkt, progress), name), progress)
