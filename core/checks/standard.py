"""Whether the points fit the rail standard that is stated, and which standard they fit.

See docs/method.md section 1.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..classify.settings import Settings, Way
from ..classify.square import classify_square
from ..classify.ways import search_alike
from ..clouds.points import Request
from ..errors import ParameterError
from ..heads.head_points import judged
from ..heads.roads import MIN_WIDER_M
from ..heads.sections import likelier_width
from ..parameters import Parameters
from ..progress import SILENT, Progress
from ..rails import HEAD_OFF_M, HeadWidths, RailLine, SearchFigures
from ..standards import (
    HEAD_WIDTH_RANGE_MM,
    SAME_GAUGE_M,
    STANDARDS,
    Gauge,
    RailStandard,
    closest_standard,
    of_gauge,
    width_at,
)
from ..tiles.grid import PointSource, fullest_square
from .spacing import Spacings, in_words, measure_spacings, middle, question, warn_of_other_spacing

TABLES_DIFFER_M = 0.002
"""By which tables state different widths of one head, and worn heads differ: no measurement tells standards apart that
are closer."""

MAX_OTHERS = 4
"""Most standards that fit as well which are named."""

RAW_SAMPLE_POINTS = 5_000_000
"""Points of a raw cloud that are looked at: a square or more of the densest ones."""

RAW_SQUARES, RAW_SQUARE_M = 2, 40.0
"""Squares in which rails are looked for, those with most points, which are next to the scanner, and their side."""

LITTLE_M = 2 * RAW_SQUARE_M
"""Length of rails with a partner below which the gauge may be another one: that of a track through one square."""

MANY_TIMES = 2.0
"""How many times as much rail another gauge shows, in these squares alone, if it is the right one: at a wrong gauge,
ties and sides of the track make pairs of a few metres."""

RAW_HEAD_M = 0.070
"""Width of a head that differs by less than 13 mm from that of any standard: heads are found 25 mm wider as well."""


def detect_standard(request: Request, progress: Progress = SILENT) -> RailStandard:
    """Find the rail standard that fits the first points of a cloud, and say what was measured and what fits as well.

    Raises CloudError if a file is damaged, NoRailPointsError if there is no point of the rail classes, and
    ParameterError if the points are too sparse, or no standard fits.
    """
    xyz, census = request.sample()
    if not len(xyz):
        raise request.explain_none(census)
    return _detected(measure_spacings(xyz), progress)


def detect_in_raw(request: Request, progress: Progress = SILENT) -> RailStandard:
    """Find the rail standard of a raw cloud: the rail points of its fullest squares are found for each plausible gauge.

    Parameters and errors are those of `detect_standard`; the request is for `standards.SEARCHED_CLASSES`.
    """
    return _detected(measure_spacings(_found_at_any_gauge(request, progress)[0]), progress)


def warn_of_raw(request: Request, found: SearchFigures, parameters: Parameters, progress: Progress = SILENT) -> bool:
    """Look for other gauges where the search of a raw cloud found next to nothing, and warn the user if one has rails.

    The request is one for `standards.SEARCHED_CLASSES`, and the figures are those of the search at the gauges of the
    parameters. Returns whether the user has been warned.
    """
    if found.paired_m >= max(found.single_m, LITTLE_M):
        return False
    progress.status("Looking for rails of other gauges")
    rails, paired_m = _found_at_any_gauge(request, progress.span(0, 0))
    return paired_m > MANY_TIMES * found.paired_m and warn_of_other_spacing(rails, parameters, progress)


def _found_at_any_gauge(request: Request, progress: Progress) -> tuple[np.ndarray, float]:
    """Find rails for each plausible gauge where a raw cloud is densest.

    Returns the points, (n, 3), on the rails of the gauge of which there are most, and the length of these rails,
    metres.
    """
    xyz, census = request.sample(RAW_SAMPLE_POINTS)
    if not len(xyz):
        raise request.explain_none(census)
    zero = np.median(xyz[:, :2], axis=0) - RAW_SQUARE_M / 2  # so that no border follows a straight track
    corners = np.floor((xyz[:, :2] - zero) / RAW_SQUARE_M).astype(np.int64)
    keys, square, counts = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    fullest = np.argsort(-counts, kind="stable")[:RAW_SQUARES]
    squares = [(np.append(zero + RAW_SQUARE_M * keys[one], 0.0), xyz[square.ravel() == one]) for one in fullest]
    best_m, best = 0.0, np.empty((0, 3))
    for gauge_m in progress.follow(_plausible_gauges()):
        found = _found(squares, Settings((gauge_m,), RAW_HEAD_M))
        paired_m = sum(one.figures.paired_m for one in found)
        if paired_m > best_m:
            best_m, best = paired_m, np.concatenate([one.rails for one in found])
    return best, best_m


_Square = tuple[np.ndarray, np.ndarray]
"""The corner of a square, (3,), and its points, (n, 3)."""


class _Found(NamedTuple):
    """Points on rails in a square, (n, 3), and figures."""

    rails: np.ndarray
    figures: SearchFigures


def _found(squares: Sequence[_Square], settings: Settings) -> list[_Found]:
    """Find the points on rails in squares of a raw cloud."""

    def search(some: Sequence[_Square], way: Way) -> Iterator[_Found]:
        for corner, xyz in some:
            classified = classify_square(xyz - corner, replace(settings, way=way))
            yield _Found(xyz[classified.rail], classified.figures)

    return list(search_alike(squares, search))


def _plausible_gauges() -> list[float]:
    """Return the gauges of the standards; of two that can't be told apart, the first."""
    gauges: list[float] = []
    for gauge_m in sorted({one.gauge_m for one in STANDARDS.values()}):
        if not gauges or gauge_m - gauges[-1] > SAME_GAUGE_M:
            gauges.append(gauge_m)
    return gauges


