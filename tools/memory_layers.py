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
    """Make a layer in memory, with a feature for each shape: WKT, vertices of a line, or nothing.

    Geometry type and fields are in the form of QGIS, such as "None" for a table and `&field=km:double`; values are rows
    of attributes.
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
