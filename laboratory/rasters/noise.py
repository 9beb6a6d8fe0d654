"""What goes wrong beside the rails or with all of them at once: shadows, patches, ballast, lost cells, lone lines.

Every function takes a severity from 0 to 1; docs/synthetic.md lists what it does.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from .drawing import Window
from .paths import STEP_M, RailPath

LONE_LINE_M = 5.0
"""Lines shorter than this beside the tracks are no rails."""
LONE_LINES = 1.5
"""Their number on 20 x 20 m at full severity, on average."""

SHADOWS = 0.8
"""Number of shadows on 20 x 20 m at full severity, on average."""
SHADOW_WIDTH_M, SHADOW_LENGTH_M = (0.1, 2.5), (2.0, 15.0)
SHADOW_SPREAD = 0.15
"""By how much a shadow widens with the distance from what throws it."""

LOST_SHARE = 0.4
"""Largest share of single cells lost."""
STRAY_SHARE = 0.02
"""Largest share of cells anywhere that are taken for rail."""
BALLAST_SHARE, GRAVE_BALLAST = 0.06, 3.0
"""Largest share of cells beside a rail that are taken for rail, and by how much of itself it grows at the top of the
scale, where the classification has all but failed."""
BALLAST_M = (0.1, 1.5)
"""Distances over which that share decays."""

BLOBS, GRAVE_BLOBS = 300.0, 1.0
"""Patches on 1024 x 1024 cells at full severity, at most on average, and their growth at the top of the scale."""
BLOB_CELLS = (1.0, 12.0)
"""Half axes of patches."""
HIDING_SHARE = 0.25
"""Share of patches that hide rail instead of feigning it."""


def gravity(severity: float) -> float:
    """How much of what only the worst clouds suffer from: next to nothing up to the middle of the scale."""
    return severity**3


def lone_lines(rng: np.random.Generator, window: Window, severity: float) -> list[RailPath]:
    """Draw short straight lines that belong to no track: cables, sleepers' ends, edges of platforms."""
    lines = []
    for _ in range(rng.poisson(LONE_LINES * severity * _area(window))):
        heading = rng.uniform(-math.pi, math.pi)
        direction = np.array([math.cos(heading), math.sin(heading)])
        along = np.arange(0.0, rng.uniform(0.5, LONE_LINE_M), STEP_M)
        xy = _place(rng, window) + along[:, None] * direction
        lines.append(RailPath(xy, np.tile([-direction[1], direction[0]], (len(xy), 1))))
    return lines


def shadows(rng: np.random.Generator, window: Window, severity: float) -> np.ndarray:
    """Draw wedges that the scanner does not see behind masts, cabinets and trains, (size, size) bool."""
    hidden = np.zeros((window.size, window.size), dtype=bool)
    centres = (np.arange(window.size) + 0.5) * window.cell_m
    for _ in range(rng.poisson(SHADOWS * severity * _area(window))):
        x, y = _place(rng, window)
        heading = rng.uniform(-math.pi, math.pi)
        width_m = math.exp(rng.uniform(*np.log(SHADOW_WIDTH_M)))
        right, up = window.x0 + centres[None, :] - x, window.y0 - centres[:, None] - y
        along = right * math.cos(heading) + up * math.sin(heading)
        across = np.abs(up * math.cos(heading) - right * math.sin(heading))
        hidden |= (
            (along > 0) & (along < rng.uniform(*SHADOW_LENGTH_M)) & (across < 0.5 * width_m + SHADOW_SPREAD * along)
        )
    return hidden


def flip(
    rng: np.random.Generator, observed: np.ndarray, label: np.ndarray, severity: float, cell_m: float
) -> np.ndarray:
    """Lose set cells, and set empty ones, more of them near the tracks where ballast is taken for rail."""
    lost = rng.random() * LOST_SHARE * severity
    stray = rng.random() ** 3 * STRAY_SHARE * severity
    beside = rng.random() ** 2 * BALLAST_SHARE * severity * (1 + GRAVE_BALLAST * gravity(severity))
    kept = observed & (rng.random(observed.shape, dtype=np.float32) >= lost)
    chance = stray
    if beside > 0 and label.any():
        distance = ndimage.distance_transform_edt(~label) * cell_m
        chance = stray + beside * np.exp(-distance / rng.uniform(*BALLAST_M))
    return kept | (rng.random(observed.shape, dtype=np.float32) < chance)


def scatter_blobs(rng: np.random.Generator, observed: np.ndarray, severity: float) -> np.ndarray:
    """Scatter elliptic patches: most are vegetation taken for rail and set cells, some hide rail and clear them."""
    size = len(observed)
    result = observed.copy()
    most = BLOBS * severity * (1 + GRAVE_BLOBS * gravity(severity)) * (size / 1024) ** 2
    for _ in range(rng.poisson(most * rng.random())):
        axes = np.exp(rng.uniform(*np.log(BLOB_CELLS), size=2))
        tilt = rng.uniform(0, math.pi)
        row, column = rng.integers(0, size, size=2)
        reach = int(axes.max()) + 1
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, size))
        columns = np.arange(max(column - reach, 0), min(column + reach + 1, size))
        down, right = rows[:, None] - row, columns[None, :] - column
        u = (right * math.cos(tilt) + down * math.sin(tilt)) / axes[0]
        v = (down * math.cos(tilt) - right * math.sin(tilt)) / axes[1]
        patch = u**2 + v**2 <= rng.uniform(0.5, 1.0, size=u.shape)
        area = result[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        if rng.random() < HIDING_SHARE:
            area &= ~patch
        else:
            area |= patch & (rng.random(u.shape) < rng.uniform(0.3, 1.0))
    return result


def _place(rng: np.random.Generator, window: Window) -> np.ndarray:
    """Draw a point of the window, metres."""
    return np.array([window.x0, window.y0]) + rng.random(2) * [window.extent_m, -window.extent_m]


def _area(window: Window) -> float:
    """Area of the window in units of 20 x 20 m, about 512 x 512 cells."""
    return (window.extent_m / 20) ** 2
