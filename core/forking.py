"""Forks: where tracks part, the branch's centerline is led back to the point at which it leaves the through track's.

The rails of a branch show as lines of their own only where they have left the stock rails by more than a head, some
metres behind the point at which the centerlines part. Between the two, a track leaves another tangentially: its
distance grows with the square of the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from .polyline import interpolate, left_normals, project, resample
from .rails import Centerline, length_along

STATION_M = 0.5
"""Spacing of the stations among which an end looks for the track it may have left."""

FURTHEST_M = 0.3
"""Rails show apart when their heads and a flangeway lie side by side, 0.12 m, or a few cells of the raster later."""

TOUCH_M = 0.002
"""Ends this close to a track lie on it, within what thinning leaves of a line."""

FIT_WITHIN_M = 0.8
"""A branch bends evenly at least until it is this far off, after 6 m of a tram's and 63 m of the widest branch."""

LEAST_M = 3.0
"""Shorter branches tell too little."""

MISFIT_M = 0.01
"""A branch may lie this far beside the parabola: a lead that is straight first does, and the raster's stairs do."""

ROUNDS = 5
"""Rounds of reweighting."""

LONGEST_M = 40.0
"""Longest way back: a branch of 2500 m radius, the widest in use, is 0.3 m off after 39 m."""

STEP_M = 0.2
"""Vertex distance on the way back, that of smoothed centerlines."""


def fork_centerlines(lines: Sequence[Centerline]) -> list[Centerline]:
    """Lead the ends of branches back onto the tracks they leave, and give these a vertex there.

    Parameters
    ----------
    lines : sequence of Centerline
        Of one gauge and class.

    Returns
    -------
    list of Centerline
        In their order; the way back counts as bridged.
    """
    forked = list(lines)
    for branch, end, through in _near_ends(lines):
        turn = 1 if end == 0 else -1
        led_back = _led_back(forked[branch].xyz[::turn], forked[through].xyz)
        if led_back is not None:
            forked[branch] = _prolonged(forked[branch], led_back[::turn])
            forked[through] = replace(forked[through], xyz=_with_vertex(forked[through].xyz, led_back[0]))
    return forked


def _near_ends(lines: Sequence[Centerline]) -> Iterator[tuple[int, int, int]]:
    """List the ends that lie near another line: number of the line, 0 or -1 for its end, and number of the nearest."""
    if len(lines) < 2:
        return
    stations = [resample(line.xyz[:, :2], STATION_M)[0] for line in lines]
    number = np.repeat(np.arange(len(lines)), [len(one) for one in stations])
    stations = np.concatenate(stations)
    tree = cKDTree(stations)
    for line, end in ((line, end) for line in range(len(lines)) for end in (0, -1)):
        place = lines[line].xyz[end, :2]
        near = [other for other in tree.query_ball_point(place, FURTHEST_M + STATION_M) if number[other] != line]
        if near:
            yield line, end, int(number[min(near, key=lambda other: np.hypot(*(stations[other] - place)))])


def _led_back(branch: np.ndarray, through: np.ndarray) -> np.ndarray | None:
    """Lead the start of a branch back onto a through track, both (n, 3); None where it does not come closer in time."""
    s = length_along(branch[:, :2])
    feet = project([through[:, :2]], branch[:, :2], FIT_WITHIN_M)
    order = np.argsort(feet.point)
    count = int(np.argmin(np.append(feet.point[order] == np.arange(len(order)), False)))
    s, t, off = s[:count], feet.t[order][:count], feet.across[order][:count]
    if not count or s[-1] < LEAST_M or abs(off[0]) > FURTHEST_M:
        return None
    back, misfit = _parabola(s, off)
    joins = int(np.max(np.flatnonzero(misfit > MISFIT_M), initial=-1)) + 1
    if joins > len(s) // 2 or not -TOUCH_M <= back <= LONGEST_M:
        return None
    length = back + s[joins] if back + s[joins] > STEP_M else 0.0
    along = length_along(through[:, :2])
    parting = t[joins] - np.sign(t[-1] - t[0]) * length
    if not 0 <= parting <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / STEP_M)) + 1)
    chainage = parting + share * (t[joins] - parting)
    lead = interpolate(through, along, chainage)
    grown = share**2 * (length > 0)
    rise = branch[joins, 2] - np.interp(t[joins], along, through[:, 2])
    lead[:, :2] += (grown * off[joins])[:, None] * interpolate(left_normals(through), along, chainage)
    lead[:, 2] += grown * rise
    return np.concatenate([lead, branch[joins + 1 :]])


def _parabola(s: np.ndarray, off: np.ndarray) -> tuple[float, np.ndarray]:
    """Fit the parabola that touches the through track to a branch's distances from it, (n,), at `s` along the branch.

    The root of the distance grows evenly. What the raster bent where rails merge loses its say in a few rounds.

    Returns
    -------
    back : float
        How far before the branch's start the parabola touches the through track; infinite where there is no growth.
    misfit : (n,) array
        How far the branch lies beside the parabola.
    """
    side = np.sign(off[-1])
    root = np.sqrt(np.maximum(side * off, 0.0))
    weight = root + np.sqrt(TOUCH_M)  # a distance's root is the less certain the smaller it is
    trust = np.ones_like(s)
    for _ in range(ROUNDS):
        growth, start = np.polyfit(s, root, 1, w=weight * trust)
        misfit = np.abs(off - side * (growth * s + start) ** 2)
        trust = 1 / np.sqrt(1 + (misfit / MISFIT_M) ** 2)
    return start / growth if growth > 0 else np.inf, misfit


def _prolonged(line: Centerline, xyz: np.ndarray) -> Centerline:
    """Give a branch its new vertices; of the way back no rail of its own is known."""
    added = length_along(xyz[:, :2])[-1] - length_along(line.xyz[:, :2])[-1]
    return replace(line, xyz=xyz, bridged_m=line.bridged_m + max(float(added), 0.0))


def _with_vertex(xyz: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """Give a line a vertex at a place on it; a vertex that is there already takes the exact place."""
    away = np.hypot(*(xyz[:, :2] - vertex[:2]).T)
    nearest = int(np.argmin(away))
    if away[nearest] <= TOUCH_M:
        moved = xyz.copy()
        moved[nearest] = vertex
        return moved
    t = project([xyz[:, :2]], vertex[None, :2], reach_m=TOUCH_M).t
    return np.insert(xyz, np.searchsorted(length_along(xyz[:, :2]), t), vertex, axis=0)
