"""The distance of rails that points show, and whether it is that of the stated gauge (docs/method.md section 1.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import Request
from ..errors import CloudError
from ..parameters import Parameters
from ..progress import Progress
from ..rails import HEAD_OFF_M
from ..standards import SPACING_RANGE_M, closest_standard
from ..tiles.grid import PointSource, fullest_square

PLACES = 300
"""Number of places where the rails are looked at."""


HALF_LENGTH_M = 1.0
"""Points this far along the rail from a place are seen with it: a rail of 150 m radius is 3 mm off straight there."""


REACH_M = 0.15
"""Points this close across the rail are on it: guard rails are closer only where they end the gauge face."""


MAX_NEAR = 10_000
"""Most points looked at around a place. Heads seen by 1000 points per metre have fewer there; more make a head no
clearer, and a column of 200,000 points would take a minute."""


SEPARATE_M = 0.05
"""Gap across the track between the points of two rails; heads seen by few scan lines have smaller ones."""


MIN_POINTS = 12
"""Points on a head that give its axis to 6 mm."""


TOP_M = 0.030
"""Depth below the top that is part of the head on all profiles; web and foot are deeper."""


TOP_PERCENT = 95
"""Percentile of the heights that stands for the top."""


BIN_M, HALF_PEAK_M = 0.005, 0.015
"""Bin of the histogram of distances, and half the width of its peak: most track is within 15 mm of its gauge."""


MIN_SHARE = 0.1
"""Share of the places at which a distance must be found."""


SEEN_SHARE = 0.96
"""Width that `_head` finds, relative to the true one: it loses the rounded edges. Measured on the synthetic scenes."""


SAMPLE_M = 50.0
"""Half the side of the area whose points show the width of the heads."""


FEET = (0.3048, 1 / 0.3048)
"""Factors by which coordinates are wrong if feet are stated as metres, or metres as feet."""


def warn_of_gauge(request: Request, parameters: Parameters, progress: Progress) -> bool:
    """Warn the user at once if the first points show another gauge: the run takes minutes until no track is found.

    Returns whether the user has been warned.
    """
    try:
        sample = request.sample()[0]
    except CloudError:
        return False  # reported when the points are sorted
    return warn_of_other_spacing(sample, parameters, progress)


def warn_of_spacing(source: PointSource, parameters: Parameters, progress: Progress) -> bool:
    """Warn the user of another gauge as `warn_of_gauge` does, by the points of one class, as found in a raw cloud."""
    return warn_of_other_spacing(middle(fullest_square(source).xyz), parameters, progress)


def warn_of_other_spacing(xyz: np.ndarray, parameters: Parameters, progress: Progress) -> bool:
    """Warn the user if rail points, (n, 3) in metres, show another gauge; return whether they do."""
    spacings = measure_spacings(xyz)
    measured = spacings.most_common()
    spacings_m, tolerance_m = [sum(one) for one in parameters.gauges], parameters.centerline_tolerance_m
    if any(spacings.include(one, tolerance_m) for one in spacings_m):
        return False
    for factor, stated, real in zip(FEET, ("metres", "feet"), ("feet", "metres")):
        if _is_off_by(factor, xyz, spacings_m, parameters):
            progress.warning(
                f"Rails are {1 / factor:.3g} times as far apart as the gauge: the coordinates are said to be {stated}, "
                f"are these {real}? Assign a coordinate system that says so."
            )
            return True
    if measured is None:
        return False
    expected = 1000 * (parameters.gauge_m + parameters.head_width_m)
    progress.warning(f"Rails are {in_words(*measured)}; {expected:.0f} mm apart are expected{question(*measured)}")
    standard = closest_standard(*measured)
    if standard is not None:
        progress.propose(standard.name)
    return True


def _is_off_by(factor: float, xyz: np.ndarray, spacings_m: Sequence[float], parameters: Parameters) -> bool:
    """Return whether rails are at a gauge, with heads of the stated width, once coordinates are multiplied."""
    measured = measure_spacings(factor * xyz).most_common()
    if measured is None or abs(measured[1] - parameters.head_width_m) > 2 * HEAD_OFF_M:
        return False
    return min(abs(measured[0] - one) for one in spacings_m) <= parameters.centerline_tolerance_m


def middle(xyz: np.ndarray) -> np.ndarray:
    """Return the points around the middle one."""
    place = xyz[np.argmin(np.abs(xyz[:, :2] - np.median(xyz[:, :2], axis=0)).max(axis=1)), :2]
    return xyz[np.abs(xyz[:, :2] - place).max(axis=1) <= SAMPLE_M]


def question(spacing_m: float, head_width_m: float) -> str:
    """End a sentence with the question for the standard that fits what was measured, if one does."""
    standard = closest_standard(spacing_m, head_width_m)
    return f": is it {standard.label} ({standard.name})?" if standard else "."


def in_words(spacing_m: float, head_width_m: float) -> str:
    """State what was measured."""
    return f"{1000 * spacing_m:.0f} mm apart, with heads {1000 * head_width_m:.0f} mm wide"


@dataclass(frozen=True)
class Spacings:
    """Distances between the axes of two rails, (n,), seen from places on them, and the width of the head of each place.

    Of the places, `places` in number, some see several rails and some none.
    """

    distance_m: np.ndarray
    head_width_m: np.ndarray
    places: int

    def include(self, spacing_m: float, tolerance_m: float) -> bool:
        """Return whether rails are found at this distance."""
        return self._often(np.abs(self.distance_m - spacing_m) <= tolerance_m)

    def most_common(self) -> tuple[float, float] | None:
        """Return the most frequent distance and the width of the heads there; None if no distance is frequent."""
        peak = self._peak()
        if not peak.any():
            return None
        return float(np.median(self.distance_m[peak])), float(np.median(self.head_width_m[peak])) / SEEN_SHARE

    def width_error_m(self) -> float:
        """Return the standard error of the width of the heads at the most frequent distance; NaN without one."""
        widths = self.head_width_m[self._peak()]
        # The median of normally distributed values is 1.25 times as uncertain as their mean.
        return float(1.25 * widths.std() / np.sqrt(len(widths))) if len(widths) else float("nan")

    def _peak(self) -> np.ndarray:
        """Return which distances are near the most frequent one, (n,) bool; none if no distance is frequent."""
        if not len(self.distance_m):
            return np.zeros(0, bool)
        counts = np.convolve(np.bincount((self.distance_m / BIN_M).astype(int)), np.ones(3), mode="same")
        peak = np.abs(self.distance_m - (np.argmax(counts) + 0.5) * BIN_M) <= HALF_PEAK_M
        return peak if self._often(peak) else np.zeros_like(peak)

    def _often(self, mask: np.ndarray) -> bool:
        return bool(mask.sum() >= max(1.0, MIN_SHARE * self.places))


def measure_spacings(xyz: np.ndarray) -> Spacings:
    """Measure the distances between rails at some of their points, (n, 3) in local metres."""
    if len(xyz) < MIN_POINTS:
        return Spacings(np.empty(0), np.empty(0), 0)
    tree = cKDTree(xyz[:, :2])
    places = xyz[np.linspace(0, len(xyz) - 1, min(PLACES, len(xyz))).astype(int)]
    found = np.array([one for place in places for one in _spacings(xyz[_near(tree, place)] - place)]).reshape(-1, 2)
    return Spacings(found[:, 0], found[:, 1], len(places))


def _near(tree: cKDTree, place: np.ndarray) -> list[int]:
    """Return the points that may be on the rail of a place or on its partner, or an even selection of them."""
    near = tree.query_ball_point(place[:2], np.hypot(SPACING_RANGE_M[1] + REACH_M, HALF_LENGTH_M))
    return near[:: -(-len(near) // MAX_NEAR) or 1]


def _spacings(near: np.ndarray) -> Iterator[tuple[float, float]]:
    """Yield the distances of other rails from the rail at the origin, with the width of that rail's head.

    The points around the origin, (n, 3), include one on a rail there.
    """
    direction = _direction(near)
    if direction is None:
        return
    along, across = (near[:, :2] @ np.column_stack([direction, [-direction[1], direction[0]]])).T
    beside = np.flatnonzero(np.abs(along) < HALF_LENGTH_M)
    beside = beside[np.argsort(across[beside])]
    rails = np.split(beside, np.flatnonzero(np.diff(across[beside]) > SEPARATE_M) + 1)
    found = (_head(along[rail], across[rail], near[rail, 2]) for rail in rails if len(rail) >= MIN_POINTS)
    heads = [head for head in found if head is not None]
    own = [head for head in heads if abs(head[0]) < REACH_M]
    if len(own) != 1:
        return
    for axis, _ in heads:
        if SPACING_RANGE_M[0] <= abs(axis - own[0][0]) <= SPACING_RANGE_M[1]:
            yield abs(axis - own[0][0]), own[0][1]


def _direction(near: np.ndarray) -> np.ndarray | None:
    """Return the direction in plan of the rail at the origin, (2,); None if it has too few points."""
    mine = near[np.hypot(*near[:, :2].T) < HALF_LENGTH_M / 2, :2]
    for _ in range(2):  # the second time with the points of the whole length
        if len(mine) < MIN_POINTS:
            return None
        off = mine - mine.mean(axis=0)
        angle = 0.5 * np.arctan2(2 * (off[:, 0] @ off[:, 1]), off[:, 0] @ off[:, 0] - off[:, 1] @ off[:, 1])
        direction = np.array([np.cos(angle), np.sin(angle)])
        along, across = near[:, :2] @ direction, near[:, :2] @ [-direction[1], direction[0]]
        mine = near[(np.abs(along) < HALF_LENGTH_M) & (np.abs(across) < REACH_M), :2]
    return direction


def _head(along: np.ndarray, across: np.ndarray, height: np.ndarray) -> tuple[float, float] | None:
    """Return the axis and the width of a railhead from the points of a rail; None if too few are on top.

    Points that are spread evenly over a width have a standard deviation of this width over the root of twelve, and
    noise of a few millimetres hardly adds to it. In a curve they are spread about an arc: 6 mm off straight at a radius
    of 25 m.
    """
    along = along - along.mean()
    length = along @ along
    height = height - along * (along @ height / length if length else 0.0)
    on_top = height > _percentile(np.sort(height), TOP_PERCENT) - TOP_M
    top = np.sort(across[on_top])
    if len(top) < MIN_POINTS or top[-1] - top[0] > REACH_M:
        return None
    bend = along[on_top] ** 2
    bend, off = bend - bend.mean(), across[on_top] - top.mean()
    off = off - bend * (bend @ off) / (bend @ bend or 1.0)
    return 0.5 * (_percentile(top, 1) + _percentile(top, 99)), float(np.sqrt(12 * (off @ off) / (len(off) - 1)))


def _percentile(ascending: np.ndarray, percent: float) -> float:
    """Return what `np.percentile` returns, twenty times as fast on some hundred numbers."""
    place = percent / 100 * (len(ascending) - 1)
    below = min(int(place), len(ascending) - 2)
    return float(ascending[below] + (place - below) * (ascending[below + 1] - ascending[below]))
