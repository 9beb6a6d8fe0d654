"""The frame of a track: along the centerline, across it in the plane of both rail tops, and perpendicular to it.

s is the plan distance along the centerline, v the distance to the left in the plane of the rail tops, and w the height
above this plane, from the middle between both tops. See docs/clearance.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial import cKDTree

from ..polyline import STATION_M, Chords, Polyline, interpolate
from ..rails import Centerline, RailLine
from ..spread import rms

STEP_M = 0.5
"""Distance of the stations: an arc between them is within 0.1 mm of its chord from radius 300 m on."""

DIRECTION_M = 6.0
"""Length over which direction and gradient are fitted: a vertex that is 1 mm off turns the line by 0.1 mrad, which is
half a millimetre 4 m aside."""

CURVATURE_M = 15.0
"""Length over which curvature is the slope of the direction: shorter than the shortest transition curve."""

SPACING_M, HEAD_M = 1.50, 0.07
"""Distance of the middles of rails where the gauge is not stated, that of standard gauge; and the width of a head, by
which it exceeds the gauge."""

RAIL_REACH_M = 0.35
"""A rail is looked for within this distance of its expected place: less than half of the narrowest spacing, so that the
rail of another branch is none."""

LINE_SIGMA_M, CANT_SIGMA_M = 0.0010, 0.0006
"""Standard errors of the centerline across and of the cant where the rails state none: those of dense mobile lidar."""

UNKNOWN_CANT_M = 0.15
"""Cant that a track without rails may have if its centerline states none: the largest in regular use."""

LEAST_NOISE_M, USUAL_NOISE_M = 0.003, 0.005
"""Noise of a point: at least that of the best mobile scanners, and the usual one where the rails do not show it."""


@dataclass(frozen=True)
class Course:
    """A track at stations of equal distance in plan, `STEP_M` or a little less; (n,) arrays.

    `xyz`, (n, 3), are metres from the zero of the coordinate system. Curvature, 1/m, is positive to the left, grade
    uphill. The cant, left minus right rail top, is 0 where rails are missing; `spacing_m` is the 3D distance of both
    tops, and the height of a rail is interpolated where it is `bridged`. `wide_m`, (n, 2), is what the profile is
    widened by on the left and on the right.

    The gauge is NaN if unknown. Standard errors are those of the line across, of the cant, and of a point; that of an
    unknown cant holds all of it. `first` is the number of the first station along the whole line.
    """

    track_id: int
    step_m: float
    xyz: np.ndarray
    heading: np.ndarray
    curvature: np.ndarray
    grade: np.ndarray
    cant_m: np.ndarray
    spacing_m: np.ndarray
    bridged: np.ndarray
    wide_m: np.ndarray
    gauge_m: float
    sigma_m: float
    cant_sigma_m: float
    noise_m: float
    has_cant: bool
    first: int = 0

    @property
    def s(self) -> np.ndarray:
        """Chainages of the stations, (n,)."""
        return self.step_m * (self.first + np.arange(len(self.xyz)))

    @property
    def by_station(self) -> dict[str, Any]:
        """What it has for each station, by name."""
        return {name: values for name, values in vars(self).items() if isinstance(values, np.ndarray)}

    def part(self, low: int, high: int) -> Course:
        """Return the stations from number `low` to before `high`, with their chainages."""
        cut = {name: values[low:high] for name, values in self.by_station.items()}
        return replace(self, **cut, first=self.first + low)

    @property
    def length_m(self) -> float:
        """Length in plan."""
        return self.step_m * (len(self.xyz) - 1)

    @property
    def roll(self) -> np.ndarray:
        """Angle of the plane of the rail tops, (n,) radians; positive if the left rail is higher."""
        return np.arcsin(np.clip(self.cant_m / self.spacing_m, -1.0, 1.0))

    def at(self, s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return values of the stations, (n,) or (n, d), at chainages."""
        return np.interp(s, self.s, values) if values.ndim == 1 else interpolate(values, self.s, s)

    def station(self, s: np.ndarray) -> np.ndarray:
        """Return the number of the station nearest to chainages."""
        return np.clip(np.rint(s / self.step_m) - self.first, 0, len(self.xyz) - 1).astype(np.int64)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.xyz[:, :2])

    def near(self, xy: np.ndarray, reach_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return which places, (m, 2), are within reach in plan, and the station nearest to each of these."""
        away, station = self._tree.query(xy, distance_upper_bound=reach_m)
        within = np.flatnonzero(np.isfinite(away))
        return within, station[within]

    def located(self, xyz: np.ndarray, station: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return s, v and w of points, (m, 3), given the station nearest to each; s is NaN beyond the ends of the line.

        Their feet are on the arc of the station, by formulas without a special case where the track is straight.
        """
        east, north = (xyz[:, :2] - self.xyz[station, :2]).T
        cos, sin = np.cos(self.heading)[station], np.sin(self.heading)[station]
        a, b, k = east * cos + north * sin, north * cos - east * sin, self.curvature[station]
        u, q = a / (1.0 - k * b), k * (a**2 + b**2) - 2.0 * b
        ahead, left = u * (1.0 - (k * u) ** 2 / 3.0), -q / (1.0 + np.sqrt(1.0 + k * q))
        s, grade = (station + self.first) * self.step_m + ahead, self.grade[station]
        up = (xyz[:, 2] - self.xyz[station, 2] - grade * ahead) / np.sqrt(1.0 + grade**2)
        roll = np.interp(s, self.s, self.roll)
        cos, sin = np.cos(roll), np.sin(roll)
        beside = (s >= self.s[0]) & (s <= self.s[-1]) & (np.abs(ahead) <= self.step_m)
        return np.where(beside, s, np.nan), left * cos + up * sin, up * cos - left * sin

    def places(self, s: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the places of s, v and w, (m, 3) metres from the zero of the coordinate system."""
        roll, heading, grade = (self.at(s, one) for one in (self.roll, self.heading, self.grade))
        across, up = v * np.cos(roll) - w * np.sin(roll), v * np.sin(roll) + w * np.cos(roll)
        plan = self.at(s, self.xyz)
        off = np.column_stack([-np.sin(heading) * across, np.cos(heading) * across, up * np.sqrt(1.0 + grade**2)])
        return plan + off

    def sigma_at(self, w: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return the standard error of v that line and cant cause at heights, (m,) metres."""
        return np.hypot(self.sigma_m, w * self.cant_sigma_m / self.at(s, self.spacing_m))


def course_of(line: Centerline, rails: Sequence[RailLine]) -> Course:
    """Return the stations of a centerline with the cant of its rails, if there are some.

    Lines are in metres from the zero of the coordinate system, (n, 3).
    """
    own = Polyline(line.xyz).resampled(STEP_M)
    xyz, step_m = own.xyz, own.length_m / (len(own.xyz) - 1)
    direction = _slope(xyz[:, :2], DIRECTION_M, 2, step_m)
    heading = np.unwrap(np.arctan2(direction[:, 1], direction[:, 0]))
    spacing_m = line.gauge_mm / 1000 + HEAD_M if np.isfinite(line.gauge_mm) else SPACING_M
    feet, bridged = _feet(xyz, heading, rails, spacing_m)
    between = feet[0] - feet[1]
    has_cant = bool(np.isfinite(between).any())
    doubt_m = line.cantmax_mm / 1000 if np.isfinite(line.cantmax_mm) else UNKNOWN_CANT_M
    cant_sigma_m = _mean_error([rail.sigmaz_mm for rail in rails], CANT_SIGMA_M, 2**0.5)
    return Course(
        track_id=line.track_id,
        step_m=step_m,
        xyz=xyz,
        heading=heading,
        curvature=_slope(heading[:, None], CURVATURE_M, 1, step_m)[:, 0],
        grade=_slope(xyz[:, 2:], DIRECTION_M, 1, step_m)[:, 0],
        cant_m=_filled(own.t, between[:, 2], 0.0),
        spacing_m=_filled(own.t, np.linalg.norm(between, axis=1), spacing_m),
        bridged=bridged,
        wide_m=np.zeros((len(xyz), 2)),
        gauge_m=line.gauge_mm / 1000,
        sigma_m=_mean_error([rail.sigma_mm for rail in rails], LINE_SIGMA_M, 0.5**0.5),
        cant_sigma_m=cant_sigma_m if has_cant else float(np.hypot(doubt_m, cant_sigma_m)),
        noise_m=max(_mean_error([rail.resid_mm for rail in rails], USUAL_NOISE_M), LEAST_NOISE_M),
        has_cant=has_cant,
    )


def _slope(values: np.ndarray, length_m: float, order: int, step_m: float) -> np.ndarray:
    """Return the derivative of values, (n, d), by least squares over a length; exact for polynomials of that order."""
    window = min(2 * int(round(length_m / step_m / 2)) + 1, len(values) - 1 + len(values) % 2)
    return savgol_filter(values, window, min(order, window - 1), deriv=1, delta=step_m, axis=0, mode="interp")


def _feet(
    xyz: np.ndarray, heading: np.ndarray, rails: Sequence[RailLine], spacing_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of the left and of the right rail, (2, n, 3), NaN without one, and where one has no points."""
    feet, bridged = np.full((2, len(xyz), 3), np.nan), np.zeros(len(xyz), dtype=bool)
    chords = Chords.of([rail.line for rail in rails], STATION_M)
    if not len(chords.first):
        return feet, bridged
    left = np.column_stack([-np.sin(heading), np.cos(heading)])
    for side, sense in enumerate((1.0, -1.0)):
        place, feet[side], t = chords.meet(xyz[:, :2], sense * left, spacing_m / 2, RAIL_REACH_M)
        for at, rail in enumerate(rails):
            bridged |= (chords.line[place] == at) & (np.searchsorted(rail.gaps.ravel(), t) % 2 == 1)
    return feet, bridged | ~np.isfinite(feet).all(axis=(0, 2))


def _filled(t: np.ndarray, values: np.ndarray, default: float) -> np.ndarray:
    """Interpolate values, (n,), across NaN; beyond the first and last, they stay; without any, the default."""
    known = np.isfinite(values)
    return np.interp(t, t[known], values[known]) if known.any() else np.full(len(t), default)


def _mean_error(values_mm: Sequence[float], default_m: float, factor: float = 1.0) -> float:
    """Return the root mean square of stated errors, metres; a default if none is stated."""
    mean_mm = rms(np.array([value for value in values_mm if value > 0]))
    return default_m if np.isnan(mean_mm) else factor * mean_mm / 1000
