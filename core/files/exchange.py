"""Files for other programs: DXF for CAD, and CSV for spreadsheets and scripts.

A DXF file is of release 12, which all CAD programs read: 3D polylines and points on named layers. It has no coordinate
system and no fields; the fields of a line are its extended data, one text such as "sigma_mm=0.42" each.

A CSV file has the geometry as well-known text, with the types of the fields in a .csvt file and the coordinate system
in a .prj file, as GDAL reads them; or it has one row per vertex.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ..alignment.elements import Alignment, CantElement, Element, VerticalElement
from ..clouds.crs import parse_crs
from ..fields import Field
from ..frame import LocalFrame
from ..polyline import Polyline
from ..progress import SILENT, Progress

VERTICES = "_points.csv"
"""Ending of the names of CSV files with one row per vertex."""

DECIMALS = 4
"""Of coordinates: 0.1 mm in metres, 0.03 mm in feet."""

CSV_TYPES = {int: "Integer", float: "Real", str: "String"}

APPLICATION = "RAIL_EXTRACT"
"""Owner of the extended data."""

MAX_TEXT = 255
"""Longest text of extended data."""

COLOURS = {"RAILS": 5, "TRACK": 1, "STATIONS": 3, "ALIGNMENT": 1, "PLAN": 7, "PROFILE": 3, "CANT": 5}
"""Colour of a layer by the first word of its name: blue, red, green; black on paper for elements in plan."""

LAYOUTS = {"H": "PLAN", "V": "PROFILE", "C": "CANT"}
"""First word of the layers of element points and their texts."""

TEXT_M = 0.8
"""Height of the texts in a drawing, metres: legible beside the track at a scale of 1:500."""

OTHER_COLOUR = 30
"""Orange, for findings and stops."""

GROUPS_AT_ONCE = 1_000
"""Groups of a drawing that are written between two checks for cancellation."""

ID_FIELDS = ("rail_id", "track_id", "guide_id", "finding", "class_code")
"""Fields that a row of a vertex has."""


Entity = tuple[str, Iterator[tuple[int, Any]]]
"""Layer of an entity of a drawing, and its groups: codes and values."""


@dataclass(frozen=True)
class Shape:
    """A line or a point to write, with the values of its fields as they are written.

    `xyz`, (n, 3), is in the coordinates of the cloud; z is NaN without heights. A point has one vertex.
    """

    xyz: np.ndarray
    values: Sequence[Any]


def write_shapes(
    path: Path, shapes: Iterable[Shape], fields: Sequence[Field], frame: LocalFrame, kind: str, is_line: bool
) -> None:
    """Write shapes, lines or points, into a .dxf or a .csv file; `kind` begins the names of layers of a drawing."""
    if path.suffix.lower() == ".dxf":
        with path.open("w", encoding="ascii", errors="replace", newline="\r\n") as file:
            _write_dxf(file, list(shapes), fields, kind, is_line)
        return
    vertices = path.name.lower().endswith(VERTICES)
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = _vertex_rows(shapes, fields, frame, is_line) if vertices else _shape_rows(shapes, fields, is_line)
        csv.writer(file).writerows(rows)
    if not vertices:
        types = ",".join(["WKT", *(CSV_TYPES[field.kind] for field in fields)])
        path.with_suffix(".csvt").write_text(types + "\n", encoding="ascii")
        if frame.crs_wkt:
            wkt = parse_crs(frame.crs_wkt).to_wkt("WKT1_GDAL")
            path.with_suffix(".prj").write_text(wkt, encoding="utf-8")


def _shape_rows(shapes: Iterable[Shape], fields: Sequence[Field], is_line: bool) -> Iterator[list[Any]]:
    """Yield the names of the fields, then a row for each shape, with its geometry first."""
    yield ["WKT", *(field.name for field in fields)]
    for shape in shapes:
        flat = bool(np.isnan(shape.xyz[:, 2]).any())
        places = ",".join(" ".join(_written(place[: 2 if flat else 3])) for place in shape.xyz)
        name = ("LINESTRING" if is_line else "POINT") + ("" if flat else " Z")
        yield [f"{name} ({places})", *shape.values]


def _vertex_rows(
    shapes: Iterable[Shape], fields: Sequence[Field], frame: LocalFrame, is_line: bool
) -> Iterator[list[Any]]:
    """Yield a row for each vertex: ids, coordinates and chainage of lines; all fields of points."""
    kept = [number for number, field in enumerate(fields) if not is_line or field.name in ID_FIELDS]
    yield [*(fields[number].name for number in kept), "x", "y", "z", *(["chainage_m"] if is_line else [])]
    for shape in shapes:
        along = Polyline(shape.xyz).t * frame.horizontal_unit_m
        for place, t in zip(shape.xyz, along):
            row = [*(shape.values[number] for number in kept), *_written(place)]
            yield [*row, f"{t:.3f}"] if is_line else row


def _written(place: np.ndarray) -> list[str]:
    """Write coordinates; those that are unknown stay empty."""
    return ["" if np.isnan(value) else f"{value:.{DECIMALS}f}" for value in place]


def write_alignments(path: Path, alignments: Sequence[Alignment], progress: Progress = SILENT) -> None:
    """Write alignments as a DXF file: a 3D polyline for each, and a point with a text where an element begins.

    The curve of track 7 is on the layer ALIGNMENT_7, the elements are on PLAN_7, PROFILE_7 and CANT_7.
    """
    entities: list[Entity] = []
    for alignment in alignments:
        track = "" if alignment.track_id is None else f"_{alignment.track_id}"
        curve = _with_heights(alignment.frame.to_crs(alignment.drawn(alignment.s_from, alignment.s_to)))
        layer = f"ALIGNMENT{track}"
        entities.append((layer, _polyline(curve, layer, ())))
        for one in alignment.elements:
            layer = f"{LAYOUTS[one.layout]}{track}"
            entities.append((layer, _element_point(alignment, one, layer)))
    with path.open("w", encoding="ascii", errors="replace", newline="\r\n") as file:
        _put_drawing(file, entities, progress)


def _with_heights(curve: np.ndarray) -> np.ndarray:
    """Return the vertices, (n, 3), whose heights are known; all of them if none is: at 0, they would make cliffs."""
    known = np.isfinite(curve[:, 2])
    return curve[known] if known.any() else curve


def _element_point(alignment: Alignment, one: Element, layer: str) -> Iterator[tuple[int, Any]]:
    """Yield the groups of the point where an element begins, and of its text, which runs away from the track."""
    at = np.array([one.s_from])
    place = alignment.frame.to_crs(alignment.xyz(at))[0]
    yield from _point(place, layer, ())
    aside = (math.degrees(float(alignment.headings(at)[0])) - 90.0) % 360.0
    yield from ((0, "TEXT"), (8, layer), *_coordinates(place), (40, TEXT_M / alignment.frame.horizontal_unit_m))
    yield from ((1, f"  {label_of(one)}"), (50, aside))


def label_of(one: Element) -> str:
    """Return an element in words.

    >>> label_of(CantElement(0.0, 40.0, 0.0, -0.12))
    'ramp 0 to -120 mm, L 40.00'
    """
    length = f"L {one.length_m:.2f}"
    if isinstance(one, CantElement):
        return f"{one.type} {_from_to(1000 * one.cant_from_m, 1000 * one.cant_to_m, '.0f')} mm, {length}"
    if isinstance(one, VerticalElement):
        grades = f"{_from_to(1000 * one.grade_from, 1000 * one.grade_to, '.2f')} per mille"
        return f"{one.type} {grades}, {length}" + (f", R {1 / one.curvature:.0f}" if one.curvature else "")
    radii = [f"{1 / bend:.2f}" if bend else "straight" for bend in (one.k_from, one.k_to)]
    curve = f" R {' to '.join(dict.fromkeys(radii))}" if one.type != "line" else ""
    return f"{one.type}{curve}, {length}"


def _from_to(start: float, end: float, digits: str) -> str:
    """Write one number, or two that differ."""
    return " to ".join(dict.fromkeys(f"{value + 0.0:{digits}}" for value in (start, end)))


def _write_dxf(file: TextIO, shapes: Sequence[Shape], fields: Sequence[Field], kind: str, is_line: bool) -> None:
    """Write shapes with their fields."""
    entities: list[Entity] = []
    for shape in shapes:
        layer = _layer(shape, fields, kind)
        data = [(1001, APPLICATION), *((1000, text) for text in _texts(shape, fields))]
        drawn = _polyline(shape.xyz, layer, data) if is_line else _point(shape.xyz[0], layer, data)
        entities.append((layer, drawn))
    _put_drawing(file, entities)


def _put_drawing(file: TextIO, entities: Sequence[Entity], progress: Progress = SILENT) -> None:
    """Write a DXF file of release 12."""
    groups: list[tuple[int, Any]] = [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")]
    groups += [(0, "SECTION"), (2, "TABLES")]
    groups += _table("APPID", [[(2, APPLICATION), (70, 0)]])
    groups += _table("LTYPE", [[(2, "CONTINUOUS"), (70, 0), (3, "Solid line"), (72, 65), (73, 0), (40, 0.0)]])
    names = sorted({layer for layer, _ in entities})
    groups += _table("LAYER", [[(2, name), (70, 0), (62, _colour(name)), (6, "CONTINUOUS")] for name in names])
    groups += [(0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    entities_of = chain.from_iterable(entity for _, entity in entities)
    everything = chain(groups, entities_of, [(0, "ENDSEC"), (0, "EOF")])
    while part := list(islice(everything, GROUPS_AT_ONCE)):
        progress.check()
        _put(file, part)


def _polyline(xyz: np.ndarray, layer: str, data: Sequence[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
    """Yield the groups of a 3D polyline."""
    yield from ((0, "POLYLINE"), (8, layer), (66, 1), (10, 0.0), (20, 0.0), (30, 0.0), (70, 8), *data)
    for place in xyz:
        yield from ((0, "VERTEX"), (8, layer), *_coordinates(place), (70, 32))
    yield from ((0, "SEQEND"), (8, layer))


def _point(place: np.ndarray, layer: str, data: Sequence[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
    """Yield the groups of a point."""
    yield from ((0, "POINT"), (8, layer), *_coordinates(place), *data)


def _coordinates(place: np.ndarray) -> list[tuple[int, Any]]:
    """Return the groups of a place; without a height, it is at 0."""
    return list(zip((10, 20, 30), np.nan_to_num(place).tolist()))


def _table(name: str, entries: Sequence[Sequence[tuple[int, Any]]]) -> list[tuple[int, Any]]:
    """Return the groups of a table."""
    groups: list[tuple[int, Any]] = [(0, "TABLE"), (2, name), (70, len(entries))]
    for entry in entries:
        groups += [(0, name), *entry]
    return [*groups, (0, "ENDTAB")]


def _texts(shape: Shape, fields: Sequence[Field]) -> Iterator[str]:
    """Yield the fields that have a value as texts."""
    for field, value in zip(fields, shape.values):
        if value not in (None, ""):
            yield f"{field.name}={value}"[:MAX_TEXT]


def _layer(shape: Shape, fields: Sequence[Field], kind: str) -> str:
    """Return the layer of a shape: rails by class, centerlines and stations by track."""
    names = [field.name for field in fields]
    by = next((name for name in ("finding", "rail_id", "track_id") if name in names), "")
    number = {"rail_id": "class_code", "track_id": "track_id"}.get(by)
    return kind if number is None else f"{kind}_{shape.values[names.index(number)]}"


def _colour(layer: str) -> int:
    return COLOURS.get(layer.partition("_")[0], OTHER_COLOUR)


def _put(file: TextIO, groups: Iterable[tuple[int, Any]]) -> None:
    """Write groups: a code and a value, each on its own line; a line break in a text would begin another group."""
    file.writelines(f"{code:3d}\n{_group_value(value)}\n" for code, value in groups)


def _group_value(value: Any) -> str:
    """Write the value of a group, in which a control character of a text becomes a blank."""
    if isinstance(value, float):
        return f"{value:.{DECIMALS}f}"
    return "".join(one if one.isprintable() else " " for one in str(value))
