"""The report on alignments: how far tracks lie off them, their elements, and a diagram of each track.

A diagram shows the elements under the measured curvature, cant and gradient, and slews and lifts. It has a row for each
kilometre, so that it can be read on paper.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..alignment.elements import (
    Alignment,
    CantElement,
    Element,
    PlanElement,
    StationRange,
    VerticalElement,
    stations_of,
)
from ..alignment.measured import Deviations
from ..progress import metres
from ..spread import largest, rms
from ..tracks.geometry import GRADE_BASE_M, HALF_CHORD_M
from .markup import figure, legend, made, page, section, table, tag, text, tiles
from .page import stated
from .plots import LEFT, SPACE, STEP_M, TICKS_ACROSS, WIDTH, Curve, Frame, Panel, across, bottom_of, broken, round_up

PROPOSAL = (
    "A fitted alignment is a proposal: the elements that the measured track most likely follows. It does not show what "
    "was designed, approved or built. The standard error of a radius is that of the fit; it does not contain a common "
    "error of the survey."
)

NOTE = (
    "Slew, lift and cant difference are measured minus design: a positive slew means that the track lies to the left "
    "of the design, seen along the track. The measured curvature is that of chords of 20 m, the measured gradient that "
    "over 10 m."
)

LAYOUTS = {"H": "plan", "V": "height", "C": "cant"}

ROW_M = 1000.0
"""Length of a row of a diagram, metres."""

STRIP, LABEL = 22.0, 46.0
"""Height of the strip of elements, and the least width of an element with a text, in units of the picture."""

ALIGNMENT_STYLE = """
svg .frame { fill: none; stroke: var(--line); }
svg .design { fill: none; stroke: #f4a261; stroke-width: 5; stroke-linejoin: round; opacity: 0.75; }
svg .jump { stroke: var(--unsure); stroke-width: 1.4; stroke-dasharray: 4 3; }
svg.alignment { margin-bottom: 14px; }
svg rect.element { stroke: var(--paper); stroke-width: 1; }
svg rect.line { fill: #b0bec5; }
svg rect.clothoid { fill: #f8bf7f; }
svg rect.arc { fill: #90bdf0; }
svg text.onelement { fill: var(--ink); }
i.designed { background: #f4a261; }
i.element { height: 10px; }
i.line { background: #b0bec5; }
i.clothoid { background: #f8bf7f; }
i.arc { background: #90bdf0; }
@page { size: A4 landscape; }
@media print { section { break-inside: auto; } }
"""
"""Rules besides those of all pages."""


def build_alignment_page(
    courses: Sequence[tuple[Alignment, Deviations]],
    source: str,
    facts: Mapping[str, str],
    fitted: bool,
    warnings: Sequence[str] = (),
) -> str:
    """Return the report on alignments and the tracks beside them, a complete HTML document.

    `source` names the measured tracks, `facts` are stated by name besides date, version and coordinate system, and
    `warnings` are what the user was warned of. `fitted` says whether the alignments were fitted to these tracks.
    """
    stated_facts = {
        **stated(courses[0][0].frame.crs_wkt),
        **facts,
        **({"Check": " ".join(warnings)} if warnings else {}),
    }
    slews, lifts = (np.concatenate([getattr(found, name) for _, found in courses]) for name in ("slew_mm", "lift_mm"))
    return page(
        f"Rail Extract: {source}",
        "Rail Extract alignment report",
        source,
        _tiles(courses, slews, lifts),
        *(_track(alignment, found) for alignment, found in courses),
        made(stated_facts, (NOTE, *([PROPOSAL] if fitted else []))),
        style=ALIGNMENT_STYLE,
    )


def _tiles(courses: Sequence[tuple[Alignment, Deviations]], slews: np.ndarray, lifts: np.ndarray) -> str:
    """Write the most important figures."""
    figures = [
        (str(len(courses)), "tracks"),
        (metres(sum(alignment.s_to - alignment.s_from for alignment, _ in courses)), "of alignment"),
        (str(sum(len(alignment.elements) for alignment, _ in courses)), "elements"),
        (figure(rms(slews)), "slew, RMS"),
        (figure(rms(lifts)), "lift, RMS"),
        (figure(largest(slews), "+.1f"), "slew, largest"),
    ]
    return tiles(figures)


def _track(alignment: Alignment, found: Deviations) -> str:
    """Write the diagram and the elements of a track."""
    name = alignment.name or f"Track {alignment.track_id}"
    keys = [("measured", "fine"), ("design", "designed")]
    keys += [(kind, f"element {kind}") for kind in ("line", "clothoid", "arc")]
    headings = ("Element", "Starts at", "Length", "From", "To", "Standard error of the radius", "Deviation, RMS")
    layouts: tuple[Sequence[Element], ...] = (alignment.plan, alignment.vertical, alignment.cant)
    rows = [_row(number, one) for elements in layouts for number, one in enumerate(elements, start=1)]
    shown = legend((what, {"class_": mark}) for what, mark in keys)
    return section(name, draw_alignment(alignment, found), shown, table(headings, rows, "scroll tall"))


def _row(number: int, one: Element) -> tuple[str, ...]:
    figures = one.figures
    start = f"{one.s_from:,.2f} m" if figures.km_from is None else f"km {figures.km_from:.5f}"
    return (
        f"{LAYOUTS[one.layout]} {number}, {one.type}",
        start,
        f"{one.length_m:,.2f} m",
        *_ends(one),
        "" if figures.sigma_r_m is None else f"{figures.sigma_r_m:.2f} m",
        "" if figures.dev_rms_mm is None else f"{figures.dev_rms_mm:.1f} mm",
    )


def _ends(one: Element) -> tuple[str, str]:
    """Write radius, gradient or cant at start and end."""
    if isinstance(one, CantElement):
        return figure(1000 * one.cant_from_m, "+.1f"), figure(1000 * one.cant_to_m, "+.1f")
    if isinstance(one, VerticalElement):
        return figure(1000 * one.grade_from, "+.3f", "‰"), figure(1000 * one.grade_to, "+.3f", "‰")
    start, end = (f"R {1 / bend:,.2f} m" if bend else "straight" for bend in (one.k_from, one.k_to))
    return start, end


def draw_alignment(alignment: Alignment, found: Deviations) -> str:
    """Return the diagram of a track as SVG, one picture for each kilometre."""
    courses = list(_courses(alignment, found))
    length_m = alignment.s_to - alignment.s_from
    borders = np.linspace(alignment.s_from, alignment.s_to, max(int(np.ceil(length_m / ROW_M)), 1) + 1)
    return "".join(_kilometre(alignment, courses, row) for row in zip(borders[:-1], borders[1:]))


def _courses(alignment: Alignment, found: Deviations) -> Iterator[Panel]:
    """Yield the quantities of the diagram: the curve of the design, where there is one, below what was measured."""
    bends = [(one.s_from, one.s_to, 1000 * one.k_from, 1000 * one.k_to) for one in alignment.plan]
    grades = [(one.s_from, one.s_to, 1000 * one.grade_from, 1000 * one.grade_to) for one in alignment.vertical]
    cants = [(one.s_from, one.s_to, 1000 * one.cant_from_m, 1000 * one.cant_to_m) for one in alignment.cant]
    cant_mm = 1000 * alignment.cants(found.s) + found.cant_diff_mm
    bent, risen = 1000 * measured_curvature(alignment, found), 1000 * measured_grade(alignment, found)
    for heading, unit, values, min_span, parts in (
        ("Curvature, positive to the left", "1/km", bent, 0.4, bends),
        ("Cant, left minus right", "mm", cant_mm, 20, cants),
        ("Gradient", "‰", risen, 2, grades),
        ("Slew: measured minus design, positive to the left", "mm", found.slew_mm, 4, []),
        ("Lift: measured minus design", "mm", found.lift_mm, 4, []),
    ):
        if np.isfinite(values).any():
            design = [Curve(*_corners(parts), "design")] if parts else []
            yield Panel(heading, f"[{unit}]", [*design, Curve(found.s, values)], min_span)


def _corners(parts: Sequence[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a curve from start, end and the values there of its parts."""
    columns = np.array(parts).reshape(-1, 4)
    return columns[:, :2].ravel(), columns[:, 2:].ravel()


def measured_curvature(alignment: Alignment, found: Deviations) -> np.ndarray:
    """Return the curvature of the measured track, (n,) 1/m, on chords of 20 m; NaN near its ends."""
    heading = alignment.headings(found.s)
    left = np.column_stack([-np.sin(heading), np.cos(heading)])
    return _along(alignment.places(found.s) + left * found.slew_mm[:, None] / 1000, found.s, int(HALF_CHORD_M), _bend)


def measured_grade(alignment: Alignment, found: Deviations) -> np.ndarray:
    """Return the gradient of the measured track, (n,), over 10 m; NaN near its ends."""
    z = alignment.heights(found.s) + found.lift_mm / 1000
    return _along(np.column_stack([found.s, z]), found.s, int(GRADE_BASE_M / 2), _slope)


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


def _kilometre(alignment: Alignment, courses: Sequence[Panel], row: tuple[float, float]) -> str:
    """Draw the part of the diagram between two distances along the track."""
    head = SPACE + STRIP
    bottom = head + bottom_of(len(courses))
    parts = [*_strip(alignment, row), *_axis(alignment, row, head, bottom)]
    for number, course in enumerate(courses):
        *design, measured = course.curves
        cut = [_cut(one, row) for one in design]
        mine = (measured.places >= row[0]) & (measured.places <= row[1])
        drawn = Curve(*broken(measured.places[mine], measured.values[mine], STEP_M))
        frame = Frame(head + bottom_of(number) + SPACE, row, course.limits())
        parts.append(replace(course, curves=[*cut, drawn]).draw(frame, class_="frame"))
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
    pieces = stations.pieces if stations else (StationRange(0.0, 0.0),)
    name = "km" if stations else "m"
    yield tag("text", text(name), x=LEFT - 8, y=SPACE - 8, class_="tick end")
    yield tag("text", text(name), x=LEFT - 8, y=bottom + 16, class_="tick end")
    step = round_up((row[1] - row[0]) / TICKS_ACROSS)
    for piece, after in zip(pieces, [*pieces[1:], StationRange(np.inf, 0.0)]):
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


def _cut(one: Curve, row: tuple[float, float]) -> Curve:
    """Return the part of a curve with jumps between two distances, with its ends there."""
    s, values = one.places, one.values
    inside = (s >= row[0]) & (s <= row[1])
    ends = [(end, np.interp(end, s, values)) for end in row if s[0] <= end <= s[-1]]
    pairs = sorted(
        [*((place, number, value) for number, (place, value) in enumerate(zip(s[inside], values[inside]), start=1))]
        + [(place, 0 if place == row[0] else len(s) + 1, value) for place, value in ends]
    )
    places, _, cut = zip(*pairs) if pairs else ((), (), ())
    return replace(one, places=np.array(places, dtype=float), values=np.array(cut, dtype=float))
