"""The extent of an alignment: its profile and cant lie on its plan, and its numbers are those of a railway."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..design_numbers import GRADE, LENGTH, NUMBER, check_turn, checked
from ..progress import Progress
from .elements import CONTINUED_M, Alignment, CantElement, Element, VerticalElement

Bent = TypeVar("Bent", VerticalElement, CantElement)


def within_plan(alignment: Alignment, where: str, progress: Progress, start_m: float = 0.0) -> Alignment:
    """Return an alignment of which profile and cant end with its plan, after a check of all its numbers.

    Parameters
    ----------
    alignment : Alignment
    where : str
        Names it in messages.
    progress : Progress
        Takes a warning where profile or cant and the plan do not cover each other.
    start_m : float
        Station of `s` = 0, which the warning counts from.

    Raises
    ------
    DesignNumberError
        An element, or the whole, is longer, steeper or farther away than anything on a railway.
    """
    checked(alignment.s_to - alignment.s_from, LENGTH, where[0].upper() + where[1:], "length")
    layouts: tuple[Sequence[Element], ...] = (alignment.plan, alignment.vertical, alignment.cant)
    for elements in layouts:
        for number, one in enumerate(elements, start=1):
            progress.check()
            _check(one, f"The element {number} of layout {one.layout} of {where}")
    vertical = _cut(alignment, alignment.vertical, f"profile of {where}", start_m, progress)
    cant = _cut(alignment, alignment.cant, f"cant of {where}", start_m, progress)
    return replace(alignment, vertical=vertical, cant=cant)


def _check(one: Element, where: str) -> None:
    """Check the numbers of an element; cants are checked as they are read."""
    checked(one.length_m, LENGTH, where, "length")
    checked(one.s_from, NUMBER, where, "s_from")
    if isinstance(one, VerticalElement):
        checked(one.z, NUMBER, where, "height")
        for grade in (one.grade_from, one.grade_to):
            checked(grade, GRADE, where, "gradient")
    elif not isinstance(one, CantElement):
        checked(max(abs(one.x), abs(one.y)), NUMBER, where, "coordinate")
        check_turn(one.length_m, one.k_from, one.k_to, where)


def _cut(
    alignment: Alignment, elements: Sequence[Bent], where: str, start_m: float, progress: Progress
) -> tuple[Bent, ...]:
    """Return elements without what lies beyond the plan, and warn where either ends before the other."""
    if not elements:
        return ()
    ends = (elements[0].s_from, elements[-1].s_to, alignment.s_from, alignment.s_to)
    if np.allclose(ends[:2], ends[2:], rtol=0.0, atol=CONTINUED_M):
        return tuple(elements)
    kept = tuple(part for one in elements for part in _between(one, ends[2], ends[3]))
    first, last, start, end = (start_m + s for s in ends)
    what = "it is used only where it is on the plan, and unknown elsewhere" if kept else "it is left out"
    progress.warning(
        f"The {where} reaches from {first:.2f} m to {last:.2f} m, and the plan from {start:.2f} m to {end:.2f} m: "
        f"{what}. Check the stations."
    )
    return kept


def _between(one: Bent, first: float, last: float) -> list[Bent]:
    """Return the part of an element between two places, if there is one."""
    start, end = max(one.s_from, first), min(one.s_to, last)
    if end <= start:
        return []
    return [one if (start, end) == (one.s_from, one.s_to) else one.part(start, end)]
