"""What differs between QGIS 3.22 and 4, in one place.

Everything else writes enums with their scope (``QgsProcessing.SourceType.TypeVectorLine``), which all of them know.
"""

from __future__ import annotations

from qgis.core import Qgis, QgsField, QgsProcessingContext

if Qgis.QGIS_VERSION_INT >= 33800:
    from qgis.PyQt.QtCore import QMetaType

    INTEGER, REAL, TEXT = QMetaType.Type.Int, QMetaType.Type.Double, QMetaType.Type.QString
else:
    from qgis.PyQt.QtCore import QVariant

    INTEGER, REAL, TEXT = QVariant.Int, QVariant.Double, QVariant.String


DIGITS = 20
"""Room for a number with decimals: a shapefile makes it one digit if none is stated, and is written with 15 decimals
if neither are those."""


def field(name: str, kind, decimals: int = 0) -> QgsField:
    """Make a field; `kind` is `INTEGER`, `REAL` or `TEXT`."""
    return QgsField(name, kind, "", DIGITS if decimals else 0, decimals)


def group_layer(details: QgsProcessingContext.LayerDetails, group: str, place: int) -> None:
    """Have a layer loaded into a group, above those with a lower `place`; before QGIS 3.32 it stands by itself."""
    if Qgis.QGIS_VERSION_INT >= 33200:
        details.groupName = group
        details.layerSortKey = place
