"""What the user is told about a result: what was left out, what is not seen, and where the tracks are too near."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..clearance.intrusions import VEHICLE_WORDS
from ..clearance.measure import UNSEEN_SHARE, Clearance
from ..clearance.sweep import SECTION_M
from ..polyline import runs
from ..progress import counted, metres

NEAR_END_M = 20.0
"""An intrusion so near to the end of a line may be entered by vehicles beyond it, which are not swept."""

TIGHTEST_M = 100.0
"""Radius of the last row of the tables of widening."""

CANTED_M = 0.02
"""Cant from which an unknown one keeps from judging."""


def cannot_be_judged(found: Clearance) -> list[str]:
    """Return why nothing can be judged; nothing if it can."""
    reasons = []
    canted = [one.track_id for one in found.courses if not one.has_cant and one.cant_sigma_m > CANTED_M]
    if canted:
        reasons.append(f"RAILS has no rails of canted tracks: {', '.join(map(str, canted))}.")
    total = sum(len(one.s) for one in found.stations)
    unseen = sum(int(found.unseen(one).sum()) for one in found.stations)
    if unseen > UNSEEN_SHARE * total:
        reasons.append(
            f"Too few points are within reach on {100 * unseen / total:.0f} % of the length: {_where(found)}."
        )
    return reasons


def _where(found: Clearance) -> str:
    """Return the sections without points in words, the first few."""
    sections = [
        f"track {one.course.track_id} {one.s[first]:,.0f} to {one.s[last]:,.0f} m"
        for one in found.stations
        for first, last in runs(found.unseen(one))
    ]
    more = f" and {len(sections) - MOST_NAMED} more" if len(sections) > MOST_NAMED else ""
    return ", ".join(sections[:MOST_NAMED]) + more


MOST_NAMED = 4
"""Sections that a sentence names."""


def remarks(found: Clearance) -> list[str]:
    """Return the sentences."""
    said = cannot_be_judged(found)
    for at in sorted({at for at, _ in found.vehicle}):
        start_m = SECTION_M * min(section for number, section in found.vehicle if number == at)
        track = found.courses[at].track_id
        said.append(f"The vehicle of the scanner was left out on track {track}, from {start_m:,.0f} m on.")
    for one in found.intrusions:
        if one.what.startswith(VEHICLE_WORDS.format("")):
            said.append(
                f"A {one.what} stands at {one.from_m:,.0f} to {one.to_m:,.0f} m of track {one.track_id}: behind the "
                "vehicle nothing is measured."
            )
    for course in found.courses:
        if (np.abs(course.curvature) * TIGHTEST_M > 1.0).any() and found.settings.widening != "NONE":
            said.append(
                f"Track {course.track_id} is tighter than {TIGHTEST_M:g} m: the last row of the table was used."
            )
    near = [one for one in found.sure if _to_end(found, one.course, one.chainage_m) < NEAR_END_M]
    if near:
        said.append(
            f"{counted(len(near), 'intrusion')} within {metres(NEAR_END_M)} of the end of a line: vehicles beyond are "
            "not swept."
        )
    return said


def step_remarks(found: Clearance, steps: Mapping[int, np.ndarray]) -> list[str]:
    """Return sentences on how far strips are apart, given chainages and millimetres, (n, 2), by track."""
    said = []
    for course in (one for one in found.courses if one.track_id in steps):
        own = steps[course.track_id]
        chainage_m, most_mm = own[np.argmax(own[:, 1])]
        deep = [one for one in found.sure if one.track_id == course.track_id]
        less = sum(one.pen_mm < np.interp(one.chainage_m, *own.T) for one in deep)
        shallow = f" {counted(less, 'place')} inside the profile: less deep than the strips are apart there."
        said.append(
            f"The strips of the survey are up to {most_mm:.1f} mm apart on track {course.track_id}, at "
            f"{chainage_m:,.0f} m; the standard errors do not hold this.{shallow if less else ''}"
        )
    return said


def _to_end(found: Clearance, course: int, chainage_m: float) -> float:
    """Return the distance of a place from the nearer end of its track."""
    return min(chainage_m, found.courses[course].length_m - chainage_m)
