"""What a fit holds: types, radii and starts of a corrected table, and proposals of round radii."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np

from ..errors import ParameterError
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from .chain import NOTHING, Chain, Held, Span, assembled
from .elements import Alignment, Element, Figures, PlanElement, VerticalElement
from .plane_fit import FitError, PlanFit, Points, fit_plan
from .signals import Signal

EDITED_R, EDITED_M = 1e-6, 0.0005
"""A radius (as a share) and a start (metres) were edited if they differ by more from what the fit has noted."""

TOUCHING_M = 0.01
"""Elements whose ends differ by less touch, metres."""

BENT = ("arc", "parabola", "ramp")
"""Types whose bend is constant and not 0."""


@dataclass(frozen=True)
class Given:
    """The structure that a table states.

    `poses`, (e, 3), is the place and direction at the start of each element in plan; None for those of the line.
    """

    chain: Chain
    held: Held = NOTHING
    poses: Optional[np.ndarray] = None


def given_of(fixed: Alignment, first_m: float, length_m: float) -> Given:
    """Return the structure of the elements in plan for a part of a line: where on the line it begins, and its length.

    The first and the last element are continued to the ends of the part.
    """
    plan = [moved(one, -first_m) for one in fixed.plan]
    bounds = _bounds(fixed.track_id, plan, 0.0, length_m)
    if plan[0].s_to <= 0.0 or (len(plan) > 1 and bounds[-2] >= length_m):
        raise ParameterError(
            f"The elements of track {fixed.track_id} in FIXED end at {fixed.s_to:.0f} m, but its line is "
            f"{first_m + length_m:.0f} m long: give the table of this line."
        )
    spans = [
        Span(start, end, one.type == "clothoid", one.type == "arc", one.k_to, one.k_from)
        for one, start, end in zip(plan, bounds[:-1], bounds[1:])
    ]
    chain = assembled(spans, 2)
    parts = [one for one in plan if one.type != "clothoid"]
    numbers = np.flatnonzero(chain.extents[1] > chain.extents[0])
    bends = {int(number): one.k_from for number, one in zip(numbers, parts) if _has_edited_radius(one)}
    poses = [_pose(fixed, one, start + first_m) for one, start in zip(fixed.plan, bounds)]
    return Given(chain, Held(bends, _edited_starts(plan, bounds)), np.array(poses))


def given_along(track_id: Optional[int], shape: Sequence[Element], signal: Signal) -> Given:
    """Return the structure of the elements in height or of cant; those beyond the ends of the signal are left out."""
    first, last = float(signal.s[0]), float(signal.s[-1])
    covering = max(sum(one.s_from <= first for one in shape) - 1, 0)
    known = [one for number, one in enumerate(shape) if number == covering or first < one.s_from < last]
    bounds = _bounds(track_id, known, first, last)
    spans = [
        Span(start, end, False, one.type in BENT, _bend(one)) for one, start, end in zip(known, bounds[:-1], bounds[1:])
    ]
    bends = {number: _bend(one) for number, one in enumerate(known) if _has_edited_radius(one)}
    return Given(assembled(spans, signal.kind.order), Held(bends, _edited_starts(known, bounds)))


def without(elements: Sequence[PlanElement], number: int, length_m: float) -> Given:
    """Return the structure of fitted elements of which one is closed by its neighbours, on a line of some length."""
    rest = [noted(one) for at, one in enumerate(elements) if at != number]
    return given_of(Alignment(None, LocalFrame(np.zeros(3)), tuple(rest)), 0.0, length_m)


def noted(one: PlanElement, **figures: Any) -> PlanElement:
    """Return a fitted element with its figures, which note radius and start so that an edit shows."""
    radius = 1.0 / one.k_from if one.type == "arc" else None
    return replace(one, figures=Figures(r_fit_m=radius, s_fit_m=one.s_from, **figures))


def moved(one: PlanElement, by_m: float) -> PlanElement:
    """Return an element that starts farther along the line."""
    noted_m = None if one.figures.s_fit_m is None else one.figures.s_fit_m + by_m
    return replace(one, s_from=one.s_from + by_m, figures=replace(one.figures, s_fit_m=noted_m))


def _pose(fixed: Alignment, one: PlanElement, start: float) -> tuple[float, float, float]:
    """Return place and direction of an element that is continued to a start."""
    alone, s = replace(fixed, plan=(one,)), np.array([start])
    (x, y), heading = alone.places(s)[0], alone.headings(s)[0]
    return float(x), float(y), float(heading)


def _bounds(track_id: Optional[int], elements: Sequence[Element], first: float, last: float) -> list[float]:
    """Return where elements start, and the end of the last one; the outer ones reach to `first` and `last`."""
    bounds = [first, *(_joint(before, after) for before, after in zip(elements[:-1], elements[1:])), last]
    wrong = next((at for at in range(1, len(bounds) - 1) if bounds[at] <= bounds[at - 1]), None)
    if wrong is not None:
        raise ParameterError(
            f"In FIXED, the element {wrong + 1} in layout {elements[wrong].layout} of track {track_id} does not start "
            f"after the one before it: correct its s_from of {elements[wrong].s_from:.4f} m."
        )
    return bounds


def _joint(before: Element, after: Element) -> float:
    """Return where two elements meet: midway if the row between them is missing."""
    if abs(before.s_to - after.s_from) < TOUCHING_M or _is_edited(after):
        return after.s_from
    return 0.5 * (before.s_to + after.s_from)


def _edited_starts(elements: Sequence[Element], bounds: Sequence[float]) -> dict[int, float]:
    """Return the starts that were edited, by the number of their element."""
    return {number: bounds[number] for number, one in enumerate(elements) if number and _is_edited(one)}


def _is_edited(one: Element) -> bool:
    """Return whether the start of an element was edited."""
    return one.figures.s_fit_m is not None and abs(one.s_from - one.figures.s_fit_m) > EDITED_M


def _has_edited_radius(one: Element) -> bool:
    """Return whether the radius of an arc or a parabola was edited, or stands in a table that no fit made."""
    if one.type not in ("arc", "parabola"):
        return False
    return one.figures.r_fit_m is None or abs(one.figures.r_fit_m * _bend(one) - 1.0) > EDITED_R


def _bend(one: Element) -> float:
    """Return the bend of an element that has a constant one, 1/m."""
    if isinstance(one, PlanElement):
        return one.k_from
    return one.curvature if isinstance(one, VerticalElement) else (one.cant_to_m - one.cant_from_m) / one.length_m


STEPS_M = (1000.0, 500.0, 100.0, 50.0, 25.0, 10.0, 5.0, 1.0)
"""Steps of round radii, the roundest first, metres."""

SIGMAS = 2.0
"""A radius may be rounded by this many standard errors."""

MOST_RISE = 6.6
"""Largest rise of chi-square for a rounded radius: its 1 % level."""


def with_round_radii(
    chain: Chain, points: Points, fit: PlanFit, elements: Sequence[PlanElement], progress: Progress = SILENT
) -> tuple[PlanElement, ...]:
    """Return elements with proposed round radii, and how far the track lies off with all of them."""
    parts = np.flatnonzero(chain.extents[1] > chain.extents[0])
    of_part = [number for number, one in enumerate(elements) if one.type != "clothoid"]
    before = _chi_square(fit, points)
    poses = np.array([(one.x, one.y, one.heading) for one in fit.elements])
    proposed = [round_radius(one, SIGMAS) for one in elements]
    radii = [(int(part), proposed[one]) for part, one in zip(parts, of_part)]
    held = {part: 1.0 / radius for part, radius in radii if radius}
    if not held:
        return tuple(elements)
    try:
        rounded = fit_plan(chain, points, Held(held), progress, poses)
    except FitError:
        return tuple(elements)
    if _chi_square(rounded, points) - before > MOST_RISE * len(held):
        return tuple(elements)
    return tuple(
        _with_round(one, radius, off_element(rounded, points, number)[0])
        for number, (one, radius) in enumerate(zip(elements, proposed))
    )


def _with_round(one: PlanElement, radius: Optional[float], rms_mm: Optional[float]) -> PlanElement:
    """Return an element with a proposal."""
    return replace(one, figures=replace(one.figures, r_round_m=radius, dev_rms_round_mm=rms_mm))


def round_radius(one: PlanElement, sigmas: float) -> Optional[float]:
    """Return the roundest radius of an arc within a number of standard errors, signed; None if there is none."""
    sigma = one.figures.sigma_r_m
    if one.type != "arc" or sigma is None:
        return None
    radius = 1.0 / one.k_from
    for step in STEPS_M:
        rounded = step * round(radius / step)
        if rounded and abs(rounded - radius) <= sigmas * sigma:
            return float(rounded)
    return None


def off_element(fit: PlanFit, points: Points, number: int) -> tuple[Optional[float], Optional[float]]:
    """Return the root mean square and the largest deviation of the points of an element, millimetres."""
    one = fit.elements[number]
    first, last = one.s_from if number else -np.inf, one.s_to if number + 1 < len(fit.elements) else np.inf
    rest = 1000.0 * fit.across[(fit.s >= first) & (fit.s < last) & (points.weight > 0)]
    if not len(rest):
        return None, None
    return float(np.sqrt(np.mean(rest**2))), float(rest[np.abs(rest).argmax()])


def _chi_square(fit: PlanFit, points: Points) -> float:
    return float(points.weight @ fit.across**2)
