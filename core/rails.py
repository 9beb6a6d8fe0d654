"""Results of an extraction: rails, track centerlines and track geometry, with the figures for their fields."""

from __future__ import annotations

from dataclasses import astuple, dataclass, field, replace
from functools import cached_property

import numpy as np

from .frame import LocalFrame
from .polyline import Polyline, length_along
from .raster import RailRaster

NO_GAPS = np.empty((0, 2))

SAME_SUM_M = 0.1
"""Gaps of lines from files explain `bridged_m` if their lengths sum up to it: both are rounded to centimetres."""


@dataclass(frozen=True)
class Support:
    """Support of a line by points, at equidistant stations along it; (n,) arrays.

    Attributes
    ----------
    t : float
        Plan chainage of the stations in metres.
    points : int
        Points on top of the railhead for which this is the nearest station.
    sigma_m : float
        Standard error of the line's lateral position.
    sigmaz_m : float
        Standard error of the line's height; NaN if it has none.
    strips : (n, 3) array
        Number of strips, passes of the scanner, that show the line, the largest distance between two of them, across
        or in height, metres, and the part of the standard error that they share with the other rail. The distance is
        NaN where there is one strip, unless its head is blurred as if there were two.
    """

    t: np.ndarray
    points: np.ndarray
    sigma_m: np.ndarray
    sigmaz_m: np.ndarray
    strips: np.ndarray

    @classmethod
    def of_one_strip(
        cls, t: np.ndarray, points: np.ndarray, sigma_m: np.ndarray, sigmaz_m: float | np.ndarray = np.nan
    ) -> Support:
        """Return the support by points of one strip, which does not blur the head."""
        return cls(t, points, sigma_m, np.full(len(t), sigmaz_m), np.tile([1.0, np.nan, 0.0], (len(t), 1)))

    @property
    def rms_m(self) -> float:
        """Standard error of the whole line (RMS)."""
        return float(np.sqrt(np.mean(self.sigma_m**2)))

    @property
    def rmsz_m(self) -> float:
        """Standard error of the height of the whole line (RMS)."""
        return float(np.sqrt(np.mean(self.sigmaz_m**2)))

    def between(self, start: float, end: float) -> Support:
        """Return the part from `start` to `end`, with at least one station; its chainages count from `start`."""
        inside = (self.t >= start) & (self.t <= end)
        inside[np.argmin(np.abs(self.t - 0.5 * (start + end)))] = True
        return self.select(inside, start)

    def select(self, which: np.ndarray, start: float) -> Support:
        """Return some stations, by a mask, (n,) bool, or by their numbers; their chainages count from `start`."""
        columns = (self.points, self.sigma_m, self.sigmaz_m, self.strips)
        return Support(self.t[which] - start, *(column[which] for column in columns))

    def reversed(self, length_m: float) -> Support:
        """Return the support of the reversed line, given the line's length."""
        return replace(self.select(np.arange(len(self.t))[::-1], 0.0), t=length_m - self.t[::-1])


def _length(xyz: np.ndarray) -> float:
    """Return the length of a line, (n, 3); in plan if it has no heights."""
    has_heights = not np.isnan(xyz[:, 2]).any()
    return float(length_along(xyz if has_heights else xyz[:, :2])[-1])


