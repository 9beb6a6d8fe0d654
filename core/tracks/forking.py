"""Forks: where tracks part, the branch's centerline is led back to the point at which it leaves the through track's.

The rails of a branch show as lines of their own only where they have left the stock rails by more than a head, some
metres behind the point at which the centerlines part. Between the two, a track leaves another tangentially, and its
distance grows with the square of the way; or it leaves at the small angle of a straight switch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import interpolate, left_normals, length_along, project, resample
from ..progress import SILENT, Progress
from ..rails import Centerline

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

BENT_M = 0.0025
"""A branch this far off the parabola, root mean square, has a straight switch: a heel of 0.15 m leaves 3 mm."""

HEEL_STEP_M = 0.5
"""Steps in which the end of a straight switch is sought; they are 3 to 12 m long."""

ROUNDS = 5
"""Rounds of reweighting."""

LONGEST_M = 40.0
"""Longest way back: a branch of 2500 m radius, the widest in use, is 0.3 m off after 39 m."""

SEEN_M = 150.0
"""Farther from its end a branch tells nothing of where it leaves: 40 m before it to 89 m behind, 1.6 m off."""

STEP_M = 0.2
"""Vertex distance on the way back, that of smoothed centerlines."""


def fork_centerlines(lines: Sequence[Centerline], progress: Progress = SILENT) -> list[Centerline]:
    """Lead the ends of branches back onto the tracks they leave, and give these a vertex there.

    Parameters
    ----------
    lines : sequence of Centerline
        Of one gauge and class.
    progress : Progress

    Returns
    -------
    list of Centerline
        In their order; the way back counts as bridged.
    """
    forked = list(lines)
    for branch, end, through in progress.follow(list(_near_ends(lines))):
        turn = 1 if end == 0 else -1
        side, main = forked[branch].xyz[::turn], forked[through].xyz
        start, seen = _seen_from(side[0], side), _seen_from(side[0], main)
        led_back = _led_back(side[start], main[seen])
        if led_back is not None:
            side = np.concatenate([led_back, side[start.stop :]])
            forked[branch] = _prolonged(forked[branch], side[::turn])
            main = np.concatenate([main[: seen.start], _with_vertex(main[seen], led_back[0]), main[seen.stop :]])
            forked[through] = replace(forked[through], xyz=main)
    return forked


def _seen_from(place: np.ndarray, line: np.ndarray) -> slice:
    """Cut out the vertices around the one nearest to a place that lie less than `SEEN_M` away."""
    away = np.hypot(*(line[:, :2] - place[:2]).T)
    nearest = int(np.argmin(away))
    hidden = np.flatnonzero(away >= SEEN_M)
    before, after = hidden[hidden < nearest], hidden[hidden > nearest]
    return slice(before[-1] + 1 if len(before) else 0, after[0] if len(after) else len(line))


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
    start = _start(s, off)
    first = int(np.searchsorted(s, start.at_m))
    joins = max(first, int(np.max(np.flatnonzero(start.misfit_m > MISFIT_M), initial=-1)) + 1)
    if joins > len(s) // 2 or start.at_m < -LONGEST_M:
        return None
    length = s[joins] - start.at_m if s[joins] - start.at_m > STEP_M else 0.0
    along = length_along(through[:, :2])
    parting = t[joins] - np.sign(t[-1] - t[0]) * length
    if not 0 <= parting <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / STEP_M)) + 1)
    chainage = parting + share * (t[joins] - parting)
    lead = interpolate(through, along, chainage)
    grown = share**start.power * (length > 0)
    rise = branch[joins, 2] - np.interp(t[joins], along, through[:, 2])
    lead[:, :2] += (grown * off[joins])[:, None] * interpolate(left_normals(through), along, chainage)
    lead[:, 2] += grown * rise
    return np.concatenate([lead, branch[joins + 1 :]])


@dataclass(frozen=True)
class _Start:
    """How a branch leaves: the place along it, negative before its own start; how its distance grows; the misfit."""

    at_m: float
    power: int
    misfit_m: np.ndarray

    @property
    def rms_m(self) -> float:
        return float(np.sqrt(np.mean(self.misfit_m**2)))


def _start(s: np.ndarray, off: np.ndarray) -> _Start:
    """Tell from distances, (n,) at `s` along a branch, how it leaves the through track: by an arc, else by an angle."""
    side = np.sign(off[-1])
    by_arc = _by_arc(s, side * off)
    if by_arc.rms_m <= BENT_M:
        return by_arc
    by_angle = min(
        (_by_angle(s, side * off, heel) for heel in np.arange(HEEL_STEP_M, s[-1] / 2, HEEL_STEP_M)),
        key=lambda start: start.rms_m,
    )
    return by_angle if by_angle.rms_m < by_arc.rms_m / 2 and np.isfinite(by_angle.at_m) else by_arc


def _by_arc(s: np.ndarray, off: np.ndarray) -> _Start:
    """Fit a parabola that touches the through track; its start is infinitely far where the distance does not grow.

    The root of the distance grows evenly. What the raster bent where rails merge loses its say in a few rounds.
    """
    root = np.sqrt(np.maximum(off, 0.0))
    weight = root + np.sqrt(TOUCH_M)  # a distance's root is the less certain the smaller it is
    trust = np.ones_like(s)
    for _ in range(ROUNDS):
        growth, first = np.polyfit(s, root, 1, w=weight * trust)
        misfit = np.abs(off - np.maximum(growth * s + first, 0.0) ** 2)
        trust = 1 / np.sqrt(1 + (misfit / MISFIT_M) ** 2)
    return _Start(-first / growth if growth > 0 else -np.inf, 2, misfit)


def _by_angle(s: np.ndarray, off: np.ndarray, heel_m: float) -> _Start:
    """Fit a straight switch up to `heel_m` along the branch and the arc behind it."""
    terms = np.column_stack([np.ones_like(s), s, np.maximum(s - heel_m, 0.0) ** 2])
    (first, slope, bend), *_ = np.linalg.lstsq(terms, off, rcond=None)
    misfit = np.abs(off - terms @ (first, slope, bend))
    return _Start(-first / slope if slope > 0 and bend > 0 else -np.inf, 1, misfit)


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
