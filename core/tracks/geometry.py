"""Track geometry by chainage: gauge, cant, twist, radius and gradient, and how well the points support them.

See docs/method.md section 9.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ..lines.smoothing import PROFILE_SIGMA_M, smooth_line, smooth_profile
from ..polyline import Polyline, distance_to
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine, TrackGeometry, cell_borders
from ..standards import Gauge, width_at
from .chaining import MEETING_STEP_M
from .midline import Meeting, Side, bridged_steps
from .parallels import most_common_spacing

TWIST_BASE_M = 3.0
"""Length over which the change of cant is stated, as in the standards for track geometry. Up to half of it from the
nearest place with both rails, gauge and cant are given."""

HALF_CHORD_M = 10.0
"""Distance of the outer ones of the three points that define the radius: it is measured on a chord of 20 m."""

PLAN_SIGMA_M = 3.0
"""Sigma of PAEK for these points: it leaves an error of half a millimetre, 1 % at a radius of 600 m. A circle of 25 m
shrinks by 9 mm, less than 0.1 % of its radius."""

MIN_VERSINE_M = 0.005
"""Versine below which a curve cannot be distinguished from a straight: beyond a radius of 10 km on a chord of 20 m."""

GRADE_BASE_M = 10.0
"""Length over which the gradient is measured: 1 mm of height makes 0.1 per mille."""


def measure_track_geometry(
    centerlines: Sequence[Centerline],
    rails: Sequence[RailLine],
    head_width_m: float,
    step_m: float = 1.0,
    progress: Progress = SILENT,
    gauges: Sequence[Gauge] = (),
) -> tuple[TrackGeometry, ...]:
    """Measure tracks at equal distances along their centerlines; the last station is the end of the track.

    The `left_ids` and `right_ids` of centerlines refer to the rails; if none of those exist, the nearest rails at gauge
    serve. Rails are preferably from `measure_rails`, with heights smoothed over 1 m only and with support by chainage.
    For a rail without support, `sigma_mm` is used everywhere and `points` are assumed to be evenly spaced; without
    known gaps, it counts as bridged only where it is missing. `gauges` are those that tracks may have, if the width of
    the heads depends on them.
    """
    track_rails = _TrackRails(rails)
    measured = []
    for line in progress.follow(centerlines):
        width_m = head_width_m
        if gauges and np.isfinite(line.gauge_mm):
            width_m = width_at(line.gauge_mm / 1000 + head_width_m, gauges)
        measured.append(_measure(line, track_rails, width_m, step_m))
    return tuple(measured)


class _TrackRails:
    """The rails between which tracks may run; properties of all of them are computed once, on demand."""

    def __init__(self, rails: Sequence[RailLine]) -> None:
        self.rails = rails

    @cached_property
    def spacing_m(self) -> float:
        """Most common distance of parallel rails."""
        return most_common_spacing(self.rails, 0.0) or 0.0

    @cached_property
    def all_rails(self) -> Side:
        """All rails."""
        return self._side(range(len(self.rails)))

    def named(self, ids: Sequence[int]) -> Side:
        """Return the rails with these ids, or all rails if there are none."""
        numbers = [number for number, rail in enumerate(self.rails) if rail.rail_id in ids]
        return self._side(numbers) if numbers else self.all_rails

    def _side(self, numbers: Sequence[int]) -> Side:
        spans = [(number, (0.0, self.rails[number].line.length_m)) for number in numbers]
        return Side.of(self.rails, spans, 0.0)


def _measure(line: Centerline, track_rails: _TrackRails, head_width_m: float, step_m: float) -> TrackGeometry:
    """Measure one track."""
    rails = track_rails.rails
    stations = line.line.resampled(MEETING_STEP_M)
    fine, along, normals = stations.xyz, stations.t, stations.normals
    # The last station is the end of the track, so that the part after the last multiple of the step is covered.
    chainage = np.append(np.arange(max(round(along[-1] / step_m), 1)) * step_m, along[-1])
    half = 0.5 * (line.gauge_mm / 1000 + head_width_m if np.isfinite(line.gauge_mm) else track_rails.spacing_m)
    left = track_rails.named(line.left_ids).meet(fine[:, :2], normals, half)
    right = track_rails.named(line.right_ids).meet(fine[:, :2], -normals, half)
    cant = left.height_m - right.height_m
    gauge = np.hypot(left.distance_m + right.distance_m, np.nan_to_num(cant)) - head_width_m
    strips = np.stack([_strips(rails, left), _strips(rails, right)])
    at = _nearest(along, chainage)
    borders = cell_borders(chainage)
    cells = np.stack([borders[:-1], borders[1:]])
    points = _whole(_points(rails, left, along, cells) + _points(rails, right, along, cells))
    sigma_m = _sigma_of_both(rails, left, right, strips[:, :, 2])
    sigmaz_m = _height_sigma_of_both(rails, left, right)
    bridged = np.concatenate([[0.0], np.cumsum(bridged_steps(rails, left, right, along))])
    twist_at = np.add.outer(0.5 * TWIST_BASE_M * np.array([-1, 1]), chainage)
    behind, ahead = _profile(along, cant, twist_at.ravel()).reshape(2, -1)
    reached = (twist_at[0] >= 0) & (twist_at[1] <= along[-1])
    return TrackGeometry(
        track_id=line.track_id,
        xyz=line.line.at(chainage),
        chainage_m=chainage,
        gauge_mm=1000 * _profile(along, gauge, chainage),
        cant_mm=1000 * _profile(along, cant, chainage),
        twist_mm=1000 * np.where(reached, ahead - behind, np.nan),
        radius_m=_radius(line.xyz[:, :2], chainage),
        grade_pm=_grade(along, fine[:, 2], chainage),
        sigma_mm=1000 * np.interp(chainage, along, sigma_m),
        points=points,
        bridged=np.diff(np.interp(cells, along, bridged), axis=0)[0] > 0.5 * np.diff(cells, axis=0)[0],
        strips=strips[:, at, 0].max(axis=0).astype(int),
        strip_mm=1000 * np.fmax(*strips[:, at, 1]),
        sigmaz_mm=1000 * np.interp(chainage, along, sigmaz_m),
    )


def _profile(along: np.ndarray, values: np.ndarray, chainage: np.ndarray) -> np.ndarray:
    """Smooth the known values of a profile; NaN far from all of them."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(chainage), np.nan)
    smooth = smooth_profile(along[known], values[known], PROFILE_SIGMA_M, chainage)
    return np.where(distance_to(along[known], chainage) <= 0.5 * TWIST_BASE_M, smooth, np.nan)


