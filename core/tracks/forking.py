"""Forks: the centerline of a branch is extended back to the point where it leaves the through track.

The rails of a branch become separate lines only where they are more than a head from the stock rails, some metres
beyond the point where the centerlines part. In between, a track leaves another tangentially, so that its distance grows
with the square of the way, or it leaves at the small angle of a straight switch. See docs/method.md section 8.7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import ARC, STRAIGHT, PartingLaw, left_of
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..rails import Centerline

STATION_M = 0.5
"""Spacing of the stations that are searched for the track that an end may have left."""

MAX_APART_M = 0.3
"""Largest distance of the end of a branch from the track that it left: rails are separate when heads and flangeway are
side by side, at 0.12 m, or a few raster cells later."""

TOUCH_M = 0.002
"""An end this close to a track is on it, within the tolerance of thinning."""

FIT_WITHIN_M = 0.8
"""A branch bends evenly at least up to this distance: 6 m along the branch of a tramway, 63 m along the widest one."""

MIN_LENGTH_M = 3.0
"""Shorter branches do not show where they begin."""

MISFIT_M = 0.01
"""Largest distance of a branch from the parabola: that of a lead that begins straight, or of stairs of the raster."""

BENT_M = 0.0025
"""A branch further from the parabola, root mean square, has a straight switch: a heel of 0.15 m leaves 3 mm."""

HEEL_STEP_M = 0.5
"""Step in which the end of a straight switch is searched; straight switches are 3 to 12 m long."""

ROUNDS = 5
"""Rounds of reweighting."""

MAX_BACK_M = 40.0
"""Largest extension: a branch of 2500 m radius, the widest in use, is 0.3 m from the through track after 39 m."""

SEEN_M = 150.0
"""Length of either line next to the end that is considered. What matters is between 40 m before the end and 89 m behind
it, where the widest branch is 1.6 m from the through track."""

VERTEX_STEP_M = 0.2
"""Spacing of the vertices of the extension, as on smoothed centerlines."""


def fork_centerlines(lines: Sequence[Centerline], progress: Progress = SILENT) -> list[Centerline]:
    """Extend branches back to the tracks that they leave, and give these tracks a vertex there.

    Takes lines of one gauge and class and returns them in the same order; the extension counts as bridged.
    """
    forked = list(lines)
    for branch, end, through in progress.follow(list(_near_ends(lines))):
        turn = 1 if end == 0 else -1
        side, main = forked[branch].xyz[::turn], forked[through].xyz
        start, seen = _seen_from(side[0], side), _seen_from(side[0], main)
        extended = _extended(side[start], main[seen])
        if extended is not None:
            side = np.concatenate([extended, side[start.stop :]])
            forked[branch] = _with_bridged(forked[branch], side[::turn])
            main = np.concatenate([main[: seen.start], _with_vertex(main[seen], extended[0]), main[seen.stop :]])
            forked[through] = replace(forked[through], xyz=main)
    return forked


def _seen_from(place: np.ndarray, line: np.ndarray) -> slice:
    """Return the range of vertices around the one nearest to a place that are less than `SEEN_M` away."""
    away = np.hypot(*(line[:, :2] - place[:2]).T)
    nearest = int(np.argmin(away))
    hidden = np.flatnonzero(away >= SEEN_M)
    before, after = hidden[hidden < nearest], hidden[hidden > nearest]
    return slice(before[-1] + 1 if len(before) else 0, after[0] if len(after) else len(line))


def _near_ends(lines: Sequence[Centerline]) -> Iterator[tuple[int, int, int]]:
    """Yield the ends near another line: number of the line, 0 or -1 for its end, and number of the nearest line."""
    if len(lines) < 2:
        return
    stations_of = [line.line.resampled(STATION_M).xy for line in lines]
    number = np.repeat(np.arange(len(lines)), [len(one) for one in stations_of])
    stations = np.concatenate(stations_of)
    tree = cKDTree(stations)
    for line, end in ((line, end) for line in range(len(lines)) for end in (0, -1)):
        place = lines[line].xyz[end, :2]
        near = [other for other in tree.query_ball_point(place, MAX_APART_M + STATION_M) if number[other] != line]
        if near:
            yield line, end, int(number[min(near, key=lambda other: np.hypot(*(stations[other] - place)))])


def _extended(branch: np.ndarray, through: np.ndarray) -> np.ndarray | None:
    """Extend the start of a branch back to a through track, both (n, 3); None if they do not meet within reach."""
    s, feet = Polyline(branch).t, Polyline(through).feet(branch[:, :2], FIT_WITHIN_M)
    order = np.argsort(feet.point)
    count = int(np.argmin(np.append(feet.point[order] == np.arange(len(order)), False)))
    s, t, off = s[:count], feet.t[order][:count], feet.across[order][:count]
    if not count or s[-1] < MIN_LENGTH_M or abs(off[0]) > MAX_APART_M:
        return None
    law, misfit_m = _law(s, off)
    first = int(np.searchsorted(s, law.touch))
    joins = max(first, int(np.max(np.flatnonzero(misfit_m > MISFIT_M), initial=-1)) + 1)
    if joins > len(s) // 2 or law.touch < -MAX_BACK_M:
        return None
    length = s[joins] - law.touch if s[joins] - law.touch > VERTEX_STEP_M else 0.0
    along = Polyline(through).t
    parting = t[joins] - np.sign(t[-1] - t[0]) * length
    if not 0 <= parting <= along[-1]:
        return None
    share = np.linspace(0.0, 1.0, int(np.ceil(length / VERTEX_STEP_M)) + 1)
    chainage = parting + share * (t[joins] - parting)
    grown = share**law.power * (length > 0)
    rise = branch[joins, 2] - np.interp(t[joins], along, through[:, 2])
    plan = left_of(through[:, :2], chainage, grown * off[joins])
    start = np.column_stack([plan, np.interp(chainage, along, through[:, 2]) + grown * rise])
    return np.concatenate([start, branch[joins + 1 :]])


def _law(s: np.ndarray, off: np.ndarray) -> tuple[PartingLaw, np.ndarray]:
    """Find the law by which a branch leaves the through track: an arc, or else an angle; and the misfit, metres.

    Given are the distances between the tracks, (n,), at `s` along the branch.
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
    """Fit a parabola that touches the through track, with less weight where the raster bent merging rails."""
    weights = np.sqrt(np.maximum(off, 0.0)) + np.sqrt(TOUCH_M)  # the smaller a distance, the less certain its root
    trust = np.ones_like(s)
    for _ in range(ROUNDS):
        law = PartingLaw.fitted(s, off, ARC, weights * trust)
        misfit_m = np.abs(off - law(s))
        trust = 1 / np.sqrt(1 + (misfit_m / MISFIT_M) ** 2)
    return law, misfit_m


