"""A corrected element table as the structure of a fit: types are held, and the radii and ends that were edited."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np

from ..errors import ParameterError
from ..frame import LocalFrame
from .chain import Chain, Span, assembled
from .elements import Alignment, Element, Figures, PlanElement
from .plane_fit import NOTHING, Held
from .signals import Signal

EDITED_R, EDITED_M = 1e-6, 0.0005
"""A radius (as a share) and an end (metres) were edited if they differ by more from what the fit has noted."""

TOUCHING_M = 0.01
"""Elements whose ends differ by less touch, metres."""


@dataclass(frozen=True)
class Given:
    """The structure in plan that a table states.

    Attributes
    ----------
    chain : Chain
    held : Held
    poses : (e, 3) array, optional
        Place and direction at the start of each element; else they are those of the line.
    """

    chain: Chain
    held: Held = NOTHING
    poses: Optional[np.ndarray] = None


def given_of(fixed: Alignment, length_m: float) -> Given:
    """Return the structure of the elements in plan.

    Parameters
    ----------
    fixed : Alignment
    length_m : float
        Length of the measured line; the table's first and last element are continued to its ends.
    """
    plan = list(fixed.plan)
    joints = [_joint(before, after) for before, after in zip(plan[:-1], plan[1:])]
    if plan[0].s_to <= 0.0 or (joints and joints[-1] >= length_m):
        raise ParameterError(
            f"The elements of track {fixed.track_id} in FIXED end at {plan[-1].s_to:.0f} m, but its line is "
            f"{length_m:.0f} m long: give the table of this line."
        )
    bounds = [0.0, *joints, length_m]
    spans = [
        Span(start, end, one.type == "clothoid", one.type == "arc", one.k_to, one.k_from)
        for one, start, end in zip(plan, bounds[:-1], bounds[1:])
    ]
    chain = assembled(spans, 2)
    arcs = [one for one in plan if one.type != "clothoid"]
    numbers = np.flatnonzero(chain.extents[1] > chain.extents[0])
    held = {int(number): one.k_from for number, one in zip(numbers, arcs) if _has_edited_radius(one)}
    starts = {number + 1: joint for number, joint in enumerate(joints) if _is_edited(plan[number + 1])}
    poses = [_pose(fixed, one, start) for one, start in zip(plan, bounds)]
    return Given(chain, Held(held, starts), np.array(poses))


def without(elements: Sequence[PlanElement], number: int, length_m: float) -> Given:
    """Return the structure of fitted elements of which one is closed by its neighbours.

    Parameters
    ----------
    elements : sequence of PlanElement
    number : int
        Of the one that goes.
    length_m : float
        Length of the measured line.
    """
    rest = [noted(one) for at, one in enumerate(elements) if at != number]
    return given_of(Alignment(None, LocalFrame(np.zeros(3)), tuple(rest)), length_m)


def noted(one: PlanElement, **figures: Any) -> PlanElement:
    """Return a fitted element with its figures, which note radius and start so that an edit shows."""
    radius = 1.0 / one.k_from if one.type == "arc" else None
    return replace(one, figures=Figures(r_fit_m=radius, s_fit_m=one.s_from, **figures))


def _pose(fixed: Alignment, one: PlanElement, start: float) -> tuple[float, float, float]:
    """Return place and direction of an element that is continued to a start."""
    alone, s = replace(fixed, plan=(one,)), np.array([start])
    (x, y), heading = alone.places(s)[0], alone.headings(s)[0]
    return float(x), float(y), float(heading)


def _joint(before: PlanElement, after: PlanElement) -> float:
    """Return where two elements meet: midway if the row between them is missing."""
    if abs(before.s_to - after.s_from) < TOUCHING_M or _is_edited(after):
        return after.s_from
    return 0.5 * (before.s_to + after.s_from)


def _is_edited(one: PlanElement) -> bool:
    """Return whether the start of an element was edited."""
    return one.figures.s_fit_m is not None and abs(one.s_from - one.figures.s_fit_m) > EDITED_M


def _has_edited_radius(one: PlanElement) -> bool:
    """Return whether the radius of an arc was edited, or stands in a table that no fit made."""
    if one.type != "arc":
        return False
    return one.figures.r_fit_m is None or abs(one.figures.r_fit_m * one.k_from - 1.0) > EDITED_R


def chain_of(shape: Sequence[Element], curved: Sequence[bool], signal: Signal) -> Chain:
    """Return the chain of elements in height or of cant, with first values from their ends."""
    first, last = float(signal.s[0]), float(signal.s[-1])
    inside = [number for number, one in enumerate(shape) if number and first < one.s_from < last]
    starts = [first, *(shape[number].s_from for number in inside)]
    flags = [curved[max(inside[0] - 1, 0)] if inside else curved[0], *(curved[number] for number in inside)]
    spans = [Span(start, end, False, flag) for start, end, flag in zip(starts, [*starts[1:], last], flags)]
    return assembled(spans, signal.kind.order)
