"""Values that are known at some chainages of a track: between these, and where they break."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..polyline import distance_to, interpolate


def known_at(at: np.ndarray, s: np.ndarray, values: np.ndarray, reach_m: float) -> np.ndarray:
    """Interpolate values, (n, d), at rising chainages s; returns (m, d), NaN beyond reach of the nearest of these."""
    if not len(s):
        return np.full((len(at), values.shape[1]), np.nan)
    return np.where((distance_to(s, at) <= reach_m)[:, None], interpolate(values, s, at), np.nan)


def pieces(s: np.ndarray, values: np.ndarray, steps: Sequence[float], hole_m: float) -> list[np.ndarray]:
    """Return the numbers of the places of each piece: within it no value, (n, d), changes by its step, nor s by a hole.

    >>> [one.tolist() for one in pieces(np.array([0, 1, 2, 9]), np.array([[0], [0], [5], [5]]), (1,), 3)]
    [[0, 1], [2], [3]]
    """
    breaks = (np.abs(np.diff(values, axis=0)) > steps).any(axis=1) | (np.diff(s) > hole_m)
    return np.split(np.arange(len(s)), np.flatnonzero(breaks) + 1) if len(s) else []