def _detected(spacings: Spacings, progress: Progress) -> RailStandard:
    """Return the standard that fits what was measured, and say how sure that is."""
    measured = spacings.most_common()
    standard = closest_standard(*measured) if measured else None
    if measured is None or standard is None:
        found = "" if measured is None else f": rails are {in_words(*measured)}"
        raise ParameterError(
            f"No rail standard could be detected{found}: choose STANDARD, or fill in GAUGE and HEAD_WIDTH."
        )
    if abs(measured[1] - standard.head_width_m) > 2 * HEAD_OFF_M:
        return _assumed(standard, measured, progress)
    off_m = max(TABLES_DIFFER_M, 2 * spacings.width_error_m())
    others = [
        one.profile
        for one in sorted(of_gauge(standard.gauge_m), key=lambda one: abs(one.head_width_m - measured[1]))
        if abs(one.head_width_m - measured[1]) <= off_m and one != standard
    ]
    more = f" and {len(others) - MAX_OTHERS} more" if len(others) > MAX_OTHERS else ""
    also = f", also {', '.join(others[:MAX_OTHERS])}{more}" if others else ""
    progress.info(
        f"Detected {standard.label} ({standard.name}): rails are {1000 * measured[0]:.0f} mm apart, head "
        f"{1000 * measured[1]:.0f} ± {np.ceil(1000 * off_m):.0f} mm; fits {standard.profile}{also}."
    )
    return standard


def _assumed(standard: RailStandard, measured: tuple[float, float], progress: Progress) -> RailStandard:
    """Say that a standard is assumed by the distance of the rails alone, and offer the one that fits this best."""
    progress.warning(
        f"Rails are {in_words(*measured)}. No standard has such heads: the cloud is blunt, or has more than heads. "
        f"{standard.label} ({standard.name}) is assumed, as its rails are this far apart; if the profile is another "
        "one, choose it as STANDARD."
    )
    head_width_m = measured[0] - standard.gauge_m
    closest = min(of_gauge(standard.gauge_m), key=lambda one: abs(one.head_width_m - head_width_m))
    if closest != standard:
        progress.propose(closest.name)
    return standard


def head_widths(
    source: PointSource, gauges: Sequence[Gauge], progress: Progress, rails: Sequence[RailLine] = ()
) -> HeadWidths:
    """Measure how wide heads look in the fullest square of a class, and warn the user if another width is stated.

    The spread of the points decides; where it is a little more than stated, which noise and side faces do as well, the
    outline of the heads along the rails does. Another standard is asked about at a stated gauge only: elsewhere, it is
    asked about already because of the gauge.
    """
    points = fullest_square(source)
    if points.strips is not None:  # strips side by side would look like a wider head
        strips, counts = np.unique(points.strips, return_counts=True)
        points = points.kept(points.strips == strips[np.argmax(counts)])
    xyz = points.xyz
    measured = measure_spacings(middle(xyz)).most_common()
    lines = [rail.xyz[:, :2] - points.frame.shift_to(source.frame)[:2] for rail in rails]
    stated_m = gauges[0][1] if measured is None else width_at(measured[0], gauges)
    if judged(points, lines, stated_m).blunt:
        progress.warning(
            f"Heads are blunt: the points show round ridges without edges where heads of {1000 * stated_m:.0f} mm are, "
            "as matched images and wide beams do. Lines follow the crests, and sigma_mm and sigmaz_mm state how far "
            "these wander: gauge and cant cannot be better, and the width of the heads is not measured."
        )
        return HeadWidths(float("nan"), stated_m, blunt=True)
    if measured is None:
        return HeadWidths(float("nan"), stated_m)
    seen_m = measured[1]
    if rails and HEAD_OFF_M < seen_m - stated_m < MIN_WIDER_M:
        seen_m = likelier_width(lines, xyz, (stated_m, seen_m))
    widths = HeadWidths(seen_m, stated_m)
    if widths.differ:
        _warn_of_widths(widths, measured[0], gauges, progress)
    return widths


def _warn_of_widths(widths: HeadWidths, spacing_m: float, gauges: Sequence[Gauge], progress: Progress) -> None:
    """Warn the user of heads that look wider or narrower than stated, given the distance of most rails."""
    seen_m, stated_m = widths.seen_m, widths.stated_m
    seen = f"Heads look {1000 * seen_m:.0f} mm wide, {1000 * stated_m:.0f} mm are stated"
    standard = closest_standard(spacing_m, seen_m)
    fits = standard is not None and abs(standard.head_width_m - seen_m) <= HEAD_OFF_M
    if 1000 * seen_m < HEAD_WIDTH_RANGE_MM[0]:
        progress.warning(
            f"The points cover only {1000 * seen_m:.0f} mm of each head of {1000 * stated_m:.0f} mm; the scanner "
            "probably saw one side only. The lines are on the axes if that width is right."
        )
    elif seen_m > stated_m + MIN_WIDER_M:
        progress.warning(
            f"{seen}: road or dirt next to them is classified as rail. Where it covers one edge of a head, the line is "
            "set from the other edge if that is at gauge. Check the classification elsewhere."
        )
    elif fits or seen_m < stated_m:
        if any(abs(spacing_m - seen_m - gauge_m) <= SAME_GAUGE_M for gauge_m, _ in gauges):
            progress.warning(f"{seen}{question(spacing_m, seen_m)} Every gauge is off by the difference.")
    else:
        progress.warning(
            f"{seen}, and no standard has such heads: passes of the scanner are not aligned, or the points are noisy. "
            "Passes can be compared and aligned (STRIPS) if the points have source ids or GPS times."
        )
