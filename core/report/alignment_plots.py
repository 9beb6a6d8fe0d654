"""Diagram of an alignment: its elements under the measured curvature, cant and gradient, and slews and lifts.

A diagram has a row for each kilometre, so that it can be read on paper.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..alignment.deviations import Deviations
from ..alignment.elements import Alignment, PlanElement
from ..alignment.equations import Piece, stations_of
from .markup import tag, text
from .plots import LEFT, PANEL, SPACE, TICKS_ACROSS, WIDTH, Frame, Panel, across, broken, place_of, round_up

ROW_M = 1000.0
"""Length of a row of a diagram, metres."""

STRIP, LABEL = 22.0, 46.0
"""Height of the strip of elements, and the least width of an element with a text, in units of the picture."""

HALF_CHORD_M, HALF_BASE_M = 10, 5
"""Distances between the three points whose circle gives the measured curvature, and from a place to the two points
that give its gradient, metres: those of the track geometry."""

STEP_M = 1.5
"""Places further apart belong to different parts of a track: deviations are given by the metre."""


@dataclass(frozen=True)
class Course:
    """A quantity along the track, as it was measured and as the elements have it.

    Attributes
    ----------
    panel : Panel
        Of the measured values.
    s, design : (k,) array
        Corners of the design's curve; empty without one.
    """

    panel: Panel
    s: np.ndarray
    design: np.ndarray


def draw_alignment(alignment: Alignment, found: Deviations) -> str:
    """Return the diagram of a track as SVG, one picture for each kilometre.

    Parameters
    ----------
    alignment : Alignment
    found : Deviations
    """
    courses = [course for course in _courses(alignment, found) if np.isfinite(course.panel.values).any()]
    length_m = alignment.s_to - alignment.s_from
    borders = np.linspace(alignment.s_from, alignment.s_to, max(int(np.ceil(length_m / ROW_M)), 1) + 1)
    return "".join(_row(alignment, found, courses, row) for row in zip(borders[:-1], borders[1:]))


def _courses(alignment: Alignment, found: Deviations) -> Iterator[Course]:
    """Yield the quantities of the diagram."""
    s, nothing = found.s, np.empty(0)
    bends = [(one.s_from, one.s_to, 1000 * one.k_from, 1000 * one.k_to) for one in alignment.plan]
    grades = [(one.s_from, one.s_to, 1000 * one.grade_from, 1000 * one.grade_to) for one in alignment.vertical]
    cants = [(one.s_from, one.s_to, 1000 * one.cant_from_m, 1000 * one.cant_to_m) for one in alignment.cant]
    heading = "Curvature, positive to the left"
    yield Course(Panel(heading, "1/km", 1000 * measured_curvature(alignment, found), 0.4), *_corners(bends))
    cant_mm = 1000 * alignment.cants(s) + found.cant_diff_mm
    yield Course(Panel("Cant, left minus right", "mm", cant_mm, 20), *_corners(cants))
    yield Course(Panel("Gradient", "‰", 1000 * measured_grade(alignment, found), 2), *_corners(grades))
    yield Course(Panel("Slew: measured minus design, positive to the left", "mm", found.slew_mm, 4), nothing, nothing)
    yield Course(Panel("Lift: measured minus design", "mm", found.lift_mm, 4), nothing, nothing)


def _corners(parts: Sequence[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a curve from start, end and the values there of its parts."""
    columns = np.array(parts).reshape(-1, 4)
    return columns[:, :2].ravel(), columns[:, 2:].ravel()


def measured_curvature(alignment: Alignment, found: Deviations) -> np.ndarray:
    """Return the curvature of the measured track, (n,) 1/m, on chords of 20 m; NaN near its ends."""
    heading = alignment.headings(found.s)
    left = np.column_stack([-np.sin(heading), np.cos(heading)])
    return _along(alignment.places(found.s) + left * found.slew_mm[:, None] / 1000, found.s, HALF_CHORD_M, _bend)


def measured_grade(alignment: Alignment, found: Deviations) -> np.ndarray:
    """Return the gradient of the measured track, (n,), over 10 m; NaN near its ends."""
    z = alignment.heights(found.s) + found.lift_mm / 1000
    return _along(np.column_stack([found.s, z]), found.s, HALF_BASE_M, _slope)


