"""Repair lines where they do not show their rail: where the strip of cells is too wide, or turns as no rail does.

Guard rails, weeds on the side of the rail and remains of other rails widen the strip and draw its middle aside. See
docs/method.md section 4.7.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.bridges import MIN_RADIUS_M, STAIRS_M, bridge
from ..lines.ends import STEP_M, cut_back, even_points
from ..lines.network import LineNetwork
from ..polyline import interpolate, length_along
from ..progress import SILENT, Progress
from .crossings import SKIP_M
from .junctions import DIRECTION_M, weld_pairs

WIDE_HEADS = 2.0
"""Strips wider than this many heads contain more than one: a cell and noise add less than one to a single head."""

MAX_WIDE_M = 8.0
"""Longer wide strips are two rails that part; guard rails are 2.5 to 5 m long."""

TOGETHER_M = 1.0
"""Wide places closer to each other than this are one."""

KINK_DEG, KINK_M = 25.0, 0.5
"""No rail turns by this angle between two parts of this length; the stairs of a raster turn by 6 degrees."""

BEND_M = 1.0
BEND = BEND_M / MIN_RADIUS_M + 2 * STAIRS_M / BEND_M
"""Largest angle, radians, between parts of this length on the tightest rail with the stairs of its raster."""

SWERVE_M = 0.05
SWERVE_SEEN_M = 6.0, 2.0
"""A line this far from the cubic through its parts 6 to 2 m before and behind has swerved to a guard rail or a weed.
The stairs of a raster are smaller, and the tightest rail itself deviates by a centimetre."""


def straighten_blots(
    network: LineNetwork,
    places: np.ndarray,
    widths_m: np.ndarray,
    head_width_m: float,
    progress: Progress = SILENT,
) -> LineNetwork:
    """Redraw lines as smooth curves wherever their strip is too wide, or they bend or swerve as no rail does.

    Parameters
    ----------
    network : LineNetwork
        Lines without passes.
    places : (n, 2) array
        Pixels of the strips, metres.
    widths_m : (n,) array
        Width of a strip whose middle is at the pixel.
    head_width_m : float
    progress : Progress
    """
    if not network.lines:
        return network
    tree = cKDTree(places)
    lines = []
    for line in progress.follow(network.lines):
        points, along = _even(line)
        wide = widths_m[tree.query(points)[1]] > WIDE_HEADS * head_width_m
        line = _straightened(line, _runs(wide | (_turns(points, BEND_M) > BEND), along))
        points, along = _even(line)
        lines.append(_straightened(line, _runs(_swerves(points) > SWERVE_M, along)))
    return replace(network, lines=tuple(lines))


def cut_kinks(network: LineNetwork, progress: Progress = SILENT) -> LineNetwork:
    """Cut lines where they turn as no rail does, and drop the bent part; the new ends are free.

    Parameters
    ----------
    network : LineNetwork
        Lines without passes.
    progress : Progress
    """
    lines: list[np.ndarray] = []
    ends: list[list[int]] = []
    nodes = list(network.nodes)
    for line, own in progress.follow(zip(network.lines, network.ends.tolist()), len(network.lines)):
        for piece in _without_kinks(line):
            lines.append(piece)
            ends.append([])
            for node, was, now in zip(own, line[[0, -1]], piece[[0, -1]]):
                ends[-1].append(node if (was == now).all() else len(nodes))
                nodes += [] if (was == now).all() else [now]
    whole = LineNetwork(tuple(lines), np.array(nodes).reshape(-1, 2), np.array(ends, dtype=int).reshape(-1, 2))
    return weld_pairs(whole.tidy())


def _without_kinks(line: np.ndarray) -> list[np.ndarray]:
    """Cut a line into the pieces between its kinks."""
    points, along = _even(line)
    bent = _turns(points, KINK_M) > np.radians(KINK_DEG)
    if not bent.any():
        return [line]
    vertex_t = length_along(line)
    borders = [(a - KINK_M, b + KINK_M) for a, b in _runs(bent, along)]
    pieces, t = [], 0.0
    for start, end in [*borders, (vertex_t[-1], np.inf)]:
        if start - t > STEP_M:
            pieces.append(_between(line, vertex_t, t, min(start, vertex_t[-1])))
        t = end
    return pieces


def _straightened(line: np.ndarray, runs: list[tuple[float, float]]) -> np.ndarray:
    """Redraw sections of a line, given by their chainages, from the last one, so that earlier chainages stay valid.

    A section across which there is no curve is tried together with those before it: a line swerves to a guard rail and
    back.
    """
    last = len(runs) - 1
    while last >= 0:
        first = last
        while first >= 0 and runs[last][1] - runs[first][0] < MAX_WIDE_M:
            redrawn = _redrawn(line, runs[first][0] - SKIP_M, runs[last][1] + SKIP_M)
            if redrawn is not None:
                line, last = redrawn, first
                break
            first -= 1
        last -= 1
    return line


def _redrawn(line: np.ndarray, start: float, end: float) -> np.ndarray | None:
    """Replace the section between two chainages by a curve that explains both its sides; None if there is none."""
    t = length_along(line)
    if start < DIRECTION_M or end > t[-1] - DIRECTION_M:
        return None
    before, behind = _between(line, t, 0.0, start)[::-1], _between(line, t, end, t[-1])
    found = bridge(before, behind)
    if found is None or max(found.cuts_m) > SKIP_M:
        return None
    before, behind = (cut_back(side, cut_m) for side, cut_m in zip((before, behind), found.cuts_m))
    return np.concatenate([before[::-1], found.points, behind])


def _turns(points: np.ndarray, length_m: float) -> np.ndarray:
    """Measure the angle between the parts of a length before and behind each even point of a line, radians, (n,)."""
    reach = int(round(length_m / STEP_M))
    turn = np.zeros(len(points))
    if len(points) > 2 * reach:
        back, ahead = points[reach:-reach] - points[: -2 * reach], points[2 * reach :] - points[reach:-reach]
        cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
        turn[reach:-reach] = np.abs(np.arctan2(cross, (back * ahead).sum(axis=1)))
    return turn


def _swerves(points: np.ndarray) -> np.ndarray:
    """Measure each even point's distance from where the line before and behind it predicts it, metres, (n,)."""
    reach, hidden = (int(round(length_m / STEP_M)) for length_m in SWERVE_SEEN_M)
    aside = np.zeros(len(points))
    if len(points) > 2 * reach:
        steps = np.arange(-reach, reach + 1)
        around = np.abs(steps) >= hidden
        weights = np.zeros(len(steps))
        # The value at 0 of a cubic fitted to the points around is a weighted sum of these points.
        weights[around] = np.linalg.pinv(np.vander(steps[around] / reach, 4))[-1]
        expected = np.column_stack([np.convolve(axis, weights[::-1], mode="valid") for axis in points.T])
        aside[reach:-reach] = np.hypot(*(points[reach:-reach] - expected).T)
    return aside


def _even(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the even points of a line and their chainages."""
    points = even_points(line)
    return points, np.linspace(0.0, length_along(line)[-1], len(points))


def _between(line: np.ndarray, along: np.ndarray, start: float, end: float) -> np.ndarray:
    """Cut out the part of a line between two chainages."""
    borders = interpolate(line, along, np.array([start, end]))
    return np.concatenate([borders[:1], line[(along > start) & (along < end)], borders[1:]])


def _runs(marked: np.ndarray, along: np.ndarray) -> list[tuple[float, float]]:
    """Return the chainages of the first and the last point of each group of marked points."""
    t = along[marked]
    if not len(t):
        return []
    breaks = np.flatnonzero(np.diff(t) > TOGETHER_M) + 1
    return [(float(run[0]), float(run[-1])) for run in np.split(t, breaks)]
