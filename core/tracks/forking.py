"""Forks: where tracks part, the branch's centerline is led back to the point at which it leaves the through track's.

The rails of a branch show as lines of their own only where they have left the stock rails by more than a head, some
metres behind the point at which the centerlines part. Between the two, a track leaves another tangentially, and its
distance grows with the square of the way; or it leaves at the small angle of a straight switch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.parting import ARC, STRAIGHT, PartingLaw, left_of
from ..polyline import length_along, project, resample
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
    law, misfit_m = _law(s, off)
    first = int(np.searchsorted(s, law.touch))
    joins = max(first, int(np.max(np.flatnonzero(misfit_m > MISFIT_M), initial=-1)) + 1)
    if joins > len(s) // 2 or law.touch < -LONGEST_M:
        return None
    length = s[joins] - law.touch if s[joins] - law.touch > STEP_M else 0.0
    along = length_along(through[:, :2])
    parting = t[joins] - np.sign(t[-1] - t[0]) * length
    if not 0 <= parting <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / STEP_M)) + 1)
    chainage = parting + share * (t[joins] - parting)
    grown = share**law.power * (length > 0)
    rise = branch[joins, 2] - np.interp(t[joins], along, through[:, 2])
    plan = left_of(through[:, :2], chainage, grown * off[joins])
    lead = np.column_stack([plan, np.interp(chainage, along, through[:, 2]) + grown * rise])
    return np.concatenate([lead, branch[joins + 1 :]])


def _law(s: np.ndarray, off: np.ndarray) -> tuple[PartingLaw, np.ndarray]:
    """Find by which law a branch leaves the through track, an arc's or else an angle's, and the misfit to it, metres.

    Given are the distances, (n,), at `s` along the branch.
    """
    off = np.sign(off[-1]) * off
    arc, arc_misfit_m = _arc(s, off)
    if _rms(arc_misfit_m) <= BENT_M:
        return arc, arc_misfit_m
    heels_m = np.arange(HEEL_STEP_M, s[-1] / 2, HEEL_STEP_M)
    angle, angle_misfit_m = min((_angle(s, off, heel_m) for heel_m in heels_m), key=lambda found: _rms(found[1]))
    if _rms(angle_misfit_m) < _rms(arc_misfit_m) / 2 and np.isfinite(angle.touch):
        return angle, angle_misfit_m
    return arc, arc_misfit_m


def _arc(s: np.ndarray, off: np.ndarray) -> tuple[PartingLaw, np.ndarray]:
    """Fit a parabola that touches the through track.

    What the raster bent where rails merge loses its weight in a few rounds.
    """
    weights = np.sqrt(np.maximum(off, 0.0)) + np.sqrt(TOUCH_M)  # a distance's root is less certain the smaller it is
    trust = np.ones_like(s)
    for _ in range(ROUNDS):
        law = PartingLaw.fitted(s, off, ARC, weights * trust)
        misfit_m = np.abs(off - law(s))
        trust = 1 / np.sqrt(1 + (misfit_m / MISFIT_M) ** 2)
    return law, misfit_m


def _angle(s: np.ndarray, off: np.ndarray, heel_m: float) -> tuple[PartingLaw, np.ndarray]:
    """Fit a straight switch up to `heel_m` along the branch and the arc behind it."""
    terms = np.column_stack([np.ones_like(s), s, np.maximum(s - heel_m, 0.0) ** 2])
    (root, slope, bend), *_ = np.linalg.lstsq(terms, off, rcond=None)
    return PartingLaw(slope if bend > 0 else 0.0, root, STRAIGHT), np.abs(off - terms @ (root, slope, bend))


def _rms(misfit_m: np.ndarray) -> float:
    return float(np.sqrt(np.mean(misfit_m**2)))


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
