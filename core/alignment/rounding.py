"""Proposals of round radii."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Optional

import numpy as np

from ..progress import SILENT, Progress
from .chain import Chain, Held
from .elements import PlanElement
from .plane_fit import FitError, PlanFit, Points, fit_plan

STEPS_M = (1000.0, 500.0, 100.0, 50.0, 25.0, 10.0, 5.0, 1.0)
"""Steps of round radii, the roundest first, metres."""

SIGMAS = (2.0, 1.0)
"""A radius may be rounded by this many standard errors; if the track does not fit all that are, by fewer."""

MOST_RISE = 6.6
"""Largest rise of chi-square for a rounded radius: its 1 % level."""


def with_round_radii(
    chain: Chain, points: Points, fit: PlanFit, elements: Sequence[PlanElement], progress: Progress = SILENT
) -> tuple[PlanElement, ...]:
    """Return elements with proposed round radii, and how far the track lies off with all of them.

    Parameters
    ----------
    chain : Chain
        That was fitted.
    points : Points
    fit : PlanFit
    elements : sequence of PlanElement
        With standard errors of their radii.
    progress : Progress
    """
    parts = np.flatnonzero(chain.extents[1] > chain.extents[0])
    of_part = [number for number, one in enumerate(elements) if one.type != "clothoid"]
    before = _chi_square(fit, points)
    poses = np.array([(one.x, one.y, one.heading) for one in fit.elements])
    for sigmas in SIGMAS:
        proposed = [round_radius(one, sigmas) for one in elements]
        radii = [(int(part), proposed[one]) for part, one in zip(parts, of_part)]
        held = {part: 1.0 / radius for part, radius in radii if radius}
        if not held:
            break
        try:
            rounded = fit_plan(chain, points, Held(held), progress, poses)
        except FitError:
            continue
        if _chi_square(rounded, points) - before <= MOST_RISE * len(held):
            return tuple(
                _with_round(one, radius, off_element(rounded, points, number)[0])
                for number, (one, radius) in enumerate(zip(elements, proposed))
            )
    return tuple(elements)


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
