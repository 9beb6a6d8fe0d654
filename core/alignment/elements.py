"""Design elements of a track in plan, height and cant, the curve that they make, and its stations.

Lengths are metres and places local metres of the alignment's frame. `s` is the distance along the plan curve. A design
file knows this distance, and states where its stations do not continue it: kilometres come from an axis, on which
numbers may be missing or twice, and on which a parallel track is longer or shorter.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Optional, Union

import numpy as np
from scipy.spatial import cKDTree

from ..frame import LocalFrame

NODES = 12
"""Of the Gauss-Legendre rule: with panels of `PANEL_RAD`, the error is below 1e-12 m at a radius of 150 m."""

PANEL_RAD = 1.0
"""Largest turn that one application of the rule covers, radians."""

_ABSCISSAE, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)
UNIT_NODES, UNIT_WEIGHTS = 0.5 * (_ABSCISSAE + 1.0), 0.5 * _WEIGHTS
"""The rule on the interval from 0 to 1, (12,) each."""

MIN_JUMP_M = 0.05
"""Smallest jump of the stations that becomes an equation, metres: a track beside its axis gains or loses millimetres
from element to element."""

SAME_PLACE_M = 1e-4
"""Places along the curve that differ by less are the same, metres: files have four decimals or more."""


def turned(u: np.ndarray, k_from: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return by how much the direction has turned at distance `u`, radians; `change` of the curvature is in 1/m²."""
    return u * (k_from + 0.5 * change * u)


