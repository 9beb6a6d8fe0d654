"""Designs in files: what a file states besides alignments, and what alignments must be to be read or written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import count
from typing import Optional, TypeVar

import numpy as np

from ..alignment.elements import CONTINUED_M, Alignment, CantElement, Element, PlanElement, VerticalElement
from ..design_numbers import GRADE, LENGTH, NUMBER, check_turn, checked
from ..errors import ParameterError
from ..progress import SILENT, Progress

BREAK_M = 0.001
"""Largest distance between the end of an element and the start of the next, metres: the last decimal of the element
table is a tenth of it, and design software takes a larger one for a break."""

SAME_BEND = 1e-9
"""Difference of two curvatures in 1/m, or of two gradients, that is none: rounding makes it of a straight end."""

PROGRAM = "Rail Extract"


@dataclass(frozen=True)
class Delivery:
    """What a file states besides the alignments; texts are empty and the EPSG code is None where unknown.

    The gauge is measured between the inner faces of the rails; cant, between the middles of heads of `head_width_m`.
    `system` and `heights` are the names of the coordinate system and of the system of heights, `version` is that of
    this program.
    """

    gauge_m: float
    head_width_m: float
    epsg: Optional[int] = None
    system: str = ""
    heights: str = ""
    version: str = ""
    made: datetime = field(default_factory=datetime.now)


def names(alignments: Sequence[Alignment]) -> list[str]:
    """Return a name for each alignment; no two are the same.

    >>> from ..frame import LocalFrame
    >>> names([Alignment(3, LocalFrame(np.zeros(3)), ()), Alignment(None, LocalFrame(np.zeros(3)), ())])
    ['Track 3', 'Track']
    """
    made: dict[str, None] = {}
    following: dict[str, Iterator[int]] = {}
    for one in alignments:
        base = one.name or ("Track" if one.track_id is None else f"Track {one.track_id}")
        more = (f"{base} ({number})" for number in following.setdefault(base, count(2)))
        made[base if base not in made else next(name for name in more if name not in made)] = None
    return list(made)


def check_joined(alignment: Alignment, progress: Progress = SILENT) -> None:
    """Check that each element of an alignment begins where the one before it ends, in plan, in height and in `s`."""
    layouts: tuple[Sequence[Element], ...] = alignment.plan, alignment.vertical, alignment.cant
    for elements in layouts:
        for number, (one, after) in enumerate(zip(elements, elements[1:]), start=1):
            progress.check()
            gap_m = _gap_m(alignment, one, after)
            if gap_m > BREAK_M:
                raise ParameterError(
                    f"Element {number} in layout {one.layout} of track {alignment.track_id} ends {gap_m:.3f} m from "
                    f"the start of element {number + 1}: run Fit alignment with the edited table as FIXED, which joins "
                    "them."
                )


def _gap_m(alignment: Alignment, one: Element, after: Element) -> float:
    """Return the distance between the end of an element and the start of the next."""
    along, end = abs(after.s_from - one.s_to), np.array([one.s_to])
    if isinstance(one, PlanElement) and isinstance(after, PlanElement):
        place = replace(alignment, plan=(one,)).places(end)[0]
        return max(along, float(np.hypot(*(place - (after.x, after.y)))))
    if isinstance(one, VerticalElement) and isinstance(after, VerticalElement):
        return max(along, abs(float(replace(alignment, vertical=(one,)).heights(end)[0]) - after.z))
    return along


Bent = TypeVar("Bent", VerticalElement, CantElement)


def within_plan(alignment: Alignment, where: str, progress: Progress, start_m: float = 0.0) -> Alignment:
    """Return an alignment of which profile and cant end with its plan, after a check of all its numbers.

    The user is told where profile or cant and the plan do not cover each other, by stations from `start_m` at `s` = 0.
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
