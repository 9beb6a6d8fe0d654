"""Rail ends that face each other across a gap are joined by a curve a rail could follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .ends import STEP_M, stretch, way_out
from .network import LineNetwork

DIRECTION_M = 2.0
"""Stretch over which an end's direction is measured; the stairs of a raster line are up to this long."""

FIT_M = 4.0
"""Stretch on either side that the joining curve is fitted to."""

SHORTEST_M = 0.25
"""Shorter pieces have no direction and join nothing."""

SLACK_M = 0.03
"""How far a raster line may lie beside its rail: three quarters of a cell."""

TIGHTEST_RADIUS_M = 20.0
"""No rail of a tram or railway is bent more sharply, turnouts included."""

TRANSITION_M = 5.0
"""Within this length the curvature may change from none to the tightest; a short clothoid of a tramway."""


@dataclass(frozen=True)
class _Join:
    """A possible join of two ends: its cost, and the points that bridge the gap from the first to the second."""

    cost: float
    ends: tuple[int, int]
    bridge: np.ndarray


def join_gaps(network: LineNetwork, max_gap_m: float, gap_angle_deg: float) -> LineNetwork:
    """Join free ends that face each other, both within `gap_angle_deg` of the way across, at most `max_gap_m` apart.

    One smooth curve must explain both ends: a cubic fitted to the stretches on either side, its curvature held to what
    rails do, may miss neither by more than `SLACK_M`. That rules out the neighbouring rail, for it takes a double bend.
    Joins happen in rounds, each end with the partner that costs least, for a joined line shows better where it leads.
    """
    while True:
        best: dict[int, _Join] = {}
        joins = _joins(network, max_gap_m, gap_angle_deg)
        for join in sorted(joins, key=lambda join: (join.cost, join.ends), reverse=True):
            best[join.ends[0]] = best[join.ends[1]] = join
        chosen = [join for join in joins if best[join.ends[0]] is join is best[join.ends[1]]]
        if not chosen:
            return network
        partner, bridges = {}, {}
        for join in chosen:
            one, other = join.ends
            partner[one], partner[other] = other, one
            bridges[one], bridges[other] = join.bridge, join.bridge[::-1]
        network = network.weld(partner, bridges)


def _joins(network: LineNetwork, max_gap_m: float, gap_angle_deg: float) -> list[_Join]:
    """Every pair of free ends that could be joined."""
    free = np.flatnonzero(network.degrees()[network.ends.ravel()] == 1)
    free = free[network.lengths()[free // 2] >= SHORTEST_M]
    if len(free) < 2:
        return []
    ways = [way_out(stretch(network.from_end(end), DIRECTION_M)) for end in free]
    tips, outward = (np.array(part) for part in zip(*ways))
    pairs = cKDTree(tips).query_pairs(max_gap_m, output_type="ndarray")
    facing = _faces(tips, outward, pairs, gap_angle_deg) & _faces(tips, outward, pairs[:, ::-1], gap_angle_deg)
    tried = (_try_join(network, one, other) for one, other in free[pairs[facing]].tolist())
    return [join for join in tried if join is not None]


def _faces(tips: np.ndarray, outward: np.ndarray, pairs: np.ndarray, angle_deg: float) -> np.ndarray:
    """Tell for which pairs the second tip lies within the fan before the first, (n,) bool."""
    across = tips[pairs[:, 1]] - tips[pairs[:, 0]]
    way = outward[pairs[:, 0]]
    ahead = (across * way).sum(axis=1)
    aside = np.abs(across[:, 0] * way[:, 1] - across[:, 1] * way[:, 0])
    return (ahead > 0) & (aside <= ahead * np.tan(np.radians(angle_deg)) + SLACK_M)


def _try_join(network: LineNetwork, one: int, other: int) -> _Join | None:
    """Fit a cubic over the gap and both stretches; None if it misses one of them or bends more than a rail."""
    before = stretch(network.from_end(one), FIT_M)[::-1]
    after = stretch(network.from_end(other), FIT_M)
    origin, along = _frame(before, after)
    across = np.array([-along[1], along[0]])
    before, after = ((points - origin) @ np.column_stack([along, across]) for points in (before, after))
    cubic = _fit(np.concatenate([before, after]))
    misfit = max(np.sqrt(np.mean((points[:, 1] - _basis(points[:, 0]) @ cubic) ** 2)) for points in (before, after))
    bend = np.abs(cubic[2] + cubic[3] * np.array([before[0, 0], after[-1, 0]])).max() * TIGHTEST_RADIUS_M
    gap = after[0, 0] - before[-1, 0]
    if gap <= 0 or misfit > SLACK_M or bend > 1:
        return None
    x = np.linspace(before[-1, 0], after[0, 0], int(gap / STEP_M) + 2)[1:-1]
    bridge = origin + x[:, None] * along + (_basis(x) @ cubic)[:, None] * across
    return _Join(gap * (1 + misfit / SLACK_M + bend), (one, other), bridge)


def _frame(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origin in the middle of the gap, and unit vector from one stretch to the other."""
    along = after.mean(axis=0) - before.mean(axis=0)
    return (before[-1] + after[0]) / 2, along / np.hypot(*along)


def _fit(points: np.ndarray) -> np.ndarray:
    """Cubic y(x) as value, slope, curvature and its change at 0, least squares with the habits of rails as prior."""
    curvature = SLACK_M * TIGHTEST_RADIUS_M
    prior = np.diag([0.0, 0.0, curvature, curvature * TRANSITION_M])
    design = np.concatenate([_basis(points[:, 0]), prior])
    return np.linalg.lstsq(design, np.concatenate([points[:, 1], np.zeros(4)]), rcond=None)[0]


def _basis(x: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones_like(x), x, x**2 / 2, x**3 / 6])
