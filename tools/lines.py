"""Lines of vector files as arrays, for the demo and the tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from osgeo import ogr

ogr.UseExceptions()


def read_features(path: Path, layer: str | None = None, where: str | None = None) -> list[tuple[np.ndarray, dict]]:
    """Read vertices, (n, 3), and attributes of the lines of a layer, by default the first, filtered as in SQL."""
    source = ogr.Open(str(path))
    table = source.GetLayerByName(layer) if layer else source.GetLayer()
    table.SetAttributeFilter(where)
    return [(np.array(feature.geometry().GetPoints()), feature.items()) for feature in table]


def read_lines(path: Path, layer: str | None = None, where: str | None = None) -> list[np.ndarray]:
    """Read the vertices only; see `read_features`."""
    return [line for line, _ in read_features(path, layer, where)]


def farthest(lines: list[np.ndarray], others: list[np.ndarray]) -> float:
    """Return the greatest distance, in plan or in height, between lines, (n, 3) each, and others in the same order.

    Where one of two lines extends beyond the other, this part is left out.
    """
    if len(lines) != len(others):
        return np.inf
    return max(max(_offset(line, other), _offset(other, line)) for line, other in zip(lines, others))


def _offset(line: np.ndarray, other: np.ndarray) -> float:
    """Return the greatest distance of the vertices of a line from another line, in plan or in height."""
    start, step = other[:-1], np.diff(other, axis=0)
    share = np.einsum("nij,ij->ni", (line[:, None] - start)[..., :2], step[:, :2]) / (step[:, :2] ** 2).sum(axis=1)
    away = line[:, None] - start - np.clip(share, 0, 1)[..., None] * step
    beside = np.hypot(away[..., 0], away[..., 1])
    nearest = beside.argmin(axis=1)
    number = np.arange(len(line))
    beyond = ((nearest == 0) & (share[:, 0] < 0)) | ((nearest == len(step) - 1) & (share[:, -1] > 1))
    offsets = np.maximum(beside[number, nearest], np.abs(away[number, nearest, 2]))
    return float(offsets[~beyond].max(initial=0.0))
