"""The tracks of Measure Clearance: centerlines with the cant of their rails, in metres from the zero of the cloud."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..clearance.frame import MIN_LENGTH_M, SAME_PLACE_M, Course, course_of
from ..clouds.crs import parse_crs, units
from ..errors import CrsError, RailExtractError
from ..frame import LocalFrame
from ..progress import Progress
from ..rails import RailLine
from .features import read_lines_in
from .lines import LayerLines
from .values import Values


def read_courses(values: Values, zero: LocalFrame, progress: Progress) -> tuple[Course, ...]:
    """Read INPUT and RAILS, given the zero of the cloud.

    Raises RailExtractError if the lines are rails, have no heights or heights in another unit, are too short, or if the
    rails are of another run.
    """
    if "rail_id" in values.source("INPUT").fields:
        raise RailExtractError("INPUT has rails: give the centerlines of these tracks, and the rails as RAILS.")
    lines = _lines(values, "INPUT", zero, progress)
    tracks = [replace(one, xyz=one.xyz + lines.frame.shift_to(zero)) for one in lines.centerlines()]
    flat = [one.track_id for one in tracks if not np.isfinite(one.xyz).all()]
    if flat:
        raise RailExtractError(f"Track {flat[0]} of INPUT has no heights: take the centerlines from Extract Rails.")
    tracks = [one for one in tracks if one.line.length_m >= MIN_LENGTH_M]
    if not tracks:
        raise RailExtractError(f"No line of INPUT is {MIN_LENGTH_M:g} m long or longer: give centerlines of tracks.")
    known: dict[int, RailLine] = {}
    if values.filled("RAILS"):
        read = _lines(values, "RAILS", zero, progress)
        rails = [replace(one, xyz=one.xyz + read.frame.shift_to(zero)) for one in read.rails(progress)]
        known = {one.rail_id: one for one in rails if np.isfinite(one.xyz).all()}
    ids = [(*one.left_ids, *one.right_ids) for one in tracks]
    own_rails = [[known[number] for number in own if number in known] for own in ids]
    courses = tuple(course_of(track, own) for track, own in zip(tracks, own_rails))
    for course, own in zip(courses, own_rails):
        _check_rails(course, own)
    lacking = [track.track_id for track, own, found in zip(tracks, ids, own_rails) if known and len(found) < len(own)]
    _say_cant(courses, lacking, values.filled("RAILS"), progress)
    return courses


def _lines(values: Values, name: str, zero: LocalFrame, progress: Progress) -> LayerLines:
    """Read lines in the coordinate system of the cloud."""
    source = values.source(name)
    if source.crs_wkt and zero.crs_wkt and units(parse_crs(source.crs_wkt))[1] != zero.vertical_unit_m:
        raise CrsError(f"{name} has heights in another unit than POINTS: give both in the same vertical unit.")
    return read_lines_in(source, zero.crs_wkt, progress)


def _check_rails(course: Course, rails: Sequence[RailLine]) -> None:
    """Refuse rails that are not beside their centerline."""
    left_m, right_m = course.beside_m
    if rails and not abs(left_m - right_m) <= SAME_PLACE_M:
        raise RailExtractError(
            f"RAILS are {left_m:.2f} and {right_m:.2f} m beside track {course.track_id} of INPUT: give the rails of "
            "the same run."
        )


def _say_cant(courses: Sequence[Course], lacking: Sequence[int], has_rails: bool, progress: Progress) -> None:
    """Say where the cant is unknown."""
    without = ", ".join(str(one.track_id) for one in courses if not one.has_cant)
    if without and not has_rails:
        progress.warning("Without RAILS the cant is unknown: what is beside canted track is not judged surely.")
    elif without:
        progress.warning(
            f"Tracks {without} of INPUT state no rails in left_ids and right_ids that RAILS has: their cant is unknown."
        )
    if lacking:
        progress.warning(f"RAILS lacks rails of tracks {', '.join(map(str, lacking))}: give all rails of the run.")
