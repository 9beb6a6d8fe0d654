"""Reading of point cloud parameters: which files a value stands for, and the points in them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsMapLayer,
    QgsPointCloudLayer,
    QgsProcessingContext,
    QgsProcessingUtils,
    QgsProperty,
)

from ...core.disk import scratch_folder, sweep
from ...core.errors import CloudError
from ...core.jobs.clouds import CloudSource


def cloud_source(value: Any, context: QgsProcessingContext) -> CloudSource:
    """Find the files that the value of a point cloud parameter stands for.

    It may be a layer, its name or id, or the path of a file, a folder or a virtual point cloud. Raises CloudError if
    the layer is not a point cloud, the path is not one of a cloud on this computer, or the layer shows other points or
    another coordinate system than its file, which is what a run reads.
    """
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    if not value:
        raise CloudError("No point cloud was given: choose a layer, a file or a folder of tiles.")
    layer = value if isinstance(value, QgsMapLayer) else _loaded_layer(str(value), context)
    if layer is None:
        return _checked(CloudSource((Path(str(value)),)))
    if not isinstance(layer, QgsPointCloudLayer):
        raise CloudError(f'The layer "{layer.name()}" is not a point cloud: choose a point cloud layer or file.')
    _check_as_in_file(layer)
    crs_wkt = layer.crs().toWkt() if layer.crs().isValid() else None
    return _checked(CloudSource((Path(layer.source()),), crs_wkt))


def _check_as_in_file(layer: QgsPointCloudLayer) -> None:
    """Raise a `CloudError` if the user has set a filter or another coordinate system for a layer."""
    shown = layer.subsetString() if hasattr(layer, "subsetString") else ""  # since QGIS 3.26
    if shown:
        raise CloudError(
            f'The layer "{layer.name()}" is filtered ({shown}), but a run reads all points of its file: remove the '
            "filter, and choose points by class and extent."
        )
    provider = layer.dataProvider()
    stated = provider.crs() if provider is not None else layer.crs()
    if stated.isValid() and stated != layer.crs():
        raise CloudError(
            f'The layer "{layer.name()}" was set to {_system_name(layer.crs())}, but its file states '
            f"{_system_name(stated)}, which a run uses: set the layer back, or correct the file."
        )


def _system_name(crs: QgsCoordinateReferenceSystem) -> str:
    return crs.authid() or crs.description() or "no coordinate system"


@contextmanager
def points_folder() -> Iterator[Path]:
    """Create a temporary folder for the points of a run, next to QGIS's own, and remove what killed runs left."""
    parent = Path(QgsProcessingUtils.tempFolder()).parent
    sweep(parent)
    with scratch_folder(parent) as folder:
        yield folder


def _loaded_layer(name: str, context: QgsProcessingContext) -> QgsMapLayer | None:
    return QgsProcessingUtils.mapLayerFromString(name, context, allowLoadingNewLayers=False)


def _checked(source: CloudSource) -> CloudSource:
    """Raise a `CloudError` now if the paths don't lead to cloud files."""
    from ...core.clouds.readers import list_files

    list_files(source.paths)
    return source
