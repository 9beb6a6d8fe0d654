"""How lines end, continue across a gap by a bridge, and part (docs/method.md sections 4.7, 4.10 and 6.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..polyline import Polyline, interpolate

STEP_M = 0.1
"""Spacing of even points. Vertices of a raster line are spaced by its corners, not by length."""


def turned(vertices: np.ndarray, end: int) -> np.ndarray:
    """Reverse a line if `end` is its last end (an odd number, see `LineNetwork`); doing so twice restores it."""
    return vertices[::-1] if end % 2 else vertices


def even_points(line: np.ndarray, length_m: float = np.inf) -> np.ndarray:
    """Return points about every `STEP_M` along the first `length_m` of a line, (n, 2), at least two."""
    own = Polyline(line)
    length_m = min(length_m, own.length_m)
    return own.at(np.linspace(0.0, length_m, max(int(length_m / STEP_M), 1) + 1))


def cut_back(line: np.ndarray, length_m: float) -> np.ndarray:
    """Remove the first `length_m` of a line that is longer."""
    if length_m <= 0:
        return line
    own = Polyline(line)
    return np.concatenate([own.at(np.array([length_m])), line[own.t > length_m]])


def tip_and_direction(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit a straight line to points, (n, 2), from the end of a line inward.

    Returns the foot of the first point on it, (2,), and the unit vector out of the line, (2,).
    """
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    outward = axes[0] if np.dot(axes[0], points[0] - points[-1]) >= 0 else -axes[0]
    return middle + np.dot(points[0] - middle, outward) * outward, outward


FIT_M = 4.0
"""Length of either line that the curve is fitted to, unless more is asked for."""

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

    `cost` is its length in metres, times 1 to 3 depending on misfit and curvature. `cuts_m` are lengths to remove from
    the first and the second line: the parts at their ends that are off the curve, as where weeds or other rails have
    drawn the line aside. `points`, (n, 2), are every `STEP_M` from the first end to the second, once these are cut;
    both ends excluded.
    """

    cost: float
    cuts_m: tuple[float, float]
    points: np.ndarray


def bridge(
    one: np.ndarray,
    other: np.ndarray,
    misfit_m: float = MISFIT_M,
    transition_m: float = TRANSITION_M,
    fit_m: float = FIT_M,
) -> Bridge | None:
    """Fit one smooth curve to the ends of two lines, (n, 2) from the end inward, and return the part between them.

    The curve is a cubic over the straight line across the gap, with the curvature of rails as prior. A connection to a
    neighbouring rail is refused because it needs two opposite bends. None if the curve misses either line by a median
    of more than `misfit_m`, bends more than a rail, or would turn back along a line, and if both are in one place.

    `transition_m` is the shortest length in which the curvature may rise from 0 to 1 / `MIN_RADIUS_M`; `fit_m` is the
    length of either line that the curve explains.
    """
    before, after = even_points(one, fit_m)[::-1], even_points(other, fit_m)
    if np.hypot(*(after.mean(axis=0) - before.mean(axis=0))) < STEP_M:
        return None
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
    cut_before, cut_after = _astray(off[0][::-1]), _astray(off[1])
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


def _fit(points: np.ndarray, transition_m: float) -> np.ndarray:
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


ARC, STRAIGHT = 2, 1
"""Powers of the way by which the distance grows: the branch begins on an arc, or at an angle."""


@dataclass(frozen=True)
class PartingLaw:
    """Distance between two axes over the way along one of them: (slope * way + root)^power, or 0 before they touch.

    The power, `ARC` or `STRAIGHT`, is that of the distance whose root follows a straight line.
    """

    slope: float
    root: float
    power: int

    @classmethod
    def fitted(cls, way: np.ndarray, apart: np.ndarray, power: int, weights: np.ndarray | None = None) -> PartingLaw:
        """Fit the law to the way along one rail and the distance of the other one there, (n,) metres each.

        The fit is a straight line through the roots of the distances, of which negative ones count as 0; `weights` are
        factors of its residuals.
        """
        slope, root = np.polyfit(way, np.maximum(apart, 0.0) ** (1 / power), 1, w=weights)
        return cls(float(slope), float(root), power)

    def way_at(self, apart_m: float) -> float:
        """Return the way at which the axes are `apart_m` apart; -inf if they do not part."""
        return (apart_m ** (1 / self.power) - self.root) / self.slope if self.slope > 0 else -np.inf

    @property
    def touch(self) -> float:
        """Way at which the axes touch; -inf if they do not part."""
        return self.way_at(0.0)

    def __call__(self, way: np.ndarray) -> np.ndarray:
        """Return the distances at (n,) places along the way, metres."""
        return np.maximum(self.slope * way + self.root, 0.0) ** self.power


def left_of(line: np.ndarray, at: np.ndarray, left_m: np.ndarray) -> np.ndarray:
    """Return places, (k, 2), at chainages along a line, (n, 2), and distances to the left of it, (k,) metres each."""
    own = Polyline(line)
    return own.at(at) + left_m[:, None] * interpolate(own.normals, own.t, at)