def _radius(xy: np.ndarray, chainage: np.ndarray) -> np.ndarray:
    """Return the radius of the circle through three points; near an end, of the last such circle on the line."""
    length = Polyline(xy).length_m
    half = min(HALF_CHORD_M, 0.5 * length)
    middle = np.clip(chainage, half, length - half)
    at = np.concatenate([middle - half, middle, middle + half])
    before, here, after = np.split(smooth_line(xy, PLAN_SIGMA_M, np.clip(at, 0.0, length), ends="free"), 3)
    first, second, chord = here - before, after - here, after - before
    doubled_area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    sides = np.prod([np.hypot(*side.T) for side in (first, second, chord)], axis=0)
    curvature = 2 * doubled_area / sides
    bent = 0.5 * np.abs(curvature) * half**2 >= MIN_VERSINE_M
    return np.where(bent, 1 / np.where(bent, curvature, 1.0), np.nan)


def _grade(along: np.ndarray, z: np.ndarray, chainage: np.ndarray) -> np.ndarray:
    """Return the gradient in per mille; near the ends, over the part of the base that is on the line."""
    ends = np.clip([chainage - 0.5 * GRADE_BASE_M, chainage + 0.5 * GRADE_BASE_M], 0.0, along[-1])
    return 1000 * np.diff(np.interp(ends, along, z), axis=0)[0] / np.diff(ends, axis=0)[0]


