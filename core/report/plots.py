"""Pictures of a report: the map of its tracks, and quantities along a track, one panel each over a common axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks.findings import DOUBTS, GAUGE_OFF_MM, TrackFindings
from ..rails import StripCourse
from ..tracks.geometry import TWIST_BASE_M
from .markup import legend, tag, text

WIDTH, LEFT, RIGHT = 1040.0, 92.0, 24.0
"""Width of a picture in its units, and its margins for labels."""

PANEL, SPACE, AXIS = 92.0, 26.0, 38.0
"""Heights of a panel, of its heading, and of the axis below the last panel."""

TICKS_ACROSS, TICKS_UP = 10, 4
"""Approximate number of ticks on an axis."""

ROOM = 0.08
"""Free share of a panel above and below the curve."""

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
"""Places further apart belong to different parts of a track: there is one for every metre."""


@dataclass(frozen=True)
class Curve:
    """Values at places along a track, (n,) each, with the class or the style of their line."""

    places: np.ndarray
    values: np.ndarray
    class_: str = "curve"
    style: str | None = None


@dataclass(frozen=True)
class Shade:
    """A section to mark in all panels: its ends, its CSS class and what it says."""

    start: float
    end: float
    class_: str
    title: str


@dataclass(frozen=True)
class Frame:
    """The axes of a panel in a picture: its upper side, the first and last place along the track, and the limits."""

    top: float
    along: tuple[float, float]
    limits: tuple[float, float]

    def x(self, place: Any) -> Any:
        """Return the x of one or several places."""
        return across(place, self.along)

    def y(self, value: Any) -> Any:
        """Return the y of one or several values."""
        low, high = self.limits
        return self.top + PANEL - (value - low) * PANEL / (high - low)

    def draw(self, heading: str, unit: str, *content: str, behind: Sequence[str] = (), class_: str = "panel") -> str:
        """Return the panel with its heading, its grid and what is drawn `behind` it and over it."""
        parts = [tag("rect", x=LEFT, y=self.top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_=class_), *behind]
        for value in ticks(*self.limits, TICKS_UP):
            level = float(self.y(value))
            parts.append(tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=level, y2=level, class_="grid"))
            parts.append(tag("text", text(f"{value:,.10g}"), x=LEFT - 8, y=level + 4, class_="tick end"))
        name = tag("tspan", text(heading), class_="name") + text(f"  {unit}")
        return "".join([*parts, *content, tag("text", name, x=LEFT, y=self.top - 8, class_="heading")])


@dataclass(frozen=True)
class Panel:
    """A quantity along the track, with its unit as it is written beside the heading.

    `min_span` is the smallest range of the panel, so that noise does not look alarming; `band` has the limits of values
    that are in order. Floor and ceiling fix the ends of the panel.
    """

    heading: str
    unit: str
    curves: Sequence[Curve]
    min_span: float
    band: tuple[float, float] | None = None
    floor: float | None = None
    ceiling: float | None = None

    def limits(self) -> tuple[float, float]:
        """Return the lower and the upper end of the panel: band and values, widened to `min_span`, with some room."""
        every = np.concatenate([*(one.values for one in self.curves), np.array(self.band or ())])
        known = every[np.isfinite(every)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
        lacking = max(self.min_span - (high - low), 0.0) / 2
        room = ROOM * max(high - low, self.min_span)
        return (
            low - lacking - room if self.floor is None else self.floor,
            high + lacking + room if self.ceiling is None else self.ceiling,
        )

    def draw(self, frame: Frame, shades: Sequence[Shade] = (), class_: str = "panel") -> str:
        """Return the panel with shades behind its curves, none of them narrower than a unit of the picture."""
        behind = []
        if self.band:
            low, high = map(float, map(frame.y, self.band))
            band = {"x": LEFT, "width": WIDTH - LEFT - RIGHT, "class_": "band", "y": high, "height": low - high}
            behind.append(tag("rect", **band))
        for one in shades:
            start, end = frame.x(one.start), frame.x(one.end)
            place = {"x": start, "y": frame.top, "width": max(end - start, 1.0), "height": PANEL}
            behind.append(tag("rect", tag("title", text(one.title)), **place, class_=one.class_))
        curves = [
            tag("path", d=path(frame.x(one.places), frame.y(one.values)), class_=one.class_, style=one.style)
            for one in self.curves
        ]
        return frame.draw(self.heading, self.unit, *curves, behind=behind, class_=class_)


def draw_panels(
    label: str, panels: Sequence[Panel], along: tuple[float, float], axis: str, *more: str, shades: Sequence[Shade] = ()
) -> str:
    """Return panels below each other as SVG, over a common axis."""
    drawn = [
        one.draw(Frame(bottom_of(number) + SPACE, along, one.limits()), shades) for number, one in enumerate(panels)
    ]
    return picture(label, drawn, along, axis, *more)


def bottom_of(count: int) -> float:
    """Return the lower side of the last of `count` panels with their headings."""
    return count * (PANEL + SPACE)


def across(place: Any, along: tuple[float, float]) -> Any:
    """Return the x of one or several places on an axis."""
    return LEFT + (place - along[0]) / (along[1] - along[0]) * (WIDTH - LEFT - RIGHT)


def picture(label: str, panels: Sequence[str], along: tuple[float, float], axis: str, *more: str) -> str:
    """Return panels below each other as SVG, over an axis that is named at its left."""
    bottom = bottom_of(len(panels))
    marks = [
        tag("text", text(f"{place:,g}"), x=float(across(place, along)), y=bottom + 16, class_="tick middle")
        for place in ticks(*along, TICKS_ACROSS)
    ]
    name = tag("text", text(axis), x=LEFT - 8, y=bottom + 16, class_="tick end")
    box = f"0 0 {WIDTH:g} {bottom + AXIS:g}"
    return tag("svg", *panels, *marks, name, *more, viewBox=box, role="img", aria_label=label)


def broken(places: np.ndarray, values: np.ndarray, step_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Insert NaN where places, (n,), are more than a step apart, so that a curve breaks there."""
    breaks = np.flatnonzero(np.diff(places) > step_m) + 1
    return np.insert(places.astype(float), breaks, np.nan), np.insert(values.astype(float), breaks, np.nan)


