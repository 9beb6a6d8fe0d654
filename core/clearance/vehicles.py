"""Vehicles: the one that carried the scanner, and trains on this track and on others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from .frame import Cells, Course

OWN_CELL_M, OWN_LENGTH_M, OWN_SHARE = 0.10, 50.0, 0.5
"""Cells across the track that are filled in more than this share of the metres of a section, and of such a length at
least, move along with the scanner."""

OWN_ASIDE_M, OWN_HEIGHT_M = 1.0, (0.3, 4.0)
"""Where such cells are of the own vehicle: nothing else stands there over such a length on a track on which trains
run."""

BOX_ASIDE_M, BOX_HEIGHT_M = 1.65, (0.3, 4.4)
"""The space of a vehicle on its track."""

INNER_M = 1.0
"""What is so near to the middle of a track is on it."""

LENGTH_M, TALL_M, SHARE = 6.0, 1.5, 0.6
"""A vehicle is longer and taller than this, and such a share of its points is in its space."""

INNER_SHARE = 0.05
"""Share of the points of a vehicle on its own track that are near to the middle: its roof and its ends."""

LOOKED_AT = 2000
"""Points of an object that are looked at: more tell a share no better."""

NEAR_M = 3.0
"""How far from a track a point may be to be in the space of its vehicles."""

ALL = -1
"""Number that stands for all points that were looked at."""


def own_vehicle(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which points of a section, (n, 3), are of the vehicle that carried the scanner, and v and w of its cells.

    The cells are (k, 2).
    """
    s, v, w = place.T
    metre = np.floor(s).astype(np.int64)
    may = np.flatnonzero((np.abs(v) < OWN_ASIDE_M) & (w > OWN_HEIGHT_M[0]) & (w < OWN_HEIGHT_M[1]))
    filled, cell = np.unique(np.floor(place[may, 1:] / OWN_CELL_M), axis=0, return_inverse=True)
    both = np.unique(np.column_stack([cell.ravel(), metre[may]]), axis=0)
    least = OWN_SHARE * max(len(np.unique(metre)), OWN_LENGTH_M)
    is_own = np.bincount(both[:, 0], minlength=len(filled)) > least
    found = np.zeros(len(s), dtype=bool)
    found[may[is_own[cell.ravel()]]] = True
    return found, (filled[is_own] + 0.5) * OWN_CELL_M


def in_boxes(place: np.ndarray, courses: Sequence[Course]) -> Counter[int]:
    """Count the points, (n, 3) in the frame of the first track, in the spaces of vehicles, by track; see `ALL`."""
    some = place[:: max(len(place) // LOOKED_AT, 1)]
    own, *others = courses
    inner = (np.abs(some[:, 1]) < INNER_M) & (some[:, 2] > BOX_HEIGHT_M[0]) & (some[:, 2] < BOX_HEIGHT_M[1])
    found = Counter({ALL: len(some), own.track_id: int(inner.sum())})
    xyz = own.places(*some.T)
    for other in others:
        near, station = Cells.around(other, NEAR_M).find(xyz[:, :2])
        _, v, w = other.located(xyz[near], station)
        inside = (np.abs(v) < BOX_ASIDE_M) & (w > BOX_HEIGHT_M[0]) & (w < BOX_HEIGHT_M[1])
        found[other.track_id] += int(inside.sum())
    return found


def vehicle_on(boxes: Counter[int], track_id: int, length_m: float, height_m: float) -> int | None:
    """Return the track on which an object of the profile of a track is a vehicle; None if it is none."""
    if length_m <= LENGTH_M or height_m <= TALL_M:
        return None
    looked = max(boxes[ALL], 1)
    if boxes[track_id] >= INNER_SHARE * looked:
        return track_id
    others = {number: count for number, count in boxes.items() if number not in (ALL, track_id)}
    best = max(others, key=lambda number: others[number], default=None)
    return best if best is not None and others[best] >= SHARE * looked else None
