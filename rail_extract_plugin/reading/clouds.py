"""From a point cloud parameter to the files that the core reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsMapLayer,
    QgsPointCloudLayer,
    QgsProcessingContext,
    QgsProcessingUtils,
    QgsProperty,
)

from ...core.errors import CloudError
from ...core.progress import Progress
from ...core.standards import RAIL_CLASS

if TYPE_CHECKING:
    from ...core.clouds.points import RailPoints
    from ...core.squares.spool import SpooledPoints

Bounds = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y."""

BoundsIn = Callable[[QgsCoordinateReferenceSystem], Optional[Bounds]]
"""Returns the area to read in a given coordinate system; None to read everything."""


@dataclass(frozen=True)
class CloudSource:
    """Where a cloud lies.

    Attributes
    ----------
    paths : tuple of Path
        Files, or folders of them.
    crs_wkt : str or None
        What the user set, for files that state none.
    """

    paths: tuple[Path, ...]
    crs_wkt: str | None = None


def cloud_source(value: Any, context: QgsProcessingContext) -> CloudSource:
    """Find the files behind the value of a point cloud parameter.

    Parameters
    ----------
    value : QgsPointCloudLayer, QgsProperty or str
        A layer, or the name or id of a loaded one, or the path of a file, a folder or a .vpc file.
    context : QgsProcessingContext

    Raises
    ------
    CloudError
        It is another kind of layer, or no path on this computer.
    """
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    if not value:
        raise CloudError("No point cloud was given: choose a layer, or a LAS or LAZ file, or a folder of them.")
    layer = value if isinstance(value, QgsMapLayer) else _loaded_layer(str(value), context)
    if layer is None:
        return CloudSource(_files(Path(str(value))))
    if not isinstance(layer, QgsPointCloudLayer):
        raise CloudError(f'The layer "{layer.name()}" is no point cloud: choose a point cloud layer or a LAS file.')
    crs_wkt = layer.crs().toWkt() if layer.crs().isValid() else None
    return CloudSource(_files(Path(layer.source())), crs_wkt)


def read_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    progress: Progress,
) -> tuple[RailPoints, ...]:
    """Read the points of the wanted classes; `bounds` says in the cloud's coordinate system where to look."""
    from ...core.clouds.points import read_rail_points

    crs = QgsCoordinateReferenceSystem(crs_of(source) or "")
    return read_rail_points(source.paths, class_codes, source.crs_wkt, bounds(crs), progress)


def spool_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    side_m: float,
    folder: Path,
    progress: Progress,
) -> tuple[SpooledPoints, ...]:
    """Do as `read_points`, but leave the points on disk, sorted into squares: a cloud of any size fits."""
    from ...core.clouds.points import ask
    from ...core.squares.spool import spool

    crs = QgsCoordinateReferenceSystem(crs_of(source) or "")
    request = ask(source.paths, class_codes, source.crs_wkt, bounds(crs), progress)
    return spool(request, side_m, folder, progress)


def crs_of(source: CloudSource) -> str | None:
    """Give a cloud's coordinate system as WKT, by its first file: whether all agree is told when they are read."""
    from ...core.clouds.las import list_files, read_header

    return read_header(list_files(source.paths)[0]).crs_wkt or source.crs_wkt


def check_lengths(source: CloudSource) -> None:
    """Refuse a cloud in degrees by the header of its first file; other faults of files are the run's to tell.

    Raises
    ------
    CrsError
        Lengths can't be measured there.
    """
    from ...core.clouds.las import list_files
    from ...core.clouds.points import ask

    try:
        ask(list_files(source.paths)[:1], (RAIL_CLASS,), source.crs_wkt)
    except CloudError:
        return


def _loaded_layer(name: str, context: QgsProcessingContext) -> QgsMapLayer | None:
    return QgsProcessingUtils.mapLayerFromString(name, context, allowLoadingNewLayers=False)


def _files(path: Path) -> tuple[Path, ...]:
    if not path.exists():
        raise CloudError(f"{path} does not exist: give a LAS or LAZ file, or a folder of them, on this computer.")
    return _tiles(path) if path.suffix.lower() == ".vpc" else (path,)


def _tiles(catalogue: Path) -> tuple[Path, ...]:
    """Tiles of a virtual point cloud, which is a STAC collection in JSON that names a file for each item."""
    try:
        items = json.loads(catalogue.read_text(encoding="utf-8"))["features"]
        # Other assets, such as the overview, repeat points of the tiles.
        tiles = tuple(catalogue.parent / item["assets"]["data"]["href"] for item in items)
    except (ValueError, TypeError, KeyError, AttributeError, OSError) as error:
        raise CloudError(f"{catalogue.name} is no virtual point cloud: build it again from its tiles.") from error
    absent = next((tile for tile in tiles if not tile.exists()), None)
    if absent is not None or not tiles:
        raise CloudError(f"{catalogue.name} names {absent or 'no tile at all'}: build it again from tiles that exist.")
    return tiles
