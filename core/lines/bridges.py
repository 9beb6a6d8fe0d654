"""Bridges: curves between two line ends that a rail could follow, and how well they explain both lines.

See docs/method.md section 4.8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .ends import STEP_M, even_points

FIT_M = 4.0
"""Length of either line that the curve is fitted to."""

STAIRS_M = 0.02
"""Largest distance of a raster line from its rail: half a cell. Larger distances come from weeds or hooks."""

MISFIT_M = 0.01
"""Up to half of the points of either line may be further from the curve. Across 4 m, a lateral shift of 0.2 m just
passes. Towards narrower gaps, which leave no room for another rail, the limit rises to `STAIRS_M`."""

MIN_RADIUS_M = 15.0
"""No rail of a tramway or railway has a smaller radius, turnouts included; the smallest in use is 18 m."""

ROUNDS = 5
"""Rounds of reweighting, which reduce the weight of points far from the curve."""

TRANSITION_M = 5.0
"""Shortest length in which the curvature may rise from 0 to 1 / `MIN_RADIUS_M`: a short clothoid of a tramway."""

STEADY_TRANSITION_M = 500.0
"""The same for curves that keep their curvature as a main line does, which excludes a swerve to a neighbouring rail."""


@dataclass(frozen=True)
class Bridge:
    """A curve between two line ends.

    Attributes
    ----------
    cost : float
        Length in metres, times 1 to 3 depending on misfit and curvature.
    cuts_m : tuple of float
        Lengths to remove from the first and the second line: the parts at their ends that are off the curve, as where
        weeds or other rails have drawn the line aside.
    points : (n, 2) array
        Points every `STEP_M` from the first end to the second, once these are cut; both ends excluded.
    """

    cost: float
    cuts_m: tuple[float, float]
    points: np.ndarray


def bridge(
    one: np.ndarray,
    other: np.ndarray,
    held: bool = False,
    misfit_m: float = MISFIT_M,
    transition_m: float = TRANSITION_M,
) -> Bridge | None:
    """Fit one smooth curve to the ends of two lines and return the part between them.

    The curve is a cubic over the straight line across the gap, with the curvature of rails as prior. A connection to a
    neighbouring rail is refused because it needs two opposite bends.

    Parameters
    ----------
    one, other : (n, 2) arrays
        Both lines, from the end to be connected inward.
    held : bool
        Whether the first line must not be cut.
    misfit_m : float
        Largest median distance of either line from the curve.
    transition_m : float
        Shortest length in which the curvature may rise from 0 to 1 / `MIN_RADIUS_M`.

    Returns
    -------
    Bridge or None
        None if the curve misses either line, bends more than a rail, or would have to turn back along a line.
    """
    before, after = even_points(one, FIT_M)[::-1], even_points(other, FIT_M)
    origin, axes = _frame(before, after)
    before, after = (before - origin) @ axes.T, (after - origin) @ axes.T
    gap = after[0, 0] - before[-1, 0]
    if min(gap, before[-1, 0] - before[0, 0], after[-1, 0] - after[0, 0]) <= 0:
        return None
    cubic = _fit(np.concatenate([before, after]), transition_m)
    off = [np.abs(points[:, 1] - _basis(points[:, 0]) @ cubic) for points in (before, after)]
    misfit = max(np.median(off[0]), np.median(off[1]))
    bend = np.abs(cubic[2] + cubic[3] * np.array([before[0, 0], after[-1, 0]])).max() * MIN_RADIUS_M
    allowed = max(misfit_m, STAIRS_M * (1 - gap / (2 * FIT_M)))
    if misfit > allowed or bend > 1:
        return None
    cut_before, cut_after = 0 if held else _astray(off[0][::-1]), _astray(off[1])
    first, last = before[-1 - cut_before, 0], after[cut_after, 0]
    x = np.linspace(first, last, int((last - first) / STEP_M) + 2)[1:-1]
    points = origin + np.column_stack([x, _basis(x) @ cubic]) @ axes
    cuts_m = _length(before[::-1][: cut_before + 1]), _length(after[: cut_after + 1])
    return Bridge(gap * (1 + misfit / MISFIT_M + bend), cuts_m, points)


def _astray(off_m: np.ndarray) -> int:
    """Count the points from the end inward up to the last one off the curve; at most half, as the rest supports it."""
    half = len(off_m) // 2
    far = np.flatnonzero(off_m[:half] > STAIRS_M)
    return int(far[-1]) + 1 if len(far) else 0


def _length(points: np.ndarray) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def _frame(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of the gap, and unit vectors along and across the way from one part to the other, (2, 2)."""
    along = after.mean(axis=0) - before.mean(axis=0)
    along = along / np.hypot(*along)
    return (before[-1] + after[0]) / 2, np.array([along, [-along[1], along[0]]])


def _fit(points: np.ndarray, transition_m: float = TRANSITION_M) -> np.ndarray:
    """Fit y(x) robustly with the curvature of rails as prior: value, slope, curvature and its change at x = 0."""
    basis, y = _basis(points[:, 0]), points[:, 1]
    prior = np.diag([0.0, 0.0, 1.0, transition_m]) * STAIRS_M * MIN_RADIUS_M
    weight = np.ones(len(points))
    for _ in range(ROUNDS):
        design = np.concatenate([weight[:, None] * basis, prior])
        cubic = np.linalg.lstsq(design, np.concatenate([weight * y, np.zeros(4)]), rcond=None)[0]
        weight = 1 / np.sqrt(1 + ((y - basis @ cubic) / STAIRS_M) ** 2)
    return cubic


def _basis(x: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones_like(x), x, x**2 / 2, x**3 / 6])