def displaced(u: np.ndarray, heading: np.ndarray, k_from: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the way from the start of an element to the place at distance `u`, (n, 2) metres; see `turned`."""
    turn = np.abs(u) * (np.abs(k_from) + np.abs(change * u))
    panels = int(np.ceil(turn.max(initial=0.0) / PANEL_RAD)) or 1
    ends = u[:, None] * np.arange(panels + 1) / panels
    way = np.zeros((len(u), 2))
    for start, end in zip(ends.T[:-1], ends.T[1:]):
        at = start[:, None] + (end - start)[:, None] * UNIT_NODES
        angle = heading[:, None] + turned(at, k_from[:, None], change[:, None])
        way[:, 0] += (end - start) * (np.cos(angle) @ UNIT_WEIGHTS)
        way[:, 1] += (end - start) * (np.sin(angle) @ UNIT_WEIGHTS)
    return way


SAGITTA_M = 0.0009
"""Largest distance of a drawn curve from the exact one, metres: below a millimetre, which no scanner resolves."""

LONGEST_STEP_M = 50.0
"""Largest distance between the vertices of a drawn element, metres, so that maps show a long straight in place."""

STATION_M = 1.0
"""Distance between the places from which the search for a foot starts, metres."""

CONTINUED_M = 1.0
"""Profile and cant that end this near to the end of the plan, metres, are continued as the plan is; files round their
stations. Those that end sooner are unknown farther on."""

TURN_AT_ONCE_RAD = 2.0 * np.pi
"""Largest turn that is integrated from the start of an element, radians: one that turns more often is cut into pieces,
so that the time for a place does not depend on how often."""

PLACES_AT_ONCE = 100_000
"""Places that are computed at once: some 50 MB."""

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
class Stretch:
    """A part of a curve: the distance along the curve at which it starts, and its length, metres."""

    s_from: float
    length_m: float

    @property
    def s_to(self) -> float:
        """Distance along the curve of the end."""
        return self.s_from + self.length_m


@dataclass(frozen=True)
class PlanElement(Stretch):
    """Line, arc or clothoid: the curvature changes linearly from start to end.

    It starts at `x` and `y`, local metres, with the direction `heading`, radians counterclockwise from the x axis;
    curvatures are in 1/m, positive to the left.
    """

    layout: ClassVar[str] = "H"
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


@dataclass(frozen=True)
class VerticalElement(Stretch):
    """Grade or parabola from the height `z`, local metres: the gradient, positive uphill, changes linearly with `s`."""

    layout: ClassVar[str] = "V"
    z: float
    grade_from: float
    grade_to: float
    figures: Figures = field(default_factory=Figures)

    @property
    def type(self) -> str:
        """Grade or parabola."""
        return "grade" if self.grade_from == self.grade_to else "parabola"

    @property
    def curvature(self) -> float:
        """Change of the gradient in 1/m, positive in a sag: the inverse of the radius."""
        return (self.grade_to - self.grade_from) / self.length_m

    def part(self, start: float, end: float) -> VerticalElement:
        """Return the part between two places on the element."""
        grades = [self.grade_from + (s - self.s_from) * self.curvature for s in (start, end)]
        z = self.z + 0.5 * (start - self.s_from) * (self.grade_from + grades[0])
        return replace(self, s_from=start, length_m=end - start, z=z, grade_from=grades[0], grade_to=grades[1])


@dataclass(frozen=True)
class CantElement(Stretch):
    """Constant cant or a ramp: the cant, left rail minus right rail, changes linearly with `s`."""

    layout: ClassVar[str] = "C"
    cant_from_m: float
    cant_to_m: float
    figures: Figures = field(default_factory=Figures)

    @property
    def type(self) -> str:
        """Constant or ramp."""
        return "constant" if self.cant_from_m == self.cant_to_m else "ramp"

    def part(self, start: float, end: float) -> CantElement:
        """Return the part between two places on the element."""
        ramp = (self.cant_to_m - self.cant_from_m) / self.length_m
        cants = [self.cant_from_m + (s - self.s_from) * ramp for s in (start, end)]
        return replace(self, s_from=start, length_m=end - start, cant_from_m=cants[0], cant_to_m=cants[1])


Element = Union[PlanElement, VerticalElement, CantElement]


@dataclass(frozen=True)
class Foot:
    """Nearest places of an alignment to n given points, (n,) arrays, metres.

    `s` is the distance along the curve, never beyond its ends, and `across_m` that of the point from the curve,
    positive to the left. `past_m` is how far the point is ahead of the foot: 0 except before the start (negative) and
    after the end (positive).
    """

    s: np.ndarray
    across_m: np.ndarray
    past_m: np.ndarray


@dataclass(frozen=True)
class Alignment:
    """The design of one track: elements in plan, and in height and cant as far as they are known.

    Elements of one layout follow each other in order of `s` without gaps; there is at least one in plan. Every element
    states its own start; the curve is evaluated from there, so that elements of a file that do not quite meet are shown
    as they are. The frame of the places knows the coordinate system; `name` is that of the track, as a file states it.
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
        parts = range(0, max(len(s), 1), PLACES_AT_ONCE)
        return np.concatenate([self._places(s[start : start + PLACES_AT_ONCE]) for start in parts])

    def _places(self, s: np.ndarray) -> np.ndarray:
        columns, u = _at(self._pieces, s)
        return columns[:, 1:3] + displaced(u, columns[:, 3], columns[:, 4], columns[:, 5])

    def headings(self, s: np.ndarray) -> np.ndarray:
        """Return directions, (n,) radians counterclockwise from the x axis."""
        columns, u = _at(self._pieces, s)
        return columns[:, 3] + turned(u, columns[:, 4], columns[:, 5])

    def curvatures(self, s: np.ndarray) -> np.ndarray:
        """Return curvatures, (n,) 1/m, positive to the left; at a jump, that ahead."""
        columns, u = _at(self._pieces, s)
        return columns[:, 4] + u * columns[:, 5]

    def heights(self, s: np.ndarray) -> np.ndarray:
        """Return heights, (n,) local metres; NaN where they are unknown."""
        return self._known(
            self.vertical, self._profile, s, lambda u, _, z, grade, bend: z + u * (grade + 0.5 * u * bend)
        )

    def grades(self, s: np.ndarray) -> np.ndarray:
        """Return gradients, (n,) metres per metre, positive uphill; NaN where they are unknown."""
        return self._known(self.vertical, self._profile, s, lambda u, _, __, slope, bend: slope + u * bend)

    def cants(self, s: np.ndarray) -> np.ndarray:
        """Return cants, (n,) metres, left rail minus right rail; NaN where they are unknown."""
        return self._known(self.cant, self._ramps, s, lambda u, _, cant, ramp: cant + u * ramp)

    def _known(
        self, elements: Sequence[Element], rows: np.ndarray, s: np.ndarray, value: Callable[..., np.ndarray]
    ) -> np.ndarray:
        """Return a value of the distance in an element and its row; NaN where no element, continued as the plan, is."""
        if not elements:
            return np.full(len(s), np.nan)
        first, last = elements[0].s_from - CONTINUED_M, elements[-1].s_to + CONTINUED_M
        reached = ((s >= first) | (first <= self.s_from)) & ((s <= last) | (last >= self.s_to))
        found, u = _at(rows, s)
        return np.where(reached, value(u, *found.T), np.nan)

    def xyz(self, s: np.ndarray) -> np.ndarray:
        """Return places, (n, 3) local metres; z is NaN where heights are unknown."""
        return np.column_stack([self.places(s), self.heights(s)])

    def drawn(self, s_from: float, s_to: float) -> np.ndarray:
        """Return vertices of a part of the curve, (n, 3) local metres, less than a millimetre off the exact curve."""
        return self.xyz(self.stations(s_from, s_to))

    def stations(self, s_from: float, s_to: float) -> np.ndarray:
        """Return the distances along the curve of the vertices of `drawn`, (n,), with both ends."""
        inner = slice(*np.searchsorted(self._joints, [np.nextafter(s_from, np.inf), s_to]))
        knots = np.concatenate([[s_from], self._joints[inner], [s_to]])
        step = np.diff(knots)
        counts = np.ceil(step / self._steps(knots)).astype(int)
        part = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(part)) - (np.cumsum(counts) - counts)[part]
        return np.append(number * (step / counts)[part] + knots[:-1][part], s_to)

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

    def _steps(self, knots: np.ndarray) -> np.ndarray:
        """Return the distance between vertices from each knot to the next, between which no element begins."""
        ends = np.array([knots[:-1], np.nextafter(knots[1:], knots[:-1])])
        sharpest = np.abs(self.curvatures(ends.ravel())).reshape(2, -1).max(axis=0)
        if self.vertical:
            sharpest = np.maximum(sharpest, np.abs(_at(self._profile, ends.mean(axis=0))[0][:, 3]))
        return np.sqrt(8.0 * SAGITTA_M / np.maximum(sharpest, 8.0 * SAGITTA_M / LONGEST_STEP_M**2))

    @cached_property
    def _joints(self) -> np.ndarray:
        """Distances along the curve at which an element begins or ends in plan or in height, increasing."""
        ends = [*(one.s_to for one in self.plan), *(one.s_to for one in self.vertical)]
        return np.unique([*ends, *(one.s_from for one in self.vertical[:1])])

    @cached_property
    def _profile(self) -> np.ndarray:
        """Start, height, gradient and its change along each element in height, (m, 4)."""
        return np.array([(one.s_from, one.z, one.grade_from, one.curvature) for one in self.vertical])

    @cached_property
    def _ramps(self) -> np.ndarray:
        """Start, cant and its change along each element of cant, (m, 3)."""
        return np.array(
            [(one.s_from, one.cant_from_m, (one.cant_to_m - one.cant_from_m) / one.length_m) for one in self.cant]
        )

    @cached_property
    def _pieces(self) -> np.ndarray:
        """Start, x, y, direction, curvature and its change along each plan element, or each piece of one, (m, 6)."""
        rows = [(one.s_from, one.x, one.y, one.heading, one.k_from, one.k_to, one.length_m) for one in self.plan]
        s, x, y, heading, k_from, k_to, length = np.array(rows).T
        change = (k_to - k_from) / length
        turn = length * (np.abs(k_from) + np.abs(k_to - k_from))
        counts = np.maximum(np.ceil(turn / TURN_AT_ONCE_RAD), 1).astype(int)
        of, first = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts) - counts
        part = (length / counts)[of]
        u = (np.arange(len(of)) - first[of]) * part
        bend = k_from[of] + change[of] * u
        ahead = heading[of] + turned(u, k_from[of], change[of])
        way = displaced(part, ahead, bend, change[of])
        before = np.cumsum(way, axis=0) - way
        xy = np.column_stack([x, y])[of] + before - before[first[of]]
        return np.column_stack([s[of] + u, xy, ahead, bend, change[of]])


