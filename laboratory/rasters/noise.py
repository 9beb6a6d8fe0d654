"""Distortions of the whole raster: shadows, patches, ballast, lost cells, lone lines.

Each function takes a severity from 0 to 1; docs/synthetic.md states its effect.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from .drawing import Window
from .paths import STEP_M, RailPath

LONE_LINE_M = 5.0
"""Length below which a line next to the tracks is not a rail."""
LONE_LINES = 1.5
"""Mean number of lone lines on 20 x 20 m at full severity."""

SHADOWS = 0.8
"""Mean number of shadows on 20 x 20 m at full severity."""
SHADOW_WIDTH_M, SHADOW_LENGTH_M = (0.1, 2.5), (2.0, 15.0)
SHADOW_SPREAD = 0.15
"""Increase of the half width of a shadow per distance from the object that casts it."""

LOST_SHARE = 0.4
"""Largest share of cells that are lost."""
STRAY_SHARE = 0.02
"""Largest share of cells, anywhere, that are set by mistake."""
BALLAST_SHARE, WORST_BALLAST = 0.06, 3.0
"""Largest share of cells next to a rail that are set because ballast was classified as rail, and its relative increase
at the top of the scale, where the classification has nearly failed."""
BALLAST_M = (0.1, 1.5)
"""Distances over which this share decays."""

PATCHES, WORST_PATCHES = 300.0, 1.0
"""Largest mean number of patches on 1024 x 1024 cells at full severity, and its relative increase at the top of the
scale."""
PATCH_CELLS = (1.0, 12.0)
"""Smallest and largest half axis of a patch."""
HIDING_SHARE = 0.25
"""Share of patches that clear cells instead of setting them."""


def worst_share(severity: float) -> float:
    """Return the share of the distortions that occur in the worst clouds only: small up to the middle of the scale."""
    return severity**3


def lone_lines(rng: np.random.Generator, window: Window, severity: float) -> list[RailPath]:
    """Draw short straight lines that belong to no track: cables, ends of sleepers, edges of platforms."""
    lines = []
    for _ in range(rng.poisson(LONE_LINES * severity * _area(window))):
        heading = rng.uniform(-math.pi, math.pi)
        direction = np.array([math.cos(heading), math.sin(heading)])
        along = np.arange(0.0, rng.uniform(0.5, LONE_LINE_M), STEP_M)
        xy = _place(rng, window) + along[:, None] * direction
        lines.append(RailPath(xy, np.tile([-direction[1], direction[0]], (len(xy), 1))))
    return lines


def shadows(rng: np.random.Generator, window: Window, severity: float) -> np.ndarray:
    """Draw wedges, (size, size), that are hidden from the scanner by masts, cabinets and trains."""
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
    """Clear random cells and set others; near the rails more cells are set, because ballast is classified as rail."""
    lost = rng.random() * LOST_SHARE * severity
    stray = rng.random() ** 3 * STRAY_SHARE * severity
    beside = rng.random() ** 2 * BALLAST_SHARE * severity * (1 + WORST_BALLAST * worst_share(severity))
    kept = observed & (rng.random(observed.shape, dtype=np.float32) >= lost)
    chance = stray
    if beside > 0 and label.any():
        distance = ndimage.distance_transform_edt(~label) * cell_m
        chance = stray + beside * np.exp(-distance / rng.uniform(*BALLAST_M))
    return kept | (rng.random(observed.shape, dtype=np.float32) < chance)


def scatter_patches(rng: np.random.Generator, observed: np.ndarray, severity: float) -> np.ndarray:
    """Scatter elliptic patches: most set cells, as vegetation classified as rail does; some clear cells."""
    size = len(observed)
    result = observed.copy()
    most = PATCHES * severity * (1 + WORST_PATCHES * worst_share(severity)) * (size / 1024) ** 2
    for _ in range(rng.poisson(most * rng.random())):
        smallest, largest = np.log(PATCH_CELLS)
        axes = np.exp(rng.uniform(smallest, largest, size=2))
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
    """Draw a point in the window, metres."""
    return np.array([window.x0, window.y0]) + rng.random(2) * [window.extent_m, -window.extent_m]


def _area(window: Window) -> float:
    """Return the area of the window in units of 20 x 20 m, about 512 x 512 cells."""
    return (window.extent_m / 20) ** 2
