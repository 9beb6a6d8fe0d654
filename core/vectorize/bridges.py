"""Curves that a rail could follow from one line end to another, and how well they explain both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .ends import STEP_M, stretch

FIT_M = 4.0
"""Stretch on either side that the curve is fitted to."""

SLACK_M = 0.03
"""How far a raster line may lie beside its rail: three quarters of a cell."""

TIGHTEST_RADIUS_M = 20.0
"""No rail of a tram or railway is bent more sharply, turnouts included."""

TRANSITION_M = 5.0
"""Within this length the curvature may change from none to the tightest; a short clothoid of a tramway."""


@dataclass(frozen=True)
class Bridge:
    """A curve between two line ends.

    Attributes
    ----------
    cost : float
        Its length in metres, made larger by what it misses and how it bends; 1 to 3 times the length.
    points : (n, 2) array
        Between the ends, every `STEP_M`, from the first end to the second.
    """

    cost: float
    points: np.ndarray


def bridge(one: np.ndarray, other: np.ndarray) -> Bridge | None:
    """Fit one smooth curve to two lines, each given from the end to be joined, and cut out what lies between them.

    The curve is a cubic over the way across, its curvature held to what rails do. None if it misses either line by more
    than `SLACK_M`, or bends more than a rail. That rules out the neighbouring rail, for it takes a double bend.
    """
    before, after = stretch(one, FIT_M)[::-1], stretch(other, FIT_M)
    origin, axes = _frame(before, after)
    before, after = (before - origin) @ axes.T, (after - origin) @ axes.T
    gap = after[0, 0] - before[-1, 0]
    cubic = _fit(np.concatenate([before, after]))
    misfit = max(np.sqrt(np.mean((points[:, 1] - _basis(points[:, 0]) @ cubic) ** 2)) for points in (before, after))
    bend = np.abs(cubic[2] + cubic[3] * np.array([before[0, 0], after[-1, 0]])).max() * TIGHTEST_RADIUS_M
    if gap <= 0 or misfit > SLACK_M or bend > 1:
        return None
    x = np.linspace(before[-1, 0], after[0, 0], int(gap / STEP_M) + 2)[1:-1]
    return Bridge(gap * (1 + misfit / SLACK_M + bend), origin + np.column_stack([x, _basis(x) @ cubic]) @ axes)


def _frame(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origin in the middle of the gap, and axes along and across the way from one stretch to the other, (2, 2)."""
    along = after.mean(axis=0) - before.mean(axis=0)
    along = along / np.hypot(*along)
    return (before[-1] + after[0]) / 2, np.array([along, [-along[1], along[0]]])


def _fit(points: np.ndarray) -> np.ndarray:
    """Cubic y(x) as value, slope, curvature and its change at 0, least squares with the habits of rails as prior."""
    curvature = SLACK_M * TIGHTEST_RADIUS_M
    prior = np.diag([0.0, 0.0, curvature, curvature * TRANSITION_M])
    design = np.concatenate([_basis(points[:, 0]), prior])
    return np.linalg.lstsq(design, np.concatenate([points[:, 1], np.zeros(4)]), rcond=None)[0]


def _basis(x: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones_like(x), x, x**2 / 2, x**3 / 6])
