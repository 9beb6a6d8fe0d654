"""Small holes and gaps in the cleaned raster are filled before it becomes lines (docs/method.md section 4.1)."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from ..progress import SILENT, Progress
from ..raster import RailRaster

CLOSING_RADIUS_CELLS = 1
"""A 3x3 square bridges gaps of two cells; a larger one would join a rail and its guard rail."""

HOLE_CELLS = 20
"""Largest hole that is filled. Holes between diverging rails soon grow larger."""

_MARGIN = HOLE_CELLS + 2 * CLOSING_RADIUS_CELLS + 1


def close(raster: RailRaster, progress: Progress = SILENT) -> RailRaster:
    """Close the rail cells morphologically and fill holes of at most `HOLE_CELLS` cells.

    The result does not depend on the tiles of the raster: each is processed with a margin wider than the largest hole.
    """
    return raster.map_tiles(_close_window, _MARGIN, progress=progress)


def _close_window(window: np.ndarray) -> np.ndarray:
    if not window.any():
        return window
    side = 2 * CLOSING_RADIUS_CELLS + 1
    grown = ndimage.maximum_filter(window, side, mode="constant", cval=0)
    closed = ndimage.minimum_filter(grown, side, mode="nearest")
    background, _ = ndimage.label(~closed)
    return closed | (np.bincount(background.ravel()) <= HOLE_CELLS)[background]
