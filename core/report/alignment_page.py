"""The report on alignments: how far tracks lie off them, their elements, and a diagram of each track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..alignment.deviations import Deviations
from ..alignment.elements import Alignment, CantElement, Element, VerticalElement
from .alignment_plots import draw_alignment
from .markup import legend, made, metres, page, section, table, tiles
from .style import ALIGNMENT_STYLE

PROPOSAL = (
    "A fitted alignment is a proposal: the elements that the measured track most likely follows. It does not show what "
    "was designed, approved or built. The standard error of a radius is that of the fit; it does not contain a common "
    "error of the survey."
)

NOTE = (
    "Slew, lift and cant difference are measured minus design: a positive slew means that the track lies to the left "
    "of the design, seen along the track. The measured curvature is that of chords of 20 m, the measured gradient that "
    "over 10 m."
)

LAYOUTS = {"H": "plan", "V": "height", "C": "cant"}


def build_alignment_page(
    courses: Sequence[tuple[Alignment, Deviations]], source: str, facts: Mapping[str, str], fitted: bool
) -> str:
    """Return the report on alignments and the tracks beside them.

    Parameters
    ----------
    courses : sequence of (Alignment, Deviations)
    source : str
        Name of the measured tracks.
    facts : mapping of str to str
        Further facts to state, by name.
    fitted : bool
        Whether the alignments were fitted to these tracks.

    Returns
    -------
    str
        A complete HTML document.
    """
    slews, lifts = (np.concatenate([getattr(found, name) for _, found in courses]) for name in ("slew_mm", "lift_mm"))
    return page(
        f"Rail Extract: {source}",
        "Rail Extract alignment report",
        source,
        _tiles(courses, slews, lifts),
        *(_track(alignment, found) for alignment, found in courses),
        made(facts, (NOTE, *([PROPOSAL] if fitted else []))),
        style=ALIGNMENT_STYLE,
    )


def _tiles(courses: Sequence[tuple[Alignment, Deviations]], slews: np.ndarray, lifts: np.ndarray) -> str:
    """Write the most important figures."""
    figures = [
        (str(len(courses)), "tracks"),
        (metres(sum(alignment.s_to - alignment.s_from for alignment, _ in courses)), "of alignment"),
        (str(sum(len(alignment.elements) for alignment, _ in courses)), "elements"),
        (_rms(slews), "slew, RMS"),
        (_rms(lifts), "lift, RMS"),
        (_largest(slews), "slew, largest"),
    ]
    return tiles(figures)


def _rms(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return f"{np.sqrt(np.mean(known**2)):.1f} mm" if len(known) else "unknown"


def _largest(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return f"{known[np.argmax(np.abs(known))]:+.1f} mm" if len(known) else "unknown"


def _track(alignment: Alignment, found: Deviations) -> str:
    """Write the diagram and the elements of a track."""
    name = alignment.name or f"Track {alignment.track_id}"
    keys = [("measured", "fine"), ("design", "designed")]
    keys += [(kind, f"element {kind}") for kind in ("line", "clothoid", "arc")]
    headings = ("Element", "Starts at", "Length", "From", "To", "Standard error of the radius", "Deviation, RMS")
    rows = [_row(number, one) for elements in _layouts(alignment) for number, one in enumerate(elements, start=1)]
    shown = legend((what, {"class_": mark}) for what, mark in keys)
    return section(name, draw_alignment(alignment, found), shown, table(headings, rows, "scroll tall"))


def _layouts(alignment: Alignment) -> tuple[Sequence[Element], ...]:
    return alignment.plan, alignment.vertical, alignment.cant


def _row(number: int, one: Element) -> tuple[str, ...]:
    figures = one.figures
    start = f"{one.s_from:,.2f} m" if figures.km_from is None else f"km {figures.km_from:.5f}"
    ends = _ends(one)
    return (
        f"{LAYOUTS[one.layout]} {number}, {one.type}",
        start,
        f"{one.length_m:,.2f} m",
        *ends,
        "" if figures.sigma_r_m is None else f"{figures.sigma_r_m:.2f} m",
        "" if figures.dev_rms_mm is None else f"{figures.dev_rms_mm:.1f} mm",
    )


def _ends(one: Element) -> tuple[str, str]:
    """Write radius, gradient or cant at start and end."""
    if isinstance(one, CantElement):
        return f"{1000 * one.cant_from_m:+.1f} mm", f"{1000 * one.cant_to_m:+.1f} mm"
    if isinstance(one, VerticalElement):
        return f"{1000 * one.grade_from:+.3f} ‰", f"{1000 * one.grade_to:+.3f} ‰"
    start, end = (f"R {1 / bend:,.2f} m" if bend else "straight" for bend in (one.k_from, one.k_to))
    return start, end
