"""What a file for design software states besides the alignments, and what the alignments must be for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import count
from typing import Optional

import numpy as np

from ..errors import ParameterError
from ..progress import SILENT, Progress
from .elements import Alignment, Element, PlanElement, VerticalElement

MAX_GAP_M = 0.001
"""Largest distance between the end of an element and the start of the next, metres: the last decimal of the element
table is a tenth of it, and design software takes a larger one for a break."""

PROGRAM = "Rail Extract"


@dataclass(frozen=True)
class Delivery:
    """What a file states besides the alignments.

    Attributes
    ----------
    gauge_m, head_width_m : float
        Between the inner faces of the rails, and of a railhead: cant is measured between the middles of the heads.
    epsg : int or None
        Code of the coordinate system in plan; None if it has none.
    system : str
        Name of the coordinate system; empty if it is unknown.
    heights : str
        Name of the system of heights; empty if it is unknown.
    version : str
        Of this program.
    made : datetime
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
    """Check that each element of an alignment begins where the one before it ends.

    Raises
    ------
    ParameterError
        There is a gap in plan, in height or along the curve.
    """
    layouts: tuple[Sequence[Element], ...] = alignment.plan, alignment.vertical, alignment.cant
    for elements in layouts:
        for number, (one, after) in enumerate(zip(elements, elements[1:]), start=1):
            progress.check()
            gap_m = _gap_m(alignment, one, after)
            if gap_m > MAX_GAP_M:
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
