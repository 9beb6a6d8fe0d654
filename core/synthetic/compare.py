"""Comparison of extracted lines with true ones: how much was found, how much is right, how far off it lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

STEP_M = 0.05
"""Distance of the places at which lines are compared."""

CANDIDATES = 4
"""Nearest places of the other lines that are looked at: enough to see both of two lines that cross."""


@dataclass(frozen=True)
class Comparison:
    """What lines are worth against the truth; of two directions of comparison the worse stands here.

    Attributes
    ----------
    completeness : float
        Share of the true length with a line within the tolerance, in plan.
    correctness : float
        Share of the lines' length within the tolerance of a true line, in plan.
    lateral_rmse_m, lateral_p95_m, lateral_bias_m : float
        Offset across the true line, positive to its left, where it is within the tolerance.
    height_rmse_m, height_bias_m : float
        Line above truth, at the same places.
    line_count, truth_count : int
    length_ratio : float
        Length of all lines over length of the truth.
    """

    completeness: float
    correctness: float
    lateral_rmse_m: float
    lateral_p95_m: float
    lateral_bias_m: float
    height_rmse_m: float
    height_bias_m: float
    line_count: int
    truth_count: int
    length_ratio: float


def compare_lines(
    extracted: Sequence[np.ndarray], truth: Sequence[np.ndarray], tolerance_m: float = 0.05
) -> Comparison:
    """Compare lines with the truth, both ways: from the truth to the lines and from the lines to the truth.

    Parameters
    ----------
    extracted, truth : sequence of (n, 3) array
        Polylines in metres; errors are NaN when nothing was extracted.
    tolerance_m : float
        A place counts as found, and enters the errors, when the other side is no farther in plan.
    """
    if not extracted:
        return Comparison(0.0, 0.0, *[np.nan] * 5, 0, len(truth), 0.0)
    true_places, true_along = _places(truth)
    places, along = _places(extracted)
    distance, lateral, height = _offsets(true_places, true_along, places, along)
    found = distance <= tolerance_m
    back_distance, back_lateral, back_height = _offsets(places, along, true_places, true_along)
    back_height = -back_height
    right = back_distance <= tolerance_m
    back_lateral = back_lateral[right]
    pairs = [(lateral[found], back_lateral), (height[found], back_height[right])]
    (lateral_rmse, lateral_bias), (height_rmse, height_bias) = (
        (_worse(_rms(there), _rms(back)), _worse(_mean(there), _mean(back))) for there, back in pairs
    )
    p95 = _worse(_percentile95(lateral[found]), _percentile95(back_lateral))
    return Comparison(
        float(found.mean()),
        float(right.mean()),
        lateral_rmse,
        p95,
        lateral_bias,
        height_rmse,
        height_bias,
        len(extracted),
        len(truth),
        len(places) / len(true_places),
    )
