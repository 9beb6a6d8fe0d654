"""Profiles of a track by chainage: one panel per quantity, over a common axis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..tracks.geometry import TWIST_BASE_M
from .findings import DOUBTS, GAUGE_OFF_MM, TrackFindings
from .markup import tag, text

WIDTH, LEFT, RIGHT = 1040.0, 92.0, 24.0
"""Width of a picture in its units, and its margins for labels."""

PANEL, SPACE, AXIS = 92.0, 26.0, 38.0
"""Heights of a panel, of its heading, and of the axis below the last panel."""

TICKS_ACROSS, TICKS_UP = 10, 4
"""Approximate number of ticks on an axis."""

ROOM = 0.08
"""Free share of a panel above and below the curve."""


@dataclass(frozen=True)
class Panel:
    """A quantity along the track.

    Attributes
    ----------
    heading, unit : str
    values : (n,) array
    min_span : float
        Smallest range of the panel, so that noise does not look alarming.
    band : tuple of float or None
        Lower and upper limit of the values that are in order.
    floor : float or None
        Lower end of the panel, if fixed.
    """

    heading: str
    unit: str
    values: np.ndarray
    min_span: float
    band: tuple[float, float] | None = None
    floor: float | None = None

    def limits(self) -> tuple[float, float]:
        """Return the lower and the upper end of the panel: band and values, widened to `min_span`, with some room."""
        known = self.values[np.isfinite(self.values)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
        if self.band:
            low, high = min(low, self.band[0]), max(high, self.band[1])
        lacking = max(self.min_span - (high - low), 0.0) / 2
        room = ROOM * max(high - low, self.min_span)
        low, high = low - lacking - room, high + lacking + room
        return (self.floor, high) if self.floor is not None else (low, high)


@dataclass(frozen=True)
class Frame:
    """The axes of a panel in a picture.

    Attributes
    ----------
    top : float
        Upper side.
    along : tuple of float
        First and last place along the track.
    limits : tuple of float
        Lower and upper end of the panel.
    """

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

    def curve(self, places: np.ndarray, values: np.ndarray, class_: str = "curve", style: str | None = None) -> str:
        """Return the curve of values, (n,), at places along the track."""
        return tag("path", d=curve(self.x(places), self.y(values)), class_=class_, style=style)

    def draw(self, heading: str, unit: str, *content: str, behind: Sequence[str] = (), class_: str = "panel") -> str:
        """Return the panel with its heading, its grid and what is drawn `behind` it and over it."""
        parts = [tag("rect", x=LEFT, y=self.top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_=class_), *behind]
        for value in ticks(*self.limits, TICKS_UP):
            level = float(self.y(value))
            parts.append(tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=level, y2=level, class_="grid"))
            parts.append(tag("text", text(f"{value:,.10g}"), x=LEFT - 8, y=level + 4, class_="tick end"))
        name = tag("tspan", text(heading), class_="name") + text(f"  {unit}")
        return "".join([*parts, *content, tag("text", name, x=LEFT, y=self.top - 8, class_="heading")])


def place_of(number: int) -> float:
    """Return the upper side of a panel, counted from 0."""
    return number * (PANEL + SPACE) + SPACE


def across(place: Any, along: tuple[float, float]) -> Any:
    """Return the x of one or several places on an axis."""
    return LEFT + (place - along[0]) / (along[1] - along[0]) * (WIDTH - LEFT - RIGHT)


def picture(label: str, panels: Sequence[str], along: tuple[float, float], axis: str, *more: str) -> str:
    """Return panels below each other as SVG, over an axis that is named at its left."""
    bottom = len(panels) * (PANEL + SPACE)
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


def draw_profiles(track: TrackFindings, height_m: np.ndarray) -> str:
    """Return the profiles of height, gauge, cant, twist, curvature and standard error of a track as SVG.

    Parameters
    ----------
    track : TrackFindings
    height_m : (n,) array
        Heights of the stations above the cloud's datum.
    """
    along = float(track.geometry.chainage_m[0]), float(track.geometry.chainage_m[-1])
    panels = [
        _draw_panel(panel, track, Frame(place_of(number), along, panel.limits()))
        for number, panel in enumerate(_panels(track, height_m))
    ]
    kilometres = _kilometres(track, along, len(panels) * (PANEL + SPACE) + 32)
    return picture(f"Profiles of track {track.line.track_id}", panels, along, "chainage [m]", *kilometres)


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


def curve(x: np.ndarray, y: np.ndarray) -> str:
    """Return the SVG path through points, (n,) each; it breaks at NaN and is thinned to the picture's resolution."""
    x, y = _thinned(x, y)
    known = np.isfinite(y)
    moves = known & ~np.concatenate([[False], known[:-1]])
    return "".join(f"{'M' if move else 'L'}{a:.1f} {b:.1f}" for a, b, ok, move in zip(x, y, known, moves) if ok)


def _panels(track: TrackFindings, height_m: np.ndarray) -> list[Panel]:
    geometry, gauge = track.geometry, track.nominal_mm
    curvature = np.where(np.isnan(geometry.radius_m), 0.0, 1000 / geometry.radius_m)
    return [
        Panel("Height", "m", height_m, 0.2),
        Panel(f"Gauge, nominal {gauge:g}", "mm", geometry.gauge_mm, 20, (gauge - GAUGE_OFF_MM, gauge + GAUGE_OFF_MM)),
        Panel("Cant, left minus right", "mm", geometry.cant_mm, 20),
        Panel(f"Twist over {TWIST_BASE_M:g} m", "mm", geometry.twist_mm, 6),
        Panel("Curvature, positive to the left", "1/km", curvature, 0.4),
        Panel("Standard error", "mm", geometry.sigma_mm, 4, floor=0.0),
    ]


def _draw_panel(panel: Panel, track: TrackFindings, frame: Frame) -> str:
    behind = list(_shades(track, frame))
    if panel.band:
        low, high = map(float, map(frame.y, panel.band))
        band = tag("rect", x=LEFT, width=WIDTH - LEFT - RIGHT, class_="band", y=high, height=low - high)
        behind.insert(0, band)
    values = frame.curve(track.geometry.chainage_m, panel.values)
    return frame.draw(panel.heading, f"[{panel.unit}]", values, behind=behind)


def _shades(track: TrackFindings, frame: Frame) -> Iterator[str]:
    """Mark the places in doubt; places less than a unit of the picture apart merge, and no mark is narrower."""
    for doubt in DOUBTS:
        for place in track.places(doubt, merge_m=track.length_m / WIDTH):
            start, end = frame.x(place.start_m), frame.x(place.end_m)
            title = tag("title", text(f"{doubt.label}: {place.start_m:.1f} to {place.end_m:.1f} m"))
            yield tag("rect", title, x=start, y=frame.top, width=max(end - start, 1.0), height=PANEL, class_=doubt.name)


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
