"""Pictures of the clearance: the diagram along a track, and cross-sections with profile, surface and the points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..clearance.along import Trace
from ..clearance.intrusions import PLATFORM_WORDS, UP_M, Intrusion
from ..clearance.measure import BANDS_M, Clearance, Stations, read_points
from ..clearance.sweep import SECTION_M, part_of
from ..polyline import runs
from ..progress import written
from .markup import section, tag, text
from .plots import LEFT, PANEL, RIGHT, SPACE, WIDTH, Curve, Frame, Panel, Shade, bottom_of, broken, picture

MOST_MM = 500.0
"""Margins above do not matter: the diagram ends there."""

BAR = 5.0
"""Height of the bar of a platform, in units of the picture."""

HEAT = ((0.0, "#d62839"), (50.0, "#f28e2b"), (150.0, "#e9d66b"), (400.0, "#9fd0a8"))
"""Colours of margins in millimetres below the number; above, and where nothing is seen, the strip is empty."""

RULES = ".crosses { display: grid; grid-template-columns: repeat(auto-fill, minmax(300px, 1fr)); gap: 12px; }"
"""Style of the cross-sections: wide enough to see a centimetre."""

SCALE, HALF_M, HIGH_M = 60.0, 2.9, 5.6
"""Units per metre of a cross-section, and what it shows at least: half its width, and its height."""

PALETTE = ("#1565c0", "#2e7d4f", "#8e5bb5", "#b26a00", "#00838f", "#6d4c41")
"""Colours of the classes of points."""

PICTURES, SLICE_M, MOST_DRAWN = 20, 0.25, 4000
"""Number of cross-sections, half the length of their points along the track, and the most points of each."""


def diagram(found: Clearance, number: int) -> str:
    """Draw the margins along a track, what is inside, and the margins of each height band."""
    stations, course = found.stations[number], found.courses[number]
    along = (0.0, max(course.length_m, 1.0))
    mine = [one for one in found.intrusions if one.course == number]
    shades = [*_unseen(found, stations), *_vehicles(mine)]
    drawn: list[str] = []
    for at, (side, sense) in enumerate((("left", 1), ("right", -1))):
        margin = np.clip(1000 * stations.least_m[:, at], None, MOST_MM)
        margin[~np.isfinite(margin)] = np.nan
        margin = np.clip(margin, -MOST_MM, None)
        deepest = max((one.pen_mm for one in mine if one.counts), default=0.0)
        low = -min(max(deepest, -float(np.nanmin(np.append(margin, 0.0)))), MOST_MM)
        panel = Panel(
            f"Least margin on the {side}",
            "[mm]; red: inside, hollow: in doubt, grey: allowed, bar: platform",
            [Curve(*broken(stations.s, margin, 1.5 * found.settings.step_m))],
            50.0,
            floor=low - 20.0,
            ceiling=MOST_MM,
        )
        frame = Frame(bottom_of(len(drawn)) + SPACE, along, panel.limits())
        marks = [_mark(frame, one) for one in mine if (one.v_mm > 0) == (sense > 0)]
        zero = float(frame.y(0.0))
        line = tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=zero, y2=zero, style="stroke: var(--offgauge)")
        edges = [one for one in found.platforms if (one.course, one.side) == (number, sense)]
        drawn.append(panel.draw(frame, shades) + line + "".join([*(_edge(frame, one) for one in edges), *marks]))
    drawn.append(_strip(stations, along, bottom_of(2) + SPACE))
    return section(
        f"Track {course.track_id}", picture(f"Clearance of track {course.track_id}", drawn, along, "chainage [m]")
    )


def _mark(frame: Frame, one: Intrusion) -> str:
    """Draw an intrusion: red if it is sure, hollow if in doubt, grey if it is allowed."""
    y = float(frame.y(max(-one.pen_mm, frame.limits[0])))
    style = (
        "fill: #9aa5b1" if one.what else "fill: var(--offgauge)" if one.sure else "fill: none; stroke: var(--offgauge)"
    )
    title = f"{one.intrusion}: {one.pen_mm:.1f} ± {one.sigma_mm:.1f} mm at {one.chainage_m:,.1f} m {one.what}"
    if one.what == PLATFORM_WORDS:
        start, end = (float(frame.x(place)) for place in (one.from_m, one.to_m))
        return tag(
            "rect", tag("title", text(title)), x=start, y=y - 2, width=max(end - start, 2.0), height=4, style=style
        )
    return tag("circle", tag("title", text(title)), cx=float(frame.x(one.chainage_m)), cy=y, r=4, style=style)


def _edge(frame: Frame, one: Trace) -> str:
    """Draw the extent of a platform at the foot of a panel."""
    start, end = (float(frame.x(place)) for place in one.ends)
    words = f"platform, {1000 * abs(one.v.mean()):,.0f} mm aside and {1000 * one.w.mean():,.0f} mm high"
    place = {"x": start, "y": float(frame.y(frame.limits[0])) - BAR, "width": max(end - start, 2.0), "height": BAR}
    return tag("rect", tag("title", text(words)), **place, style="fill: var(--ink); opacity: 0.5")


def _unseen(found: Clearance, stations: Stations) -> Iterator[Shade]:
    for first, last in runs(found.unseen(stations)):
        yield Shade(stations.s[first], stations.s[last], "unsupported", "too few points to judge")


def _vehicles(mine: list[Intrusion]) -> Iterator[Shade]:
    for one in mine:
        if one.what.startswith("vehicle"):
            yield Shade(one.from_m, one.to_m, "unsure", f"{one.what}: nothing is measured behind it")


def _strip(stations: Stations, along: tuple[float, float], top: float) -> str:
    """Draw the margins of the height bands as a strip, the highest band on top, left above right."""
    frame = Frame(top, along, (0.0, 1.0))
    rows, height = [], PANEL / (2 * len(BANDS_M))
    half = (stations.s[1] - stations.s[0]) / 2 if len(stations.s) > 1 else 0.5
    for side in range(2):
        for band in range(len(BANDS_M)):
            margin = 1000 * stations.margin_m[:, side, len(BANDS_M) - 1 - band]
            colour = np.searchsorted([limit for limit, _ in HEAT], np.nan_to_num(margin, nan=np.inf))
            y = top + (side * len(BANDS_M) + band) * height
            for number, (_, fill) in enumerate(HEAT):
                for first, last in runs(colour == number):
                    x1, x2 = (float(frame.x(place)) for place in (stations.s[first] - half, stations.s[last] + half))
                    x1, x2 = max(x1, LEFT), min(x2, WIDTH - RIGHT)
                    rows.append(
                        tag("rect", x=x1, y=y, width=max(x2 - x1, 0.5), height=height - 1, style=f"fill: {fill}")
                    )
    box = tag("rect", x=LEFT, y=top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_="panel")
    labels = [
        tag("text", text(word), x=LEFT - 8, y=top + share * PANEL, class_="tick end")
        for word, share in (("left", 0.3), ("right", 0.8))
    ]
    heading = tag("tspan", text("Margins by height"), class_="name") + text(
        "  red below 0, orange 50, yellow 150, green 400 mm"
    )
    return box + "".join([*rows, *labels, tag("text", heading, x=LEFT, y=top - 8, class_="heading")])


def cross_section(found: Clearance, one: Slice) -> str:
    """Draw a cross-section: profile with widening and margin, points by class, surface, depth, and both rails."""
    profile, margin_m = found.settings.profile, found.settings.margin_m
    half = max(HALF_M, profile.half_width_m + 0.4)
    high = max(HIGH_M, profile.height_m + 0.5)
    width, height = 2 * half * SCALE, (high + 0.4) * SCALE

    def x(v: float) -> float:
        return (half - v) * SCALE  # seen along the line, v grows to the left

    def y(w: float) -> float:
        return (high - w) * SCALE

    ring = [(v + np.sign(v) * one.wide_m[0 if v > 0 else 1], w) for v, w in profile.points]
    parts = [_ring([(x(v), y(w)) for v, w in ring], "fill: #f4f8f5; stroke: #2e7d4f; stroke-width: 1.6")]
    if margin_m:
        grown = [(v + np.sign(v) * margin_m, w + (margin_m if w > profile.height_m / 2 else 0.0)) for v, w in ring]
        parts.append(_ring([(x(v), y(w)) for v, w in grown], "fill: none; stroke: #2e7d4f; stroke-dasharray: 5 4"))
    for number, code in enumerate(np.unique(one.code).tolist()):
        mine = one.code == code
        dots = "".join(
            f"M{x(v):.1f} {y(w):.1f}h.01" for v, w in zip(one.v[mine], one.w[mine]) if abs(v) < half and w < high
        )
        fill = PALETTE[number % len(PALETTE)]
        parts.append(tag("path", d=dots, style=f"stroke: {fill}; stroke-width: 1.8; stroke-linecap: round; fill: none"))
    spacing = float(np.median(found.courses[one.intrusion.course].spacing_m))
    for v in (spacing / 2, -spacing / 2):
        parts.append(tag("rect", x=x(v) - 2.2, y=y(0.0), width=4.4, height=9.0, style="fill: var(--ink)"))
    place = one.intrusion
    v, w, lean = place.v_mm / 1000, place.w_mm / 1000, UP_M * np.array(place.lean)
    ends = [f"{x(v + sense * lean[0]):.1f} {y(w + sense * lean[1]):.1f}" for sense in (-1, 1)]
    parts.append(tag("path", d=f"M{ends[0]}L{ends[1]}", style="stroke: var(--offgauge); stroke-width: 2; fill: none"))
    parts.append(
        tag(
            "circle",
            cx=x(v),
            cy=y(w),
            r=6,
            style="fill: none; stroke: var(--offgauge); stroke-width: 2",
        )
    )
    svg = tag(
        "svg",
        *parts,
        viewBox=f"0 0 {width:.0f} {height:.0f}",
        role="img",
        aria_label=f"Cross-section {place.intrusion}",
    )
    where = place.km_text or f"{place.chainage_m:,.1f} m"
    words = (
        f"{place.intrusion}: track {place.track_id}, {where}, {place.side}: {written(place.pen_mm)} ± "
        f"{written(place.sigma_mm)} mm inside{'' if place.sure else ', in doubt'}{place.what and ', '}{place.what}"
    )
    return tag("div", svg, tag("span", text(words)), class_="tile")


def _ring(places: list[tuple[float, float]], style: str) -> str:
    return tag("path", d="M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in places) + "Z", style=style)


@dataclass(frozen=True)
class Slice:
    """The points around the worst place of an intrusion: v, w, and class, (n,) each; and the widening on both sides."""

    intrusion: Intrusion
    v: np.ndarray
    w: np.ndarray
    code: np.ndarray
    wide_m: tuple[float, float]


def slices(found: Clearance) -> Iterator[Slice]:
    """Yield the cross-sections of the worst places, while the points along the tracks are on disk."""
    for one in found.intrusions[:PICTURES]:
        course, section = found.courses[one.course], int(one.chainage_m // SECTION_M)
        files = found.swept.files_around(one.course, section)
        points = read_points(part_of(course, section), section, files, found.settings)
        near = np.flatnonzero(np.abs(points.place[:, 0] - one.chainage_m) <= SLICE_M)
        near = near[:: max(len(near) // MOST_DRAWN, 1)]
        left_m, right_m = course.wide_m[course.station(np.array([one.chainage_m]))][0].tolist()
        v, w = points.place[near, 1:].T
        yield Slice(one, v, w, points.code[near], (left_m, right_m))
