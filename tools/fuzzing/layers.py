"""Small layers and rasters, to be damaged and read through QGIS by the algorithms that take them."""

from __future__ import annotations

import os
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsCoordinateTransformContext,
    QgsFeature,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from rail_extract.core.errors import RailExtractError  # noqa: E402

UNFORESEEN = ("Traceback", "failed unexpectedly")
"""Words of what must not be said about a damaged file."""


class Listener(QgsProcessingFeedback):
    """Remembers errors."""

    def __init__(self) -> None:
        super().__init__(False)
        self.errors: list[str] = []

    def reportError(self, error: str, fatal: bool = False) -> None:  # noqa: N802 - QGIS's name
        """Remember an error."""
        self.errors.append(error)


@lru_cache(maxsize=1)
def qgis() -> QgsApplication:
    """Start QGIS with the plugin, once in a process."""
    application = QgsApplication.instance()
    if application is None:
        application = QgsApplication([], False)
        application.initQgis()
    sys.path.append(str(Path(application.pkgDataPath()) / "python" / "plugins"))
    if application.processingRegistry().providerById("railextract") is None:
        from rail_extract import classFactory

        qgis.plugin = classFactory(None)  # type: ignore[attr-defined]
        qgis.plugin.initProcessing()  # type: ignore[attr-defined]
    return application


def write_lines(folder: Path, suffix: str) -> list[Path]:
    """Write a track of two rails; a shapefile consists of several files, each of which is damaged in turn."""
    qgis()
    layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643&field=rail_id:integer&field=class_code:integer", "a", "memory")
    for number, y in enumerate((0.0, 1.507)):
        feature = QgsFeature(layer.fields())
        feature.setAttributes([number + 1, 10])
        places = ", ".join(f"{500_000 + x} {3_000_000 + y} {100 + 0.001 * x}" for x in range(0, 21, 2))
        feature.setGeometry(QgsGeometry.fromWkt(f"LINESTRING Z ({places})"))
        layer.dataProvider().addFeature(feature)
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = QgsVectorFileWriter.driverForExtension(suffix)
    path = folder / f"lines.{suffix}"
    QgsVectorFileWriter.writeAsVectorFormatV3(layer, str(path), QgsCoordinateTransformContext(), options)
    return sorted(folder.glob("lines.*"))


def write_raster(folder: Path) -> list[Path]:
    """Write a small rail raster."""
    from rail_extract.core.clouds.crs import import_pyproj
    from rail_extract.core.frame import LocalFrame
    from rail_extract.core.raster import rasterize
    from rail_extract.core.raster_file import header_for
    from rail_extract.core.standards import STANDARDS
    from rail_extract.rail_extract_plugin.reading.geotiff import write_rasters

    qgis()
    raster = rasterize(np.random.default_rng(0).uniform(0, 4, (200, 2)), 0.04)
    wkt = import_pyproj().CRS.from_epsg(32643).to_wkt()
    frame = LocalFrame(np.array([500_000.0, 3_000_000.0, 0.0]), crs_wkt=wkt)
    write_rasters(folder / "rail.tif", header_for([raster], (10,), frame, STANDARDS["EN_60E1_1435"]), [raster])
    return [folder / "rail.tif"]


def read_lines(path: Path) -> None:
    """Build track centerlines from a file of rails."""
    main = next(iter(path.parent.glob("lines.shp")), path)
    _run("buildtrackcenterlines", {"INPUT": str(main), "OUTPUT": "memory:"})


def read_raster(path: Path) -> None:
    """Vectorize a rail raster."""
    _run("vectorizerails", {"INPUT": str(path), "OUTPUT": "memory:"})


def _run(name: str, parameters: dict[str, Any]) -> None:
    """Check the values and run an algorithm, as QGIS does.

    Raises
    ------
    RailExtractError
        What the algorithm refused.
    AssertionError
        It failed without an explanation.
    """
    algorithm = qgis().processingRegistry().createAlgorithmById(f"railextract:{name}")
    context, listener = QgsProcessingContext(), Listener()
    accepted, said = algorithm.checkParameterValues(parameters, context)
    if accepted:
        _, accepted = algorithm.run(parameters, context, listener)
        said = "\n".join(listener.errors).strip()
    context.temporaryLayerStore().removeAllMapLayers()
    if any(word in said for word in UNFORESEEN):
        raise AssertionError(said)
    if not accepted:
        raise RailExtractError(said)
