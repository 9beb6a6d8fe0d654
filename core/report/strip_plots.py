"""The strips of the report: a table of their offsets from their mean, and profiles of them along each track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..rails import StripCourse
from .markup import metres, table, tag, text
from .plots import AXIS, LEFT, PANEL, RIGHT, SPACE, TICKS_ACROSS, TICKS_UP, WIDTH, curve, ticks

COLOURS = ("#1565c0", "#d62839", "#2e7d4f", "#f28e2b", "#8e5bb5", "#00838f", "#6d4c41", "#5d6b7a")
"""Colours of strips; with more strips, the first follow again."""

MIN_SPAN_MM = 10.0
"""Smallest range of a panel, so that noise does not look alarming."""

HEADINGS = ("Track", "Strip", "With others", "Across", "Range", "Height", "Range")


def list_strips(courses: Sequence[StripCourse]) -> str:
    """Return the table of strips: mean and range of the offsets of each along each track."""
    return table(HEADINGS, [_row(course) for course in courses])


def _row(course: StripCourse) -> tuple[str, ...]:
    offsets = [
        cell
        for values in (course.across_mm, course.up_mm)
        for cell in (f"{values.mean():+.1f} mm", f"{values.min():+.1f} to {values.max():+.1f} mm")
    ]
    return str(course.track_id), str(course.strip), metres(float(len(course.chainage_m))), *offsets


def draw_strips(courses: Sequence[StripCourse]) -> str:
    """Return profiles of the offsets of the strips of one track as SVG.

    Parameters
    ----------
    courses : sequence of StripCourse
        All of the same track.
    """
    every = np.concatenate([course.chainage_m for course in courses])
    along = float(every.min()), float(max(every.max(), every.min() + 1.0))
    panels = [
        _panel(name, courses, [getattr(course, field) for course in courses], along, top)
        for (name, field), top in zip(
            (("Offset to the left", "across_mm"), ("Offset in height", "up_mm")), (SPACE, PANEL + 2 * SPACE)
        )
    ]
    bottom = 2 * (PANEL + SPACE)
    axis = [
        tag("text", text(f"{chainage:,g}"), x=float(_across(chainage, along)), y=bottom + 16, class_="tick middle")
        for chainage in ticks(*along, TICKS_ACROSS)
    ]
    name = tag("text", text("chainage [m]"), x=WIDTH - RIGHT, y=bottom + 32, class_="tick end")
    label = f"Strips of track {courses[0].track_id}"
    return tag("svg", *panels, *axis, name, viewBox=f"0 0 {WIDTH:g} {bottom + AXIS:g}", role="img", aria_label=label)


def strip_legend(courses: Sequence[StripCourse]) -> str:
    """Return the legend of the profiles of one track."""
    keys = [
        tag("span", tag("i", style=f"background: {_colour(number)}"), text(f"strip {course.strip}"))
        for number, course in enumerate(courses)
    ]
    return tag("div", *keys, class_="legend")


def _panel(
    name: str, courses: Sequence[StripCourse], values: Sequence[np.ndarray], along: tuple[float, float], top: float
) -> str:
    """Draw the curves of all strips over each other."""
    every = np.concatenate(values)
    middle, span = 0.5 * (every.max() + every.min()), max(1.2 * np.ptp(every), MIN_SPAN_MM)
    low, high = float(middle - 0.5 * span), float(middle + 0.5 * span)

    def up(value: Any) -> Any:
        return top + PANEL - (value - low) * PANEL / (high - low)

    parts = [tag("rect", x=LEFT, y=top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_="panel")]
    for value in ticks(low, high, TICKS_UP):
        level = float(up(value))
        parts.append(tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=level, y2=level, class_="grid"))
        parts.append(tag("text", text(f"{value:,.10g}"), x=LEFT - 8, y=level + 4, class_="tick end"))
    for number, (course, own) in enumerate(zip(courses, values)):
        breaks = np.flatnonzero(np.diff(course.chainage_m) > 1.5) + 1
        x, y = (np.insert(one.astype(float), breaks, np.nan) for one in (course.chainage_m, own))
        style = f"stroke: {_colour(number)}"
        parts.append(tag("path", d=curve(_across(x, along), up(y)), class_="curve", style=style))
    heading = tag("tspan", text(name), class_="name") + text("  [mm]")
    return "".join([*parts, tag("text", heading, x=LEFT, y=top - 8, class_="heading")])


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]


def _across(chainage: Any, along: tuple[float, float]) -> Any:
    """Return the x of one or several chainages."""
    return LEFT + (chainage - along[0]) / (along[1] - along[0]) * (WIDTH - LEFT - RIGHT)
