"""What a stretch hands on: its rails, cut where they are no longer good."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..lines.polyline import resample
from ..rails import RailLine
from .squares import HALO_M, Stretch

STATION_M = 0.25
"""Spacing of the stations at which lines are cut and compared."""


@dataclass(frozen=True)
class StretchRails:
    """What one stretch gives.

    Attributes
    ----------
    stretch : Stretch
    rails : tuple of RailLine
        In its local metres, cut `HALO_M` outside its border; those with no length inside it are left out.
    nodes : (n, 2) array
        Places where rails end on each other.
    """

    stretch: Stretch
    rails: tuple[RailLine, ...]
    nodes: np.ndarray


def trim(rails: Sequence[RailLine], stretch: Stretch) -> StretchRails:
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
    return StretchRails(stretch, tuple(parts), unique[counts > 1])


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """First and last number of each run of marked items."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(first), int(after) - 1) for first, after in edges.reshape(-1, 2)]
