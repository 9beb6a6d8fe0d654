"""Platform edges: the offset and the height of the edge beside a track, metre by metre."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import median_filter

from .along import Trace, traced_at, traces_of

ASIDE_M, HEIGHT_M = (1.2, 3.0), (0.12, 1.4)
"""Where edges of platforms are, aside and above the rail tops."""

LAYER_M = 0.04
"""Thickness of the layers among which the level face is: paving is even within it."""

FULLEST, LEAST_POINTS, LEAST_WIDTH_M = 3, 30, 0.3
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

LONGEST_HOLE_M, LARGEST_STEP_M, SHORTEST_M = 3.0, 0.10, 10.0
"""Between metres of one platform: longest hole and largest step; and the shortest platform."""

STRAY_M, MEDIAN_OF = 0.03, 5
"""What deviates by this from the median of a number of metres is not an edge."""

NOMINAL_MM, NOMINAL_WITHIN_MM = (550, 760), 60.0
"""Heights of the technical specification for interoperability, and how near a platform is to be one."""

LEVEL, EDGE = 0.05, 0.10
"""Points at most at these distances above the level and in front of the edge are of the platform."""


def edges_of(place: np.ndarray) -> np.ndarray:
    """Return the metres of platform edges that points, (n, 3), show: rows as of `Trace`, (k, 5)."""
    aside, w = np.abs(place[:, 1]), place[:, 2]
    strip = (aside > ASIDE_M[0]) & (aside < ASIDE_M[1]) & (w > HEIGHT_M[0]) & (w < HEIGHT_M[1] + ABOVE_M[1])
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
            if on_level.sum() < LEAST_POINTS or np.ptp(aside[on_level]) < LEAST_WIDTH_M:
                break
            slope, middle = np.polyfit(aside[on_level], w[on_level], 1).tolist()
        else:
            if abs(slope) < STEEPEST and middle + slope * float(np.median(aside[on_level])) < HEIGHT_M[1]:
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
        yield from traces_of(course, rows, (LARGEST_STEP_M,) * 2, LONGEST_HOLE_M, SHORTEST_M, 0.5)


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
