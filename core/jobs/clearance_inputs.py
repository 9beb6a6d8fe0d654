"""The inputs of Measure Clearance: tracks in metres from the zero of the cloud, with their cant, and the profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..clearance.frame import Course, course_of
from ..clearance.profiles import COLUMNS, CUSTOM, REFERENCE, Profile, mirrored, named
from ..clouds.crs import parse_crs, units
from ..errors import CrsError, ParameterError, RailExtractError
from ..frame import LocalFrame
from ..polyline import project
from ..progress import Progress, counted
from ..rails import Centerline, RailLine
from .declaration import LINE, POLYGON
from .features import read_lines_in
from .lines import LayerLines
from .values import Values

MIN_LENGTH_M = 3.0
"""Shorter lines have no direction that could be measured."""

BESIDE_M, SAME_PLACE_M = 3.0, 0.10
"""Rails are looked for up to this distance from the centerline of their track; and the largest difference between the
distances of both."""

MAX_M = 20.0
"""Larger coordinates are not in metres: the widest gauge in use is 6 m high."""

LEAST_POINTS = 3
"""Fewer points make no outline."""


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
    for track in tracks:
        _check_rails(track, known)
    lacking = [track.track_id for track, own, found in zip(tracks, ids, own_rails) if known and len(found) < len(own)]
    _say_cant(courses, lacking, values.filled("RAILS"), progress)
    return courses


def _lines(values: Values, name: str, zero: LocalFrame, progress: Progress) -> LayerLines:
    """Read lines in the coordinate system of the cloud."""
    source = values.source(name)
    if source.crs_wkt and zero.crs_wkt and units(parse_crs(source.crs_wkt))[1] != zero.vertical_unit_m:
        raise CrsError(f"{name} has heights in another unit than POINTS: give both in the same vertical unit.")
    return read_lines_in(source, zero.crs_wkt, progress)


def _check_rails(track: Centerline, known: Mapping[int, RailLine]) -> None:
    """Refuse rails that are not beside their centerline, given those that are known by their ids."""
    sides = [[known[one].xyz for one in ids if one in known] for ids in (track.left_ids, track.right_ids)]
    if not all(sides):
        return
    feet = [np.abs(project(own, track.xyz[:, :2], BESIDE_M).across) for own in sides]
    far = [f"{np.median(one):.2f}" if len(one) else f"more than {BESIDE_M:g}" for one in feet]
    if not all(map(len, feet)) or abs(float(np.median(feet[0]) - np.median(feet[1]))) > SAME_PLACE_M:
        raise RailExtractError(
            f"RAILS are {far[0]} and {far[1]} m beside track {track.track_id} of INPUT: give the rails of the same run."
        )


def _say_cant(courses: Sequence[Course], lacking: Sequence[int], has_rails: bool, progress: Progress) -> None:
    """Say where the cant is unknown."""
    without = [one.track_id for one in courses if not one.has_cant and one.track_id not in lacking]
    if without and not has_rails:
        progress.warning("Without RAILS the cant is unknown: what is beside canted track is not judged surely.")
    elif without:
        progress.warning(
            f"INPUT has no left_ids and right_ids for {_named(without)}, whose cant is unknown: take the centerlines "
            "from Extract Rails."
        )
    if lacking:
        progress.warning(f"RAILS lacks rails of {_named(lacking)}, whose cant is unknown: give all rails of the run.")


def _named(track_ids: Sequence[int]) -> str:
    """Name tracks, for messages."""
    return f"track{'s' if len(track_ids) > 1 else ''} {', '.join(map(str, track_ids))}"


def read_steps(values: Values, progress: Progress) -> Mapping[int, np.ndarray]:
    """Read from QUALITY how far strips are apart: chainages and millimetres by track, (n, 2), where several show it."""
    rows, fields = values.rows("QUALITY", progress)
    missing = [name for name in ("track_id", "chainage_m", "strip_mm") if name not in fields]
    if missing:
        raise ParameterError(
            f"QUALITY has no field {missing[0]}: take the points of Extract Rails or Measure Track Geometry."
        )
    steps: dict[int, list[tuple[float, float]]] = {}
    for row in rows:
        if row["strip_mm"] is not None:
            steps.setdefault(int(row["track_id"]), []).append((float(row["chainage_m"]), float(row["strip_mm"])))
    return {track_id: np.array(sorted(own)) for track_id, own in sorted(steps.items())}


def read_profile(values: Values) -> Profile:
    """Return the profile, which PROFILE_FILE states if PROFILE is CUSTOM."""
    if values["PROFILE"] != CUSTOM:
        return named()[values["PROFILE"]]
    if not values.filled("PROFILE_FILE"):
        raise ParameterError(
            f"PROFILE is CUSTOM: name a file with the columns {' and '.join(COLUMNS)} in PROFILE_FILE."
        )
    return values.once("profile", lambda: _custom(values))


def _custom(values: Values) -> Profile:
    """Read the user's profile: a table, or a layer with a line or a polygon."""
    source = values.source("PROFILE_FILE")
    title = values.title("PROFILE_FILE")
    name = title.replace("\\", "/").rpartition("/")[2] or "PROFILE_FILE"
    if all(column in source.fields for column in COLUMNS):
        try:
            points = [(float(row[COLUMNS[0]]), float(row[COLUMNS[1]])) for _, row in source.rows()]
        except (TypeError, ValueError) as error:
            raise ParameterError(f"PROFILE_FILE {name} has a row without two numbers: correct or delete it.") from error
        return custom(points, name)
    drawn = [part for one in source.features(None) for kind, part in one.parts if kind in (LINE, POLYGON)]
    if len(drawn) != 1:
        raise ParameterError(
            f"PROFILE_FILE {name} has neither the columns {' and '.join(COLUMNS)} nor one line or polygon: give one."
        )
    return custom([(float(v), float(w)) for v, w in drawn[0][:, :2]], name)


