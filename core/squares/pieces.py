"""What a stretch hands on: its rails, cut where they are no longer good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import resample, runs
from ..rails import RailLine
from .grid import HALO_M, Square

STATION_M = 0.25
"""Spacing of the stations at which lines are cut and compared."""


@dataclass(frozen=True)
class SquareRails:
    """What one stretch gives.

    Attributes
    ----------
    stretch : Square
    rails : tuple of RailLine
        In its local metres, cut `HALO_M` outside its border; those with no length inside it are left out.
    nodes : (n, 2) array
        Places where rails end on each other.
    """

    stretch: Square
    rails: tuple[RailLine, ...]
    nodes: np.ndarray


def trim(rails: Sequence[RailLine], stretch: Square) -> SquareRails:
    """Cut the lines of a stretch where they are no longer good."""
    parts: list[RailLine] = []
    for rail in rails:
        stations, t = resample(rail.xyz[:, :2], STATION_M)
        inside = stretch.holds(stations, HALO_M)
        if inside.all():
            found = [(rail, stretch.holds(stations))]
        else:
            found = [
                (rail.between(t[first], t[last]), stretch.holds(stations[first : last + 1]))
                for first, last in runs(inside)
                if last > first
            ]
        parts += [part for part, own in found if own.any()]
    places = np.concatenate([rail.xyz[:, :2] for rail in rails]) if rails else np.empty((0, 2))
    unique, counts = np.unique(places, axis=0, return_counts=True)
    return SquareRails(stretch, tuple(parts), unique[counts > 1])
