"""Vehicles: the one that carried the scanner, and trains on this track and on others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from .frame import Course

OWN_CELL_M, OWN_LENGTH_M, OWN_SHARE = 0.10, 50.0, 0.5
"""Cells across the track that are filled in more than this share of the metres of a section, and of such a length at
least, move along with the scanner."""

OWN_ASIDE_M, OWN_HEIGHT_M = 1.0, (0.3, 4.0)
"""Where such cells are of the own vehicle: nothing else stands there over such a length on a track on which trains
run."""

BOX_ASIDE_M, BOX_HEIGHT_M = 1.65, (0.3, 4.4)
"""The space of a vehicle on its track."""

LENGTH_M, TALL_M, SHARE = 6.0, 1.5, 0.6
"""A vehicle is longer and taller than this, and such a share of its points is in its space."""

INNER_M, INNER_SHARE = 1.0, 0.05
"""What is so near to the middle of a track is on it, and such a share of the points of a vehicle: roof and ends."""

NEAR_M = 3.0
"""How far from a track a point may be to be in the space of its vehicles."""


def own_vehicle(place: np.ndarray) -> np.ndarray:
    """Return which points of a section, (n, 3), are of the vehicle that carried the scanner."""
    s, v, w = place.T
    metre = np.floor(s).astype(np.int64)
    may = np.flatnonzero((np.abs(v) < OWN_ASIDE_M) & (w > OWN_HEIGHT_M[0]) & (w < OWN_HEIGHT_M[1]))
    filled, cell = np.unique(np.floor(place[may, 1:] / OWN_CELL_M), axis=0, return_inverse=True)
    both = np.unique(np.column_stack([cell.ravel(), metre[may]]), axis=0)
    least = OWN_SHARE * max(len(np.unique(metre)), OWN_LENGTH_M)
    is_own = np.bincount(both[:, 0], minlength=len(filled)) > least
    found = np.zeros(len(s), dtype=bool)
    found[may[is_own[cell.ravel()]]] = True
    return found


def spaces_of(place: np.ndarray, courses: Sequence[Course]) -> dict[int, np.ndarray]:
    """Return which points, (n, 3) in the frame of the first track, are where vehicles of each track stand, by id."""
    own, *others = courses
    found = {own.track_id: _is_within(place[:, 1], place[:, 2], INNER_M)}
    xyz = own.places(*place.T)
    for other in others:
        near, station = other.near(xyz[:, :2], NEAR_M)
        _, v, w = other.located(xyz[near], station)
        found[other.track_id] = np.zeros(len(place), dtype=bool)
        found[other.track_id][near] = _is_within(v, w, BOX_ASIDE_M)
    return found


def _is_within(v: np.ndarray, w: np.ndarray, aside_m: float) -> np.ndarray:
    return (np.abs(v) < aside_m) & (w > BOX_HEIGHT_M[0]) & (w < BOX_HEIGHT_M[1])


def vehicle_on(inside: Counter[int], count: int, track_id: int, length_m: float, height_m: float) -> int | None:
    """Return the track on which an object in the profile of a track is a vehicle; None if it is none.

    Given are its points in the spaces of vehicles, by track, and all of its points.
    """
    if length_m <= LENGTH_M or height_m <= TALL_M:
        return None
    if inside[track_id] >= INNER_SHARE * count:
        return track_id
    return next((number for number, own in inside.most_common() if number != track_id and own >= SHARE * count), None)
