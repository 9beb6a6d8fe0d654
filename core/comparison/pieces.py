"""Lines cut into short pieces: the nearest place on any of them, and gauge and cant between two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import length_along

STEP_M = 0.05
"""Length of the pieces that are compared; a chord of this length deviates from an arc of 25 m by 0.01 mm."""

CANDIDATES = 4
"""Number of nearest pieces to search: near a place there may be two pieces of a line and a second line."""

ASTRAY_M = 0.10
"""Distance from its expected place, relative to the track, at which a line is not the rail of the track."""


@dataclass(frozen=True)
class Pieces:
    """Short straight pieces of polylines.

    Attributes
    ----------
    start, end : (n, 3) array
        Metres.
    number : (n,) int array
        Number of the line of each piece.
    t : (n,) array
        Plan distance of the middle of each piece from the start of its line.
    """

    start: np.ndarray
    end: np.ndarray
    number: np.ndarray
    t: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Points midway between the ends, (n, 3)."""
        return 0.5 * (self.start + self.end)

    @cached_property
    def tree(self) -> cKDTree:
        """Middles in plan, for searches."""
        return cKDTree(self.middle[:, :2])

    @property
    def left(self) -> np.ndarray:
        """Unit vectors to the left in plan, (n, 2)."""
        along = (self.end - self.start)[:, :2]
        return np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)

    @property
    def lengths(self) -> np.ndarray:
        """Lengths in space, (n,)."""
        return np.linalg.norm(self.end - self.start, axis=1)


def cut(lines: Sequence[np.ndarray]) -> Pieces:
    """Cut polylines into pieces of equal length, at most `STEP_M`."""
    starts, ends, middles, counts = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0)], []
    for line in lines:
        chainage = length_along(np.asarray(line)[:, :2])
        count = int(np.ceil(chainage[-1] / STEP_M))
        at = np.linspace(0, chainage[-1], count + 1)
        places = np.column_stack([np.interp(at, chainage, column) for column in np.asarray(line, dtype=float).T])
        starts.append(places[:-1])
        ends.append(places[1:])
        middles.append(0.5 * (at[:-1] + at[1:]))
        counts.append(count)
    numbers = np.repeat(np.arange(len(lines)), counts)
    return Pieces(np.concatenate(starts), np.concatenate(ends), numbers, np.concatenate(middles))


def nearest(places: np.ndarray, pieces: Pieces) -> tuple[np.ndarray, np.ndarray]:
    """Find the nearest point on any piece, in plan.

    Parameters
    ----------
    places : (n, 3) array
    pieces : Pieces

    Returns
    -------
    feet : (n, 3) array
        Points on the pieces.
    numbers : (n,) int array
        Piece of each point.
    """
    count = min(CANDIDATES, len(pieces.start))
    _, candidates = pieces.tree.query(places[:, :2], k=np.arange(1, count + 1))
    start = pieces.start[candidates]
    step = pieces.end[candidates] - start
    ahead = np.sum((places[:, None, :2] - start[..., :2]) * step[..., :2], axis=2)
    share = np.clip(ahead / np.sum(step[..., :2] ** 2, axis=2), 0, 1)
    feet = start + share[..., None] * step
    distance = np.linalg.norm(feet[..., :2] - places[:, None, :2], axis=2)
    rows, best = np.arange(len(places)), np.argmin(distance, axis=1)
    return feet[rows, best], candidates[rows, best]


def spacing_and_cant(left: np.ndarray, right: np.ndarray, pieces: Pieces) -> np.ndarray:
    """Measure the distance in space of the two rails of a track, and the height of the left one above the right one.

    Parameters
    ----------
    left, right : (n, 2) array
        Where the two rails are expected, metres.
    pieces : Pieces
        Of all rails.

    Returns
    -------
    (n, 2) array
        Metres; NaN where a rail is missing.
    """
    sides = []
    for place in (left, right):
        feet, _ = nearest(np.column_stack([place, np.zeros(len(place))]), pieces)
        astray = ~(np.linalg.norm(feet[:, :2] - place, axis=1) <= ASTRAY_M)
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    plan = np.hypot(step[:, 0], step[:, 1])
    return np.column_stack([np.hypot(plan, np.nan_to_num(step[:, 2])), step[:, 2]])