def _sigma(
    rails: Sequence[RailLine], side: Meeting, whole_mm: str = "sigma_mm", along_m: str = "sigma_m"
) -> np.ndarray:
    """Look up a standard deviation of the rails at the meetings, (n,) metres; that of the whole rail if need be."""
    sigma = np.full(len(side.t), np.nan)
    for number in np.unique(side.rail):
        mine, rail = (side.rail == number) & np.isfinite(side.t), rails[number]
        sigma[mine] = (
            getattr(rail, whole_mm) / 1000
            if rail.support is None
            else np.interp(side.t[mine], rail.support.t, getattr(rail.support, along_m))
        )
    return sigma


def _sigma_of_both(rails: Sequence[RailLine], left: Meeting, right: Meeting, shared: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the middle, (n,) metres, given what both rails share, (2, n): that of strips."""
    sigma = np.stack([_sigma(rails, left), _sigma(rails, right)])
    own = np.sqrt(np.maximum(sigma**2 - shared**2, 0.0))
    return np.hypot(0.5 * np.hypot(*own), 0.5 * shared.sum(axis=0))


def _height_sigma_of_both(rails: Sequence[RailLine], left: Meeting, right: Meeting) -> np.ndarray:
    """Return the standard deviation of the height of the middle, (n,) metres.

    That of one rail: what hides heads, such as trains and roads, hides both, and passes are off in height alike.
    """
    squares = [_sigma(rails, side, "sigmaz_mm", "sigmaz_m") ** 2 for side in (left, right)]
    return np.sqrt(np.mean(squares, axis=0))


def _strips(rails: Sequence[RailLine], side: Meeting) -> np.ndarray:
    """Look up the strips of the rails at the meetings, (n, 3); see `Support.strips`."""
    found = np.tile([1.0, np.nan, 0.0], (len(side.t), 1))
    for number in np.unique(side.rail):
        mine, support = (side.rail == number) & np.isfinite(side.t), rails[number].support
        if support is not None:
            found[mine] = support.strips[_nearest(support.t, side.t[mine])]
    return found


def _nearest(t: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the number of the nearest of chainages `t`, ascending, for each place."""
    return np.searchsorted(0.5 * (t[1:] + t[:-1]), places)


def _points(rails: Sequence[RailLine], side: Meeting, along: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Count the points on the rails of one side in cells along the track, given by their borders, (2, n)."""
    total = np.zeros(cells.shape[1])
    for number in np.unique(side.rail):
        mine = (side.rail == number) & np.isfinite(side.t)
        if mine.sum() < 2:
            continue
        t = side.t[mine]
        steps = np.abs(np.diff(_points_before(rails[number], t)))
        # Where a ring closes, or the rail is met again further on, the part in between was not passed.
        steps[np.abs(np.diff(t)) > 2 * MEETING_STEP_M] = 0.0
        passed = np.concatenate([[0.0], np.cumsum(steps)])
        total += np.diff(np.interp(cells, along[mine], passed), axis=0)[0]
    return total


def _whole(counts: np.ndarray) -> np.ndarray:
    """Round counts so that the sum of any successive ones changes by at most one."""
    total = np.round(np.cumsum(counts), 6)  # halves are common: their rounding must not depend on the last bit
    return np.diff(np.round(total), prepend=0.0).astype(int)


def _points_before(rail: RailLine, t: np.ndarray) -> np.ndarray:
    """Count the points between the start of a rail and chainages, (n,); without support, as if evenly spaced."""
    support = rail.support
    if support is None:
        return rail.points * np.clip(t / rail.line.length_m, 0.0, 1.0)
    return np.interp(t, support.t, np.cumsum(support.points) - 0.5 * support.points)
