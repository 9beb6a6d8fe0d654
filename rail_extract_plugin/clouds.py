"""From a point cloud parameter to the files that the core reads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qgis.core import QgsMapLayer, QgsPointCloudLayer, QgsProcessingContext, QgsProcessingUtils, QgsProperty

from ..core.errors import CloudError


@dataclass(frozen=True)
class CloudSource:
    """Where a cloud lies.

    Attributes
    ----------
    paths : tuple of Path
        Files, or folders of them.
    crs_wkt : str or None
        What the user set on the loaded layer; None for a path.
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
        tiles = tuple(catalogue.parent / asset["href"] for item in items for asset in item["assets"].values())
    except (ValueError, TypeError, KeyError, AttributeError, OSError) as error:
        raise CloudError(f"{catalogue.name} is no virtual point cloud: build it again from its tiles.") from error
    absent = next((tile for tile in tiles if not tile.exists()), None)
    if absent is not None or not tiles:
        raise CloudError(f"{catalogue.name} names {absent or 'no tile at all'}: build it again from tiles that exist.")
    return tiles