@dataclass(frozen=True)
class RailLine:
    """A rail: the top of its railhead, on the axis of the railhead.

    Attributes
    ----------
    xyz : (n, 3) array
        Vertices in local metres, from the western end, or from the southern end if the line runs within one degree of
        north. z is NaN everywhere if no points gave heights.
    points : float
        Number of points that support the line; for part of a line, its share of them, which may be a fraction.
    resid_mm : float
        Root mean square of the lateral distances between these points and the line.
    sigma_mm : float
        Standard error of the line's lateral position: two thirds of the line are within it.
    bridged_m : float
        Plan length without supporting points; NaN if that is unknown.
    gaps : (k, 2) array
        Plan chainages at which the sections without points start and end; see `knows_gaps`.
    support : Support or None
        Support along the line; None for lines read from files.
    track_ids : tuple of int
        Tracks of the rail; empty for a lone rail, and before rails are paired.
    sigmaz_mm : float
        Standard error of the line's height; NaN if it is unknown.
    fills : bool
        Whether blunt points show the line where the sharp ones of the cloud do not.
    """

    xyz: np.ndarray
    rail_id: int
    class_code: int
    points: float
    resid_mm: float
    sigma_mm: float
    bridged_m: float
    gaps: np.ndarray = field(default_factory=NO_GAPS.copy)
    support: Support | None = None
    track_ids: tuple[int, ...] = ()
    sigmaz_mm: float = np.nan
    fills: bool = False

    @property
    def length_m(self) -> float:
        """Length in 3D; in plan if the line has no heights."""
        return _length(self.xyz)

    @cached_property
    def line(self) -> Polyline:
        """Line with its chainages in plan."""
        return Polyline(self.xyz)

    @property
    def knows_gaps(self) -> bool:
        """Whether `gaps` are all sections without points; not of lines from files that say less."""
        return bool(abs(np.sum(self.gaps[:, 1] - self.gaps[:, 0]) - self.bridged_m) <= SAME_SUM_M)

    def bridged_before(self, t: np.ndarray) -> np.ndarray:
        """Return the length of gaps before chainages `t`, (n,) metres; everything beyond the line's ends is a gap."""
        beyond = t - np.clip(t, 0.0, self.line.length_m)
        if not len(self.gaps):
            return beyond
        passed = np.cumsum(self.gaps[:, 1] - self.gaps[:, 0])
        return beyond + np.interp(t, self.gaps.ravel(), np.repeat(np.append(0.0, passed), 2)[1:-1])

    def between(self, start: float, end: float) -> RailLine:
        """Return the part between two plan chainages, with the share of the points that its stations count."""
        length_m = self.line.length_m
        if start <= 0.0 and end >= length_m:
            return self
        start, end = max(start, 0.0), min(end, length_m)
        gaps = np.clip(self.gaps, start, end)
        gaps = gaps[gaps[:, 1] > gaps[:, 0]] - start
        support, share = None, (end - start) / length_m
        if self.support is not None:
            last = np.inf if end >= self.support.t[-1] else end
            support = self.support.select((self.support.t >= start) & (self.support.t < last), start)
            share = support.points.sum() / max(self.support.points.sum(), 1)
        return replace(self, xyz=self.line.part(start, end).xyz, points=self.points * share, gaps=gaps, support=support)

    def part(self, start: float, end: float) -> RailLine:
        """Return the part between two plan chainages as a rail of its own, with its own figures."""
        part = self.between(start, end)
        sigma_mm = self.sigma_mm if part.support is None else 1000 * part.support.rms_m
        bridged_m = float(np.sum(part.gaps[:, 1] - part.gaps[:, 0]))
        sigmaz_mm = self.sigmaz_mm if part.support is None else 1000 * part.support.rmsz_m
        return replace(part, sigma_mm=sigma_mm, sigmaz_mm=sigmaz_mm, bridged_m=bridged_m)

    def reversed(self) -> RailLine:
        """Return the line in the other direction."""
        plan_length = self.line.length_m
        support = None if self.support is None else self.support.reversed(plan_length)
        return replace(self, xyz=self.xyz[::-1], gaps=plan_length - self.gaps[::-1, ::-1], support=support)


