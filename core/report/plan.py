"""The map of the report: the tracks in plan, with marks where they are in doubt."""

from __future__ import annotations

import numpy as np

from .findings import DOUBTS, Doubt, Findings, TrackFindings
from .markup import tag, text
from .plots import curve, round_up

WIDTH, MIN_HEIGHT, MAX_HEIGHT, MARGIN = 1040.0, 150.0, 520.0, 42.0
"""Width of the picture in its units, its smallest and its largest height, and the margin around the tracks."""

BAR = 0.1
"""Smallest length of the scale bar as a share of the width."""

LABEL_PLACES = 6
"""Places along a track among which the labels of neighbouring tracks alternate."""


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
    lines = [tag("path", d=curve(*places.T), class_="track") for _, places in drawn]
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
    return tag("path", d=curve(places[:, 0], np.where(near, places[:, 1], np.nan)), class_=f"{doubt.name} mark")


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
