"""How layers of lines look in a 3D map view: at their own heights, in the colours of the map."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsVectorLayer
from qgis.PyQt.QtGui import QColor

from .. import compat

COLORS = {"rails": "#1565c0", "centerlines": "#e64a19", "findings": "#d62839"}
"""Colour of the lines by style, as most of them have it in the map."""

WIDTHS_PX = {"rails": 3.0, "centerlines": 2.0, "findings": 6.0}
"""Width on the screen by style: lines as wide as a railhead disappear a few tens of metres away."""


def show_lines_in_3d(layer: QgsVectorLayer, style: str) -> None:
    """Draw a layer of lines in 3D map views at the heights of its vertices; without them, QGIS lays it on the terrain.

    Layers of other styles than those in `COLORS` stay as they are.
    """
    if style not in COLORS:
        return
    try:
        from qgis._3d import QgsLine3DSymbol, QgsSimpleLineMaterialSettings, QgsVectorLayer3DRenderer
    except ImportError:  # a QGIS that was built without 3D views
        return
    material = QgsSimpleLineMaterialSettings()
    material.setAmbient(QColor(COLORS[style]))
    symbol: Any = QgsLine3DSymbol()
    symbol.setRenderAsSimpleLines(True)
    symbol.setWidth(WIDTHS_PX[style])
    compat.set_material(symbol, material)
    compat.keep_heights(symbol)
    renderer = QgsVectorLayer3DRenderer(symbol)
    renderer.setLayer(layer)
    layer.setRenderer3D(renderer)
