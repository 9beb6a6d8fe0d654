"""From single finds to lines: finds that continue each other, with the same direction or along an arc, are chained."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from .search import Finds

AHEAD_M, LEAST_AHEAD_M = 60.0, 6.0
"""Distance to the next find of a chain: a crossing or a short bridge may lie between."""

ASIDE_M, ASIDE_SHARE = 0.4, 0.01
"""Distance of the next find from the arc that both directions make, and what it grows by per metre."""

RADIUS_M, TURNED_RAD = 140.0, 0.015
"""Tightest arc between two finds, and the error of a direction."""

ASTRAY = 30.0
"""Metres that a find may lie farther ahead for each metre that it lies nearer to the arc."""

SAME_M, SAME_RAD = 1.2, 0.15
"""Finds this close to a chain, and turned by less, belong to it."""

FEW_FINDS, MIN_LENGTH_M = 3, 50.0
"""Chains with fewer finds, or shorter ones, are chance."""

BEYOND_M = 30.0
"""Length by which a chain is continued at both ends: the next tile holds too little of the track to be found."""


def chains(finds: Finds) -> Iterator[np.ndarray]:
    """Yield chains of finds, those of the best finds first.

    Yields
    ------
    (n, 2) array
        Vertices, metres.
    """
    free = np.ones(len(finds.xy), dtype=bool)
    tree = cKDTree(finds.xy) if len(free) else None
    for start in np.argsort(-finds.score, kind="stable").tolist():
        if tree is None or not free[start]:
            continue
        back = _followed(start, np.pi, finds, tree, free)
        chain = [*back[::-1], start, *_followed(start, 0.0, finds, tree, free)]
        free[chain] = False
        line = finds.xy[chain]
        if len(chain) < 2:
            continue
        free[_members(line, finds)] = False
        if len(chain) >= FEW_FINDS and Polyline(line).length_m > MIN_LENGTH_M:
            yield _continued(line)


def _followed(start: int, turn: float, finds: Finds, tree: cKDTree, free: np.ndarray) -> list[int]:
    """Return the finds that continue one, in its direction turned by `turn`."""
    found: list[int] = []
    place, heading = finds.xy[start], finds.direction[start] + turn
    while True:
        near = np.array(tree.query_ball_point(place, AHEAD_M), dtype=np.int64)
        near = near[free[near] & ~np.isin(near, [start, *found])]
        step = finds.xy[near] - place
        ahead = step @ [np.cos(heading), np.sin(heading)]
        left = step @ [-np.sin(heading), np.cos(heading)]
        turned = (finds.direction[near] - heading + np.pi / 2) % np.pi - np.pi / 2
        astray = np.abs(left - ahead * turned / 2)
        fits = (ahead > LEAST_AHEAD_M) & (astray < ASIDE_M + ASIDE_SHARE * ahead)
        fits &= np.abs(turned) < ahead / RADIUS_M + TURNED_RAD
        if not fits.any():
            return found
        best = int(np.argmin(np.where(fits, ahead + ASTRAY * astray, np.inf)))
        found.append(int(near[best]))
        place, heading = finds.xy[near[best]], heading + turned[best]


def _members(line: np.ndarray, finds: Finds) -> np.ndarray:
    """Return the numbers of the finds that belong to a chain."""
    chain = Polyline(line)
    feet = chain.feet(finds.xy, SAME_M)
    segment = np.clip(np.searchsorted(chain.t, feet.t) - 1, 0, len(line) - 2)
    step = line[segment + 1] - line[segment]
    turned = finds.direction[feet.point] - np.arctan2(step[:, 1], step[:, 0])
    turned = np.abs((turned + np.pi / 2) % np.pi - np.pi / 2)
    return feet.point[turned < SAME_RAD]


def _continued(line: np.ndarray) -> np.ndarray:
    """Return a chain that goes on straight at both ends."""
    first, last = line[0] - line[1], line[-1] - line[-2]
    ends = [line[0] + BEYOND_M * first / np.hypot(*first), line[-1] + BEYOND_M * last / np.hypot(*last)]
    return np.concatenate([ends[:1], line, ends[1:]])