def _angle(s: np.ndarray, off: np.ndarray, heel_m: float) -> tuple[PartingLaw, np.ndarray]:
    """Fit a straight switch up to `heel_m` along the branch and an arc behind it."""
    terms = np.column_stack([np.ones_like(s), s, np.maximum(s - heel_m, 0.0) ** 2])
    (root, slope, bend), *_ = np.linalg.lstsq(terms, off, rcond=None)
    return PartingLaw(slope if bend > 0 else 0.0, root, STRAIGHT), np.abs(off - terms @ (root, slope, bend))


def _rms(misfit_m: np.ndarray) -> float:
    return float(np.sqrt(np.mean(misfit_m**2)))


def _with_bridged(line: Centerline, xyz: np.ndarray) -> Centerline:
    """Give a branch its new vertices; the extension has no rails of its own."""
    added = Polyline(xyz).length_m - line.line.length_m
    return replace(line, xyz=xyz, bridged_m=line.bridged_m + max(added, 0.0))


def _with_vertex(xyz: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """Give a line a vertex at a place on it; a vertex within `TOUCH_M` moves to the place instead."""
    away = np.hypot(*(xyz[:, :2] - vertex[:2]).T)
    nearest = int(np.argmin(away))
    if away[nearest] <= TOUCH_M:
        moved = xyz.copy()
        moved[nearest] = vertex
        return moved
    line = Polyline(xyz)
    return np.insert(xyz, np.searchsorted(line.t, line.feet(vertex[None, :2], TOUCH_M).t), vertex, axis=0)