@dataclass(frozen=True)
class Centerline:
    """The line midway between the two rails of a track.

    Attributes
    ----------
    xyz : (n, 3) array
        Vertices in local metres, directed like `RailLine.xyz`.
    left_ids, right_ids : tuple of int
        Rails on either side, seen along the line, in order along the line.
    gauge_mm, gaugesd_mm : float
        Mean and standard deviation of the distance between the rail lines minus the railhead width.
    cant_mm, cantmax_mm : float
        Mean of the left minus the right height, and the value of it with the largest absolute value.
    bridged_m : float
        Plan length in which at least one rail has no supporting points; NaN if the gaps of a rail are unknown.
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
        """Length in 3D; in plan if the line has no heights."""
        return _length(self.xyz)

    @cached_property
    def line(self) -> Polyline:
        """Line with its chainages in plan."""
        return Polyline(self.xyz)

    def part(self, start: float, end: float) -> Centerline:
        """Return the part between two plan chainages, with the means of the whole line."""
        share = (end - start) / self.line.length_m
        return replace(self, xyz=self.line.part(start, end).xyz, bridged_m=self.bridged_m * share)


def cell_borders(chainage: np.ndarray) -> np.ndarray:
    """Return the borders, (n + 1,), of the sections that n stations represent: half way to their neighbours.

    >>> cell_borders(np.array([0.0, 1.0, 3.0])).tolist()
    [0.0, 0.5, 2.0, 3.0]
    """
    return np.concatenate([chainage[:1], 0.5 * (chainage[1:] + chainage[:-1]), chainage[-1:]])


@dataclass(frozen=True)
class Kilometres:
    """Places along the axis of a railway; (n,) arrays. See docs/stationing.md.

    Attributes
    ----------
    axis : object
        Name of the axis; None where the place is beyond all axes, as are the following then, and `km` NaN.
    piece : object
        Number of the section of the axis between two jumps of the kilometres, from 1.
    km_text : object
        The kilometre as railways write it.
    offset_m : float
        Distance from the axis, positive to the left as the kilometres increase.
    side : object
        "left", "right" or "on".
    ambiguous : object
        Whether another place of an axis is nearly as close.
    """

    axis: np.ndarray
    piece: np.ndarray
    km: np.ndarray
    km_text: np.ndarray
    offset_m: np.ndarray
    side: np.ndarray
    ambiguous: np.ndarray

    @classmethod
    def empty(cls, count: int) -> Kilometres:
        """Return `count` places without a kilometre."""
        made = {name: np.full(count, None, dtype=object) for name in ("axis", "piece", "km_text", "side", "ambiguous")}
        return cls(km=np.full(count, np.nan), offset_m=np.full(count, np.nan), **made)

    def part(self, start: int, end: int) -> Kilometres:
        """Return the places from number `start` to before `end`."""
        return Kilometres(*(column[start:end] for column in vars(self).values()))

    def put(self, which: np.ndarray, others: Kilometres) -> None:
        """Set the places marked in `which`, (n,) bool, to others."""
        for name, column in vars(self).items():
            column[which] = getattr(others, name)


@dataclass(frozen=True)
class TrackGeometry:
    """Geometry of one track at stations along its centerline; (n,) arrays, NaN where it is unknown.

    Attributes
    ----------
    xyz : (n, 3) array
        Stations on the centerline in local metres.
    chainage_m : float
        Plan distance from the start of the centerline.
    gauge_mm : float
        Distance between the rail lines minus the railhead width.
    cant_mm : float
        Left minus right height.
    twist_mm : float
        Change of cant over 3 m, ahead minus behind; NaN at the ends of the track.
    radius_m : float
        Positive in left-hand curves, NaN above 10 km.
    grade_pm : float
        Gradient in per mille, positive uphill.
    sigma_mm : float
        Standard error of the centerline's lateral position.
    points : int
        Points on both rails for which this is the nearest station.
    bridged : bool
        Whether a rail has no points, or is missing, for most of the section that the station represents.
    strips : int
        Number of strips, passes of the scanner, that show the rails.
    strip_mm : float
        Largest distance between two of them, across or in height; NaN where there is only one.
    sigmaz_mm : float
        Standard error of the centerline's height.
    kilometres : Kilometres or None
        Places of the stations along an axis; None without one.
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
    strips: np.ndarray
    strip_mm: np.ndarray
    sigmaz_mm: np.ndarray
    kilometres: Kilometres | None = None

    @property
    def cells_m(self) -> np.ndarray:
        """Length that each station represents, (n,)."""
        return np.diff(cell_borders(self.chainage_m))

    @property
    def bridged_m(self) -> float:
        """Length that the bridged stations represent."""
        return float(self.cells_m[self.bridged].sum())


@dataclass(frozen=True)
class StripCourse:
    """Offsets of one strip, a pass of the scanner, from the mean of all strips along a track; (n,) arrays.

    `chainage_m` is the plan distance from the start of the centerline of places that another strip shows as well;
    `across_mm` and `up_mm` are the offsets to the left, seen along the centerline, and upwards.
    """

    track_id: int
    strip: int
    chainage_m: np.ndarray
    across_mm: np.ndarray
    up_mm: np.ndarray


HALF_TRACK_M = 1.0
"""Distance from a centerline within which its rails are: half of the widest gauge and a head."""

STRIP_OFF_M = 0.003
"""Distance between strips from which the user is warned. Strips of one scanner that agree differ by a millimetre."""

HEAD_OFF_M = 0.005
"""Difference between the head widths that the points show and that is stated, from which the user is warned: noise of
8 mm makes heads look 4.6 mm too wide, two passes of the scanner 15 mm apart make them look 5.3 mm too wide."""


