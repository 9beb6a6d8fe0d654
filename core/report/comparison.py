"""The page about a comparison of two surveys: what has moved, the constant shift, and how the differences scatter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ..comparison import BOTH, EXTRA, MISSING, SURE, LineDifferences, TrackComparison
from ..progress import metres
from ..spread import known, largest, rms
from .markup import figure, made, page, section, table, tag, text, tiles, verdict_box
from .plots import LEFT, PANEL, RIGHT, SPACE, WIDTH, Curve, Frame, Panel, draw_panels, picture, round_up

BINS = 40
"""Bars of a distribution."""

SHOWN_SHARE = 99.0
"""Per cent of the differences that a distribution shows; its outermost bars hold the rest."""

MIN_SPAN_MM = 4.0
"""Smallest range of a distribution or profile, so that noise does not look alarming."""

LIMIT = f"{SURE:g} standard errors"

NOTES = (
    "Differences are the later survey minus the reference: across, positive to the left of the reference, and in "
    "height, positive above it. They contain the constant shift. Cant is the left rail minus the right one.",
    f"A place has moved if its difference, without the constant shift unless that counts, exceeds {SURE:g} standard "
    "errors of the difference across or in height. By chance, one place in 370 exceeds them in each.",
)


def build_comparison(found: TrackComparison, source: str, facts: Mapping[str, str]) -> str:
    """Return the page about a comparison, a complete HTML document, with the names of both surveys and more facts."""
    return page(
        f"Comparison: {source}",
        "Comparison of tracks",
        source,
        _verdict(found),
        _tiles(found),
        section("Differences", table(HEADINGS, _rows(found)), *_distributions(found)),
        *_places(found),
        *(_profiles(line, found.counts_shift) for line in found.lines if (line.state == BOTH).sum() > 1),
        made(facts, NOTES),
    )


def verdict_on(found: TrackComparison) -> str:
    """Return in words how much has moved, and by how much all of the later survey is shifted if that shows."""
    compared_m = found.length_of(BOTH)
    if not compared_m:
        return "The two surveys have no line in common."
    shift = f"The later survey is shifted by {_shift(found)}; apart from that, " if _is_shifted(found) else ""
    if not found.moved_m:
        return f"{shift}{'n' if shift else 'N'}othing has moved by more than {LIMIT} on {metres(compared_m)}."
    moved = f"{metres(found.moved_m)} of {metres(compared_m)} ({100 * found.moved_m / compared_m:.1f} %)"
    return f"{shift}{moved} have moved by more than {LIMIT}."


def _is_shifted(found: TrackComparison) -> bool:
    """Return whether a constant shift that is left out of account exceeds the limit of a movement anywhere."""
    return not found.counts_shift and any(line.shifted.any() for line in found.lines)


def describe_shift(found: TrackComparison) -> str:
    """Return the constant shift in words."""
    if not found.values("across_mm").size:
        return "Without common lines, no constant shift is known."
    part = "" if found.shift.both else ", of which only the part across the tracks shows"
    return f"Constant shift of the later survey: {_shift(found)}{part}."


def _shift(found: TrackComparison) -> str:
    """Return the components of the constant shift."""
    components = zip((*found.shift.plan_m, found.shift.up_m), ("east", "north", "up"))
    return ", ".join(f"{figure(1000 * size_m, '+.1f')} {way}" for size_m, way in components if np.isfinite(size_m))


def _verdict(found: TrackComparison) -> str:
    reasons = [
        describe_shift(found),
        "It counts as a movement." if found.counts_shift else "It does not count as a movement.",
    ]
    if np.isfinite(found.estimated_m):
        reasons.append(
            "A survey has no standard errors: the scatter of the differences is used instead "
            f"({1000 * found.estimated_m:.1f} mm across)."
        )
    for state, words in ((MISSING, "of the reference is missing in the later survey"), (EXTRA, "is new in it")):
        if found.length_of(state):
            reasons.append(f"{metres(found.length_of(state))} {words}.")
    kind = "fair" if found.moved_m or _is_shifted(found) or not found.length_of(BOTH) else "good"
    return verdict_box(kind, verdict_on(found), reasons)


def _tiles(found: TrackComparison) -> str:
    figures = (
        (metres(found.length_of(BOTH)), "compared"),
        (metres(found.moved_m), "moved"),
        (metres(found.length_of(MISSING)), "missing"),
        (metres(found.length_of(EXTRA)), "extra"),
        (figure(rms(found.values("across_mm"))), "across, root mean square"),
        (figure(rms(found.values("height_mm"))), "height, root mean square"),
    )
    return tiles(figures)


HEADINGS = ("Difference", "Mean", "Root mean square", "Half are within", "95 % are within", "Largest", "Stations")


def _rows(found: TrackComparison) -> Iterator[tuple[object, ...]]:
    for name, values in _quantities(found).items():
        size = np.abs(values)
        if len(values):
            figures = (values.mean(), rms(values), np.median(size), np.percentile(size, 95), largest(values))
            yield (name, *map(figure, figures), len(values))


def _quantities(found: TrackComparison) -> dict[str, np.ndarray]:
    """Return the differences of all stations by name, mm."""
    across, height = (
        np.concatenate([getattr(line, value) - getattr(line, shift) for line in found.lines] or [np.empty(0)])
        for value, shift in (("across_mm", "shift_mm"), ("height_mm", "shiftz_mm"))
    )
    return {
        "Across": found.values("across_mm"),
        "Across, without the shift": known(across),
        "Height": found.values("height_mm"),
        "Height, without the shift": known(height),
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
    frame, width = Frame(SPACE, (-half, half), (0.0, float(counts.max()))), (WIDTH - LEFT - RIGHT) / BINS
    bars = []
    for number, count in enumerate(counts.tolist()):
        title = tag("title", text(f"{count} stations from {edges[number]:.1f} to {edges[number + 1]:.1f} mm"))
        top, bottom = float(frame.y(count)), SPACE + PANEL
        bar = {"x": LEFT + number * width, "y": top, "width": width - 1, "height": bottom - top}
        bars.append(tag("rect", title, class_="bar", style="fill: var(--track)", **bar))
    return picture(f"Distribution: {name}", [frame.draw(name, "[stations]", *bars)], frame.along, "[mm]")


def _places(found: TrackComparison) -> Iterator[str]:
    """List the sections that have moved, are missing or are extra."""
    rows = [row for line in found.lines for row in _sections(line)]
    if rows:
        headings = ("What", "Line", "Chainage", "Length", "Across, largest", "Height, largest")
        yield section("Where", table(headings, rows, "scroll tall", "words"))


def _sections(line: LineDifferences) -> Iterator[tuple[object, ...]]:
    for what, which in (("moved", line.moved), (MISSING, line.state == MISSING), (EXTRA, line.state == EXTRA)):
        for start_m, end_m, stations in line.sections(which):
            off_mm = (largest(getattr(line, name)[stations]) for name in ("across_mm", "height_mm"))
            place = f"{start_m:,.1f} to {end_m:,.1f} m"
            yield (what, line.name, place, metres(end_m - start_m), *(figure(one, unknown="") for one in off_mm))


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
    panels = []
    for name, values, center, sigma in columns:
        if np.isfinite(values).any():
            limits = [] if center is None or sigma is None else [center - SURE * sigma, center + SURE * sigma]
            curves = [Curve(line.chainage_m, limit, style="stroke: var(--good)") for limit in limits]
            curves.append(Curve(line.chainage_m, values))
            unit = "[mm]; green: limits of a movement" if limits else "[mm]"
            panels.append(Panel(name, unit, curves, MIN_SPAN_MM))
    drawn = draw_panels(f"Differences of {line.name}", panels, along, "chainage [m]")
    return section(f"{line.name[:1].upper()}{line.name[1:]}", drawn)
