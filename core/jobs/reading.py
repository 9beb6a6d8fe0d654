"""What jobs read from vector layers: tracks with their cant, elements, and lines in one frame."""

from __future__ import annotations

import numpy as np

from ..alignment.elements import Alignment
from ..alignment.measured import Track, cant_of_rails, stations_by_track, with_cant
from ..clouds.crs import name_of, parse_crs, same_plane, units
from ..errors import CrsError
from ..files.table import alignments, check_table, frame_of, read_table
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from .lines import system_of
from .values import Values


def check_same_plane(name: str, crs_wkt: str | None, other_name: str, other: LocalFrame) -> None:
    """Check that two inputs, of these names, have the same coordinate system in plan.

    An unknown one is taken to be the other. Raises CrsError if both are known and differ, or the second is unknown and
    the first is not in metres.
    """
    if crs_wkt and other.crs_wkt and not same_plane(crs_wkt, other.crs_wkt, tuple(other.origin[:2])):
        raise CrsError(
            f"{name} are in {_title(crs_wkt)} but {other_name} in {_title(other.crs_wkt)}: give both in the "
            "same coordinate system."
        )
    if crs_wkt and not other.crs_wkt and units(parse_crs(crs_wkt))[0] != other.horizontal_unit_m:
        raise CrsError(
            f"{name} are in {_title(crs_wkt)}, whose unit is not the metre: assign a coordinate system to {other_name} "
            "too."
        )


def _title(wkt: str) -> str:
    return name_of(parse_crs(wkt))


def way(name: str, own: LocalFrame, other_name: str, frame: LocalFrame) -> np.ndarray:
    """Return the vector, (3,) metres, from the frame of an input to that of another; see `check_same_plane`."""
    check_same_plane(name, own.crs_wkt, other_name, frame)
    check_same_plane(other_name, frame.crs_wkt, name, own)
    return own.shift_to(frame)


def read_tracks(values: Values, name: str, progress: Progress) -> tuple[list[Track], LocalFrame]:
    """Read centerlines with their cant: from QUALITY, else from RAILS.

    Raises RailExtractError if a layer has no lines, lacks a field, or states the cant of other tracks.
    """
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

    `crs_wkt` is the coordinate system of a table that has none. Raises RailExtractError if the table is in degrees or
    not an element table, or an element is wrong.
    """
    table, fields = values.rows(name, progress)
    check_table(fields, name)
    rows = read_table(table, name)
    return alignments(rows, frame_of(rows, system_of(values.system(name) or crs_wkt, progress), name), progress)