def _bend(before: np.ndarray, at: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the curvature of the circles through three points each, (n, 2)."""
    to, fro, chord = at - before, after - at, after - before
    cross = to[:, 0] * fro[:, 1] - to[:, 1] * fro[:, 0]
    return 2 * cross / np.prod([np.hypot(*way.T) for way in (to, fro, chord)], axis=0)


def _slope(before: np.ndarray, _: np.ndarray, after: np.ndarray) -> np.ndarray:
    return (after[:, 1] - before[:, 1]) / (after[:, 0] - before[:, 0])


def _along(points: np.ndarray, s: np.ndarray, reach: int, measure: Any) -> np.ndarray:
    """Apply a measure to each point with those `reach` before and after it, where all three are of one part."""
    values = np.full(len(s), np.nan)
    if len(s) <= 2 * reach:
        return values
    inner = measure(points[: -2 * reach], points[reach:-reach], points[2 * reach :])
    whole = s[2 * reach :] - s[: -2 * reach] < 2 * reach * STEP_M
    values[reach:-reach] = np.where(whole, inner, np.nan)
    return values


def _row(alignment: Alignment, found: Deviations, courses: Sequence[Course], row: tuple[float, float]) -> str:
    """Draw the part of the diagram between two distances along the track."""
    head = SPACE + STRIP
    bottom = head + len(courses) * (PANEL + SPACE)
    parts = [*_strip(alignment, row), *_axis(alignment, row, head, bottom)]
    for number, course in enumerate(courses):
        parts.append(_panel(course, found, row, head + place_of(number)))
    label = f"Alignment of track {alignment.track_id} from {row[0]:.0f} to {row[1]:.0f} m"
    box = f"0 0 {WIDTH:g} {bottom + SPACE:g}"
    return tag("svg", *parts, viewBox=box, role="img", aria_label=label, class_="alignment")


def _strip(alignment: Alignment, row: tuple[float, float]) -> Iterator[str]:
    """Draw the elements in plan as a strip."""
    for one in alignment.plan:
        start, end = max(one.s_from, row[0]), min(one.s_to, row[1])
        if start < end:
            x, width = float(across(start, row)), float(across(end, row) - across(start, row))
            title = tag("title", text(f"{one.type}, {one.s_from:.2f} to {one.s_to:.2f} m"))
            yield tag("rect", title, x=x, y=SPACE, width=width, height=STRIP, class_=f"element {one.type}")
            if width > LABEL:
                words = tag("text", text(_words(one)), x=x + width / 2, y=SPACE + STRIP - 6, class_="middle onelement")
                yield words


def _words(one: PlanElement) -> str:
    """Write what matters of an element in few characters."""
    if one.type == "line":
        return f"{one.length_m:.0f} m"
    if one.type == "arc":
        return f"R {1 / one.k_from:.0f}"
    return f"A {(one.length_m / abs(one.k_to - one.k_from)) ** 0.5:.0f}"


def _axis(alignment: Alignment, row: tuple[float, float], top: float, bottom: float) -> Iterator[str]:
    """Draw the kilometres, or the metres along the track where they are unknown, through all panels."""
    stations = stations_of(alignment)
    pieces = stations.pieces if stations else (Piece(0.0, 0.0),)
    name = "km" if stations else "m"
    yield tag("text", text(name), x=LEFT - 8, y=SPACE - 8, class_="tick end")
    yield tag("text", text(name), x=LEFT - 8, y=bottom + 16, class_="tick end")
    step = round_up((row[1] - row[0]) / TICKS_ACROSS)
    for piece, after in zip(pieces, [*pieces[1:], Piece(np.inf, 0.0)]):
        start, end = max(piece.s, row[0]), min(after.s, row[1])
        if piece.s > row[0] and piece.s < row[1]:
            yield tag("line", **_vertical(piece.s, row, top, bottom), class_="jump")
        if start >= end and stations:
            continue
        low, high = sorted((piece.at(start), piece.at(end))) if stations else row
        for station in np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step:
            s = piece.s + (station - piece.station) * (1 if piece.rises else -1)
            yield tag("line", **_vertical(s, row, top, bottom), class_="grid")
            words = text(f"{station / 1000:.3f}".rstrip("0").rstrip(".") if stations else f"{station:,g}")
            yield tag("text", words, x=float(across(s, row)), y=SPACE - 8, class_="tick middle")
            yield tag("text", words, x=float(across(s, row)), y=bottom + 16, class_="tick middle")


def _vertical(s: float, row: tuple[float, float], top: float, bottom: float) -> dict[str, float]:
    x = float(across(s, row))
    return {"x1": x, "x2": x, "y1": top, "y2": bottom}


def _panel(course: Course, found: Deviations, row: tuple[float, float], top: float) -> str:
    """Draw a quantity: the measured curve over that of the design."""
    panel = course.panel
    both = np.concatenate([panel.values, course.design])
    frame = Frame(top, row, Panel(panel.heading, panel.unit, both, panel.min_span).limits())
    mine = (found.s >= row[0]) & (found.s <= row[1])
    curves = [frame.curve(*_cut(course.s, course.design, row), class_="design")] if len(course.s) else []
    curves.append(frame.curve(*broken(found.s[mine], panel.values[mine], STEP_M)))
    return frame.draw(panel.heading, f"[{panel.unit}]", *curves, class_="frame")


def _cut(s: np.ndarray, values: np.ndarray, row: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of a curve with jumps between two distances, with its ends there."""
    inside = (s >= row[0]) & (s <= row[1])
    ends = [(end, np.interp(end, s, values)) for end in row if s[0] <= end <= s[-1]]
    pairs = sorted(
        [*((place, number, value) for number, (place, value) in enumerate(zip(s[inside], values[inside]), start=1))]
        + [(place, 0 if place == row[0] else len(s) + 1, value) for place, value in ends]
    )
    places, _, cut = zip(*pairs) if pairs else ((), (), ())
    return np.array(places, dtype=float), np.array(cut, dtype=float)
