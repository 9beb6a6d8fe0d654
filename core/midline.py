"""Where both rails of a track are met on the normals of a guide line, and the middle between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .polyline import interpolate
from .rails import RailLine, length_along

PIECE_M = 0.1
"""Pieces in which rails are searched; on a tram's curve of 25 m they deviate by 0.05 mm."""

ASTRAY_M = 0.2
"""Rails are looked for this far from where the guide expects them: it runs straight across gaps of 5 m in curves."""


@dataclass(frozen=True)
class Side:
    """The rails on one side of a track, in short pieces; piece k runs from point k to point k + 1 of one rail."""

    xyz: np.ndarray
    rail: np.ndarray

    @classmethod
    def of(cls, rails: Sequence[RailLine], spans: Sequence[tuple[int, tuple[float, float]]], margin_m: float) -> Side:
        """Cut the spans out of their rails, with a margin that shows a rail on while its partner is broken."""
        pieces = []
        for number, span in spans:
            line = rails[number].xyz
            along = length_along(line[:, :2])
            start, end = max(min(span) - margin_m, 0.0), min(max(span) + margin_m, along[-1])
            t = np.linspace(start, end, int(np.ceil((end - start) / PIECE_M)) + 1)
            pieces.append(interpolate(line, along, t))
        return cls(np.concatenate(pieces), np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces]))

    def meet(self, stations: np.ndarray, directions: np.ndarray, expected_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Go from stations in their directions, (n, 2) unit vectors, to the rail.

        Returns
        -------
        distance, height : (n,) arrays
            How far the rail is and how high; NaN where there is none near the expected distance.
        """
        tree = cKDTree(self.xyz[:, :2])
        off, nearest = tree.query(stations + expected_m * directions, distance_upper_bound=ASTRAY_M)
        nearest = np.where(np.isfinite(off), nearest, 0)
        found = np.full((2, len(stations)), np.nan)
        for first in (nearest - 1, nearest):
            a, b = np.maximum(first, 0), np.minimum(first + 1, len(self.xyz) - 1)
            ahead_a, ahead_b = (self._ahead(point, stations, directions) for point in (a, b))
            passed = ahead_a - ahead_b
            share = np.divide(ahead_a, passed, out=np.full(len(passed), np.inf), where=passed != 0)
            # A rail is prolonged by a piece: two rails of a track hardly end abreast to the centimetre.
            met = np.isfinite(off) & (self.rail[a] == self.rail[b]) & (share >= -1) & (share <= 2)
            point = self.xyz[a] + np.where(met, share, 0.0)[:, None] * (self.xyz[b] - self.xyz[a])
            distance = np.einsum("ij,ij->i", point[:, :2] - stations, directions)
            found = np.where(met, [distance, point[:, 2]], found)
        return found[0], found[1]

    def _ahead(self, point: np.ndarray, stations: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """How far points lie to the left of the way from the stations in their directions, (n,)."""
        step = self.xyz[point, :2] - stations
        return directions[:, 0] * step[:, 1] - directions[:, 1] * step[:, 0]


def midway(
    guide: np.ndarray,
    normals: np.ndarray,
    left: tuple[np.ndarray, np.ndarray],
    right: tuple[np.ndarray, np.ndarray],
    spacing_m: float,
) -> np.ndarray:
    """Find the middle between both rails at stations.

    Where one rail is missing, the other and half the usual spacing tell; where both are, the station is left out.

    Parameters
    ----------
    guide, normals : (n, 2) arrays
        Stations between the rails and unit vectors to the left.
    left, right : tuple of (n,) arrays
        Distance and height of the rails, as `Side.meet` gives them.
    spacing_m : float
        Spacing to assume where no station meets both rails.

    Returns
    -------
    (k, 3) array
    """
    (to_left, left_z), (to_right, right_z) = left, right
    both = to_left + to_right
    usual = np.nanmedian(both) if np.isfinite(both).any() else spacing_m
    shift = np.where(np.isnan(both), np.where(np.isnan(to_left), usual / 2 - to_right, to_left - usual / 2), 0.0)
    shift = np.where(np.isnan(both), shift, (to_left - to_right) / 2)
    known = ~np.isnan(shift)
    z = (_filled(left_z) + _filled(right_z)) / 2
    return np.column_stack([guide + shift[:, None] * normals, z])[known]


def _filled(values: np.ndarray) -> np.ndarray:
    """Interpolate what is missing from its neighbours; all NaN stays so."""
    known = np.flatnonzero(~np.isnan(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else values
