"""Alignments as an IFC 4.3 file, a STEP file (ISO 10303-21): design elements, and the curves that viewers show.

The centerline is midway between the rails. Coordinates are metres from the origin of the alignments' frame, a round
place of the map, because viewers compute in single precision; a map conversion states the place.

Radii are positive to the left and 0 where straight. Lengths of vertical elements are in plan, those of their curves
along the curve. Each layout ends with a segment of length 0. Half the cant raises the left rail and half lowers the
right one, so that the centerline stays.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from ..alignment.elements import (
    UNIT_NODES,
    UNIT_WEIGHTS,
    Alignment,
    CantElement,
    PlanElement,
    StationRange,
    Stations,
    VerticalElement,
    stations_of,
)
from ..progress import SILENT, Progress
from .design import PROGRAM, SAME_BEND, Delivery, names

GUID_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"
"""Digits in which IFC writes a GUID, by value."""

NAMESPACE = uuid.UUID("5b0a9f52-0d0c-4d67-9a3b-6d3a3e2f7c11")
"""Of the GUIDs: equal names give equal ids, so that a file that is written again replaces what it showed."""

SCHEMA, VIEW = "IFC4X3_ADD2", "Alignment-basedView"

PRECISION_M = 1e-5
"""Distance below which viewers take two points for one, metres."""


@dataclass(frozen=True)
class Ref:
    """Reference to an instance."""

    number: int


@dataclass(frozen=True)
class Enum:
    """Item of an enumeration."""

    name: str


@dataclass(frozen=True)
class Measure:
    """Value with the name of its type, where an attribute admits several types."""

    type: str
    value: float | bool


@dataclass(frozen=True)
class Whole:
    """Number of the type INTEGER; all others are written as REAL."""

    value: int


DERIVED = Enum("")
"""Attribute that the schema computes."""


class StepFile:
    """Instances of a STEP file, in the order in which they are added; adding them can be cancelled."""

    def __init__(self, progress: Progress = SILENT) -> None:
        self._lines: list[str] = []
        self._progress = progress

    def add(self, entity: str, *attributes: Any) -> Ref:
        """Add an instance of a type such as IfcProject; see `written` for the attributes."""
        self._progress.check()
        number = len(self._lines) + 1
        self._lines.append(f"#{number}={entity.upper()}({','.join(map(written, attributes))});\n")
        return Ref(number)

    def text(self, schema: str, view: str, name: str, program: str, made: datetime) -> str:
        """Return the text of the file, given schema, model view, its name, the program that writes it, and the time."""
        stamp = written(made.replace(microsecond=0).isoformat())
        head = (
            f"FILE_DESCRIPTION(({written(f'ViewDefinition [{view}]')}),'2;1');\n"
            f"FILE_NAME({written(name)},{stamp},(''),(''),{written(program)},{written(program)},'');\n"
            f"FILE_SCHEMA(({written(schema)}));\n"
        )
        return f"ISO-10303-21;\nHEADER;\n{head}ENDSEC;\nDATA;\n{''.join(self._lines)}ENDSEC;\nEND-ISO-10303-21;\n"


def guid(*names: object) -> str:
    """Return the id, 22 digits, that IFC writes for what these names name."""
    number = uuid.uuid5(NAMESPACE, "/".join(map(str, names))).int
    return "".join(GUID_DIGITS[number >> 6 * place & 63] for place in range(21, -1, -1))


def written(value: Any) -> str:
    """Write a value.

    >>> written(("Track 1", None, True, Whole(2), 1, Ref(7), Enum("LINE"), Measure("IFCLENGTHMEASURE", 1), DERIVED))
    "('Track 1',$,.T.,2,1.0,#7,.LINE.,IFCLENGTHMEASURE(1.0),*)"
    """
    if value is None:
        return "$"
    if isinstance(value, bool):
        return ".T." if value else ".F."
    if isinstance(value, str):
        return f"'{_escaped(value)}'"
    if isinstance(value, Ref):
        return f"#{value.number}"
    if isinstance(value, Enum):
        return f".{value.name}." if value.name else "*"
    if isinstance(value, Measure):
        return f"{value.type}({written(value.value)})"
    if isinstance(value, Sequence):
        return f"({','.join(map(written, value))})"
    return str(value.value) if isinstance(value, Whole) else _real(float(value))


def _real(value: float) -> str:
    """Write a number with all its digits; the format wants a point in it."""
    mantissa, exponent, power = repr(value + 0.0).upper().partition("E")
    return f"{mantissa if '.' in mantissa else mantissa + '.'}{exponent}{power}"


def _escaped(text: str) -> str:
    """Write characters outside ASCII by their numbers; double quotes and backslashes."""
    parts = []
    for one in text:
        if " " <= one <= "~":
            parts.append({"'": "''", "\\": "\\\\"}.get(one, one))
        else:
            parts.append(f"\\X2\\{one.encode('utf-16-be', 'replace').hex().upper()}\\X0\\")
    return "".join(parts)


def write_ifc(path: Path, alignments: Sequence[Alignment], delivery: Delivery, progress: Progress = SILENT) -> None:
    """Write alignments of one frame, with coordinates in metres; there is at least one."""
    model = _Model(alignments[0].frame.origin, delivery, progress)
    alone = [model.add(name, alignment) for name, alignment in zip(names(alignments), alignments)]
    model.relate("IfcRelAggregates", model.project, [*alone], "alignments")
    file = model.file
    file.add("IfcRelReferencedInSpatialStructure", guid("referenced"), None, None, None, alone, model.railway)
    text = file.text(SCHEMA, VIEW, path.name, f"{PROGRAM} {delivery.version}", delivery.made)
    path.write_text(text, encoding="ascii")


class _Model:
    """The file with its project, its place on the map, and the contexts of its curves."""

    def __init__(self, origin: np.ndarray, delivery: Delivery, progress: Progress) -> None:
        self.file, self._origin, self._delivery = StepFile(progress), origin, delivery
        add = self.file.add
        metre = add("IfcSIUnit", DERIVED, Enum("LENGTHUNIT"), None, Enum("METRE"))
        radian = add("IfcSIUnit", DERIVED, Enum("PLANEANGLEUNIT"), None, Enum("RADIAN"))
        zero = add("IfcAxis2Placement3D", point(self.file, 0.0, 0.0, 0.0), None, None)
        space = add("IfcGeometricRepresentationContext", None, "Model", Whole(3), PRECISION_M, zero, None)
        self._footprint, self._axis = (
            add(
                "IfcGeometricRepresentationSubContext",
                *(name, "Model", DERIVED, DERIVED, DERIVED, DERIVED, space, None, Enum(view), None),
            )
            for name, view in (("FootPrint", "PLAN_VIEW"), ("Axis", "GRAPH_VIEW"))
        )
        self._place_on_map(space, metre)
        units = add("IfcUnitAssignment", (metre, radian))
        project = (guid("project"), None, PROGRAM, None, None, None, None, (space,), units)
        self.project = add("IfcProject", *project)
        self._placement = add("IfcLocalPlacement", None, zero)
        spatial = (None, None, self._placement, None, None, Enum("ELEMENT"))
        site = add("IfcSite", guid("site"), None, "Site", *spatial, *5 * (None,))
        self.railway = add("IfcRailway", guid("railway"), None, "Railway", *spatial, None)
        self.relate("IfcRelAggregates", self.project, [site], "site")
        self.relate("IfcRelAggregates", site, [self.railway], "railway")

    def _place_on_map(self, space: Ref, metre: Ref) -> None:
        """State the coordinate system, and the place of the origin in it."""
        delivery, (east, north, _) = self._delivery, map(float, self._origin)
        name = f"EPSG:{delivery.epsg}" if delivery.epsg else delivery.system or "Unknown"
        system = self.file.add(
            "IfcProjectedCRS", name, delivery.system or None, None, delivery.heights or None, None, None, metre
        )
        self.file.add("IfcMapConversion", space, system, east, north, 0.0, 1.0, 0.0, 1.0)

    def relate(self, relation: str, whole: Ref, parts: Sequence[Ref], *names: str) -> None:
        """Relate an object to its parts."""
        self.file.add(relation, guid(relation, *names), None, None, None, whole, parts)

    def add(self, name: str, alignment: Alignment) -> Ref:
        """Add an alignment with its layouts and stations, and return it."""
        file, z = self.file, float(self._origin[2])
        layouts = {"H": plan_segments(file, alignment)}
        plan = base = file.add("IfcCompositeCurve", _curves(layouts["H"]), False)
        if alignment.vertical:
            layouts["V"] = vertical_segments(file, alignment, z)
            base = file.add("IfcGradientCurve", _curves(layouts["V"]), False, plan, None)
        curve, distance_m = base, self._delivery.gauge_m + self._delivery.head_width_m
        if alignment.vertical and alignment.cant:
            layouts["C"] = cant_segments(file, alignment, distance_m)
            curve = file.add("IfcSegmentedReferenceCurve", _curves(layouts["C"]), False, base, None)
        made = file.add(
            *("IfcAlignment", guid(name), None, name, None, None, self._placement),
            self._shape(plan, curve if alignment.vertical else None),
            None,
        )
        nested = [self._layout(name, layout, segments, distance_m) for layout, segments in layouts.items()]
        self.relate("IfcRelNests", made, nested, name, "layouts")
        stations = stations_of(alignment) or Stations((StationRange(alignment.s_from, alignment.s_from),))
        referents = [self._referent(name, alignment, stations, piece, base) for piece in stations.pieces]
        self.relate("IfcRelNests", made, referents, name, "stations")
        return made

    def _shape(self, plan: Ref, curve: Ref | None) -> Ref:
        """Return the shape of an alignment: a curve in plan, and one in space if heights are known."""
        add = self.file.add
        if curve is None:
            shapes = [add("IfcShapeRepresentation", self._axis, "Axis", "Curve2D", (plan,))]
        else:
            shapes = [
                add("IfcShapeRepresentation", self._footprint, "FootPrint", "Curve2D", (plan,)),
                add("IfcShapeRepresentation", self._axis, "Axis", "Curve3D", (curve,)),
            ]
        return add("IfcProductDefinitionShape", None, None, shapes)

    def _layout(self, name: str, layout: str, segments: Sequence[Segment], distance_m: float) -> Ref:
        """Return a layout with its elements."""
        entity = {"H": "IfcAlignmentHorizontal", "V": "IfcAlignmentVertical", "C": "IfcAlignmentCant"}[layout]
        own = (None, entity[len("IfcAlignment") :], None, None, self._placement, None)
        further = (distance_m,) if layout == "C" else ()
        made = self.file.add(entity, guid(name, layout), *own, *further)
        nested = [self._segment((name, layout, number), one) for number, one in enumerate(segments, start=1)]
        self.relate("IfcRelNests", made, nested, name, layout, "segments")
        return made

    def _segment(self, names: tuple[str, str, int], segment: Segment) -> Ref:
        """Return an element with its curve."""
        add = self.file.add
        shape = add("IfcShapeRepresentation", self._axis, "Axis", "Segment", (segment.curve,))
        drawn = add("IfcProductDefinitionShape", None, None, (shape,))
        own = (None, f"{names[1]}{names[2]}", None, None, self._placement, drawn)
        return add("IfcAlignmentSegment", guid(*names), *own, segment.design)

    def _referent(self, name: str, alignment: Alignment, stations: Stations, piece: StationRange, curve: Ref) -> Ref:
        """Return a referent that states the station of a place, and the one behind it at a jump."""
        add, along = self.file.add, Measure("IFCLENGTHMEASURE", piece.s - alignment.s_from)
        where = add("IfcPointByDistanceExpression", along, None, None, None, curve)
        linear = add("IfcAxis2PlacementLinear", where, None, None)
        placement = add("IfcLinearPlacement", None, linear, self._position(alignment, piece.s))
        made = add(
            *("IfcReferent", guid(name, "station", piece.s), None, f"{piece.station:.3f}", None, None),
            *(placement, None, Enum("STATION")),
        )
        facts = {
            "Station": Measure("IFCLENGTHMEASURE", piece.station),
            "HasIncreasingStation": Measure("IFCBOOLEAN", piece.rises),
        }
        if piece is not stations.pieces[0]:
            facts["IncomingStation"] = Measure("IFCLENGTHMEASURE", stations.behind(piece.s))
        values = [add("IfcPropertySingleValue", key, None, value, None) for key, value in facts.items()]
        own = guid(name, "properties", piece.s), None, "Pset_Stationing", None, values
        properties = add("IfcPropertySet", *own)
        related = guid(name, "defines", piece.s), None, None, None, (made,), properties
        add("IfcRelDefinesByProperties", *related)
        return made

    def _position(self, alignment: Alignment, s: float) -> Ref:
        """Return the place and direction of the curve, for programs that do not evaluate it."""
        at = np.array([s])
        x, y, z = np.nan_to_num(alignment.xyz(at)[0] + (0.0, 0.0, self._origin[2]))
        heading = float(alignment.headings(at)[0])
        file = self.file
        up = file.add("IfcDirection", (0.0, 0.0, 1.0))
        ahead = file.add("IfcDirection", (math.cos(heading), math.sin(heading), 0.0))
        return file.add("IfcAxis2Placement3D", point(file, x, y, z), up, ahead)


def _curves(segments: Sequence[Segment]) -> list[Ref]:
    return [one.curve for one in segments]


ROUND, SMOOTH, BROKEN = (Enum("CONTSAMEGRADIENTSAMECURVATURE"), Enum("CONTSAMEGRADIENT"), Enum("DISCONTINUOUS"))
"""How a curve continues in the next: with its curvature, with its direction, or not."""


@dataclass(frozen=True)
class Segment:
    """References to a design element and to its curve."""

    design: Ref
    curve: Ref


def plan_segments(file: StepFile, alignment: Alignment) -> list[Segment]:
    """Add the elements in plan."""
    bends = [(one.k_from, one.k_to) for one in alignment.plan]
    made = [_plan_segment(file, one, how) for one, how in zip(alignment.plan, _transitions(bends))]
    end = np.array([alignment.s_to])
    (x, y), heading = alignment.places(end)[0], float(alignment.headings(end)[0])
    return [*made, _plan_segment(file, PlanElement(alignment.s_to, 0.0, float(x), float(y), heading), BROKEN)]


def _plan_segment(file: StepFile, one: PlanElement, transition: Enum) -> Segment:
    place = point(file, one.x, one.y)
    kind = {"line": "LINE", "arc": "CIRCULARARC", "clothoid": "CLOTHOID"}[one.type]
    radii = tuple(1.0 / bend if bend else 0.0 for bend in (one.k_from, one.k_to))
    heading = math.remainder(one.heading, math.tau)
    design = file.add(
        "IfcAlignmentHorizontalSegment", None, None, place, heading, *radii, one.length_m, None, Enum(kind)
    )
    start, length = 0.0, one.length_m
    if one.type == "line":
        parent = line(file)
    elif one.type == "arc":
        parent = file.add("IfcCircle", placement_2d(file, point(file, 0.0, 0.0), 0.0), abs(radii[0]))
        length = math.copysign(length, one.k_from)
    else:
        # The curvature of the parent curve at distance u from its inflection is change * u.
        change = (one.k_to - one.k_from) / one.length_m
        constant = math.copysign(1.0 / math.sqrt(abs(change)), change)
        parent = _clothoid(file, constant)
        start = one.k_from / change
    return Segment(design, _curve(file, transition, placement_2d(file, place, heading), start, length, parent))


def vertical_segments(file: StepFile, alignment: Alignment, z_of_origin: float) -> list[Segment]:
    """Add the grades and parabolas, given the height of the zero of local heights."""
    bends = [2 * (one.curvature,) for one in alignment.vertical]
    made = [
        _vertical_segment(file, alignment, one, z_of_origin, how)
        for one, how in zip(alignment.vertical, _transitions(bends))
    ]
    last, end = alignment.vertical[-1], np.array([alignment.vertical[-1].s_to])
    after = VerticalElement(last.s_to, 0.0, float(alignment.heights(end)[0]), last.grade_to, last.grade_to)
    return [*made, _vertical_segment(file, alignment, after, z_of_origin, BROKEN)]


def _vertical_segment(
    file: StepFile, alignment: Alignment, one: VerticalElement, z_of_origin: float, transition: Enum
) -> Segment:
    along, z = one.s_from - alignment.s_from, one.z + z_of_origin
    grades, is_curve = (one.grade_from, one.grade_to), one.type == "parabola"
    kind, radius = ("PARABOLICARC", 1.0 / one.curvature) if is_curve else ("CONSTANTGRADIENT", None)
    own = (None, None, along, one.length_m, z, *grades, radius, Enum(kind))
    design = file.add("IfcAlignmentVerticalSegment", *own)
    parent = line(file)
    if is_curve:
        position = placement_2d(file, point(file, 0.0, 0.0), 0.0)
        heights = (z, one.grade_from, 0.5 * one.curvature)
        parent = file.add("IfcPolynomialCurve", position, (0.0, 1.0), heights, None)
    place = placement_2d(file, point(file, along, z), math.atan(one.grade_from))
    return Segment(design, _curve(file, transition, place, 0.0, _slope_length(one), parent))


def _slope_length(one: VerticalElement) -> float:
    """Return the length along the slope."""
    grades = one.grade_from + UNIT_NODES * (one.grade_to - one.grade_from)
    return one.length_m * float(UNIT_WEIGHTS @ np.hypot(1.0, grades))


def cant_segments(file: StepFile, alignment: Alignment, distance_m: float) -> list[Segment]:
    """Add constant cant and ramps, given the distance between the middles of the heads."""
    last = alignment.cant[-1]
    after = CantElement(last.s_to, 0.0, last.cant_to_m, last.cant_to_m)
    ways = [SMOOTH] * len(alignment.cant) + [BROKEN]
    elements = zip([*alignment.cant, after], ways)
    return [_cant_segment(file, alignment, one, distance_m, how) for one, how in elements]


def _cant_segment(
    file: StepFile, alignment: Alignment, one: CantElement, distance_m: float, transition: Enum
) -> Segment:
    along, (start, end) = one.s_from - alignment.s_from, (0.5 * one.cant_from_m, 0.5 * one.cant_to_m)
    kind = Enum("CONSTANTCANT" if one.type == "constant" else "LINEARTRANSITION")
    rails = (start, end, -start, -end) if one.type == "ramp" else (start, None, -start, None)
    design = file.add("IfcAlignmentCantSegment", None, None, along, one.length_m, *rails, kind)
    tilt = math.asin(one.cant_from_m / distance_m)
    up = file.add("IfcDirection", (0.0, -math.sin(tilt), math.cos(tilt)))
    ahead = file.add("IfcDirection", (1.0, 0.0, 0.0))
    place = file.add("IfcAxis2Placement3D", point(file, along, 0.0, 0.0), up, ahead)
    parent = line(file)
    if one.type == "ramp":
        # It says that the tilt changes linearly: the middle between the rails does not rise.
        rise = one.cant_to_m - one.cant_from_m
        parent = _clothoid(file, math.copysign(one.length_m**1.5 / math.sqrt(abs(rise)), rise))
    return Segment(design, _curve(file, transition, place, 0.0, one.length_m, parent))


def _transitions(bends: Sequence[tuple[float, float]]) -> list[Enum]:
    """Return how elements with curvatures at both ends continue; a layout ends straight."""
    return [
        ROUND if abs(after[0] - one[1]) < SAME_BEND else SMOOTH for one, after in zip(bends, [*bends[1:], (0.0, 0.0)])
    ]


def _curve(file: StepFile, transition: Enum, place: Ref, start: float, length: float, parent: Ref) -> Ref:
    measures = (Measure("IFCLENGTHMEASURE", value) for value in (start, length))
    return file.add("IfcCurveSegment", transition, place, *measures, parent)


def _clothoid(file: StepFile, constant: float) -> Ref:
    return file.add("IfcClothoid", placement_2d(file, point(file, 0.0, 0.0), 0.0), constant)


def line(file: StepFile) -> Ref:
    """Add a line along the x axis."""
    direction = file.add("IfcDirection", (1.0, 0.0))
    return file.add("IfcLine", point(file, 0.0, 0.0), file.add("IfcVector", direction, 1.0))


def placement_2d(file: StepFile, place: Ref, heading: float) -> Ref:
    """Add a placement in a plane, of which the x axis has a direction, radians."""
    direction = file.add("IfcDirection", (math.cos(heading), math.sin(heading)))
    return file.add("IfcAxis2Placement2D", place, direction)


def point(file: StepFile, *coordinates: float) -> Ref:
    """Add a point."""
    return file.add("IfcCartesianPoint", tuple(map(float, coordinates)))
