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

FIT_M = 5.0
"""Stretch of the branch that tells how it comes closer: even a tram's branch bends evenly for as long."""

LONGEST_M = 40.0
"""Longest way back: a branch of 2500 m radius, the widest in use, is 0.3 m off after 39 m."""

LEAST_VERTICES = 4
"""Vertices that a parabola is fitted to."""

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
    first = branch[length_along(branch[:, :2]) <= FIT_M]
    feet = project([through[:, :2]], first[:, :2], reach_m=FIT_M)
    order = np.argsort(feet.point)
    t, off = feet.t[order], feet.across[order]
    if len(first) < LEAST_VERTICES or len(t) < len(first) or abs(off[0]) > FURTHEST_M:
        return None
    touches = abs(off[0]) <= TOUCH_M
    length = 0.0 if touches else _length_back(length_along(first[:, :2]), off)
    along = length_along(through[:, :2])
    ahead = np.sign(t[-1] - t[0])
    if not 0 <= length <= LONGEST_M or not 0 <= t[0] - ahead * length <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / STEP_M)) + 1)
    chainage = t[0] + ahead * (share - 1) * length
    lead = interpolate(through, along, chainage)
    rise = branch[0, 2] - np.interp(t[0], along, through[:, 2])
    grown = 0.0 * share if touches else share**2
    lead[:, :2] += (grown * off[0])[:, None] * interpolate(left_normals(through), along, chainage)
    lead[:, 2] += grown * rise
    return np.concatenate([lead, branch[1:]])


def _length_back(along: np.ndarray, off: np.ndarray) -> float:
    """Length of the parabola that touches the through track and has the distance and slope that `off` starts with."""
    _, slope, start = np.polyfit(along, off, 2)
    return 2 * start / slope if slope else np.inf


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
