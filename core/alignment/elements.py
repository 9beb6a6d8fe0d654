"""Design elements of a track in plan, height and cant, and the curve that they make.

Lengths are metres and places local metres of the alignment's frame. `s` is the distance along the plan curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Optional, Union

import numpy as np
from scipy.spatial import cKDTree

from ..frame import LocalFrame
from .curves import displaced, turned

SAGITTA_M = 0.0009
"""Largest distance of a drawn curve from the exact one, metres: below a millimetre, which no scanner resolves."""

LONGEST_STEP_M = 50.0
"""Largest distance between the vertices of a drawn element, metres, so that maps show a long straight in place."""

STATION_M = 1.0
"""Distance between the places from which the search for a foot starts, metres."""

FOOT_STEPS = 4
"""Newton steps to a foot: from half a metre away, the error is below a micrometre after three."""


@dataclass(frozen=True)
class Figures:
    """What is stated of an element besides its shape; None where it is unknown.

    Attributes
    ----------
    joint : str or None
        How the element begins: "G2" if the curvature (the grade, the cant) continues, "G1" if it jumps.
    km_from, km_to : float or None
        Kilometres of start and end.
    dev_rms_mm, dev_max_mm : float or None
        Deviation of the measured track from the element: root mean square, and the largest, with its sign.
    sigma_r_m, sigma_len_m, sigma_s_m : float or None
        Standard errors of radius, length and `s_from`.
    r_round_m : float or None
        Proposed round radius, signed.
    dev_rms_round_mm : float or None
        The same as `dev_rms_mm` with round radii.
    r_fit_m, s_fit_m : float or None
        Radius and `s_from` as they were fitted: what differs was edited, and is held by the next fit.
    """

    joint: Optional[str] = None
    km_from: Optional[float] = None
    km_to: Optional[float] = None
    dev_rms_mm: Optional[float] = None
    dev_max_mm: Optional[float] = None
    sigma_r_m: Optional[float] = None
    sigma_len_m: Optional[float] = None
    sigma_s_m: Optional[float] = None
    r_round_m: Optional[float] = None
    dev_rms_round_mm: Optional[float] = None
    r_fit_m: Optional[float] = None
    s_fit_m: Optional[float] = None


@dataclass(frozen=True)
class PlanElement:
    """Line, arc or clothoid: the curvature changes linearly from start to end.

    Attributes
    ----------
    s_from, length_m : float
    x, y, heading : float
        Start in local metres, and direction there in radians, counterclockwise from the x axis.
    k_from, k_to : float
        Curvature at start and end in 1/m, positive to the left.
    figures : Figures
    """

    layout: ClassVar[str] = "H"
    s_from: float
    length_m: float
    x: float
    y: float
    heading: float
    k_from: float = 0.0
    k_to: float = 0.0
    figures: Figures = field(default_factory=Figures)

    @property
    def type(self) -> str:
        """Line, arc or clothoid."""
        if self.k_from != self.k_to:
            return "clothoid"
        return "arc" if self.k_from else "line"

    @property
    def s_to(self) -> float:
        """Distance along the curve of the end."""
        return self.s_from + self.length_m


@dataclass(frozen=True)
class VerticalElement:
    """Grade or parabola: the gradient changes linearly with `s`.

    Attributes
    ----------
    s_from, length_m : float
    z : float
        Height of the start, local metres.
    grade_from, grade_to : float
        Gradient at start and end, metres per metre, positive uphill.
    figures : Figures
    """

    layout: ClassVar[str] = "V"
    s_from: float
    length_m: float
    z: float
    grade_from: float
    grade_to: float
    figures: Figures = field(default_factory=Figures)

    @property
    def type(self) -> str:
        """Grade or parabola."""
        return "grade" if self.grade_from == self.grade_to else "parabola"

    @property
    def s_to(self) -> float:
        """Distance along the curve of the end."""
        return self.s_from + self.length_m

    @property
    def curvature(self) -> float:
        """Change of the gradient in 1/m, positive in a sag: the inverse of the radius."""
        return (self.grade_to - self.grade_from) / self.length_m


@dataclass(frozen=True)
class CantElement:
    """Constant cant or a ramp: the cant changes linearly with `s`.

    Attributes
    ----------
    s_from, length_m : float
    cant_from_m, cant_to_m : float
        Cant at start and end in metres, left rail minus right rail.
    figures : Figures
    """

    layout: ClassVar[str] = "C"
    s_from: float
    length_m: float
    cant_from_m: float
    cant_to_m: float
    figures: Figures = field(default_factory=Figures)

    @property
    def type(self) -> str:
        """Constant or ramp."""
        return "constant" if self.cant_from_m == self.cant_to_m else "ramp"

    @property
    def s_to(self) -> float:
        """Distance along the curve of the end."""
        return self.s_from + self.length_m


Element = Union[PlanElement, VerticalElement, CantElement]


@dataclass(frozen=True)
class Foot:
    """Nearest places of an alignment to given points.

    Attributes
    ----------
    s : (n,) array
        Distance along the curve, never beyond its ends.
    across_m : (n,) array
        Distance of the point from the curve, positive to the left.
    past_m : (n,) array
        How far the point is ahead of the foot: 0 except before the start (negative) and after the end (positive).
    """

    s: np.ndarray
    across_m: np.ndarray
    past_m: np.ndarray


@dataclass(frozen=True)
class Alignment:
    """The design of one track: elements in plan, and in height and cant as far as they are known.

    Elements of one layout follow each other in order of `s` without gaps. Every element states its own start; the curve
    is evaluated from there, so that elements of a file that do not quite meet are shown as they are.

    Attributes
    ----------
    track_id : int or None
    frame : LocalFrame
        Of the places; it knows the coordinate system.
    plan : tuple of PlanElement
        At least one.
    vertical : tuple of VerticalElement
        Empty if heights are unknown.
    cant : tuple of CantElement
        Empty if the cant is unknown.
    name : str
        Of the track, as a file states it.
    """

    track_id: Optional[int]
    frame: LocalFrame
    plan: tuple[PlanElement, ...]
    vertical: tuple[VerticalElement, ...] = ()
    cant: tuple[CantElement, ...] = ()
    name: str = ""

    @property
    def s_from(self) -> float:
        """Distance along the curve of its start."""
        return self.plan[0].s_from

    @property
    def s_to(self) -> float:
        """Distance along the curve of its end."""
        return self.plan[-1].s_to

    @property
    def elements(self) -> tuple[Element, ...]:
        """All elements: plan, then height, then cant."""
        return (*self.plan, *self.vertical, *self.cant)

    def places(self, s: np.ndarray) -> np.ndarray:
        """Return places in plan, (n, 2) local metres; outside, the first and the last element are continued."""
        at, u = _within(self.plan, s)
        columns = self._columns[at]
        return columns[:, :2] + displaced(u, columns[:, 2], columns[:, 3], columns[:, 4])

    def headings(self, s: np.ndarray) -> np.ndarray:
        """Return directions, (n,) radians counterclockwise from the x axis."""
        at, u = _within(self.plan, s)
        columns = self._columns[at]
        return columns[:, 2] + turned(u, columns[:, 3], columns[:, 4])

    def curvatures(self, s: np.ndarray) -> np.ndarray:
        """Return curvatures, (n,) 1/m, positive to the left; at a jump, that ahead."""
        at, u = _within(self.plan, s)
        return self._columns[at, 3] + u * self._columns[at, 4]

    def heights(self, s: np.ndarray) -> np.ndarray:
        """Return heights, (n,) local metres; NaN if they are unknown."""
        if not self.vertical:
            return np.full(len(s), np.nan)
        at, u = _within(self.vertical, s)
        z, grade, curvature = np.array([(one.z, one.grade_from, one.curvature) for one in self.vertical]).T
        return z[at] + u * (grade[at] + 0.5 * u * curvature[at])

    def grades(self, s: np.ndarray) -> np.ndarray:
        """Return gradients, (n,) metres per metre, positive uphill; NaN if they are unknown."""
        if not self.vertical:
            return np.full(len(s), np.nan)
        at, u = _within(self.vertical, s)
        grade, curvature = np.array([(one.grade_from, one.curvature) for one in self.vertical]).T
        return grade[at] + u * curvature[at]

    def cants(self, s: np.ndarray) -> np.ndarray:
        """Return cants, (n,) metres, left rail minus right rail; NaN if they are unknown."""
        if not self.cant:
            return np.full(len(s), np.nan)
        at, u = _within(self.cant, s)
        start, end, length = np.array([(one.cant_from_m, one.cant_to_m, one.length_m) for one in self.cant]).T
        return start[at] + u * ((end - start) / length)[at]

    def xyz(self, s: np.ndarray) -> np.ndarray:
        """Return places, (n, 3) local metres; z is NaN if heights are unknown."""
        return np.column_stack([self.places(s), self.heights(s)])

    def drawn(self, s_from: float, s_to: float) -> np.ndarray:
        """Return vertices of a part of the curve, (n, 3) local metres, less than a millimetre off the exact curve."""
        return self.xyz(self.stations(s_from, s_to))

    def stations(self, s_from: float, s_to: float) -> np.ndarray:
        """Return the distances along the curve of the vertices of `drawn`, (n,), with both ends."""
        joints = [*(one.s_to for one in self.plan), *(one.s_to for one in self.vertical)]
        inner = [joint for joint in joints if s_from < joint < s_to]
        knots = np.unique([s_from, *inner, s_to])
        parts = [self._steps(start, end) for start, end in zip(knots[:-1], knots[1:])]
        return np.concatenate([*parts, knots[-1:]])

    def foot(self, xy: np.ndarray) -> Foot:
        """Return the nearest places of the curve to points, (n, 2) local metres."""
        count = max(int(np.ceil((self.s_to - self.s_from) / STATION_M)), 1) + 1
        stations = np.linspace(self.s_from, self.s_to, count)
        s = stations[cKDTree(self.places(stations)).query(xy)[1]]
        for _ in range(FOOT_STEPS):
            ahead, across = self._aside(xy, s)
            s = np.clip(s + ahead / np.maximum(1.0 - self.curvatures(s) * across, 0.1), self.s_from, self.s_to)
        ahead, across = self._aside(xy, s)
        return Foot(s, across, np.where((s > self.s_from) & (s < self.s_to), 0.0, ahead))

    def _aside(self, xy: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return how far points are ahead of and to the left of places, (2, n)."""
        away, heading = xy - self.places(s), self.headings(s)
        cos, sin = np.cos(heading), np.sin(heading)
        return np.array([away[:, 0] * cos + away[:, 1] * sin, away[:, 1] * cos - away[:, 0] * sin])

    def _steps(self, start: float, end: float) -> np.ndarray:
        """Return stations from `start` to before `end`, between which no element begins."""
        bends = np.abs(self.curvatures(np.array([start, np.nextafter(end, start)])))
        middle = np.array([0.5 * (start + end)])
        at = _within(self.vertical, middle)[0][0] if self.vertical else None
        sharpest = max(*bends, abs(self.vertical[at].curvature) if at is not None else 0.0)
        step = min(np.sqrt(8.0 * SAGITTA_M / sharpest) if sharpest else LONGEST_STEP_M, LONGEST_STEP_M)
        return np.linspace(start, end, int(np.ceil((end - start) / step)) + 1)[:-1]

    @cached_property
    def _columns(self) -> np.ndarray:
        """Start x, y, direction, curvature and its change along each plan element, (m, 5)."""
        rows = [(one.x, one.y, one.heading, one.k_from, (one.k_to - one.k_from) / one.length_m) for one in self.plan]
        return np.array(rows)


