"""The smooth lines through guides along which airborne points are seen at first, and the points around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ..polyline import Polyline

STEP_M = 1.0
"""Distance between the vertices of an axis: a chord of a curve of 300 m radius is then 0.4 mm off."""

MIN_VERTEX_M = 8.0
"""Distance below which vertices of a guide are left out: their errors would bend the curve between them."""

LONG_RUN = 2.0
"""A run this many times as long as the one next to it is straight up to it."""

SMOOTHED_M = 4.0
"""Standard deviation of the smoothing of a guide, which rounds its kinks; a curve of 300 m radius moves by 3 cm."""


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

    @classmethod
    def near(cls, line: Polyline, xyz: np.ndarray, strip: np.ndarray, reach_m: float) -> Points:
        """Return the points, (n, 3) of strips (n,), within reach of a line."""
        feet = line.feet(xyz[:, :2], reach_m)
        return cls(xyz[feet.point], strip[feet.point], feet.t)


def axis_of_guide(vertices: np.ndarray) -> Polyline:
    """Draw a smooth curve through the vertices of a guide, (n, 2) metres; straight runs stay straight.

    The curve removes the error of chords, which is 0.67 m where the vertices of a curve of 300 m radius are 40 m apart.
    """
    kept = Polyline(_without_bulges(_apart(vertices)))
    fine = np.arange(0.0, kept.length_m, STEP_M / 4)
    curve = Polyline(Akima1DInterpolator(kept.t, kept.xy)(fine) if len(kept.t) > 2 else kept.at(fine))
    t = np.arange(0.0, curve.length_m, STEP_M)
    return Polyline(_smoothed(curve.at(t)), t)


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
