"""The segments of an alignment in IFC 4.3: each a design element with its curve.

Radii are positive to the left and 0 where straight. Lengths of vertical elements are in plan, those of their curves
along the curve. Each layout ends with a segment of length 0. Half the cant raises the left rail and half lowers the
right one, so that the centerline stays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .curves import UNIT_NODES, UNIT_WEIGHTS
from .elements import Alignment, CantElement, PlanElement, VerticalElement
from .step import Enum, Measure, Ref, StepFile

SAME_BEND = 1e-9
"""Difference of two curvatures in 1/m, or of two gradients, that is none."""

ROUND, SMOOTH, BROKEN = (Enum("CONTSAMEGRADIENTSAMECURVATURE"), Enum("CONTSAMEGRADIENT"), Enum("DISCONTINUOUS"))
"""How a curve continues in the next: with its curvature, with its direction, or not."""


@dataclass(frozen=True)
class Segment:
    """References to a design element and to its curve."""

    design: Ref
    curve: Ref


def plan_segments(file: StepFile, alignment: Alignment) -> list[Segment]:
    """Add the elements in plan.

    Parameters
    ----------
    file : StepFile
    alignment : Alignment
    """
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
    """Add the grades and parabolas; see `plan_segments`.

    Parameters
    ----------
    file, alignment
        See `plan_segments`.
    z_of_origin : float
        Height of the zero of local heights.
    """
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
    """Add constant cant and ramps; see `plan_segments`.

    Parameters
    ----------
    file, alignment
        See `plan_segments`.
    distance_m : float
        Between the middles of the heads.
    """
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
    """Add a placement in a plane.

    Parameters
    ----------
    file : StepFile
    place : Ref
    heading : float
        Direction of its x axis, radians.
    """
    direction = file.add("IfcDirection", (math.cos(heading), math.sin(heading)))
    return file.add("IfcAxis2Placement2D", place, direction)


def point(file: StepFile, *coordinates: float) -> Ref:
    """Add a point."""
    return file.add("IfcCartesianPoint", tuple(map(float, coordinates)))
