"""Lines of vector files as arrays, for the demo and the tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from osgeo import ogr

ogr.UseExceptions()


def read_features(path: Path, layer: str | None = None, where: str | None = None) -> list[tuple[np.ndarray, dict]]:
    """Vertices, (n, 3), and attributes of the lines of a layer; `where` filters as in SQL."""
    source = ogr.Open(str(path))
    table = source.GetLayerByName(layer) if layer else source.GetLayer()
    table.SetAttributeFilter(where)
    return [(np.array(feature.geometry().GetPoints()), feature.items()) for feature in table]


def read_lines(path: Path, layer: str | None = None, where: str | None = None) -> list[np.ndarray]:
    """Read the vertices alone."""
    return [line for line, _ in read_features(path, layer, where)]
