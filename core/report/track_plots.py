"""The pictures of an extraction: the profiles of each track, and the offsets of strips."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks.findings import DOUBTS, GAUGE_OFF_MM, TrackFindings
from ..rails import StripCourse
from ..tracks.geometry import TWIST_BASE_M
from .markup import legend, tag, text
from .plots import (
    LEFT,
    TICKS_ACROSS,
    WIDTH,
    Curve,
    Panel,
    Shade,
    across,
    bottom_of,
    broken,
    draw_panels,
    ticks,
)

COLOURS = ("#1565c0", "#d62839", "#2e7d4f", "#f28e2b", "#8e5bb5", "#00838f", "#6d4c41", "#5d6b7a")
"""Colours of strips; with more strips, the first follow again."""

STRIP_SPAN_MM = 10.0
"""Smallest range of a panel of strips, so that noise does not look alarming."""

STEP_M = 1.5
"""Stations of strips further apart belong to different parts of a course: there is one for every metre."""


def draw_profiles(track: TrackFindings, height_m: np.ndarray) -> str:
    """Return the profiles of height, gauge, cant, twist, curvature and standard error of a track as SVG.

    `height_m`, (n,), are the heights of the stations above the cloud's datum.
    """
    geometry, gauge = track.geometry, track.nominal_mm
    along = float(geometry.chainage_m[0]), float(geometry.chainage_m[-1])
    curvature = np.where(np.isnan(geometry.radius_m), 0.0, 1000 / geometry.radius_m)

    def panel(heading: str, unit: str, values: np.ndarray, min_span: float, **more: Any) -> Panel:
        return Panel(heading, f"[{unit}]", [Curve(geometry.chainage_m, values)], min_span, **more)

    in_order = gauge - GAUGE_OFF_MM, gauge + GAUGE_OFF_MM
    panels = [
        panel("Height", "m", height_m, 0.2),
        panel(f"Gauge, nominal {gauge:g}", "mm", geometry.gauge_mm, 20, band=in_order),
        panel("Cant, left minus right", "mm", geometry.cant_mm, 20),
        panel(f"Twist over {TWIST_BASE_M:g} m", "mm", geometry.twist_mm, 6),
        panel("Curvature, positive to the left", "1/km", curvature, 0.4),
        panel("Standard error", "mm", geometry.sigma_mm, 4, floor=0.0),
    ]
    shades = [
        Shade(place.start_m, place.end_m, doubt.name, f"{doubt.label}: {place.start_m:.1f} to {place.end_m:.1f} m")
        for doubt in DOUBTS
        for place in track.places(doubt, merge_m=track.length_m / WIDTH)  # a unit of the picture
    ]
    kilometres = _kilometres(track, along, bottom_of(len(panels)) + 32)
    label = f"Profiles of track {track.line.track_id}"
    return draw_panels(label, panels, along, "chainage [m]", *kilometres, shades=shades)


def _kilometres(track: TrackFindings, along: tuple[float, float], y: float) -> list[str]:
    """Write the kilometres along the axis below the chainages."""
    kilometres = track.geometry.kilometres
    if kilometres is None:
        return []
    at = ticks(*along, TICKS_ACROSS)
    nearest = np.argmin(np.abs(track.geometry.chainage_m[:, None] - at), axis=0)
    marks = [
        tag("text", text(kilometres.km_text[number] or ""), x=float(across(place, along)), y=y, class_="tick middle")
        for place, number in zip(at, nearest)
    ]
    return [*marks, tag("text", text("kilometre"), x=LEFT - 8, y=y, class_="tick end")]


def draw_strips(courses: Sequence[StripCourse]) -> str:
    """Return profiles of the offsets of the strips of one track as SVG, with their legend."""
    every = np.concatenate([course.chainage_m for course in courses])
    along = float(every.min()), float(max(every.max(), every.min() + 1.0))
    colours = [COLOURS[number % len(COLOURS)] for number in range(len(courses))]
    panels = [
        Panel(
            name,
            "[mm]",
            [
                Curve(*broken(course.chainage_m, getattr(course, field), STEP_M), style=f"stroke: {colour}")
                for course, colour in zip(courses, colours)
            ],
            STRIP_SPAN_MM,
        )
        for name, field in (("Offset to the left", "across_mm"), ("Offset in height", "up_mm"))
    ]
    keys = [(f"strip {one.strip}", {"style": f"background: {colour}"}) for one, colour in zip(courses, colours)]
    drawn = draw_panels(f"Strips of track {courses[0].track_id}", panels, along, "chainage [m]")
    return drawn + legend(keys)
