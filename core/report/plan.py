"""The map of a report: tracks with their numbers and directions, and marks along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .markup import tag, text
from .plots import WIDTH, path, round_up

MIN_HEIGHT, MAX_HEIGHT, MARGIN = 150.0, 520.0, 42.0
"""Smallest and largest height of the map in units of the picture, and the margin around the tracks."""

BAR = 0.1
"""Smallest length of the scale bar as a share of the width."""

LABEL_PLACES = 6
"""Places along a track among which the labels of neighbouring tracks alternate."""


@dataclass(frozen=True)
class Course:
    """A track in the map: its stations, `xyz` (n, 3), and which of them have a mark, by the mark's CSS class.

    Later marks are drawn over earlier ones.
    """

    label: str
    xyz: np.ndarray
    marks: Mapping[str, np.ndarray]


def draw_plan(courses: Sequence[Course]) -> str:
    """Return the map as SVG, north up."""
    xy = np.concatenate([course.xyz[:, :2] for course in courses])
    low, span = xy.min(axis=0), np.maximum(np.ptp(xy, axis=0), 1.0)
    scale = min((WIDTH - 2 * MARGIN) / span[0], (MAX_HEIGHT - 2 * MARGIN) / span[1])
    height = max(span[1] * scale + 2 * MARGIN, MIN_HEIGHT)
    middle = low + span / 2

    def place(points: np.ndarray) -> np.ndarray:
        return (points[:, :2] - middle) * [scale, -scale] + [WIDTH / 2, height / 2]

    drawn = [(course, place(course.xyz)) for course in courses]
    lines = [tag("path", d=path(*places.T), class_="track") for _, places in drawn]
    names = dict.fromkeys(name for course in courses for name in course.marks)
    marks = [_mark(name, course.marks[name], places) for name in names for course, places in drawn]
    labels = [_label(course.label, places, number) for number, (course, places) in enumerate(drawn)]
    furniture = (_scale_bar(scale, height), _north())
    view = f"0 0 {WIDTH:g} {height:.0f}"
    return tag("svg", *lines, *marks, *labels, *furniture, viewBox=view, role="img", aria_label="Map of the tracks")


def _mark(name: str, marked: np.ndarray, places: np.ndarray) -> str:
    """Mark stations."""
    if not marked.any():
        return ""
    # A station represents the line half way to its neighbours: draw up to both.
    near = marked | np.append(marked[1:], False) | np.append(False, marked[:-1])
    return tag("path", d=path(places[:, 0], np.where(near, places[:, 1], np.nan)), class_=f"{name} mark")


def _label(label: str, places: np.ndarray, number: int) -> str:
    """Write a track's label next to it, with an arrow in its direction; the place along it varies with `number`."""
    if len(places) < 2:
        return ""
    at = (len(places) - 1) * (1 + number % LABEL_PLACES) // (LABEL_PLACES + 2)
    place, after = places[at], places[at + 1]
    angle = float(np.degrees(np.arctan2(*(after - place)[::-1])))
    turn = f"translate({place[0]:.1f} {place[1]:.1f}) rotate({angle:.0f})"
    arrow = tag("path", d="M9 0 L-4 -5 L-4 5 Z", class_="arrow", transform=turn)
    return arrow + tag("text", text(label), x=float(place[0]), y=float(place[1]) - 9, class_="number middle")


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
