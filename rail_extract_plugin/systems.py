"""Coordinate systems that outlive the thread of a run.

QGIS builds a coordinate system once, in the thread that first asks for it, and shares it from then on. When that thread
ends, which a thread of the pool does 30 s after a run, every layer and cache that shares the system is left with an
empty one. Algorithms therefore have theirs built in the main thread, before they run.
"""

from __future__ import annotations

from qgis.core import QgsCoordinateReferenceSystem, QgsFields, QgsMemoryProviderUtils, QgsWkbTypes

from ..core.clouds.crs import parse_crs
from ..core.fields import UNKNOWN_IN_METRES

_built: dict[str, QgsCoordinateReferenceSystem] = {}
"""By their WKT."""


def prepare_system(wkt: str | None) -> None:
    """Build the system of a run's inputs, which is that of its results; called in the main thread.

    Parameters
    ----------
    wkt : str or None
        None for coordinates in metres of an unknown system.
    """
    for text in {wkt, parse_crs(wkt).to_wkt()} if wkt else {UNKNOWN_IN_METRES}:
        if text not in _built:
            _built[text] = QgsCoordinateReferenceSystem.fromWkt(text)
            # The layer asks for it by its code, which QGIS keeps apart from systems known by their WKT.
            QgsMemoryProviderUtils.createMemoryLayer("", QgsFields(), QgsWkbTypes.Type.Point, _built[text])


def system(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Return the system of a WKT; an invalid one where there is none."""
    if not wkt:
        return QgsCoordinateReferenceSystem()
    return _built.get(wkt) or QgsCoordinateReferenceSystem.fromWkt(wkt)