def ticks(low: float, high: float, count: int) -> np.ndarray:
    """Return about `count` round numbers from `low` to `high`.

    >>> ticks(0.3, 7.9, 4).tolist()
    [2.0, 4.0, 6.0]
    """
    step = round_up(max(high - low, 1e-9) / count)
    return np.round(np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step, 9) + 0.0


def round_up(value: float) -> float:
    """Round up to 1, 2 or 5 times a power of ten.

    >>> round_up(23.0)
    50.0
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(factor for factor in (1, 2, 5, 10) if value <= power * factor))


def path(x: np.ndarray, y: np.ndarray) -> str:
    """Return the SVG path through points, (n,) each; it breaks at NaN and is thinned to the picture's resolution."""
    x, y = _thinned(x, y)
    known = np.isfinite(y)
    moves = known & ~np.concatenate([[False], known[:-1]])
    return "".join(f"{'M' if move else 'L'}{a:.1f} {b:.1f}" for a, b, ok, move in zip(x, y, known, moves) if ok)


def _thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Keep the lowest and the highest point in each unit of x: the curve looks the same."""
    columns = int(WIDTH)
    if len(x) <= 4 * columns:
        return x, y
    kept = []
    for part in np.array_split(np.arange(len(x)), columns):
        unknown = np.isnan(y[part])
        if unknown.all():
            kept.append(part[:1])
        else:
            kept.append(np.unique([part[np.nanargmin(y[part])], part[np.nanargmax(y[part])]]))
    numbers = np.concatenate(kept)
    return x[numbers], y[numbers]


@dataclass(frozen=True)
class MapTrack:
    """A track in the map: its stations, `xyz` (n, 3), and which of them have a mark, by the mark's CSS class.

    Later marks are drawn over earlier ones.
    """

    label: str
    xyz: np.ndarray
    marks: Mapping[str, np.ndarray]


def draw_plan(courses: Sequence[MapTrack]) -> str:
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
