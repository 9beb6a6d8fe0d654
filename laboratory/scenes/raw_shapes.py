"""Plain shapes made of points, for tests of single steps: a flat bed, bars and tracks on it."""

from __future__ import annotations

import numpy as np

MIDDLE = np.array([20.0, 20.0])
"""Middle of the shapes, metres from a square's corner."""

TOP_M = 0.17
"""Height of a bar."""


def flat(
    size_m: float = 6.0, step_m: float = 0.01, rng: np.random.RandomState | None = None, per_m2: float = 0.0
) -> np.ndarray:
    """Lay points on a square at height 0: on a grid, or at random where `rng` is given, (n, 3)."""
    if rng is None:
        side = np.arange(-size_m / 2, size_m / 2, step_m) + step_m / 2
        xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    else:
        xy = rng.uniform(-size_m / 2, size_m / 2, (int(per_m2 * size_m**2), 2))
    return np.column_stack([xy + MIDDLE, np.zeros(len(xy))])


def turned(xyz: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates along and across (to the left) of a line through `MIDDLE`."""
    x, y = (xyz[:, :2] - MIDDLE).T
    return x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)


def with_bar(
    xyz: np.ndarray,
    width_m: float,
    angle: float = 0.0,
    left_m: float = 0.0,
    height_m: float = TOP_M,
    length_m: float = np.inf,
    middle_m: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Lift points, (n, 3), to a straight bar, and return which are on it.

    The angle is in radians; `left_m` and `middle_m` are the place of its middle across the line through `MIDDLE`, and
    along it.
    """
    along, across = turned(xyz, angle)
    on = (np.abs(across - left_m) <= width_m / 2) & (np.abs(along - middle_m) <= length_m / 2)
    lifted = xyz.copy()
    lifted[on, 2] += height_m
    return lifted, on


def with_track(
    xyz: np.ndarray, gauge_m: float, width_m: float, angle: float = 0.0, length_m: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Lift points to two rails at a gauge; see `with_bar`."""
    half_m = (gauge_m + width_m) / 2
    xyz, left = with_bar(xyz, width_m, angle, half_m, length_m=length_m)
    xyz, right = with_bar(xyz, width_m, angle, -half_m, length_m=length_m)
    return xyz, left | right


def rough(xyz: np.ndarray, rng: np.random.RandomState, bed_m: float = 0.012, bar_m: float = 0.002) -> np.ndarray:
    """Roughen the bed as ballast is, and the bars as a scanner's noise does."""
    lifted = xyz.copy()
    lifted[:, 2] += np.where(xyz[:, 2] > 0.5 * TOP_M, bar_m, bed_m) * rng.standard_normal(len(xyz))
    return lifted


def track_beside_kerb(per_m2: float) -> tuple[np.ndarray, np.ndarray]:
    """Return 12 m of track in four areas, with a kerb as high as the rails, (n, 3), and which points are on heads."""
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=per_m2), 1.435, 0.072, 0.3)
    xyz, kerb = with_bar(xyz, 0.5, 0.3, 3.0)
    return rough(xyz, rng), on & ~kerb
