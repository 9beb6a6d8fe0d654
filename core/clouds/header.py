"""What a reader of point clouds returns: the header of a file, and chunks of its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Union

import numpy as np

Extent = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y, in units of the CRS."""

Part = tuple[Callable[[Union[np.ndarray, slice]], np.ndarray], np.ndarray, np.ndarray, np.ndarray, bool]
"""A chunk of points: a function that returns the coordinates (k, 3) of some of them, classes (n,), marks (n,) and which
are valid (n,) bool, as in `Points`, and whether the file is read as a whole."""


@dataclass(frozen=True)
class CloudHeader:
    """What the header of a file states; the extent is smallest x and y, largest x and y in units of the CRS.

    `crs_wkt` is WKT 2; None if the file states no coordinate system that PROJ understands.
    """

    path: Path
    point_count: int
    extent: Extent
    crs_wkt: str | None
