"""Reference lines along which airborne points are seen: a guide at first, then the line that was fitted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ..polyline import interpolate, left_normals, length_along, project

STEP_M = 1.0
"""Distance between the vertices of an axis: a chord of a curve of 300 m radius is then 0.4 mm off."""

MIN_VERTEX_M = 8.0
"""Distance below which vertices of a guide are left out: their errors would bend the curve between them."""

LONG_RUN = 2.0
"""A run this many times as long as the one next to it is straight up to it."""

SMOOTHED_M = 4.0
"""Standard deviation of the smoothing of a guide, which rounds its kinks; a curve of 300 m radius moves by 3 cm."""


FOOT_ROUNDS = 3
"""Rounds of the search for the segment with the foot of a point; the first one is off by the bend of the guide."""


PAST_END = 1.0
"""A foot this many segments from the middle of its segment is beside the line; a bend leaves small gaps."""


@dataclass(frozen=True)
class Points:
    """Points around a guide.

    Attributes
    ----------
    xyz : (n, 3) array
        Metres.
    strip : (n,) int array
        Number of the strip of each.
    t : (n,) array
        Chainage of each along the guide.
    """

    xyz: np.ndarray
    strip: np.ndarray
    t: np.ndarray


@dataclass(frozen=True)
class Axis:
    """A line with chainages.

    Attributes
    ----------
    xy : (n, 2) array
        Vertices, metres.
    t : (n,) array
        Chainage of each along the guide, rising; that of a fitted line is the chainage of the guide beside it.
    """

    xy: np.ndarray
    t: np.ndarray

    @cached_property
    def normal(self) -> np.ndarray:
        """Unit vectors to the left, (n, 2)."""
        return left_normals(self.xy)

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places, (k, 2), and unit vectors to the left, (k, 2), at chainages."""
        normal = interpolate(self.normal, self.t, t)
        return interpolate(self.xy, self.t, t), normal / np.hypot(*normal.T)[:, None]

    def points_near(self, xyz: np.ndarray, strip: np.ndarray, reach_m: float) -> Points:
        """Return the points, (n, 3) of strips (n,), within reach."""
        feet = project([self.xy], xyz[:, :2], reach_m)
        return Points(xyz[feet.point], strip[feet.point], np.interp(feet.t, length_along(self.xy), self.t))

    def feet(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """Return chainages of points and distances to the left, (n,) each; NaN before the start and past the end.

        The chainages along the guide lead to the feet: a fitted line has its vertices beside those of the guide.
        """
        along = np.diff(self.xy, axis=0)
        length = np.hypot(*along.T)
        segment = np.clip(np.searchsorted(self.t, points.t) - 1, 0, len(length) - 1)
        for _ in range(FOOT_ROUNDS):
            step = points.xyz[:, :2] - self.xy[segment]
            share = np.einsum("ij,ij->i", step, along[segment]) / length[segment] ** 2
            segment = np.clip(segment + np.floor(share).astype(np.int64), 0, len(length) - 1)
        step = points.xyz[:, :2] - self.xy[segment]
        share = np.einsum("ij,ij->i", step, along[segment]) / length[segment] ** 2
        across = (along[segment, 0] * step[:, 1] - along[segment, 1] * step[:, 0]) / length[segment]
        t = self.t[segment] + share * np.diff(self.t)[segment]
        beside = np.abs(share - 0.5) < PAST_END
        return np.where(beside, t, np.nan), np.where(beside, across, np.nan)

    def part(self, first_m: float, last_m: float) -> Axis:
        """Return the vertices between two chainages."""
        inside = slice(*np.searchsorted(self.t, [first_m, np.nextafter(last_m, np.inf)]))
        return Axis(self.xy[inside], self.t[inside])


def axis_of_guide(vertices: np.ndarray) -> Axis:
    """Draw a smooth curve through the vertices of a guide, (n, 2) metres; straight runs stay straight.

    The curve removes the error of chords, which is 0.67 m where the vertices of a curve of 300 m radius are 40 m apart.
    """
    kept = _without_bulges(_apart(vertices))
    along = length_along(kept)
    fine = np.arange(0.0, along[-1], STEP_M / 4)
    curve = Akima1DInterpolator(along, kept)(fine) if len(kept) > 2 else interpolate(kept, along, fine)
    length = length_along(curve)
    t = np.arange(0.0, length[-1], STEP_M)
    return Axis(_smoothed(interpolate(curve, length, t)), t)


def _apart(vertices: np.ndarray) -> np.ndarray:
    """Return the vertices at a distance from each other, with both ends."""
    kept = [0]
    for number in range(1, len(vertices) - 1):
        if np.hypot(*(vertices[number] - vertices[kept[-1]])) >= MIN_VERTEX_M:
            kept.append(number)
    if len(kept) > 1 and np.hypot(*(vertices[-1] - vertices[kept[-1]])) < MIN_VERTEX_M:
        kept.pop()
    return vertices[[*kept, len(vertices) - 1]]


def _without_bulges(vertices: np.ndarray) -> np.ndarray:
    """Add a vertex to a straight run where it meets a much shorter one: the curve beyond would bend it."""
    steps = np.hypot(*np.diff(vertices, axis=0).T)
    added = [vertices[:1]]
    for number in range(len(steps)):
        start, end, length_m = vertices[number], vertices[number + 1], steps[number]
        before_m = steps[number - 1] if number else np.inf
        after_m = steps[number + 1] if number + 1 < len(steps) else np.inf
        if length_m > LONG_RUN * before_m:
            added.append((start + before_m / length_m * (end - start))[None])
        if length_m > LONG_RUN * after_m:
            added.append((end - after_m / length_m * (end - start))[None])
        added.append(end[None])
    return np.concatenate(added)


def _smoothed(xy: np.ndarray) -> np.ndarray:
    """Smooth a line with vertices every `STEP_M`; beyond its ends it goes on straight."""
    half = int(3 * SMOOTHED_M / STEP_M)
    if len(xy) <= half + 1:
        return xy
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) * STEP_M / SMOOTHED_M) ** 2)
    padded = np.concatenate([2 * xy[0] - xy[half:0:-1], xy, 2 * xy[-1] - xy[-2 : -half - 2 : -1]])
    return np.column_stack([np.convolve(column, kernel / kernel.sum(), "valid") for column in padded.T])