def custom(points: Sequence[tuple[float, float]], name: str) -> Profile:
    """Make a profile from the points of the user's file of that name: v and w in metres.

    With all v >= 0 they are a half from its foot to its top; else the whole outline. Raises `ParameterError` if there
    are too few points, they are not in metres, or the outline crosses itself.
    """
    ring = list(dict.fromkeys(points)) if points and points[0] == points[-1] else list(points)
    if len(ring) < LEAST_POINTS:
        found = counted(len(ring), "point")
        raise ParameterError(f"PROFILE_FILE {name} has {found}: an outline needs {LEAST_POINTS} or more.")
    if any(not max(abs(v), abs(w)) <= MAX_M for v, w in ring):
        raise ParameterError(
            f"PROFILE_FILE {name} has coordinates above {MAX_M:g} m: are these millimetres? Give metres."
        )
    said = None
    if all(v >= 0 for v, _ in ring):
        if ring[-1][0] > 0:
            said = (
                f"The half outline of {name} does not end at v = 0: it was closed at its top, {ring[-1][1]:g} m high."
            )
            ring.append((0.0, ring[-1][1]))
        ring = list(mirrored(ring))
    if _crosses_itself(ring):
        raise ParameterError(f"The outline in PROFILE_FILE {name} crosses itself: give its points in order.")
    return Profile(CUSTOM, tuple(ring), REFERENCE, name, said)


def _crosses_itself(ring: Sequence[tuple[float, float]]) -> bool:
    """Return whether two edges of a ring that are not neighbours meet; outlines have few edges."""
    edges = list(zip(ring, [*ring[1:], ring[0]]))
    last = len(edges) - 1
    return any(_meet(*edges[i], *edges[j]) for i in range(last) for j in range(i + 2, last + 1) if (i, j) != (0, last))


def _meet(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]) -> bool:
    """Return whether the segments a-b and c-d cross."""

    def turn(p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0
