"""Where both rails of a track are met on the normals of a guide line, and the middle between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import interpolate, length_along
from ..rails import RailLine

PIECE_M = 0.1
"""Pieces in which rails are searched; on a tram's curve of 25 m they deviate by 0.05 mm."""

ASTRAY_M = 0.2
"""Rails are looked for this far from where the guide expects them: it runs straight across gaps of 5 m in curves."""


@dataclass(frozen=True)
class Meeting:
    """Where normals meet the rails of one side, (n,) arrays.

    Attributes
    ----------
    distance_m, height_m : float
        How far the rail is and how high; NaN where there is none near the expected distance.
    rail : int
        Number of the rail that was met.
    t : float
        Plan chainage along it.
    matched : bool
        Whether it was matched there.
    """

    distance_m: np.ndarray
    height_m: np.ndarray
    rail: np.ndarray
    t: np.ndarray
    matched: np.ndarray

    @classmethod
    def joined(cls, parts: Sequence[Meeting]) -> Meeting:
        """Put meetings in a row."""
        return cls(*(np.concatenate(columns) for columns in zip(*(vars(part).values() for part in parts))))

    def without(self, which: np.ndarray) -> Meeting:
        """Forget the rails met from some stations, (n,) bool."""
        values = [np.where(which, np.nan, column) for column in (self.distance_m, self.height_m, self.t)]
        return Meeting(values[0], values[1], self.rail, values[2], self.matched)


