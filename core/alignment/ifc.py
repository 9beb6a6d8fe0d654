"""Alignments as an IFC 4.3 file: design elements, and the curves that viewers show.

The centerline is midway between the rails. Coordinates are metres from the origin of the alignments' frame, a round
place of the map, because viewers compute in single precision; a map conversion states the place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..progress import SILENT, Progress
from .delivery import PROGRAM, Delivery, names
from .elements import Alignment
from .equations import Piece, Stations, stations_of
from .ifc_segments import Segment, cant_segments, plan_segments, point, vertical_segments
from .step import DERIVED, Enum, Measure, Ref, StepFile, Whole, guid

SCHEMA, VIEW = "IFC4X3_ADD2", "Alignment-basedView"

PRECISION_M = 1e-5
"""Distance below which viewers take two points for one, metres."""


def write_ifc(path: Path, alignments: Sequence[Alignment], delivery: Delivery, progress: Progress = SILENT) -> None:
    """Write alignments whose coordinates are in metres.

    Parameters
    ----------
    path : Path
    alignments : sequence of Alignment
        At least one; all in the same frame.
    delivery : Delivery
    progress : Progress

    Raises
    ------
    OSError
        The file cannot be written.
    """
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
        stations = stations_of(alignment) or Stations((Piece(alignment.s_from, alignment.s_from),))
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

    def _referent(self, name: str, alignment: Alignment, stations: Stations, piece: Piece, curve: Ref) -> Ref:
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