@dataclass(frozen=True)
class HeadWidths:
    """Width of the railheads as the points show it, NaN if they do not, and as it is stated, metres.

    Heads that are `blunt` show no width: they are round ridges, which beams or images have blurred.
    """

    seen_m: float
    stated_m: float
    blunt: bool = False

    @property
    def differ(self) -> bool:
        """Whether the points show another width than the stated one."""
        return abs(self.seen_m - self.stated_m) > HEAD_OFF_M


ENOUGH_CELLS_PER_M = 10.0
"""Cells per metre of rail below which lines are less accurate and may have gaps."""


@dataclass(frozen=True)
class SearchFigures:
    """What was found in a raw cloud, or in a square of it; figures of squares add up.

    Attributes
    ----------
    points : int
        Points on rails.
    paired_m, single_m : float
        Length of rails with and without a partner.
    cells : int
        Cells of railheads.
    squares, thin, paved : int
        Squares with rails; those among them that are thin, and those with rails in pavement.
    along_m, across_m : float
        Length of rails near the guide that run along it, and across it, whether they are kept or not.
    blunt_m : float
        Length of rails where the blur of the cloud hides how wide a head is.
    blur_m2 : float
        The blur there, a standard deviation, times this length.
    filled_m : float
        Length of the rails just above the ballast, in a cloud that was searched for them.
    sharp_m, round_m : float
        Length of the rails with a partner that are as narrow as a head, and of those that are wider and round, before
        the cloud is known to be blunt; see `classify.ways`.
    clear_m : float
        Length of those as narrow as a head that stand clear of their bed: no tops of them are too low to be seen.
    unsure_m : float
        Length of those that are wider, but not round and not too wide for a head, and of rails in pavements.
    """

    points: int = 0
    paired_m: float = 0.0
    single_m: float = 0.0
    cells: int = 0
    squares: int = 0
    thin: int = 0
    paved: int = 0
    along_m: float = 0.0
    across_m: float = 0.0
    blunt_m: float = 0.0
    blur_m2: float = 0.0
    filled_m: float = 0.0
    sharp_m: float = 0.0
    round_m: float = 0.0
    unsure_m: float = 0.0
    clear_m: float = 0.0

    def __add__(self, other: SearchFigures) -> SearchFigures:
        return SearchFigures(*(one + more for one, more in zip(astuple(self), astuple(other))))

    @property
    def filling(self) -> SearchFigures:
        """What blunt sources add: figures of sharp ones count the same rails already, and cover the others for most."""
        return SearchFigures(self.points, blunt_m=self.blunt_m, blur_m2=self.blur_m2)

    @property
    def cells_per_m(self) -> float:
        """Cells per metre of rail; 0 without rails."""
        length_m = self.paired_m + self.single_m
        return self.cells / length_m if length_m else 0.0

    @property
    def is_from_air(self) -> bool:
        """Whether all squares with rails are thin: a scanner on the ground shows what is near it with more points."""
        return 0 < self.squares == self.thin

    @property
    def blur_m(self) -> float:
        """Mean blur where heads are blunt, metres; 0 where they are not."""
        return self.blur_m2 / self.blunt_m if self.blunt_m else 0.0


@dataclass(frozen=True)
class RailNetwork:
    """All results of an extraction from one cloud.

    Attributes
    ----------
    frame : LocalFrame
        Converts the lines' local metres to the cloud's coordinates.
    engine : str
        Engine and device that ran the network, for the output ENGINE_USED.
    geometry : tuple of TrackGeometry
        One per centerline; empty unless requested. To find that of a centerline, compare `track_id`.
    cleaned : tuple of RailRaster
        Raster cleaned by the network, one per class; empty unless requested.
    cleaned_classes : tuple of int
        Class of each of these rasters.
    failures : tuple of str
        A sentence for each file or square that is missing from the result, if the run tolerates that, and one if no
        two rails have the gauge.
    strips : tuple of StripCourse
        By track and strip, where several strips show a track.
    search : SearchFigures or None
        What was found in a raw cloud; None for a classified one.
    """

    rails: tuple[RailLine, ...]
    centerlines: tuple[Centerline, ...]
    frame: LocalFrame
    engine: str = field(default="")
    geometry: tuple[TrackGeometry, ...] = ()
    cleaned: tuple[RailRaster, ...] = ()
    cleaned_classes: tuple[int, ...] = ()
    failures: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    heads: HeadWidths | None = None
    strips: tuple[StripCourse, ...] = ()
    search: SearchFigures | None = None
