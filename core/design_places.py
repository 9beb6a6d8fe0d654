"""Where what a design is placed by may be: axes, posts, places, guides, masks and seeds on a map."""

from __future__ import annotations

import numpy as np

from .design_numbers import LENGTH, MAX_PLACE_M, NUMBER, checked
from .errors import DesignNumberError
from .polyline import Polyline

MAX_SEGMENT_M = 100_000.0
"""A longer straight segment of a measured line or a guide has a stray vertex: in the plane of a map, a railway that is
straight on the ground bows by metres over this length."""

MAX_SPIKE_M = 10_000.0
"""A longer straight segment from which the line turns back has a stray vertex."""


def check_places(xy: np.ndarray, where: str, unit_m: float = 1.0) -> np.ndarray:
    """Return places, (n, 2), in units of `unit_m` metres, if all are on the map; messages name `where` they stand."""
    wrong = xy[~are_places(xy, unit_m)]
    for value in wrong.ravel() if len(wrong) else ():
        checked(float(value) * unit_m, NUMBER, where, "coordinate")
    return xy


def are_places(xy: np.ndarray, unit_m: float = 1.0) -> np.ndarray:
    """Return which places, (n, 2) in units of `unit_m` metres, are on the map, (n,) bool."""
    return (np.abs(xy) <= MAX_PLACE_M / unit_m).all(axis=1)


def check_line(xy: np.ndarray, where: str, unit_m: float = 1.0) -> np.ndarray:
    """Return the vertices of a guide, (n, 2) in units of `unit_m` metres, if they are on the map and none is stray."""
    check_places(xy, where, unit_m)
    checked(Polyline(xy).length_m * unit_m, LENGTH, where, "length")
    if has_stray(xy * unit_m):
        raise DesignNumberError(f"{where} has a stray vertex: repair or delete it.")
    return xy


def has_stray(xy: np.ndarray) -> bool:
    """Return whether a line, (n, 2) metres in plan, has a vertex that is a mistake: too far from the others."""
    steps = np.diff(xy, axis=0)
    lengths_m = np.hypot(*steps.T)
    turns_back = np.einsum("ij,ij->i", steps[:-1], steps[1:]) < 0
    spikes_m = np.maximum(lengths_m[:-1], lengths_m[1:])[turns_back]
    return bool(lengths_m.max() > MAX_SEGMENT_M or spikes_m.max(initial=0.0) > MAX_SPIKE_M)
