"""What is measured between lines and surveys: gauge and cant of two rails, and the constant shift of one survey.

The shift is found in differences of which some are movements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Chords, Polyline

STEP_M = 0.05
"""Length of the chords that are compared; a chord of this length deviates from an arc of 25 m by 0.01 mm."""

ASTRAY_M = 0.10
"""Distance from its expected place, relative to the track, at which a line is not the rail of the track."""

SMALLEST_M = 1e-4
"""Differences from the shift below this count alike, metres: it is below the noise of any survey."""

STEPS = 50
"""Steps of the iteration, of which twenty are enough even where a third of the length has moved."""

STRAIGHT = 0.1
"""Smallest ratio of the two singular values of the directions across the tracks from which a shift in both directions
shows: tracks whose direction varies by less than some six degrees show only the shift across."""


def cut(lines: Sequence[np.ndarray]) -> Chords:
    """Cut lines, (n, 3) each, into chords of equal length, at most `STEP_M`."""
    return Chords.of([Polyline(line) for line in lines], STEP_M)


def spacing_and_cant(left: np.ndarray, right: np.ndarray, rails: Chords) -> np.ndarray:
    """Measure the distance in space of the two rails of a track, and the height of the left one above the right one.

    The rails are expected at `left` and `right`, (n, 2) metres, and found in the chords of all rails. Returns (n, 2)
    metres; NaN where a rail is missing.
    """
    sides = []
    for place in (left, right):
        feet, _ = rails.nearest(place)
        astray = ~(np.linalg.norm(feet[:, :2] - place, axis=1) <= ASTRAY_M)
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    plan = np.hypot(step[:, 0], step[:, 1])
    return np.column_stack([np.hypot(plan, np.nan_to_num(step[:, 2])), step[:, 2]])


@dataclass(frozen=True)
class Shift:
    """A constant shift of the later survey, metres.

    `plan_m` is east and north; for tracks of one direction, the part across them, so that `both` is false. `up_m` is
    NaN without heights.
    """

    plan_m: np.ndarray
    up_m: float
    both: bool


def find_shift(across_m: np.ndarray, height_m: np.ndarray, left: np.ndarray) -> Shift:
    """Find the shift that most of the length shares: that with the smallest sum of absolute differences.

    Differences across, positive to the left, and in height are (n,) metres, NaN where unknown; `left`, (n, 2), holds
    unit vectors to the left. Up to half of the length may have moved without effect on the shift.
    """
    known = np.isfinite(across_m)
    values = np.linalg.svd(left[known], compute_uv=False) if known.any() else np.zeros(2)
    plan_m = _least_absolute(left[known], across_m[known]) if known.any() else np.zeros(2)
    heights = height_m[np.isfinite(height_m)]
    both = bool(len(values) > 1 and values[1] >= STRAIGHT * values[0] > 0)
    return Shift(plan_m, float(np.median(heights)) if len(heights) else np.nan, both)


def _least_absolute(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Solve rows @ x = values for the smallest sum of absolute residuals, by weights of their reciprocals."""
    weight = np.ones(len(values))
    x: np.ndarray = np.zeros(rows.shape[1])
    for _ in range(STEPS):
        x, *_ = np.linalg.lstsq(rows * weight[:, None], values * weight, rcond=STRAIGHT)
        weight = 1 / np.sqrt(np.maximum(np.abs(values - rows @ x), SMALLEST_M))
    return x
