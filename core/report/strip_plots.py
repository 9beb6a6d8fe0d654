"""The strips of the report: a table of their offsets from their mean, and profiles of them along each track."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rails import StripCourse
from .markup import legend, metres, table
from .plots import Frame, Panel, broken, picture, place_of

COLOURS = ("#1565c0", "#d62839", "#2e7d4f", "#f28e2b", "#8e5bb5", "#00838f", "#6d4c41", "#5d6b7a")
"""Colours of strips; with more strips, the first follow again."""

MIN_SPAN_MM = 10.0
"""Smallest range of a panel, so that noise does not look alarming."""

STEP_M = 1.5
"""Stations further apart belong to different parts of a course: there is one for every metre."""

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
    quantities = (("Offset to the left", "across_mm"), ("Offset in height", "up_mm"))
    panels = [
        _panel(name, courses, [getattr(course, field) for course in courses], along, place_of(number))
        for number, (name, field) in enumerate(quantities)
    ]
    return picture(f"Strips of track {courses[0].track_id}", panels, along, "chainage [m]")


def strip_legend(courses: Sequence[StripCourse]) -> str:
    """Return the legend of the profiles of one track."""
    return legend(
        (f"strip {course.strip}", {"style": f"background: {_colour(number)}"}) for number, course in enumerate(courses)
    )


def _panel(
    name: str, courses: Sequence[StripCourse], values: Sequence[np.ndarray], along: tuple[float, float], top: float
) -> str:
    """Draw the curves of all strips over each other."""
    frame = Frame(top, along, Panel(name, "mm", np.concatenate(values), MIN_SPAN_MM).limits())
    curves = [
        frame.curve(*broken(course.chainage_m, own, STEP_M), style=f"stroke: {_colour(number)}")
        for number, (course, own) in enumerate(zip(courses, values))
    ]
    return frame.draw(name, "[mm]", *curves)


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]
