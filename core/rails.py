"""The lines that come out: rails and track centerlines, with the figures that go into their fields."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .frame import LocalFrame
from .polyline import length_along
from .raster import RailRaster

SAME_PLACE_M = 1e-9
"""Vertices closer together than this along a line are one."""

NO_GAPS = np.empty((0, 2))


@dataclass(frozen=True)
class Support:
    """How well points support a line, at stations of equal distance along it; (n,) arrays.

    Attributes
    ----------
    t : float
        Plan chainage of the stations, metres.
    points : int
        Points on top of the head that are nearest to the station.
    sigma_m : float
        Standard deviation of the line's lateral position.
    """

    t: np.ndarray
    points: np.ndarray
    sigma_m: np.ndarray

    @property
    def rms_m(self) -> float:
        """Standard deviation of the line as a whole."""
        return float(np.sqrt(np.mean(self.sigma_m**2)))

    def between(self, start: float, end: float) -> Support:
        """Cut out the stretch from `start` to `end`, with one station at least; chainages then count from `start`."""
        inside = (self.t >= start) & (self.t <= end)
        inside[np.argmin(np.abs(self.t - 0.5 * (start + end)))] = True
        return self.select(inside, start)

    def select(self, which: np.ndarray, start: float) -> Support:
        """Keep the stations marked in `which`, (n,) bool; chainages then count from `start`."""
        return Support(self.t[which] - start, self.points[which], self.sigma_m[which])

    def reversed(self, length_m: float) -> Support:
        """Run the line, of this length, the other way."""
        return Support(length_m - self.t[::-1], self.points[::-1], self.sigma_m[::-1])


@dataclass(frozen=True)
class RailLine:
    """The top of one railhead on the head's own axis.

    Attributes
    ----------
    xyz : (n, 3) array
        Vertices in local metres, from the western end (the southern end where the line runs within one degree of
        north); z is NaN everywhere when there were no points to give height.
    rail_id, class_code : int
    points : int
        Rail points that support the line; of a piece of one, the share of them, which may be no whole number.
    resid_mm : float
        Root mean square of the supporting points' offsets across the line.
    sigma_mm : float
        Standard deviation of the line's lateral position: two thirds of the line lie within it.
    bridged_m : float
        Plan length without supporting points.
    gaps : (k, 2) array
        Where these stretches start and end, in plan chainage along the line; none are known of lines read from files.
    support : Support or None
        Support along the line; None for lines read from files.
    """

    xyz: np.ndarray
    rail_id: int
    class_code: int
    points: int
    resid_mm: float
    sigma_mm: float
    bridged_m: float
    gaps: np.ndarray = field(default_factory=NO_GAPS.copy)
    support: Support | None = None

    @property
    def length_m(self) -> float:
        """Length in space; in plan where the line has no height."""
        flat = np.isnan(self.xyz[:, 2]).any()
        return float(length_along(self.xyz[:, :2] if flat else self.xyz)[-1])

    def bridged_before(self, t: np.ndarray) -> np.ndarray:
        """Length of gaps between the start and the chainages `t`, (n,) metres; beyond the line's ends all is gap."""
        beyond = t - np.clip(t, 0.0, length_along(self.xyz[:, :2])[-1])
        if not len(self.gaps):
            return beyond
        passed = np.cumsum(self.gaps[:, 1] - self.gaps[:, 0])
        return beyond + np.interp(t, self.gaps.ravel(), np.repeat(np.append(0.0, passed), 2)[1:-1])

    def between(self, start: float, end: float) -> RailLine:
        """Cut out the stretch between two plan chainages; it gets that share of the points that its stations count."""
        along = length_along(self.xyz[:, :2])
        if start <= 0.0 and end >= along[-1]:
            return self
        start, end = max(start, 0.0), min(end, float(along[-1]))
        inner = (along > start + SAME_PLACE_M) & (along < end - SAME_PLACE_M)
        t = np.concatenate([[start], along[inner], [end]])
        xyz = np.column_stack([np.interp(t, along, column) for column in self.xyz.T])
        gaps = np.clip(self.gaps, start, end)
        gaps = gaps[gaps[:, 1] > gaps[:, 0]] - start
        support, share = None, (end - start) / along[-1]
        if self.support is not None:
            last = np.inf if end >= self.support.t[-1] else end
            support = self.support.select((self.support.t >= start) & (self.support.t < last), start)
            share = support.points.sum() / max(self.support.points.sum(), 1)
        return replace(self, xyz=xyz, points=self.points * share, gaps=gaps, support=support)

    def reversed(self) -> RailLine:
        """Run the same line the other way."""
        plan_length = length_along(self.xyz[:, :2])[-1]
        support = None if self.support is None else self.support.reversed(plan_length)
        return replace(self, xyz=self.xyz[::-1], gaps=plan_length - self.gaps[::-1, ::-1], support=support)