def _at(rows: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the row, which begins with its start, for each distance along the curve, and the distance from there."""
    found = rows[np.maximum(np.searchsorted(rows[:, 0], s, side="right") - 1, 0)]
    return found, s - found[:, 0]


def chained(
    start: tuple[float, float], heading: float, shapes: Sequence[tuple[float, float, float]]
) -> tuple[PlanElement, ...]:
    """Return plan elements, given length and curvatures, that continue each other from `s` = 0.

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


@dataclass(frozen=True)
class StationRange:
    """A part of the curve on which stations continue: it starts at `s` along the curve with `station`, both metres.

    `rises` says whether stations rise along the curve.
    """

    s: float
    station: float
    rises: bool = True

    def at(self, s: float) -> float:
        """Return the station of a place, metres."""
        return self.station + (s - self.s if self.rises else self.s - s)


@dataclass(frozen=True)
class Stations:
    """The stations along a curve: at least one piece, in order of `s`.

    Examples
    --------
    >>> stations = Stations((StationRange(0.0, 1000.0), StationRange(50.0, 1200.0)))
    >>> stations.ahead(50.0), stations.behind(50.0)
    (1200.0, 1050.0)
    """

    pieces: tuple[StationRange, ...]

    def ahead(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that ahead."""
        return self.pieces[max(bisect_right(self._starts, s + SAME_PLACE_M) - 1, 0)].at(s)

    def behind(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that behind."""
        return self.pieces[max(bisect_left(self._starts, s - SAME_PLACE_M) - 1, 0)].at(s)

    @cached_property
    def _starts(self) -> list[float]:
        return [one.s for one in self.pieces]


def stations_of(alignment: Alignment) -> Optional[Stations]:
    """Return the stations that the kilometres of the plan elements make; None if no element states both of its own.

    `km_from` and `km_to` may be those of the two ends in order along the track, or the smaller and the larger one.
    """
    known = [
        (one.s_from, one.figures.km_from, one.figures.km_to)
        for one in alignment.plan
        if one.figures.km_from is not None and one.figures.km_to is not None
    ]
    if not known:
        return None
    (_, *first), (_, *last) = known[0], known[-1]
    rises = sum(last) >= sum(first) if len(known) > 1 else last[1] >= last[0]
    pieces: list[StationRange] = []
    for s, *ends in known:
        piece = StationRange(s, 1000.0 * (min(ends) if rises else max(ends)), rises)
        if not pieces or abs(pieces[-1].at(piece.s) - piece.station) >= MIN_JUMP_M:
            pieces.append(piece)
    start = StationRange(alignment.s_from, pieces[0].at(alignment.s_from), rises)
    return Stations((start, *pieces[1:]))


def measured(alignment: Alignment) -> np.ndarray:
    """Return the vertices of the whole curve with the kilometre of each, (n, 4), local metres and kilometres.

    A jump of the kilometres has two vertices at the same place. Kilometres are NaN if they are unknown.
    """
    s = alignment.stations(alignment.s_from, alignment.s_to)
    stations = stations_of(alignment)
    if stations is None:
        return np.column_stack([alignment.xyz(s), np.full(len(s), np.nan)])
    jumps = np.array([piece.s for piece in stations.pieces[1:]])
    s = np.sort(np.concatenate([s[~np.isin(s, jumps)], jumps, jumps]))
    repeated = np.append(False, np.diff(s) == 0)
    known = [stations.ahead(place) if again else stations.behind(place) for place, again in zip(s, repeated)]
    return np.column_stack([alignment.xyz(s), np.array(known) / 1000.0])
