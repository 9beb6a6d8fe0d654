"""What many values, of which some may be unknown, have in common: their median, size, extreme and scatter."""

from __future__ import annotations

import numpy as np

SIGMA_OF_MEDIAN = 1.4826
"""Standard deviation of normally distributed values divided by the median of their sizes."""


def known(values: np.ndarray) -> np.ndarray:
    """Return the values that are numbers, (k,)."""
    return values[np.isfinite(values)]


def median(values: np.ndarray) -> float:
    """Return the median of the known values; NaN without any."""
    return float(np.median(known(values))) if known(values).size else np.nan


def rms(values: np.ndarray) -> float:
    """Return the root mean square of the known values; NaN without any."""
    return float(np.sqrt(np.mean(known(values) ** 2))) if known(values).size else np.nan


def largest(values: np.ndarray) -> float:
    """Return the known value that is furthest from 0, with its sign; NaN without any."""
    return float(max(known(values).tolist(), key=abs, default=np.nan))


def sigma_by_median(errors: np.ndarray) -> float:
    """Estimate a standard deviation from the median size of errors, which outliers hardly affect."""
    return SIGMA_OF_MEDIAN * float(np.median(np.abs(errors)))
