"""What follows a track: platform edges and contact wires, found in sections and traced from place to place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from ..polyline import distance_to, interpolate
from .frame import Course

SHORTEST_M = 10.0
"""Least length of what is a platform or a wire."""

EDGE_ASIDE_M, EDGE_HEIGHT_M = (1.2, 3.0), (0.12, 1.4)
"""Where edges of platforms are, aside and above the rail tops."""

LAYER_M = 0.04
"""Thickness of the layers among which the level face is: paving is even within it."""

FULLEST, LEAST_ON_LEVEL, LEAST_WIDTH_M = 3, 30, 0.3
"""The level face is the highest of this number of fullest layers that has enough points over such a width."""

ROUNDS, LEVEL_SIGMA_M, STEEPEST = 4, 0.012, 0.10
"""Rounds of the fit of the level face, distance up to which points count, and steepest fall of a platform across."""

BEHIND_M, ABOVE_M, FULL_SHARE = 0.35, (0.10, 0.60), 0.3
"""Behind the edge and above the level there are fewer points than this share of those on it; else it is the floor of a
wagon, or the foot of a wall."""

FACE_M, FACE_DEPTH_M, FACE_LEAST = (0.015, 0.075), 0.05, 5
"""The vertical face: how far below the level its points are, over which depth, and how many are needed."""

TRIMMED = 0.1
"""Share of the points of the face on either side that its mean leaves out: bolts, dirt, joints."""

EDGE_NOISE_M, EVEN_M = 0.03, 0.3
"""Six times the usual noise, behind which a level face is full; and the width over which it is evenly so."""

LONGEST_HOLE_M, LARGEST_STEP_M = 3.0, 0.10
"""Between metres of one platform: longest hole and largest step."""

STRAY_M, MEDIAN_OF = 0.03, 5
"""What deviates by this from the median of a number of metres is not an edge."""

NOMINAL_MM, NOMINAL_WITHIN_MM = (550, 760), 60.0
"""Heights of the technical specification for interoperability, and how near a platform is to be one."""

LEVEL, EDGE = 0.05, 0.10
"""Points at most at these distances above the level and in front of the edge are of the platform."""

WIRE_ASIDE_M, WIRE_HEIGHT_M = 1.1, (4.4, 7.0)
"""Where a contact wire is: beyond, no pantograph reaches it."""

BIN_M = 0.5
"""Length of the pieces in which a wire is looked for: at 400 points per square metre, two or three points of it."""

GROUPS, THICK_M, WIDE_M, LEAST_IN_GROUP = 4, 0.04, 0.06, 2
"""Groups of points that may be a wire, from below, in each piece: their largest number, thickness and width, and least
number of points."""

BESIDE_M, BESIDE_UP_M = (0.08, 0.40), 0.06
"""Aside and in height: around a wire, this space holds no more points than the wire, which is thin, unlike roofs, beams
and leaves."""

HEIGHT_COST, POINT_GAIN, POINTS_GAIN, NONE_COST = 0.3, 0.15, 6, 0.8
"""Cost of a metre of height, gain of each of the first points, their number, and cost of a piece without a wire: the
lowest thing that goes on is the contact wire, not the messenger, a dropper or an arm."""

TURN_M, RISE_M, ENTER_COST = 0.03, 0.02, 3.0
"""Change across and in height that costs 1, and the cost of a gap on either side: a larger change costs a gap."""

NEAR_M = 0.05, 0.035
"""Points within these distances of the chain, across and in height, are of the wire."""

WINDOWS_M, STEADY = ((-1.5, 1.5), (-2.2, 0.0), (0.0, 2.2)), 1.2
"""Parts around a place over which the wire is straight, and how much more than those of the steadiest part the points
of the first one that counts may scatter: a kink at a support stays."""

LEAST_FITTED, ACCEPTED_SIGMAS = 6, 3.0
"""Points that a straight piece needs, and standard deviations beyond which a point is of an arm or a clamp."""

JUMP_M, LONGEST_GAP_M = (0.10, 0.06), 8.0
"""Change across and in height between pieces at which a wire breaks, ten times that of the steepest one; longest
gap."""

GRADE_M = 20.0
"""Length over which the gradient is measured."""

LIVE_M, ARMS_M = 0.15, 4.6
"""What is so near to the wire and above this height is live itself: clamps and arms; insulation keeps off the rest."""


@dataclass(frozen=True)
class Trace:
    """The edge of a platform or a contact wire along a track.

    `course` is the number of the track among the courses. Places have s, v and w, and the standard errors of v and w,
    (n,) metres each; at both ends, the thing reaches `end_m` beyond the last one.
    """

    course: int
    end_m: float
    s: np.ndarray
    v: np.ndarray
    w: np.ndarray
    sigma_m: np.ndarray
    sigmaz_m: np.ndarray

    @property
    def ends(self) -> tuple[float, float]:
        """Chainages of both ends."""
        return float(self.s[0]) - self.end_m, float(self.s[-1]) + self.end_m

    @property
    def length_m(self) -> float:
        """Length along the track."""
        return self.ends[1] - self.ends[0]

    @property
    def side(self) -> int:
        """Side of the track on which it begins: 1 on the left, -1 on the right."""
        return 1 if self.v[0] > 0 else -1


def traces_of(course: int, rows: np.ndarray, steps: Sequence[float], hole_m: float, end_m: float) -> Iterator[Trace]:
    """Yield the traces that places make, (n, 5): they part where v or w changes by its step, or s by a hole."""
    breaks = (np.abs(np.diff(rows[:, 1:3], axis=0)) > steps).any(axis=1) | (np.diff(rows[:, 0]) > hole_m)
    for part in np.split(rows, np.flatnonzero(breaks) + 1) if len(rows) else ():
        one = Trace(course, end_m, *part.T)
        if one.length_m >= SHORTEST_M:
            yield one


def known_at(at: np.ndarray, s: np.ndarray, vw: np.ndarray, reach_m: float = LONGEST_HOLE_M / 2) -> np.ndarray:
    """Interpolate v and w, (n, 2), at rising chainages s; returns (m, 2), NaN beyond reach of the nearest of these.

    Half of the longest hole in a platform is within reach.
    """
    if not len(s):
        return np.full((len(at), 2), np.nan)
    return np.where((distance_to(s, at) <= reach_m)[:, None], interpolate(vw, s, at), np.nan)


def traced_at(traces: Sequence[Trace], course: int, s: np.ndarray, side: int = 0) -> np.ndarray:
    """Return v and w of what follows a track at chainages, (m, 2), on a side or on both; NaN where nothing does."""
    found = np.full((len(s), 2), np.nan)
    for one in traces:
        if one.course == course and side in (0, one.side):
            here = known_at(s, one.s, np.column_stack([one.v, one.w]))
            found = np.where(np.isfinite(here), here, found)
    return found


def edges_of(place: np.ndarray) -> np.ndarray:
    """Return the metres of platform edges that points, (n, 3), show: rows as of `Trace`, (k, 5)."""
    aside, w = np.abs(place[:, 1]), place[:, 2]
    strip = (
        (aside > EDGE_ASIDE_M[0])
        & (aside < EDGE_ASIDE_M[1])
        & (w > EDGE_HEIGHT_M[0])
        & (w < EDGE_HEIGHT_M[1] + ABOVE_M[1])
    )
    s, v, w = place[strip].T
    metre = 2 * np.floor(s).astype(np.int64) + (v > 0)
    order = np.argsort(metre, kind="stable")
    found = []
    for part in np.split(order, np.flatnonzero(np.diff(metre[order])) + 1) if len(order) else ():
        edge = _edge(np.abs(v[part]), w[part])
        if edge is not None:
            offset, *rest = edge
            found.append((np.floor(s[part[0]]) + 0.5, np.sign(v[part[0]]) * offset, *rest))
    return np.reshape(found, (-1, 5))


def _edge(aside: np.ndarray, w: np.ndarray) -> tuple[float, float, float, float] | None:
    """Return offset and height of the edge within a metre, and their standard errors; None if there is none."""
    level = _level(aside, w)
    if level is None:
        return None
    height, slope, on_level = level
    first = float(np.percentile(aside[on_level], 1))
    behind = (aside > first) & (aside < first + BEHIND_M)
    rise = w - height - slope * aside
    above = int((behind & (rise > ABOVE_M[0]) & (rise < ABOVE_M[1])).sum())
    if above >= FULL_SHARE * max(int((behind & on_level).sum()), 1):
        return None
    face = (rise < -FACE_M[0]) & (rise > -FACE_M[1]) & (aside < first + FACE_DEPTH_M)
    if face.sum() >= FACE_LEAST:
        cut = int(TRIMMED * face.sum())
        kept = np.sort(aside[face])[cut : face.sum() - cut]
        offset, sigma = float(kept.mean()), float(kept.std() / np.sqrt(len(kept)))
    else:
        offset, sigma = _first_of_level(aside[on_level])
    sigmaz = float(2 * rise[on_level].std() / np.sqrt(on_level.sum()))
    return offset, height + slope * offset, max(sigma, 1e-4), max(sigmaz, 1e-4)


def _level(aside: np.ndarray, w: np.ndarray) -> tuple[float, float, np.ndarray] | None:
    """Return height and slope of the level face, and which points are on it; None without one."""
    layer = np.floor(w / LAYER_M).astype(np.int64)
    count = np.bincount(layer - layer.min())
    both = count + np.append(count[1:], 0)  # a face may lie across the border of two layers
    best = np.sort(np.argsort(-both, kind="stable")[:FULLEST])[::-1] + layer.min()
    for one in best:
        on_level = (layer == one) | (layer == one + 1)
        middle, slope = float(np.median(w[on_level])), 0.0
        for _ in range(ROUNDS):
            on_level = np.abs(w - middle - slope * aside) <= LEVEL_SIGMA_M
            if on_level.sum() < LEAST_ON_LEVEL or np.ptp(aside[on_level]) < LEAST_WIDTH_M:
                break
            slope, middle = np.polyfit(aside[on_level], w[on_level], 1).tolist()
        else:
            if abs(slope) < STEEPEST and middle + slope * float(np.median(aside[on_level])) < EDGE_HEIGHT_M[1]:
                return middle, slope, on_level
    return None


def _first_of_level(aside: np.ndarray) -> tuple[float, float]:
    """Return where a level face of evenly dense points begins that is seen from above only, and its standard error."""
    inner = float(aside.min()) + EDGE_NOISE_M
    density = max(int(((aside >= inner) & (aside < inner + EVEN_M)).sum()), 1) / EVEN_M
    before = int((aside < inner).sum())
    return inner - before / density, float(np.sqrt(before + 1)) / density


def platforms_of(course: int, edges: np.ndarray) -> Iterator[Trace]:
    """Yield the platforms that the metres of a track make, (k, 5)."""
    for sense in (1, -1):
        rows = edges[sense * edges[:, 1] > 0]
        rows = rows[np.argsort(rows[:, 0])]
        smooth = median_filter(rows[:, 1:3], (MEDIAN_OF, 1), mode="nearest")
        rows = rows[(np.abs(rows[:, 1:3] - smooth) <= STRAY_M).all(axis=1)]
        yield from traces_of(course, rows, (LARGEST_STEP_M,) * 2, LONGEST_HOLE_M, 0.5)


def on_platforms(edges: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return which points, (n, 3), are of the platforms that the metres of their track make."""
    found, (s, v, w) = np.zeros(len(place), dtype=bool), place.T
    platforms = list(platforms_of(0, edges))
    for side in (1, -1):
        edge, height = traced_at(platforms, 0, s, side).T
        with np.errstate(invalid="ignore"):
            found |= (side * (v - edge) >= -EDGE) & (w <= height + LEVEL)
    return found


