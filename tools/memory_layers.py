"""Temporary layers of QGIS for the tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from qgis.core import QgsFeature, QgsGeometry, QgsLineString, QgsVectorLayer


def layer_of(
    *shapes: str | QgsGeometry | np.ndarray | None,
    kind: str = "LineStringZ",
    crs: str = "EPSG:32643",
    fields: str = "",
    values: Sequence[Sequence[Any]] = (),
) -> QgsVectorLayer:
    """Make a layer in memory.

    Parameters
    ----------
    shapes : str, QgsGeometry, (n, 2) or (n, 3) array, or None
        One for each feature: WKT, vertices of a line, or nothing.
    kind : str
        The geometry type of QGIS; "None" for a table.
    fields : str
        In the form of QGIS, such as `&field=km:double`.
    values : sequence of sequences
        Attributes of each feature.
    """
    layer = QgsVectorLayer(f"{kind}?crs={crs}{fields}" if kind != "None" else f"None?{fields[1:]}", "layer", "memory")
    for number in range(max(len(shapes), len(values))):
        feature = QgsFeature(layer.fields())
        if shapes and shapes[number] is not None:
            feature.setGeometry(_geometry(shapes[number]))
        if values:
            feature.setAttributes(list(values[number]))
        if not layer.dataProvider().addFeature(feature):
            raise ValueError(f"QGIS takes no {shapes[number] if shapes else values[number]} into a layer of {kind}.")
    return layer


def _geometry(shape: str | QgsGeometry | np.ndarray) -> QgsGeometry:
    if isinstance(shape, QgsGeometry):
        return shape
    if isinstance(shape, str):
        return QgsGeometry.fromWkt(shape)
    return QgsGeometry(QgsLineString(*np.asarray(shape).T.tolist()))
