"""Curves that a rail could follow from one line end to another, and how well they explain both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .ends import STEP_M, stretch

FIT_M = 4.0
"""Stretch on either side that the curve is fitted to."""

STAIRS_M = 0.02
"""How far a raster line strays from its rail: half a cell. What strays further is a weed or a hook."""

MISFIT_M = 0.01
"""Half of either line may lie this far beside the curve, no more. Across 4 m a shift of 0.2 m just passes; towards
narrower gaps, where no other rail has room, twice as much is allowed, as far as the stairs go."""

TIGHTEST_RADIUS_M = 15.0
"""No rail of a tram or railway is bent more sharply, turnouts included; 18 m is the least in use."""

ROUNDS = 5
"""Rounds of reweighting, in which what strays loses its say."""

TRANSITION_M = 5.0
"""Within this length the curvature may change from none to the tightest; a short clothoid of a tramway."""

STEADY_TRANSITION_M = 500.0
"""The same for curves that keep their bend as a main line does, which rules out a swerve to a neighbour."""


@dataclass(frozen=True)
class Bridge:
    """A curve between two line ends.

    Attributes
    ----------
    cost : float
        Its length in metres, made larger by what it misses and how it bends; 1 to 3 times the length.
    cuts_m : tuple of float
        Lengths at the two ends that stray from the curve, as rails seem to beside weeds and other rails.
    points : (n, 2) array
        Between the ends so cut back, every `STEP_M`, from the first end to the second.
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
    """Fit one smooth curve to two lines, each given from the end to be joined, and cut out what lies between them.

    The curve is a cubic over the way across, its curvature held to what rails do. None if it misses either line, or
    bends more than a rail. That rules out the neighbouring rail, for it takes a double bend. With `held` nothing is cut
    off the first line; `misfit_m` is how far half of either line may lie beside the curve, and `transition_m` the
    length in which its curvature may change from none to the tightest.
    """
    before, after = stretch(one, FIT_M)[::-1], stretch(other, FIT_M)
    origin, axes = _frame(before, after)
    before, after = (before - origin) @ axes.T, (after - origin) @ axes.T
    gap = after[0, 0] - before[-1, 0]
    cubic = _fit(np.concatenate([before, after]), transition_m)
    off = [np.abs(points[:, 1] - _basis(points[:, 0]) @ cubic) for points in (before, after)]
    misfit = max(np.median(off[0]), np.median(off[1]))
    bend = np.abs(cubic[2] + cubic[3] * np.array([before[0, 0], after[-1, 0]])).max() * TIGHTEST_RADIUS_M
    allowed = max(misfit_m, STAIRS_M * (1 - gap / (2 * FIT_M)))
    if gap <= 0 or misfit > allowed or bend > 1:
        return None
    astray = 0 if held else _astray(off[0][::-1]), _astray(off[1])
    first, last = before[-1 - astray[0], 0], after[astray[1], 0]
    x = np.linspace(first, last, int((last - first) / STEP_M) + 2)[1:-1]
    points = origin + np.column_stack([x, _basis(x) @ cubic]) @ axes
    cuts_m = tuple(
        float(np.hypot(*np.diff(side[: count + 1], axis=0).T).sum())
        for side, count in zip((before[::-1], after), astray)
    )
    return Bridge(gap * (1 + misfit / MISFIT_M + bend), cuts_m, points)


def curvature(points: np.ndarray) -> float:
    """Measure the curvature of a stretch in its middle, 1/m, positive to the left of (n, 2) points in order."""
    half = len(points) // 2
    origin, axes = _frame(points[: half + 1], points[half:])
    return float(_fit((points - origin) @ axes.T)[2])


def _astray(off_m: np.ndarray) -> int:
    """Count the points from the end inward that stray from the curve; no more than half, for the rest bears it."""
    half = len(off_m) // 2
    far = np.flatnonzero(off_m[:half] > STAIRS_M)
    return int(far[-1]) + 1 if len(far) else 0


def _frame(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origin in the middle of the gap, and axes along and across the way from one stretch to the other, (2, 2)."""
    along = after.mean(axis=0) - before.mean(axis=0)
    along = along / np.hypot(*along)
    return (before[-1] + after[0]) / 2, np.array([along, [-along[1], along[0]]])


def _fit(points: np.ndarray, transition_m: float = TRANSITION_M) -> np.ndarray:
    """Fit y(x) robustly, the habits of rails as prior: value, slope, curvature and its change at x = 0."""
    basis, y = _basis(points[:, 0]), points[:, 1]
    prior = np.diag([0.0, 0.0, 1.0, transition_m]) * STAIRS_M * TIGHTEST_RADIUS_M
    weight = np.ones(len(points))
    for _ in range(ROUNDS):
        design = np.concatenate([weight[:, None] * basis, prior])
        cubic = np.linalg.lstsq(design, np.concatenate([weight * y, np.zeros(4)]), rcond=None)[0]
        weight = 1 / np.sqrt(1 + ((y - basis @ cubic) / STAIRS_M) ** 2)
    return cubic


def _basis(x: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones_like(x), x, x**2 / 2, x**3 / 6])
