"""What lies beside a line: a rail stands free on both sides, the edge of something wide does not."""

from __future__ import annotations

import numpy as np

from .lines import Lines
from .tops import HIGH_M, Band, Tops

ACROSS_M = (0.09, 0.13, 0.17, 0.21, 0.25, 0.29)
"""Distances from the axis at which the surroundings are looked at: from beyond the head to the next 0.2 m."""

ALONG = 9
"""Places along the line, over half its reach to either side."""

MAX_HIGH = 4
"""Of these distances, as many may be as high as the line on one side. A guard rail takes three; the edge of a kerb, of
a cable trough, or of the shoulder of the ballast takes all."""


def stands_free(tops: Tops, band: Band, marks: np.ndarray, lines: Lines) -> np.ndarray:
    """Return which lines have lower ground, or nothing seen, on each side, (n,) bool.

    Parameters
    ----------
    tops : Tops
    band : Band
    marks : (n,) int array
        Cells.
    lines : Lines
        The line of each cell.
    """
    along = np.linspace(-0.5, 0.5, ALONG) * lines.reach_m
    free = np.ones(len(lines.axis), dtype=bool)
    depth_m = band.depth_m(lines.height)
    z, high_cells = tops.z.ravel(), tops.high.ravel()
    own, ahead_m, left_m = z[marks], lines.along, lines.across
    for side in (1, -1):
        distances = np.zeros(len(free), dtype=np.int64)
        for left in ACROSS_M:
            seen, high = np.zeros(len(free), dtype=np.int64), np.zeros(len(free), dtype=np.int64)
            for ahead in along:
                cell, inside = tops.grid.cells(lines.axis + ahead * ahead_m + side * left * left_m)
                rise = z[cell] - own
                wall = inside & high_cells[cell]
                seen += wall | (inside & (np.abs(rise) < HIGH_M))
                high += wall | (inside & (rise >= -depth_m) & (rise < HIGH_M))
            distances += 2 * high > seen
        free &= distances <= MAX_HIGH
    return free
