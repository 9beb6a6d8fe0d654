"""Small layers and rasters, to be damaged and read through QGIS by the algorithms that take them."""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import lru_cache
from pathlib import Path
from sqlite3 import connect
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np  # noqa: E402
from osgeo import gdal  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsCoordinateTransformContext,
    QgsFeature,
    QgsGeometry,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from rail_extract.core.clouds import points, readers  # noqa: E402
from rail_extract.core.errors import RailExtractError  # noqa: E402
from rail_extract.core.progress import Progress  # noqa: E402
from rail_extract.core.squares import steps  # noqa: E402
from rail_extract.core.tracks import centerlines  # noqa: E402

PAGE_BYTES = 512
"""Smallest page of a GeoPackage: a file of small pages has little that is never read."""

BLOCK_CELLS = 32
"""Side of the blocks of a raster: a damaged block is full of cells, and takes as long as a large one for nothing."""

REMEMBERED = 100
"""Results that are remembered."""

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
        centerlines.tracks_of, steps.lines_of = remembered(centerlines.tracks_of), remembered(steps.lines_of)
        points.read_header = readers.read_header = remembered(readers.read_header)  # of clouds that are not damaged
    return application


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compute what is read once only: most damage changes nothing of it."""
    known: dict[bytes, Any] = {}

    def call(*values: Any, **options: Any) -> Any:
        key = pickle.dumps(([value for value in values if not isinstance(value, Progress)], options))
        if key not in known:
            if len(known) >= REMEMBERED:
                known.clear()
            known[key] = function(*values, **options)
        return known[key]

    return call


def write_lines(folder: Path, suffix: str) -> list[Path]:
    """Write a track of two rails; a shapefile consists of several files, each of which is damaged in turn."""
    qgis()
    layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643&field=rail_id:integer&field=class_code:integer", "a", "memory")
    for number, y in enumerate((0.0, 1.507)):
        feature = QgsFeature(layer.fields())
        feature.setAttributes([number + 1, 10])
        places = ", ".join(f"{500_000 + x} {3_000_000 + y} {100 + 0.001 * x}" for x in (0, 2, 5, 6))
        feature.setGeometry(QgsGeometry.fromWkt(f"LINESTRING Z ({places})"))
        layer.dataProvider().addFeature(feature)
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = QgsVectorFileWriter.driverForExtension(suffix)
    path = folder / f"lines.{suffix}"
    QgsVectorFileWriter.writeAsVectorFormatV3(layer, str(path), QgsCoordinateTransformContext(), options)
    if suffix == "gpkg":
        compact(path)
    return sorted(folder.glob("lines.*"))


def compact(path: Path) -> None:
    """Give a GeoPackage small pages without gaps."""
    with closing(connect(path)) as database:
        database.execute(f"PRAGMA page_size = {PAGE_BYTES}")
        database.execute("VACUUM")


def write_raster(folder: Path) -> list[Path]:
    """Write a small rail raster."""
    from rail_extract.core.clouds.crs import import_pyproj
    from rail_extract.core.files.rail_rasters import header_for
    from rail_extract.core.frame import LocalFrame
    from rail_extract.core.raster import rasterize
    from rail_extract.core.standards import STANDARDS
    from rail_extract.rail_extract_plugin.writing.geotiff import write_rasters

    qgis()
    raster = rasterize(np.random.default_rng(0).uniform(0, 4, (200, 2)), 0.04)
    wkt = import_pyproj().CRS.from_epsg(32643).to_wkt()
    frame = LocalFrame(np.array([500_000.0, 3_000_000.0, 0.0]), crs_wkt=wkt)
    whole = folder / "whole.tif"
    write_rasters(whole, header_for([raster], (10,), frame, STANDARDS["EN_60E1_1435"]), [raster])
    blocks = ["TILED=YES", f"BLOCKXSIZE={BLOCK_CELLS}", f"BLOCKYSIZE={BLOCK_CELLS}", "COMPRESS=DEFLATE"]
    gdal.Translate(str(folder / "rail.tif"), str(whole), creationOptions=blocks)
    gdal.Translate(str(folder / "rows.tif"), str(whole), creationOptions=["COMPRESS=LZW"])
    whole.unlink()
    return [folder / "rail.tif", folder / "rows.tif"]


def read_lines(path: Path) -> None:
    """Build track centerlines from a file of rails."""
    main = next(iter(path.parent.glob("lines.shp")), path)
    with run("buildtrackcenterlines", {"INPUT": str(main), "OUTPUT": "memory:"}):
        pass


def read_raster(path: Path) -> None:
    """Vectorize a rail raster."""
    with run("vectorizerails", {"INPUT": str(path), "OUTPUT": "memory:"}):
        pass


@contextmanager
def run(name: str, parameters: dict[str, Any]) -> Iterator[tuple[dict[str, Any], QgsProcessingContext]]:
    """Check the values and run an algorithm, as QGIS does; yields the results and the context with their layers.

    Raises RailExtractError with what the algorithm refused, AssertionError if it failed without an explanation.
    """
    context, listener = QgsProcessingContext(), Listener()
    try:
        results, succeeded = check(name, parameters, context).run(parameters, context, listener)
        _judge(succeeded, "\n".join(listener.errors).strip())
        yield results, context
    finally:
        context.temporaryLayerStore().removeAllMapLayers()


def check(name: str, parameters: dict[str, Any], context: QgsProcessingContext) -> QgsProcessingAlgorithm:
    """Check the values of an algorithm, as QGIS does; errors as for `run`."""
    algorithm = qgis().processingRegistry().createAlgorithmById(f"railextract:{name}")
    _judge(*algorithm.checkParameterValues(parameters, context))
    return algorithm


def _judge(succeeded: bool, said: str) -> None:
    if any(word in said for word in UNFORESEEN):
        raise AssertionError(said)
    if not succeeded:
        raise RailExtractError(said)
