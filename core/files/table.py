"""The element table: alignments as rows with the fields `core.fields.ELEMENT_FIELDS`, and back."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields
from itertools import groupby
from typing import Any, Optional, TypeVar

import numpy as np

from ..alignment.elements import Alignment, CantElement, Element, Figures, PlanElement, VerticalElement
from ..design_numbers import CANT_MM, GRADE_PM, KM, NUMBER, RADIUS, WHOLE, checked, number_in, quoted
from ..errors import ParameterError, RailExtractError
from ..fields import ELEMENT_FIELDS
from ..frame import ORIGIN_STEP, LocalFrame
from ..kilometres.text import read_km
from ..progress import SILENT, Progress
from .design import within_plan

Row = Mapping[str, Any]

Bent = TypeVar("Bent", VerticalElement, CantElement)

GON = 200.0 / math.pi
"""Gon in a radian."""

LAYOUTS = (PlanElement.layout, VerticalElement.layout, CantElement.layout)

UNREAD = ("length_m", "a_param", "rot", "azimuth_gon")
"""Fields that follow from others."""

KINDS = {
    **dict.fromkeys(("track_id", "no"), WHOLE),
    **dict.fromkeys(("r1_m", "r2_m", "r_fit_m", "r_round_m"), RADIUS),
    **dict.fromkeys(("km_from", "km_to"), KM),
    **dict.fromkeys(("grade1_pm", "grade2_pm"), GRADE_PM),
    **dict.fromkeys(("cant1_mm", "cant2_mm"), CANT_MM),
}
"""What the numbers of some fields may be; those of the others are any of a design."""

KEY_FIELDS = ("layout", "s_from", "s_to")
"""Fields by which an element table is recognized."""


def check_table(names: Collection[str], source: str) -> None:
    """Check that a table with these fields is an element table; `source` names it in the message."""
    if not set(KEY_FIELDS) <= set(names):
        raise RailExtractError(
            f"{source} is not an element table, because it lacks the fields {', '.join(KEY_FIELDS)}: give the output "
            "ELEMENTS of Fit alignment or Import alignment."
        )


def read_table(table: Iterable[Row], source: str) -> list[Row]:
    """Return the rows of an element table with numbers for numbers that are written as text, after a check of all."""
    known = [one for one in ELEMENT_FIELDS if one.name not in UNREAD]
    return [{one.name: _read(row, one.name, one.kind, f"{_where(row)} of {source}") for one in known} for row in table]


def _read(row: Row, name: str, kind: type, where: str) -> Any:
    """Return the value of a field; None where it is empty."""
    value = row.get(name)
    if kind is str:
        return None if value is None else str(value)
    number = read_km(value) if isinstance(value, str) and KINDS.get(name) is KM else None
    number = number_in(value) if number is None else number
    if number is None:
        return None
    if math.isnan(number) or (kind is int and not number.is_integer()):
        what = "whole number" if kind is int else "number"
        raise ParameterError(f"{where} has {quoted(value)} in the field {name}, which is not a {what}: correct it.")
    return kind(checked(number, KINDS.get(name, NUMBER), where, name))


def frame_of(table: Iterable[Row], system: tuple[Optional[str], float, float], source: str) -> LocalFrame:
    """Return the local frame of rows of `read_table`, given a coordinate system and its units in plan and height."""
    starts = [(row["x"], row["y"]) for row in table if None not in (row["x"], row["y"])]
    if not starts:
        raise RailExtractError(f"{source} has no element in plan with x and y: give a table with layout H.")
    crs_wkt, horizontal_unit_m, vertical_unit_m = system
    origin = np.append(np.round(np.median(starts, axis=0) / ORIGIN_STEP) * ORIGIN_STEP, 0.0)
    return LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)


def rows(alignment: Alignment, progress: Progress = SILENT) -> list[dict[str, Any]]:
    """Return the rows of an alignment, unrounded: plan, then height, then cant, in order along the track."""
    layouts: tuple[Sequence[Element], ...] = (alignment.plan, alignment.vertical, alignment.cant)
    starts = np.array([one.s_from for one in alignment.elements])
    places, headings = alignment.frame.to_crs(alignment.xyz(starts)), alignment.headings(starts)
    numbered = [(number, one) for elements in layouts for number, one in enumerate(elements, 1)]
    made = []
    for (number, one), place, heading in zip(numbered, places, headings.tolist()):
        progress.check()
        made.append(_row(alignment.track_id, number, one, place, heading))
    return made


def alignments(table: Iterable[Row], frame: LocalFrame, progress: Progress = SILENT) -> list[Alignment]:
    """Return the alignments of rows of `read_table`, in any order, in order of their track.

    Start, end, place and direction of the start, type and radii are read in plan; height and gradients, or cant, in the
    other layouts.
    """
    tracks: dict[Optional[int], list[Row]] = {}
    for row in table:
        progress.check()
        if _layout(row):
            tracks.setdefault(row["track_id"], []).append(row)
    in_order = sorted(tracks, key=lambda number: (number is not None, number))
    return [within_plan(_alignment(number, tracks[number], frame), f"track {number}", progress) for number in in_order]


def _alignment(track_id: Optional[int], table: list[Row], frame: LocalFrame) -> Alignment:
    """Return the alignment of one track."""
    table = sorted(table, key=lambda row: (LAYOUTS.index(row["layout"]), float(_needed(row, "s_from"))))
    by_layout = {layout: list(members) for layout, members in groupby(table, key=lambda row: row["layout"])}
    for members in by_layout.values():
        _check_order(members)
    if "H" not in by_layout:
        raise ParameterError(
            f"The element table has no row with layout H for track {track_id}: give it the elements in plan, too."
        )
    return Alignment(
        track_id,
        frame,
        tuple(_plan_element(row, frame) for row in by_layout["H"]),
        tuple(_vertical_element(row, frame) for row in by_layout.get("V", ())),
        tuple(_cant_element(row) for row in by_layout.get("C", ())),
    )


def _check_order(table: Sequence[Row]) -> None:
    """Check that elements which follow each other along the track are numbered in this order."""
    for before, after in zip(table, table[1:]):
        first, second = (math.nan if row["no"] is None else row["no"] for row in (before, after))
        if first > second:
            raise ParameterError(
                f"{_where(before)} starts at s_from = {float(before['s_from']):g} m, before element {second:g} at "
                f"{float(after['s_from']):g} m: correct s_from, or number the elements in order along the track."
            )


def _row(track_id: Optional[int], number: int, element: Element, place: np.ndarray, heading: float) -> dict[str, Any]:
    """Return the row of an element, given the place, (3,), and the direction of its start."""
    row = dict.fromkeys((one.name for one in ELEMENT_FIELDS), None)
    row.update(
        track_id=track_id,
        no=number,
        layout=element.layout,
        type=element.type,
        s_from=element.s_from,
        s_to=element.s_to,
        length_m=element.length_m,
        x=float(place[0]),
        y=float(place[1]),
        z=None if math.isnan(place[2]) else float(place[2]),
        azimuth_gon=(100.0 - heading * GON) % 400.0,
        heading=math.remainder(heading, math.tau),
    )
    row.update({one.name: getattr(element.figures, one.name) for one in fields(Figures)})
    row.update(_shape(element))
    return row


def _shape(element: Element) -> dict[str, Any]:
    """Return the fields that only one layout fills."""
    if isinstance(element, CantElement):
        return {"cant1_mm": 1000.0 * element.cant_from_m, "cant2_mm": 1000.0 * element.cant_to_m}
    if isinstance(element, VerticalElement):
        radius = 1.0 / element.curvature if element.type == "parabola" else None
        grades = {"grade1_pm": 1000.0 * element.grade_from, "grade2_pm": 1000.0 * element.grade_to}
        return {**grades, "r1_m": radius, "r2_m": radius}
    change = element.k_to - element.k_from
    bend = element.k_from + element.k_to
    return {
        "r1_m": 1.0 / element.k_from if element.k_from else None,
        "r2_m": 1.0 / element.k_to if element.k_to else None,
        "a_param": math.sqrt(element.length_m / abs(change)) if change else None,
        "rot": ("L" if bend > 0 else "R") if bend else None,
    }


def _layout(row: Row) -> Optional[str]:
    """Return the layout of a row, None in an empty row."""
    layout = row.get("layout")
    if layout is None and row.get("s_from") is None:
        return None
    if layout not in LAYOUTS:
        raise ParameterError(f"The element table has the layout {layout!r}: write H, V or C.")
    return str(layout)


def _plan_element(row: Row, frame: LocalFrame) -> PlanElement:
    """Return the element of a row in plan; its type decides which radii count."""
    kind, place = row.get("type"), frame.to_local(np.array([_needed(row, "x"), _needed(row, "y"), 0.0]))
    ends = {"line": (None, None), "arc": (_edited_radius(row),) * 2, "clothoid": (row["r1_m"], row["r2_m"])}
    if kind not in ends:
        raise ParameterError(f"{_where(row)} has the type {kind!r}: in plan, write line, arc or clothoid.")
    if kind != "line" and ends[kind] == (None, None):
        raise ParameterError(f"{_where(row)} is of type {kind} and has no radius: fill one, or make it a line.")
    k_from, k_to = (_bend(radius) for radius in ends[kind])
    start = *_extent(row), float(place[0]), float(place[1]), _needed(row, "heading")
    return PlanElement(*start, k_from, k_to, _figures(row))


def _vertical_element(row: Row, frame: LocalFrame) -> VerticalElement:
    """Return the element of a row in height; the radius of a parabola counts where a fit has noted its own."""
    s_from, length_m = _extent(row)
    z = float(frame.to_local(np.array([0.0, 0.0, _needed(row, "z")]))[2])
    grade_from, grade_to = _ends(row, ("grade", "parabola"), "grade1_pm", "grade2_pm")
    radius = _edited_radius(row)
    if (
        row.get("type") == "parabola"
        and radius is not None
        and (grade_from == grade_to or row.get("r_fit_m") is not None)
    ):
        grade_to = grade_from + length_m * _bend(radius)
    return _checked(row, VerticalElement(s_from, length_m, z, grade_from, grade_to, _figures(row)), "fill r1_m")


def _cant_element(row: Row) -> CantElement:
    """Return the element of a row of cant."""
    cant_from_m, cant_to_m = _ends(row, ("constant", "ramp"), "cant1_mm", "cant2_mm")
    return _checked(row, CantElement(*_extent(row), cant_from_m, cant_to_m, _figures(row)), "change cant2_mm")


def _ends(row: Row, types: tuple[str, str], *names: str) -> tuple[float, float]:
    """Return gradients or cants at both ends, as shares or metres; the first of the types has equal ones."""
    start, end = (_needed(row, name) / 1000.0 for name in names)
    return start, start if row.get("type") == types[0] else end


def _checked(row: Row, made: Bent, remedy: str) -> Bent:
    """Check that an element is of the type that its row states, if it states one."""
    if row.get("type") not in (None, made.type):
        raise ParameterError(
            f"{_where(row)} has the type {row.get('type')!r}, but its values are those of a {made.type}: {remedy}, or "
            f"write {made.type}."
        )
    return made


def _extent(row: Row) -> tuple[float, float]:
    """Return start and length."""
    s_from, s_to = _needed(row, "s_from"), _needed(row, "s_to")
    if s_to <= s_from:
        raise ParameterError(f"{_where(row)} ends at s_to = {s_to:g} m: let it end after its start.")
    return s_from, s_to - s_from


def _edited_radius(row: Row) -> Optional[float]:
    """Return the radius of an arc: of two that differ, the one that is not as it was fitted."""
    first, second, fitted = (row.get(name) for name in ("r1_m", "r2_m", "r_fit_m"))
    return second if second is not None and (first is None or first == fitted) else first


def _bend(radius: Optional[float]) -> float:
    """Return the curvature for a radius; 0 where it is empty."""
    return 0.0 if radius is None else 1.0 / radius


def _figures(row: Row) -> Figures:
    """Return what the row states besides the shape."""
    return Figures(**{one.name: row.get(one.name) for one in fields(Figures)})


def _needed(row: Row, name: str) -> float:
    """Return a number that a row must have."""
    value = row[name]
    if value is not None:
        return float(value)
    raise ParameterError(f"{_where(row)} has no value in the field {name}: fill it, or remove the row.")


def _where(row: Row) -> str:
    """Name a row in a message."""
    no, layout, track = (quoted(row.get(name)).strip("'") for name in ("no", "layout", "track_id"))
    return f"The element {no} of layout {layout} of track {track}"
