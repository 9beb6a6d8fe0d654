"""The points around the worst places of intrusions, for the cross-sections of the report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..clearance.intrusions import Intrusion
from ..clearance.measure import Clearance, read_points
from ..clearance.sweep import SECTION_M, part_of

PICTURES, SLICE_M, MOST_DRAWN = 20, 0.25, 4000
"""Number of cross-sections, half the length of their points along the track, and the most points of each."""


@dataclass(frozen=True)
class Slice:
    """The points around the worst place of an intrusion: v, w, and class, (n,) each; and the widening on both sides."""

    intrusion: Intrusion
    v: np.ndarray
    w: np.ndarray
    code: np.ndarray
    wide_m: tuple[float, float]


def slices(found: Clearance) -> Iterator[Slice]:
    """Yield the cross-sections of the worst places, while the points along the tracks are on disk."""
    for one in found.intrusions[:PICTURES]:
        course, section = found.courses[one.course], int(one.chainage_m // SECTION_M)
        files = found.swept.files_around(one.course, section)
        points = read_points(part_of(course, section), section, files, found.settings)
        near = np.flatnonzero(np.abs(points.place[:, 0] - one.chainage_m) <= SLICE_M)
        near = near[:: max(len(near) // MOST_DRAWN, 1)]
        left_m, right_m = course.wide_m[course.station(np.array([one.chainage_m]))][0].tolist()
        v, w = points.place[near, 1:].T
        yield Slice(one, v, w, points.code[near], (left_m, right_m))
