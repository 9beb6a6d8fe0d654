"""Coordinate systems that outlive the thread of a run.

QGIS builds a coordinate system once, in the thread that first requests it, and shares it from then on. When that thread
ends (a thread of the pool ends 30 s after a run), all layers and caches that share the system are left with an empty
one. Algorithms therefore build their systems in the main thread, before they run.
"""

from __future__ import annotations

from qgis.core import QgsCoordinateReferenceSystem, QgsFields, QgsMemoryProviderUtils, QgsWkbTypes

from ..core.fields import UNKNOWN_IN_METRES

_built: dict[str, QgsCoordinateReferenceSystem] = {}
"""Systems by their WKT."""


def prepare_system(wkt: str | None) -> None:
    """Build the coordinate system of a run's inputs and results; to be called in the main thread.

    None stands for coordinates in metres in an unknown system.
    """
    from ..core.clouds.crs import parse_crs

    for text in {wkt, parse_crs(wkt).to_wkt()} if wkt else {UNKNOWN_IN_METRES}:
        if text not in _built:
            _built[text] = QgsCoordinateReferenceSystem.fromWkt(text)
            # The layer requests the system by its code; QGIS caches systems by code and by WKT separately.
            QgsMemoryProviderUtils.createMemoryLayer("", QgsFields(), QgsWkbTypes.Type.Point, _built[text])


def lost_part(wkt: str | None) -> str | None:
    """Return the coordinate system of a cloud if QGIS drops its vertical part, as it does before version 3.34."""
    from ..core.clouds.crs import parse_crs

    crs = parse_crs(wkt) if wkt else None
    if crs is None or not crs.is_compound:
        return None
    kept = parse_crs(system(wkt).toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED))
    return None if kept.is_compound else wkt


def system(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Return the coordinate system of a WKT, or an invalid one if there is no WKT."""
    if not wkt:
        return QgsCoordinateReferenceSystem()
    return _built.get(wkt) or QgsCoordinateReferenceSystem.fromWkt(wkt)
