"""Reading of point cloud parameters: which files a value stands for, and the points in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
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
from ...core.scratch import scratch_folder, sweep
from ...core.standards import RAIL_CLASS
from ..systems import system

if TYPE_CHECKING:
    from ...core.clouds.mask import Mask
    from ...core.clouds.points import RailPoints, Request
    from ...core.squares.spool import SpooledPoints

Bounds = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y."""

BoundsIn = Callable[[QgsCoordinateReferenceSystem], Optional[Bounds]]
"""Returns the area to read in a given coordinate system; None to read everything."""


@dataclass(frozen=True)
class CloudSource:
    """The files of a cloud.

    Attributes
    ----------
    paths : tuple of Path
        Files, virtual point clouds, or folders of tiles.
    crs_wkt : str or None
        Coordinate system set by the user, used where files state none.
    mask : Mask or None
        Area to which the points are limited, in the coordinate system of the cloud.
    """

    paths: tuple[Path, ...]
    crs_wkt: str | None = None
    mask: Mask | None = None
    leave_out: tuple[str, ...] = ()


def cloud_source(value: Any, context: QgsProcessingContext) -> CloudSource:
    """Find the files that the value of a point cloud parameter stands for.

    Parameters
    ----------
    value : QgsPointCloudLayer, QgsProperty or str
        A layer, the name or id of a loaded layer, or the path of a file, a folder or a virtual point cloud.
    context : QgsProcessingContext

    Raises
    ------
    CloudError
        The layer is not a point cloud, the path is not one of a cloud on this computer, or the layer shows other points
        or another coordinate system than its file, which is what a run reads.
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


def read_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    progress: Progress,
) -> tuple[RailPoints, ...]:
    """Read the points on the heads of the rail classes.

    Parameters
    ----------
    source : CloudSource
    class_codes : sequence of int
    bounds : callable
        Returns the extent to read, given the cloud's coordinate system.
    progress : Progress
    """
    from ...core.clouds.points import read_requested
    from ...core.heads.on_heads import heads_of

    found = read_requested(request_points(source, class_codes, bounds, progress), progress)
    return tuple(heads_of(points) for points in found)


def spool_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    side_m: float,
    folder: Path,
    progress: Progress,
) -> tuple[SpooledPoints, ...]:
    """Sort the points of the rail classes into squares on disk, so that a cloud of any size fits.

    Parameters
    ----------
    source, class_codes, bounds, progress
        See `read_points`.
    side_m : float
        Side of the squares.
    folder : Path
        Where to write them.
    """
    from ...core.squares.spool import spool

    return spool(request_points(source, class_codes, bounds, progress), side_m, folder, progress)


def request_points(source: CloudSource, class_codes: Sequence[int], bounds: BoundsIn, progress: Progress) -> Request:
    """Check which points of which files are to be read, and read the headers of the files.

    Parameters
    ----------
    source, class_codes, bounds, progress
        See `read_points`.
    """
    from ...core.clouds.points import ask

    request = ask(source.paths, class_codes, source.crs_wkt, bounds(system(crs_of(source))), progress)
    return replace(request, mask=source.mask, leave_out=source.leave_out)


@contextmanager
def points_folder() -> Iterator[Path]:
    """Create a temporary folder for the points of a run, next to that of QGIS, and remove those of killed runs."""
    parent = Path(QgsProcessingUtils.tempFolder()).parent
    sweep(parent)
    with scratch_folder(parent) as folder:
        yield folder


def crs_of(source: CloudSource) -> str | None:
    """Return the coordinate system of a cloud's first file as WKT; reading the points checks that all files agree."""
    from ...core.clouds.readers import first_header

    return first_header(source.paths).crs_wkt or source.crs_wkt


def checked_crs(source: CloudSource) -> str | None:
    """Return the coordinate system of a cloud's points as WKT, by the header of the first file.

    None where there is none; also where the file is damaged, which the run reports.

    Raises
    ------
    CrsError
        The coordinate system does not measure lengths.
    """
    from ...core.clouds.points import ask
    from ...core.clouds.readers import first_header

    try:
        return ask(first_header(source.paths).path, (RAIL_CLASS,), source.crs_wkt).zero.crs_wkt
    except CloudError:
        return None


def _loaded_layer(name: str, context: QgsProcessingContext) -> QgsMapLayer | None:
    return QgsProcessingUtils.mapLayerFromString(name, context, allowLoadingNewLayers=False)


def _checked(source: CloudSource) -> CloudSource:
    """Raise a `CloudError` now if the paths don't lead to cloud files."""
    from ...core.clouds.readers import list_files

    list_files(source.paths)
    return source
