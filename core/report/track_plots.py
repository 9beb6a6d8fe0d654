"""The pictures of an extraction: the map, the profiles of each track, and the offsets of strips."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks.findings import DOUBTS, GAUGE_OFF_MM, Doubt, Findings, TrackFindings
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
    path,
    round_up,
    ticks,
)

MIN_HEIGHT, MAX_HEIGHT, MARGIN = 150.0, 520.0, 42.0
"""Smallest and largest height of the map in units of the picture, and the margin around the tracks."""

BAR = 0.1
"""Smallest length of the scale bar as a share of the width."""

LABEL_PLACES = 6
"""Places along a track among which the labels of neighbouring tracks alternate."""

COLOURS = ("#1565c0", "#d62839", "#2e7d4f", "#f28e2b", "#8e5bb5", "#00838f", "#6d4c41", "#5d6b7a")
"""Colours of strips; with more strips, the first follow again."""

STRIP_SPAN_MM = 10.0
"""Smallest range of a panel of strips, so that noise does not look alarming."""

STEP_M = 1.5
"""Stations of strips further apart belong to different parts of a course: there is one for every metre."""


def draw_plan(findings: Findings) -> str:
    """Return the map as SVG, north up."""
    xy = np.concatenate([track.geometry.xyz[:, :2] for track in findings.tracks])
    low, span = xy.min(axis=0), np.maximum(np.ptp(xy, axis=0), 1.0)
    scale = min((WIDTH - 2 * MARGIN) / span[0], (MAX_HEIGHT - 2 * MARGIN) / span[1])
    height = max(span[1] * scale + 2 * MARGIN, MIN_HEIGHT)
    middle = low + span / 2

    def place(points: np.ndarray) -> np.ndarray:
        return (points[:, :2] - middle) * [scale, -scale] + [WIDTH / 2, height / 2]

    drawn = [(track, place(track.geometry.xyz)) for track in findings.tracks]
    lines = [tag("path", d=path(*places.T), class_="track") for _, places in drawn]
    marks = [_mark(track, places, doubt) for doubt in reversed(DOUBTS) for track, places in drawn]
    labels = [_label(*one, number) for number, one in enumerate(drawn)]
    furniture = (_scale_bar(scale, height), _north())
    view = f"0 0 {WIDTH:g} {height:.0f}"
    return tag("svg", *lines, *marks, *labels, *furniture, viewBox=view, role="img", aria_label="Map of the tracks")


def _mark(track: TrackFindings, places: np.ndarray, doubt: Doubt) -> str:
    """Mark where a track is in doubt for a reason."""
    doubtful = track.doubtful[doubt]
    if not doubtful.any():
        return ""
    # A station represents the line half way to its neighbours: draw up to both.
    near = doubtful | np.append(doubtful[1:], False) | np.append(False, doubtful[:-1])
    return tag("path", d=path(places[:, 0], np.where(near, places[:, 1], np.nan)), class_=f"{doubt.name} mark")


def _label(track: TrackFindings, places: np.ndarray, number: int) -> str:
    """Write a track's number next to it, with an arrow in its direction; the place along it varies with `number`."""
    at = (len(places) - 1) * (1 + number % LABEL_PLACES) // (LABEL_PLACES + 2)
    place, after = places[at], places[at + 1]
    angle = float(np.degrees(np.arctan2(*(after - place)[::-1])))
    turn = f"translate({place[0]:.1f} {place[1]:.1f}) rotate({angle:.0f})"
    arrow = tag("path", d="M9 0 L-4 -5 L-4 5 Z", class_="arrow", transform=turn)
    name = tag("text", text(track.line.track_id), x=float(place[0]), y=float(place[1]) - 9, class_="number middle")
    return arrow + name


def _scale_bar(scale: float, height: float) -> str:
    """Draw a scale bar of a round length."""
    length_m = round_up(BAR * WIDTH / scale)
    end, y = MARGIN / 2 + length_m * scale, height - 14
    bar = tag("path", d=f"M{MARGIN / 2} {y - 5:.1f} V{y:.1f} H{end:.1f} V{y - 5:.1f}", class_="bar")
    return bar + tag("text", text(f"{length_m:,g} m"), x=end + 8, y=y, class_="tick")


def _north() -> str:
    x = WIDTH - MARGIN / 2
    return tag("path", d=f"M{x} 12 l6 18 l-6 -4 l-6 4 Z", class_="arrow") + tag(
        "text", text("N"), x=x, y=44.0, class_="tick middle"
    )


def draw_profiles(track: TrackFindings, height_m: np.ndarray) -> str:
    """Return the profiles of height, gauge, cant, twist, curvature and standard error of a track as SVG.

    Parameters
    ----------
    height_m : (n,) array
        Heights of the stations above the cloud's datum.
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
    """Return profiles of the offsets of the strips of one track as SVG, with their legend.

    Parameters
    ----------
    courses : sequence of StripCourse
        All of the same track.
    """
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
