"""The contact wire over a track: its height and its stagger, every half metre."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..polyline import interpolate
from .along import Trace, known_at, traces_of
from .frame import Course

ASIDE_M, HEIGHT_M = 1.1, (4.4, 7.0)
"""Where a contact wire is: beyond, no pantograph reaches it."""

BIN_M = 0.5
"""Length of the pieces in which a wire is looked for: at 400 points per square metre, two or three points of it."""

GROUPS, THICK_M, WIDE_M, LEAST_POINTS = 4, 0.04, 0.06, 2
"""Groups of points that may be a wire, from below, in each piece: their largest number, thickness and width, and least
number of points."""

BESIDE_M, BESIDE_UP_M = (0.08, 0.40), 0.06
"""Aside and in height: where there are no more points than in a group, because a wire is thin, unlike roofs, beams and
leaves."""

HEIGHT_COST, POINT_GAIN, POINTS_GAIN, NONE_COST = 0.3, 0.15, 6, 0.8
"""Cost of a metre of height, gain of each of the first points, their number, and cost of a piece without a wire: the
lowest thing that goes on is the contact wire, not the messenger, a dropper or an arm."""

TURN_M, RISE_M, CHANGE_CAP, ENTER_COST = 0.03, 0.02, 12.0, 3.0
"""Change across and in height that costs 1, the largest such cost, and the cost of a gap on either side."""

NEAR_M = 0.05, 0.035
"""Points within these distances of the chain, across and in height, are of the wire."""

WINDOWS_M, STEADY = ((-1.5, 1.5), (-2.2, 0.0), (0.0, 2.2)), 1.2
"""Parts around a place over which the wire is straight, and how much more than those of the steadiest part the points
of the first one that counts may scatter: a kink at a support stays."""

LEAST_FITTED, ACCEPTED_SIGMAS = 6, 3.0
"""Points that a straight piece needs, and standard deviations beyond which a point is of an arm or a clamp."""

JUMP_M, LONGEST_GAP_M, SHORTEST_M = (0.10, 0.06), 8.0, 10.0
"""Change across and in height between pieces at which a wire breaks, ten times that of the steepest one; its longest
gap, and its least length."""

GRADE_M = 20.0
"""Length over which the gradient is measured."""

LIVE_M, ARMS_M = 0.15, 4.6
"""What is so near to the wire and above this height is live itself: clamps and arms; insulation keeps off the rest."""


def nodes_of(place: np.ndarray, course: Course) -> np.ndarray:
    """Return the places of the contact wire over a track in points, (n, 3): rows as of `Trace`, (k, 5)."""
    _, v, w = place.T
    points = place[(np.abs(v) < ASIDE_M) & (w > HEIGHT_M[0]) & (w < HEIGHT_M[1])]
    points = points[np.argsort(points[:, 0], kind="stable")]
    pieces = np.floor(points[:, 0] / BIN_M)
    bins = np.arange(pieces[0], pieces[-1] + 1) if len(pieces) else pieces
    groups = [_from_below(own) for own in np.split(points[:, 1:], np.searchsorted(pieces, bins[1:]))]
    chain = _chain(groups)
    there = np.flatnonzero(chain >= 0)
    if len(there) < LEAST_FITTED:
        return np.empty((0, 5))
    at = (bins[there] + 0.5) * BIN_M
    way = np.array([groups[i][chain[i]][:2] for i in there])
    points = points[(np.abs(points[:, 1:] - interpolate(way, at, points[:, 0])) <= NEAR_M).all(axis=1)]
    curvature = course.at(at, course.curvature)
    refined = (_refined(points, *one) for one in zip(at.tolist(), curvature.tolist()))
    return np.reshape([row for row in refined if row is not None], (-1, 5))


def _from_below(vw: np.ndarray) -> np.ndarray:
    """Return v, w and number of points of the groups in a piece, (k, 3), the lowest first."""
    found: list[tuple[float, float, int]] = []
    free = vw[np.argsort(vw[:, 1], kind="stable")]
    while len(free) and len(found) < GROUPS:
        aside, up = (free - free[0]).T
        mine = (up <= THICK_M) & (np.abs(aside) <= WIDE_M / 2)
        middle = np.median(free[mine], axis=0)
        aside, up = np.abs(vw - middle).T
        beside = (aside > BESIDE_M[0]) & (aside < BESIDE_M[1]) & (up < BESIDE_UP_M)
        if mine.sum() >= max(LEAST_POINTS, beside.sum()):
            found.append((*middle.tolist(), int(mine.sum())))
        free = free[~mine]
    return np.reshape(found, (-1, 3))


def _chain(groups: Sequence[np.ndarray]) -> np.ndarray:
    """Return the number of the group of the wire in each piece, -1 where there is none: the cheapest way (Viterbi)."""
    costs, back = np.zeros(1), []
    before = np.empty((0, 3))
    for own in groups:
        gain = HEIGHT_COST * (own[:, 1] - HEIGHT_M[0]) - POINT_GAIN * np.minimum(own[:, 2], POINTS_GAIN)
        change = np.full((len(before) + 1, len(own) + 1), ENTER_COST)
        change[-1, -1] = 0.0
        turn = np.abs(before[:, None, :2] - own[None, :, :2]) @ (1 / TURN_M, 1 / RISE_M)
        change[:-1, :-1] = np.minimum(turn, CHANGE_CAP)
        total = costs[:, None] + change
        back.append(np.argmin(total, axis=0))
        costs = total.min(axis=0) + np.append(gain, NONE_COST)
        before = own
    chain = np.full(len(groups), -1)
    state = int(np.argmin(costs))
    for at in range(len(groups) - 1, -1, -1):
        chain[at] = state if state < len(groups[at]) else -1
        state = int(back[at][state])
    return chain


def _refined(points: np.ndarray, s: float, curvature: float) -> tuple[float, ...] | None:
    """Return s, v, w and the standard errors of the wire at a place; None where too few points tell it."""
    borders = [np.searchsorted(points[:, 0], (s + low, s + high)) for low, high in WINDOWS_M]
    fits = [_straight(points[i:j, 0] - s, points[i:j, 1:], curvature) for i, j in borders]
    known = [one for one in fits if one is not None]
    least = STEADY * min((scatter for *_, scatter in known), default=0.0)
    return next(((s, v, w, sigma, sigma) for v, w, sigma, scatter in known if scatter <= least), None)


def _straight(ahead: np.ndarray, vw: np.ndarray, curvature: float) -> tuple[float, float, float, float] | None:
    """Return v and w at the origin of a straight piece, a parabola in the frame, their standard error, and scatter."""
    values = vw + np.column_stack([0.5 * curvature * ahead**2, np.zeros(len(ahead))])
    kept = np.ones(len(ahead), dtype=bool)
    for _ in range(3):
        if kept.sum() < LEAST_FITTED or np.ptp(ahead[kept]) < 0.5:
            return None
        design = np.column_stack([np.ones(int(kept.sum())), ahead[kept]])
        fit, *_ = np.linalg.lstsq(design, values[kept], rcond=None)
        off = np.abs(values - fit[0] - ahead[:, None] * fit[1])
        scatter = np.sqrt(np.mean(off[kept] ** 2, axis=0))
        kept = (off <= ACCEPTED_SIGMAS * np.maximum(scatter, 0.003)).all(axis=1)
    spread = np.linalg.inv(design.T @ design)[0, 0]
    both = float(np.hypot(*scatter))
    return float(fit[0, 0]), float(fit[0, 1]), both * float(np.sqrt(spread)), both


def wires_of(course: int, nodes: np.ndarray) -> Iterator[Trace]:
    """Yield the wires over a track, given places in order."""
    return traces_of(course, nodes, JUMP_M, LONGEST_GAP_M, SHORTEST_M, 0.0)


def away(nodes: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the distance of points, (n, 3), from the places of a wire, (k, 5); inf where there is none."""
    off = place[:, 1:] - known_at(place[:, 0], nodes[:, 0], nodes[:, 1:3], LONGEST_GAP_M / 2)
    return np.nan_to_num(np.hypot(*off.T), nan=np.inf)


def grade_pm(wire: Trace) -> float:
    """Return the steepest gradient of a wire against the track over 20 m, per mille; NaN for a shorter one."""
    known = wire.s + GRADE_M <= wire.s[-1]
    rise = np.abs(np.interp(wire.s + GRADE_M, wire.s, wire.w) - wire.w)[known]
    return float(rise.max() / GRADE_M * 1000) if known.any() else np.nan