@dataclass(frozen=True)
class Side:
    """The rails on one side of a track, in short pieces; piece k runs from point k to point k + 1 of one stretch.

    Attributes
    ----------
    xyz : (n, 3) array
    stretch : (n,) int array
        Number of the stretch that each point belongs to.
    rail : (n,) int array
    t : (n,) array
        Rail of each point, and plan chainage along it.
    matched : (n,) bool array
        Whether the point lies within the stretch, not in the margin.
    tree : cKDTree
        Of the points in plan.
    """

    xyz: np.ndarray
    stretch: np.ndarray
    rail: np.ndarray
    t: np.ndarray
    matched: np.ndarray
    tree: cKDTree

    @classmethod
    def of(cls, rails: Sequence[RailLine], spans: Sequence[tuple[int, tuple[float, float]]], margin_m: float) -> Side:
        """Cut the spans out of their rails, with a margin that shows a rail on while its partner is broken."""
        pieces, chainages, matched = [], [], []
        for number, span in spans:
            line = rails[number].xyz
            along = length_along(line[:, :2])
            start, end = max(min(span) - margin_m, 0.0), min(max(span) + margin_m, along[-1])
            chainages.append(np.linspace(start, end, int(np.ceil((end - start) / PIECE_M)) + 1))
            pieces.append(interpolate(line, along, chainages[-1]))
            matched.append((chainages[-1] >= min(span)) & (chainages[-1] <= max(span)))
        counts = [len(piece) for piece in pieces]
        rail = np.repeat([number for number, _ in spans], counts)
        stretch = np.repeat(np.arange(len(pieces)), counts)
        xyz, t, matched = (np.concatenate(parts) for parts in (pieces, chainages, matched))
        return cls(xyz, stretch, rail, t, matched, cKDTree(xyz[:, :2]))

    def meet(
        self, stations: np.ndarray, directions: np.ndarray, expected_m: float, astray_m: float = ASTRAY_M
    ) -> Meeting:
        """Go from stations in their directions, (n, 2) unit vectors, to the rail."""
        off, nearest = self.tree.query(stations + expected_m * directions, distance_upper_bound=astray_m)
        nearest = np.where(np.isfinite(off), nearest, 0)
        found = np.full((3, len(stations)), np.nan)
        for first in (nearest - 1, nearest):
            a, b = np.maximum(first, 0), np.minimum(first + 1, len(self.xyz) - 1)
            ahead_a, ahead_b = (self._ahead(point, stations, directions) for point in (a, b))
            passed = ahead_a - ahead_b
            share = np.divide(ahead_a, passed, out=np.full(len(passed), np.inf), where=passed != 0)
            # A rail is prolonged by a piece: two rails of a track hardly end abreast to the centimetre.
            met = np.isfinite(off) & (self.stretch[a] == self.stretch[b]) & (share >= -1) & (share <= 2)
            share = np.where(met, share, 0.0)
            point = self.xyz[a] + share[:, None] * (self.xyz[b] - self.xyz[a])
            distance = np.einsum("ij,ij->i", point[:, :2] - stations, directions)
            t = self.t[a] + share * (self.t[b] - self.t[a])
            found = np.where(met, [distance, point[:, 2], t], found)
        distance, height, t = found
        return Meeting(distance, height, self.rail[nearest], t, self.matched[nearest])

    def _ahead(self, point: np.ndarray, stations: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """How far points lie to the left of the way from the stations in their directions, (n,)."""
        step = self.xyz[point, :2] - stations
        return directions[:, 0] * step[:, 1] - directions[:, 1] * step[:, 0]


def at_gauge(left: Meeting, right: Meeting, spacing_m: float, tolerance_m: float) -> tuple[Meeting, Meeting]:
    """Believe in a rail beyond the stretch in which it was matched only where it keeps the distance to the other one.

    A stock rail that runs on into the branch soon leaves the through track.
    """
    astray = np.abs(left.distance_m + right.distance_m - spacing_m) > tolerance_m
    return left.without(astray & ~left.matched), right.without(astray & ~right.matched)


def midway(
    guide: np.ndarray,
    normals: np.ndarray,
    left: Meeting,
    right: Meeting,
    spacing_m: float,
) -> np.ndarray:
    """Find the middle between both rails at stations.

    Where one rail is missing, the other and half the usual spacing tell; where both are, the station is left out.

    Parameters
    ----------
    guide, normals : (n, 2) arrays
        Stations between the rails and unit vectors to the left.
    left, right : Meeting
    spacing_m : float
        Spacing to assume where no station meets both rails.

    Returns
    -------
    (k, 3) array
    """
    to_left, to_right = left.distance_m, right.distance_m
    both = to_left + to_right
    usual = np.nanmedian(both) if np.isfinite(both).any() else spacing_m
    shift = np.where(np.isnan(both), np.where(np.isnan(to_left), usual / 2 - to_right, to_left - usual / 2), 0.0)
    shift = np.where(np.isnan(both), shift, (to_left - to_right) / 2)
    known = ~np.isnan(shift)
    return np.column_stack([guide + shift[:, None] * normals, _heights(left.height_m, right.height_m)])[known]


def _heights(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Find the height midway between both rails, (n,); where one is missing, the other and the cant around tell."""
    half_cant = np.nan_to_num(_filled(left - right)) / 2
    return _filled(np.where(np.isnan(left), right + half_cant, left - half_cant))


def bridged_steps(rails: Sequence[RailLine], left: Meeting, right: Meeting, along: np.ndarray) -> np.ndarray:
    """Measure on how much of each step a rail has no points or is not there.

    Parameters
    ----------
    rails : sequence of RailLine
        The rails that the meetings number.
    left, right : Meeting
    along : (n,) array
        Chainage of the stations from which rails are met.

    Returns
    -------
    (n - 1,) array
        Metres between each two stations.
    """
    steps = np.diff(along)
    return np.maximum(_bridged_on(rails, left, steps), _bridged_on(rails, right, steps))


def _bridged_on(rails: Sequence[RailLine], side: Meeting, steps: np.ndarray) -> np.ndarray:
    """Measure the same on one side only."""
    before = np.full(len(side.t), np.nan)
    for number in np.unique(side.rail):
        mine = side.rail == number
        before[mine] = rails[number].bridged_before(side.t[mine])
    on_one = np.diff(side.rail) == 0
    bridged = np.where(on_one, np.minimum(np.abs(np.diff(before)), steps), 0.0)
    unmet = np.isnan(before)
    return np.where(unmet[1:] | unmet[:-1], 0.5 * steps * (unmet[1:] + unmet[:-1].astype(int)), bridged)


def _filled(values: np.ndarray) -> np.ndarray:
    """Interpolate what is missing from its neighbours; all NaN stays so."""
    known = np.flatnonzero(~np.isnan(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else values
