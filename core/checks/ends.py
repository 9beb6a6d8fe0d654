"""Ends of tracks behind which rails may be missing: holes, and ends beside a track that goes on.

See docs/method.md section 9.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Polyline
from ..rails import Centerline

MAX_HOLE_M = 200.0
"""Longest section without any rail across which two tracks are recognized as one: longer ones may hide a switch."""

END_M = 20.0
"""Length of the end of a track that shows its direction, and whether it runs beside another track."""

MET_M = 1.0
"""Distance of another track up to which it meets an end."""

HOLE_RADIUS_M, HOLE_MISS_DEG = 150.0, 1.5
"""Smallest radius of a curve in a hole, and largest angle by which its chord may differ from the mean direction of the
two tracks, which it equals on an arc."""

BESIDE_M, SPREAD_M = 8.0, 1.0
"""Largest distance of the tracks of one line, and by how much it may change over `END_M`: a branch of 1:20 leaves its
track by as much."""

EARLY_M = 10.0
"""Least length by which a track ends early: clouds of two tracks that are `BESIDE_M` apart end at an angle across."""


@dataclass(frozen=True)
class Hole:
    """A section without rails between two tracks that are likely one; `ends`, (2, 3), are theirs in local metres."""

    first: int
    second: int
    length_m: float
    ends: np.ndarray


@dataclass(frozen=True)
class EarlyEnd:
    """An end of a track `apart_m` beside one that goes on for `length_m`; `xyz`, (n, 3), is where it would go on."""

    track_id: int
    beside: int
    apart_m: float
    length_m: float
    xyz: np.ndarray


@dataclass(frozen=True)
class End:
    """An end of a track that no other one meets.

    `outward`, (2,), is the unit vector out of the track at `xyz`, (3,), and `inside`, (2,), a place `END_M` before it,
    or the other end. The lines `around` it may be as near as `BESIDE_M`.
    """

    track_id: int
    xyz: np.ndarray
    outward: np.ndarray
    inside: np.ndarray
    around: Sequence[Centerline]

    @classmethod
    def of(cls, track_id: int, xyz: np.ndarray, around: Sequence[Centerline]) -> End:
        """Describe the first end of a track, (n, 3).

        An arc through it, and places in the middle and at the end of `END_M`, has its direction at the end itself.
        """
        line = Polyline(xyz[:, :2])
        reach_m = min(END_M, line.length_m)
        near, far = line.at(np.array([reach_m / 2, reach_m]))
        outward = 3 * xyz[0, :2] - 4 * near + far
        return cls(track_id, xyz[0], outward / np.hypot(*outward), far, around)


def ends_of(lines: Sequence[Centerline]) -> Iterator[End]:
    """Find the ends that no other track meets; closed tracks have none."""
    boxes = np.array([[line.xyz[:, :2].min(axis=0), line.xyz[:, :2].max(axis=0)] for line in lines])
    for number, line in enumerate(lines):
        for end in () if line.line.is_closed else (line.xyz, line.xyz[::-1]):
            near = ((boxes[:, 0] <= end[0, :2] + BESIDE_M) & (boxes[:, 1] >= end[0, :2] - BESIDE_M)).all(axis=1)
            around = [lines[other] for other in np.flatnonzero(near).tolist() if other != number]
            if not any(len(other.line.feet(end[:1, :2], MET_M).t) for other in around):
                yield End.of(line.track_id, end, around)


def find_holes(ends: Sequence[End]) -> Iterator[Hole]:
    """Find ends that lead to each other on an arc, the nearest first; each end leads to one other."""
    found = []
    for number, one in enumerate(ends):
        for before, other in enumerate(ends[:number]):
            way = (other.xyz - one.xyz)[:2]
            length_m = float(np.hypot(*way))
            if one.track_id == other.track_id or not 0 < length_m <= MAX_HOLE_M:
                continue
            leaving, arriving = _angle(one.outward, way), _angle(way, -other.outward)
            bend = length_m / HOLE_RADIUS_M
            if abs(leaving - arriving) / 2 <= np.radians(HOLE_MISS_DEG) and abs(leaving + arriving) <= bend:
                found.append((length_m, number, before))
    used: set[int] = set()
    for length_m, *both in sorted(found):
        if used.isdisjoint(both):
            used.update(both)
            first, second = sorted((ends[number] for number in both), key=lambda end: end.track_id)
            yield Hole(first.track_id, second.track_id, length_m, np.stack([first.xyz, second.xyz]))


def find_early_ends(ends: Sequence[End], holes: Sequence[Hole]) -> Iterator[EarlyEnd]:
    """Find ends that are abreast of the middle of the nearest track beside them; those at a hole are known."""
    known = {tuple(place) for hole in holes for place in hole.ends}
    for end in ends:
        beside = filter(None, (_beside(end, line) for line in end.around))
        near = min(beside, key=lambda one: one.apart_m, default=None)
        if near is not None and near.length_m >= EARLY_M and tuple(end.xyz) not in known:
            yield near


def _beside(end: End, line: Centerline) -> EarlyEnd | None:
    """Return how a track goes on beside another one; None if its last `END_M` do not run beside it."""
    places, way = np.stack([end.xyz[:2], end.inside]), line.line
    (at_m, from_m), (left_m, before_m) = way.feet_of(places)
    if not (abs(left_m) <= BESIDE_M and abs(left_m - before_m) <= SPREAD_M):
        return None
    ahead = at_m >= from_m
    length_m = way.length_m - at_m if ahead else at_m
    shown_m = min(length_m, MAX_HOLE_M)
    part = way.part(at_m, at_m + shown_m) if ahead else way.part(at_m - shown_m, at_m)
    xyz = np.column_stack([part.xy + left_m * part.normals, part.xyz[:, 2]])
    return EarlyEnd(end.track_id, line.track_id, abs(left_m), length_m, xyz)


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle from one direction to another, radians, positive to the left."""
    return float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))