def _within(elements: Sequence[Element], s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the element at each distance, and the distance from its start."""
    starts = np.array([one.s_from for one in elements])
    at = np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(starts) - 1)
    return at, s - starts[at]


def chained(
    start: tuple[float, float], heading: float, shapes: Sequence[tuple[float, float, float]]
) -> tuple[PlanElement, ...]:
    """Return plan elements that continue each other in place and direction, from `s` = 0.

    Parameters
    ----------
    start : (float, float)
        Local metres.
    heading : float
        Radians counterclockwise from the x axis.
    shapes : sequence of (length_m, k_from, k_to)
        Of each element; see `PlanElement`.

    Examples
    --------
    >>> [(one.type, round(one.x, 3), round(one.y, 3)) for one in chained((0, 0), 0.0, [(10, 0, 0), (15.708, 0.1, 0.1)])]
    [('line', 0.0, 0.0), ('arc', 10.0, 0.0)]
    """
    made: list[PlanElement] = []
    place, s = np.array(start, dtype=float), 0.0
    for length_m, k_from, k_to in shapes:
        made.append(PlanElement(s, length_m, float(place[0]), float(place[1]), heading, k_from, k_to))
        u, change = np.array([length_m]), np.array([(k_to - k_from) / length_m])
        first = np.array([k_from])
        place = place + displaced(u, np.array([heading]), first, change)[0]
        heading, s = heading + float(turned(u, first, change)[0]), s + length_m
    return tuple(made)