@dataclass(frozen=True)
class Centerline:
    """The line midway between the two rails of a track.

    Attributes
    ----------
    xyz : (n, 3) array
        Vertices in local metres, directed like `RailLine.xyz`.
    track_id, class_code : int
    left_ids, right_ids : tuple of int
        Rails on either side, seen along the line, in the order they are met.
    gauge_mm, gaugesd_mm : float
        Mean and standard deviation of the distance between the rail lines less the head width.
    cant_mm, cantmax_mm : float
        Left minus right height: its mean, and its largest value in size with its sign.
    bridged_m : float
        Plan length along which at least one rail has no supporting points.
    """

    xyz: np.ndarray
    track_id: int
    class_code: int
    left_ids: tuple[int, ...]
    right_ids: tuple[int, ...]
    gauge_mm: float
    gaugesd_mm: float
    cant_mm: float
    cantmax_mm: float
    bridged_m: float

    @property
    def length_m(self) -> float:
        """Length in space; in plan where the line has no height."""
        flat = np.isnan(self.xyz[:, 2]).any()
        return float(length_along(self.xyz[:, :2] if flat else self.xyz)[-1])


def cell_borders(chainage: np.ndarray) -> np.ndarray:
    """Borders, (n + 1,), of what each of n stations stands for: half way to its neighbours."""
    return np.concatenate([chainage[:1], 0.5 * (chainage[1:] + chainage[:-1]), chainage[-1:]])


@dataclass(frozen=True)
class TrackGeometry:
    """Geometry of one track at stations along its centerline, (n,) arrays; NaN where it can't be known.

    Attributes
    ----------
    track_id : int
    xyz : (n, 3) array
        Stations on the centerline, local metres.
    chainage_m : float
        Plan distance from the centerline's start.
    gauge_mm : float
        Distance between the rail lines less the head width.
    cant_mm : float
        Left minus right height.
    twist_mm : float
        Change of cant over 3 m, ahead minus behind; NaN where the track does not reach as far.
    radius_m : float
        Positive to the left, NaN above 10 km.
    grade_pm : float
        Rise in per mille.
    sigma_mm : float
        Standard deviation of the centerline's lateral position.
    points : int
        Points on both rails that are nearest to the station.
    bridged : bool
        Whether for most of the station's length a rail has no points or is not there.
    """

    track_id: int
    xyz: np.ndarray
    chainage_m: np.ndarray
    gauge_mm: np.ndarray
    cant_mm: np.ndarray
    twist_mm: np.ndarray
    radius_m: np.ndarray
    grade_pm: np.ndarray
    sigma_mm: np.ndarray
    points: np.ndarray
    bridged: np.ndarray

    @property
    def cells_m(self) -> np.ndarray:
        """Length that each station stands for, (n,)."""
        return np.diff(cell_borders(self.chainage_m))

    @property
    def bridged_m(self) -> float:
        """Length of the stations that are bridged."""
        return float(self.cells_m[self.bridged].sum())


@dataclass(frozen=True)
class RailNetwork:
    """Everything extracted from one cloud.

    Attributes
    ----------
    rails : tuple of RailLine
    centerlines : tuple of Centerline
    frame : LocalFrame
        Turns the lines' local metres into the cloud's coordinates.
    engine : str
        Engine and device that ran the network, for ENGINE_USED.
    geometry : tuple of TrackGeometry
        Of each centerline in turn; none unless asked for.
    cleaned : tuple of RailRaster
        What the network made of each class in turn; none unless asked for.
    """

    rails: tuple[RailLine, ...]
    centerlines: tuple[Centerline, ...]
    frame: LocalFrame
    engine: str = field(default="")
    geometry: tuple[TrackGeometry, ...] = ()
    cleaned: tuple[RailRaster, ...] = ()
