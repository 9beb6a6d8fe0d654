"""Pictures of quantities along a track: one panel per quantity, over a common axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

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