def nominal_mm(platform: Trace) -> int | None:
    """Return the nominal height of a platform; None if none is near."""
    mean = 1000 * float(platform.w.mean())
    return next((one for one in NOMINAL_MM if abs(one - mean) <= NOMINAL_WITHIN_MM), None)


def nodes_of(place: np.ndarray, course: Course) -> np.ndarray:
    """Return the places of the contact wire over a track in points, (n, 3): rows as of `Trace`, (k, 5)."""
    _, v, w = place.T
    points = place[(np.abs(v) < WIRE_ASIDE_M) & (w > WIRE_HEIGHT_M[0]) & (w < WIRE_HEIGHT_M[1])]
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
        if mine.sum() >= max(LEAST_IN_GROUP, beside.sum()):
            found.append((*middle.tolist(), int(mine.sum())))
        free = free[~mine]
    return np.reshape(found, (-1, 3))


def _chain(groups: Sequence[np.ndarray]) -> np.ndarray:
    """Return the number of the group of the wire in each piece, -1 where there is none: the cheapest way (Viterbi)."""
    costs, back = np.zeros(1), []
    before = np.empty((0, 3))
    for own in groups:
        gain = HEIGHT_COST * (own[:, 1] - WIRE_HEIGHT_M[0]) - POINT_GAIN * np.minimum(own[:, 2], POINTS_GAIN)
        change = np.full((len(before) + 1, len(own) + 1), ENTER_COST)
        change[-1, -1] = 0.0
        change[:-1, :-1] = np.abs(before[:, None, :2] - own[None, :, :2]) @ (1 / TURN_M, 1 / RISE_M)
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
    return traces_of(course, nodes, JUMP_M, LONGEST_GAP_M, 0.0)


def away(nodes: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the distance of points, (n, 3), from the places of a wire, (k, 5); inf where there is none."""
    off = place[:, 1:] - known_at(place[:, 0], nodes[:, 0], nodes[:, 1:3], LONGEST_GAP_M / 2)
    return np.nan_to_num(np.hypot(*off.T), nan=np.inf)


def grade_pm(wire: Trace) -> float:
    """Return the steepest gradient of a wire against the track over 20 m, per mille; NaN for a shorter one."""
    known = wire.s + GRADE_M <= wire.s[-1]
    rise = np.abs(np.interp(wire.s + GRADE_M, wire.s, wire.w) - wire.w)[known]
    return float(rise.max() / GRADE_M * 1000) if known.any() else np.nan
