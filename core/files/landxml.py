"""Alignments as a LandXML 1.2 file.

Conventions of the format that are easily mistaken: points are written northing first; `rot` and `curvature` are cw for
a curve to the right along the track; cant is positive where the outer rail is higher, in millimetres, whichever way the
curve turns; stations within an alignment are internal, the distance along the curve from `staStart`. No attribute `dir`
is written: programs disagree on its sense.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET  # nosec B405 - files with a DOCTYPE are refused before any entity is read
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..alignment.elements import Alignment, PlanElement, Stations, VerticalElement, stations_of
from ..progress import SILENT, Progress
from .design import PROGRAM, SAME_BEND, Delivery, names

NAMESPACE = "http://www.landxml.org/schema/LandXML-1.2"

DECIMALS = 7
"""Of lengths and coordinates in metres: a tenth of a micrometre, so that what is read again is the same element."""

STRAIGHT = "INF"
"""Radius of a straight end of a spiral, as XML Schema writes infinity."""

PARALLEL_RAD = 1e-9
"""Directions that differ by less have no intersection: that of the tangents of a spiral is then put in the middle."""

MIN_BREAK = 1e-6
"""Smallest break of the gradient, metres per metre, that becomes a point of its own: the element table is rounded to a
hundredth of it."""


def write_landxml(
    path: Path,
    alignments: Sequence[Alignment],
    delivery: Delivery,
    circles: bool = True,
    progress: Progress = SILENT,
) -> None:
    """Write alignments whose coordinates are in metres.

    Curves of the profile are written as circles, as railways do, or as parabolas, as roads do.
    """
    made = delivery.made.replace(microsecond=0)
    facts = {"date": made.date().isoformat(), "time": made.time().isoformat(), "version": "1.2", "language": "English"}
    root = ET.Element("LandXML", {"xmlns": NAMESPACE, **facts})
    units = {"areaUnit": "squareMeter", "linearUnit": "meter", "volumeUnit": "cubicMeter"}
    ET.SubElement(
        ET.SubElement(root, "Units"), "Metric", {**units, "temperatureUnit": "celsius", "pressureUnit": "HPA"}
    )
    if delivery.system:
        system = {"name": delivery.system, **({"epsgCode": str(delivery.epsg)} if delivery.epsg else {})}
        heights = {"verticalDatum": delivery.heights} if delivery.heights else {}
        ET.SubElement(root, "CoordinateSystem", {**system, **heights})
    ET.SubElement(root, "Project", {"name": PROGRAM})
    ET.SubElement(root, "Application", {"name": PROGRAM, "version": delivery.version})
    parent = ET.SubElement(root, "Alignments")
    for name, alignment in zip(names(alignments), alignments):
        _write_alignment(parent, name, alignment, delivery, circles, progress)
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _write_alignment(
    parent: ET.Element, name: str, alignment: Alignment, delivery: Delivery, circles: bool, progress: Progress
) -> None:
    stations = stations_of(alignment)
    start = stations.pieces[0].station if stations and stations.pieces[0].rises else alignment.s_from
    internal = start - alignment.s_from
    facts = {"name": name, "length": _written(alignment.s_to - alignment.s_from), "staStart": _written(start)}
    node = ET.SubElement(parent, "Alignment", {**facts, "state": "existing"})
    geometry = ET.SubElement(node, "CoordGeom", {"name": name})
    pieces = list(_split(alignment))
    for piece, after in zip(progress.follow(pieces), [*pieces[1:], None]):
        _write_piece(geometry, alignment, piece, after, internal)
    if alignment.cant:
        _write_cant(node, name, alignment, delivery, internal, progress)
    if stations:
        _write_equations(node, stations, internal)
    if alignment.vertical:
        profile = ET.SubElement(ET.SubElement(node, "Profile", {"name": name}), "ProfAlign", {"name": name})
        _write_profile(profile, alignment, internal, circles, progress)


def _split(alignment: Alignment) -> Iterator[PlanElement]:
    """Yield the plan elements; a clothoid between a curve and its reverse in two parts, as a spiral has one `rot`."""
    for one in alignment.plan:
        if one.k_from * one.k_to >= 0:
            yield one
            continue
        length_m = one.length_m * one.k_from / (one.k_from - one.k_to)
        alone, s = replace(alignment, plan=(one,)), one.s_from + length_m
        (x, y), heading = alone.places(np.array([s]))[0], float(alone.headings(np.array([s]))[0])
        yield replace(one, length_m=length_m, k_to=0.0)
        rest = one.length_m - length_m
        yield replace(one, s_from=s, length_m=rest, x=float(x), y=float(y), heading=heading, k_from=0.0)


def _write_piece(
    parent: ET.Element, alignment: Alignment, piece: PlanElement, after: PlanElement | None, internal: float
) -> None:
    """Write a line, a curve or a spiral; it ends where the next one starts."""
    alone, start = replace(alignment, plan=(piece,)), np.array([piece.x, piece.y])
    s = np.array([piece.s_to])
    end = alone.places(s)[0] if after is None else np.array([after.x, after.y])
    common = {"staStart": _written(piece.s_from + internal), "length": _written(piece.length_m)}
    rot = "ccw" if piece.k_from + piece.k_to > 0 else "cw"
    points = {"Start": start, "End": end}
    if piece.type == "line":
        node = ET.SubElement(parent, "Line", common)
    elif piece.type == "arc":
        node = ET.SubElement(
            parent, "Curve", {"rot": rot, "crvType": "arc", "radius": _written(abs(1 / piece.k_from)), **common}
        )
        points = {"Start": start, "Center": start + _left(piece.heading) / piece.k_from, "End": end}
    else:
        radii = {"radiusStart": _radius(piece.k_from), "radiusEnd": _radius(piece.k_to)}
        constant = _written(math.sqrt(piece.length_m / abs(piece.k_to - piece.k_from)))
        node = ET.SubElement(
            parent, "Spiral", {"rot": rot, "spiType": "clothoid", **radii, "constant": constant, **common}
        )
        meet = _intersection(start, piece.heading, end, float(alone.headings(s)[0]))
        points = {"Start": start, "PI": meet, "End": end}
    for name, place in points.items():
        x, y, _ = alignment.frame.to_crs(np.append(place, 0.0))
        ET.SubElement(node, name).text = f"{_written(y)} {_written(x)}"


def _radius(curvature: float) -> str:
    return _written(abs(1 / curvature)) if curvature else STRAIGHT


def _left(heading: float) -> np.ndarray:
    return np.array([-math.sin(heading), math.cos(heading)])


def _intersection(start: np.ndarray, heading: float, end: np.ndarray, end_heading: float) -> np.ndarray:
    """Return where the tangents at both ends of a curve meet."""
    turn = math.sin(end_heading - heading)
    if abs(turn) < PARALLEL_RAD:
        return 0.5 * (start + end)
    ahead = float((start - end) @ _left(end_heading)) / turn
    return start + ahead * np.array([math.cos(heading), math.sin(heading)])


def _write_cant(
    parent: ET.Element, name: str, alignment: Alignment, delivery: Delivery, internal: float, progress: Progress
) -> None:
    """Write the cant at the ends of its ramps; negative where the inner rail of the curve is higher."""
    gauge = {"gauge": _written(delivery.gauge_m), "rotationPoint": "center"}
    node = ET.SubElement(parent, "Cant", {"name": name, **gauge})
    for s, cant_m in _cant_knots(alignment):
        progress.check()
        cw = _turns_right(alignment, s, cant_m)
        outer_m = cant_m if cw else -cant_m
        adverse = {"adverse": "true"} if outer_m < 0 else {}
        ET.SubElement(
            node,
            "CantStation",
            {
                "station": _written(s + internal),
                "appliedCant": _written(1000.0 * outer_m + 0.0),
                "transitionType": "clothoid",
                "curvature": "cw" if cw else "ccw",
                **adverse,
            },
        )


def _cant_knots(alignment: Alignment) -> Iterator[tuple[float, float]]:
    """Yield distance along the curve and cant of the ends of constant cant and ramps; a jump has two."""
    end = None
    for one in alignment.cant:
        if end is not None and end != one.cant_from_m:
            yield one.s_from, end
        yield one.s_from, one.cant_from_m
        end = one.cant_to_m
    yield alignment.cant[-1].s_to, alignment.cant[-1].cant_to_m


def _turns_right(alignment: Alignment, s: float, cant_m: float) -> bool:
    """Return whether the track turns right there; on a straight, whether cant would suit a curve to the right."""
    beside = alignment.curvatures(np.array([np.nextafter(s, -np.inf), s]))
    sharper = float(beside[np.argmax(np.abs(beside))])
    return sharper < 0 if abs(sharper) > SAME_BEND else cant_m >= 0


def _write_equations(parent: ET.Element, stations: Stations, internal: float) -> None:
    """Write where stations do not continue the distance along the curve."""
    for number, piece in enumerate(stations.pieces):
        sense = {"staIncrement": "increasing" if piece.rises else "decreasing"}
        place = {"staInternal": _written(piece.s + internal), "staAhead": _written(piece.station)}
        if number:
            ET.SubElement(parent, "StaEquation", {**place, "staBack": _written(stations.behind(piece.s)), **sense})
        elif not piece.rises:
            ET.SubElement(parent, "StaEquation", {**place, **sense})


def _write_profile(
    parent: ET.Element, alignment: Alignment, internal: float, circles: bool, progress: Progress
) -> None:
    """Write the points where tangents of the profile meet, with their curves."""
    first, last = alignment.vertical[0], alignment.vertical[-1]
    _write_meeting(parent, "PVI", alignment, first.s_from + internal, first.z, {})
    for before, one in zip([None, *alignment.vertical], alignment.vertical):
        progress.check()
        if before is not None and _breaks(before, one):
            _write_meeting(parent, "PVI", alignment, one.s_from + internal, one.z, {})
        if one.type == "parabola":
            kind, facts = _curve(one, circles)
            middle = one.s_from + 0.5 * one.length_m + internal
            _write_meeting(parent, kind, alignment, middle, one.z + 0.5 * one.length_m * one.grade_from, facts)
    end = float(alignment.heights(np.array([last.s_to]))[0])
    _write_meeting(parent, "PVI", alignment, last.s_to + internal, end, {})


def _breaks(before: VerticalElement, one: VerticalElement) -> bool:
    """Return whether the joint of two elements is not a joint of a tangent with its curve, or of two curves."""
    return before.type == one.type == "grade" or abs(one.grade_from - before.grade_to) > MIN_BREAK


def _curve(one: VerticalElement, circles: bool) -> tuple[str, dict[str, str]]:
    """Return tag and attributes of a curve; a circle of the same tangents differs by less than a millimetre."""
    length = {"length": _written(one.length_m)}
    if not circles:
        return "ParaCurve", length
    radius = one.length_m / abs(math.atan(one.grade_to) - math.atan(one.grade_from))
    return "CircCurve", {**length, "radius": _written(radius)}


def _write_meeting(
    parent: ET.Element, kind: str, alignment: Alignment, station: float, z: float, facts: dict[str, str]
) -> None:
    height = float(alignment.frame.to_crs(np.array([0.0, 0.0, z]))[2])
    ET.SubElement(parent, kind, facts).text = f"{_written(station)} {_written(height)}"


def _written(value: float) -> str:
    return f"{value:.{DECIMALS}f}"
