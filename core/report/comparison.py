"""The page about a comparison of two surveys: what has moved, the constant shift, and how the differences scatter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..comparison.tracks import BOTH, EXTRA, MISSING, SURE, LineDifferences, TrackComparison
from .markup import metres, table, tag, text
from .plots import AXIS, LEFT, PANEL, RIGHT, SPACE, TICKS_ACROSS, TICKS_UP, WIDTH, curve, round_up, ticks
from .style import STYLE

BINS = 40
"""Bars of a distribution."""

SHOWN_SHARE = 99.0
"""Per cent of the differences that a distribution shows; its outermost bars hold the rest."""

MIN_SPAN_MM = 4.0
"""Smallest range of a distribution or profile, so that noise does not look alarming."""

NOTES = (
    "Differences are the later survey minus the reference: across, positive to the left of the reference, and in "
    "height, positive above it. They contain the constant shift. Cant is the left rail minus the right one.",
    f"A place has moved if its difference, without the constant shift unless that counts, exceeds {SURE:g} standard "
    "errors of the difference across or in height. By chance, one place in 370 exceeds them in each.",
)


def build_comparison(found: TrackComparison, counts_shift: bool, source: str, facts: Mapping[str, str]) -> str:
    """Return the page about a comparison, a complete HTML document.

    Parameters
    ----------
    found : TrackComparison
    counts_shift : bool
        Whether the constant shift counts as a movement.
    source : str
        Names of both surveys.
    facts : mapping of str to str
        Further facts to state, by name.
    """
    body = [
        tag("h1", text("Comparison of tracks")),
        tag("p", text(source), class_="source"),
        _verdict(found, counts_shift),
        _tiles(found),
        _section("Differences", tag("div", table(HEADINGS, _rows(found)), class_="scroll"), *_distributions(found)),
        *_places(found),
        *(_profiles(line, counts_shift) for line in found.lines if (line.state == BOTH).sum() > 1),
        _section(
            "How it was made", tag("dl", *_facts(facts)), *(tag("p", text(note), class_="notes") for note in NOTES)
        ),
    ]
    head = (
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        tag("title", text(f"Comparison: {source}")),
        f"<style>{STYLE}</style>",
    )
    return f"<!DOCTYPE html>\n{tag('html', tag('head', *head), tag('body', tag('main', *body)), lang='en')}\n"


def verdict_on(found: TrackComparison) -> str:
    """Return in words how much has moved."""
    compared_m = found.length_of(BOTH)
    if not compared_m:
        return "The two surveys have no line in common."
    if not found.moved_m:
        return f"Nothing has moved by more than {SURE:g} standard errors on {metres(compared_m)}."
    moved = f"{metres(found.moved_m)} of {metres(compared_m)} ({100 * found.moved_m / compared_m:.1f} %)"
    return f"{moved} have moved by more than {SURE:g} standard errors."


def describe_shift(found: TrackComparison) -> str:
    """Return the constant shift in words."""
    east, north = 1000 * found.shift.plan_m
    if not found.values("across_mm").size:
        return "Without common lines, no constant shift is known."
    height = f", {1000 * found.shift.up_m:+.1f} mm up" if np.isfinite(found.shift.up_m) else ""
    part = "" if found.shift.both else ", of which only the part across the tracks shows"
    return f"Constant shift of the later survey: {east:+.1f} mm east, {north:+.1f} mm north{height}{part}."


def _verdict(found: TrackComparison, counts_shift: bool) -> str:
    reasons = [
        describe_shift(found),
        "It counts as a movement." if counts_shift else "It does not count as a movement.",
    ]
    if np.isfinite(found.estimated_m):
        reasons.append(
            "A survey has no standard errors: the scatter of the differences is used instead "
            f"({1000 * found.estimated_m:.1f} mm across)."
        )
    for state, words in ((MISSING, "of the reference is missing in the later survey"), (EXTRA, "is new in it")):
        if found.length_of(state):
            reasons.append(f"{metres(found.length_of(state))} {words}.")
    kind = "fair" if found.moved_m or not found.length_of(BOTH) else "good"
    listed = tag("ul", *(tag("li", text(reason)) for reason in reasons))
    return tag("div", tag("strong", text(verdict_on(found))), listed, class_=f"verdict {kind}")


def _tiles(found: TrackComparison) -> str:
    tiles = (
        (metres(found.length_of(BOTH)), "compared"),
        (metres(found.moved_m), "moved"),
        (metres(found.length_of(MISSING)), "missing"),
        (metres(found.length_of(EXTRA)), "extra"),
        (_figure(_rms(found.values("across_mm"))), "across, root mean square"),
        (_figure(_rms(found.values("height_mm"))), "height, root mean square"),
    )
    shown = (tag("div", tag("b", text(figure)), tag("span", text(what)), class_="tile") for figure, what in tiles)
    return tag("div", *shown, class_="tiles")


HEADINGS = ("Difference", "Mean", "Root mean square", "Half are within", "95 % are within", "Largest", "Stations")


def _rows(found: TrackComparison) -> Iterator[tuple[object, ...]]:
    for name, values in _quantities(found).items():
        size = np.abs(values)
        if len(values):
            largest = values[np.argmax(size)]
            figures = (values.mean(), _rms(values), np.median(size), np.percentile(size, 95), largest)
            yield (name, *map(_figure, figures), len(values))


def _quantities(found: TrackComparison) -> dict[str, np.ndarray]:
    """Return the differences of all stations by name, mm."""
    across, height = (
        np.concatenate([getattr(line, value) - getattr(line, shift) for line in found.lines] or [np.empty(0)])
        for value, shift in (("across_mm", "shift_mm"), ("height_mm", "shiftz_mm"))
    )
    return {
        "Across": found.values("across_mm"),
        "Across, without the shift": across[np.isfinite(across)],
        "Height": found.values("height_mm"),
        "Height, without the shift": height[np.isfinite(height)],
        "Gauge": found.values("gauge_mm"),
        "Cant": found.values("cant_mm"),
    }


def _distributions(found: TrackComparison) -> Iterator[str]:
    for name in ("Across, without the shift", "Height, without the shift"):
        values = _quantities(found)[name]
        if len(values):
            yield _distribution(name, values)


def _distribution(name: str, values: np.ndarray) -> str:
    """Draw how many stations have which difference."""
    half = round_up(max(float(np.percentile(np.abs(values), SHOWN_SHARE)), MIN_SPAN_MM / 2))
    counts, edges = np.histogram(np.clip(values, -half, half), BINS, (-half, half))
    scale, width = PANEL / counts.max(), (WIDTH - LEFT - RIGHT) / BINS
    parts = [tag("rect", x=LEFT, y=SPACE, width=WIDTH - LEFT - RIGHT, height=PANEL, class_="panel")]
    for number, count in enumerate(counts):
        title = tag("title", text(f"{count} stations from {edges[number]:.1f} to {edges[number + 1]:.1f} mm"))
        height = float(count * scale)
        top = SPACE + PANEL - height
        bar = {"x": LEFT + number * width, "y": top, "width": width - 1, "height": height}
        parts.append(tag("rect", title, class_="bar", style="fill: var(--track)", **bar))
    for value in ticks(-half, half, TICKS_ACROSS):
        x = float(LEFT + (value + half) / (2 * half) * (WIDTH - LEFT - RIGHT))
        parts.append(tag("text", text(f"{value:g}"), x=x, y=SPACE + PANEL + 16, class_="tick middle"))
    heading = tag("tspan", text(name), class_="name") + text(f"  [mm]: {len(values):,} stations")
    parts.append(tag("text", heading, x=LEFT, y=SPACE - 8, class_="heading"))
    box = f"0 0 {WIDTH:g} {SPACE + PANEL + AXIS:g}"
    return tag("svg", *parts, viewBox=box, role="img", aria_label=f"Distribution: {name}")


def _places(found: TrackComparison) -> Iterator[str]:
    """List the sections that have moved, are missing or are extra."""
    rows = [row for line in found.lines for row in _sections(line)]
    if rows:
        headings = ("What", "Line", "Chainage", "Length", "Across, largest", "Height, largest")
        written = tag("div", table(headings, rows), class_="scroll tall")
        yield _section("Where", written.replace("<table>", '<table class="words">'))


def _sections(line: LineDifferences) -> Iterator[tuple[object, ...]]:
    for what, which in (("moved", line.moved), (MISSING, line.state == MISSING), (EXTRA, line.state == EXTRA)):
        for start_m, end_m, stations in line.sections(which):
            largest = (_largest(getattr(line, name)[stations]) for name in ("across_mm", "height_mm"))
            place = f"{start_m:,.1f} to {end_m:,.1f} m"
            yield (what, line.line_id, place, metres(end_m - start_m), *largest)


def _largest(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return _figure(float(known[np.argmax(np.abs(known))])) if len(known) else ""


def _profiles(line: LineDifferences, counts_shift: bool) -> str:
    """Draw the differences along a line, with the limits beyond which it has moved."""
    centers = (0 * line.shift_mm, 0 * line.shiftz_mm) if counts_shift else (line.shift_mm, line.shiftz_mm)
    along = float(line.chainage_m[0]), float(line.chainage_m[-1])
    columns = (
        ("Across, positive to the left", line.across_mm, centers[0], line.sigma_mm),
        ("Height", line.height_mm, centers[1], line.sigmaz_mm),
        ("Gauge", line.gauge_mm, None, None),
        ("Cant", line.cant_mm, None, None),
    )
    shown = [column for column in columns if np.isfinite(column[1]).any()]
    panels = [
        _panel(name, values, shift, sigma, line.chainage_m, number * (PANEL + SPACE) + SPACE)
        for number, (name, values, shift, sigma) in enumerate(shown)
    ]
    bottom = len(shown) * (PANEL + SPACE)
    marks = [
        tag("text", text(f"{at:,g}"), x=float(_x(np.array([at]), along)[0]), y=bottom + 16, class_="tick middle")
        for at in ticks(*along, TICKS_ACROSS)
    ]
    name = tag("text", text("chainage [m]"), x=WIDTH - RIGHT, y=bottom + 32, class_="tick end")
    box = f"0 0 {WIDTH:g} {bottom + AXIS:g}"
    label = f"Differences of line {line.line_id}"
    drawn = tag("svg", *panels, *marks, name, viewBox=box, role="img", aria_label=label)
    return _section(f"Line {line.line_id}", drawn)


def _panel(
    name: str,
    values: np.ndarray,
    shift: np.ndarray | None,
    sigma: np.ndarray | None,
    chainage: np.ndarray,
    top: float,
) -> str:
    """Draw one difference along a line."""
    band = [] if shift is None or sigma is None else [shift - SURE * sigma, shift + SURE * sigma]
    every = np.concatenate([values, *band])
    known = every[np.isfinite(every)]
    middle, span = 0.5 * (known.max() + known.min()), max(1.1 * float(np.ptp(known)), MIN_SPAN_MM)
    low, high = float(middle - span / 2), float(middle + span / 2)
    x = _x(chainage, (float(chainage[0]), float(chainage[-1])))

    def y(heights: np.ndarray) -> np.ndarray:
        return top + PANEL - (heights - low) * PANEL / (high - low)

    parts = [tag("rect", x=LEFT, y=top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_="panel")]
    for value in ticks(low, high, TICKS_UP):
        level = float(y(np.array([value]))[0])
        parts.append(tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=level, y2=level, class_="grid"))
        parts.append(tag("text", text(f"{value:,.10g}"), x=LEFT - 8, y=level + 4, class_="tick end"))
    parts += [tag("path", d=curve(x, y(limit)), class_="curve", style="stroke: var(--good)") for limit in band]
    parts.append(tag("path", d=curve(x, y(values)), class_="curve"))
    heading = tag("tspan", text(name), class_="name") + text(
        "  [mm]" + ("; green: limits of a movement" if band else "")
    )
    parts.append(tag("text", heading, x=LEFT, y=top - 8, class_="heading"))
    return "".join(parts)


def _x(chainage: np.ndarray, along: tuple[float, float]) -> np.ndarray:
    return LEFT + (chainage - along[0]) / (along[1] - along[0]) * (WIDTH - LEFT - RIGHT)


def _facts(facts: Mapping[str, str]) -> Sequence[str]:
    return [tag("dt", text(name)) + tag("dd", text(value)) for name, value in facts.items() if value]


def _section(heading: str, *content: str) -> str:
    return tag("section", tag("h2", text(heading)), *content)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan


def _figure(value: float) -> str:
    return f"{value:.1f} mm" if np.isfinite(value) else "unknown"
