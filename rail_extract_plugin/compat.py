"""The differences between QGIS 3.22 and 4, in one place.

All other modules write enums with their scope (``QgsProcessing.SourceType.TypeVectorLine``), which every version knows.
"""

from __future__ import annotations

from typing import Any

from qgis.core import Qgis, QgsField

if Qgis.QGIS_VERSION_INT >= 33800:
    from qgis.PyQt.QtCore import QMetaType

    INTEGER, REAL, TEXT = QMetaType.Type.Int, QMetaType.Type.Double, QMetaType.Type.QString
else:
    from qgis.PyQt.QtCore import QVariant

    INTEGER, REAL, TEXT = QVariant.Int, QVariant.Double, QVariant.String

OPENS_3D_VIEWS = Qgis.QGIS_VERSION_INT >= 33600
"""Whether a plugin can open a 3D map view."""

DIGITS = 20
"""Width of a number with decimals. Without a width, a shapefile field would have one digit; without decimals either, 15
decimals."""


def field(name: str, kind, decimals: int = 0) -> QgsField:
    """Define a field of the kind `INTEGER`, `REAL` or `TEXT`."""
    return QgsField(name, kind, "", DIGITS if decimals else 0, decimals)


def set_material(symbol: Any, material: Any) -> None:
    """Give a 3D symbol its material; the method has another name since QGIS 3.36."""
    (symbol.setMaterialSettings if hasattr(symbol, "setMaterialSettings") else symbol.setMaterial)(material)


def keep_heights(symbol: Any) -> None:
    """Have a 3D symbol use the heights of all vertices as they are; the enums moved in QGIS 3.30."""
    if hasattr(Qgis, "AltitudeClamping"):
        clamping, binding = Qgis.AltitudeClamping.Absolute, Qgis.AltitudeBinding.Vertex
    else:
        from qgis._3d import Qgs3DTypes

        clamping, binding = Qgs3DTypes.AltitudeClamping.AltClampAbsolute, Qgs3DTypes.AltitudeBinding.AltBindVertex
    symbol.setAltitudeClamping(clamping)
    symbol.setAltitudeBinding(binding)
