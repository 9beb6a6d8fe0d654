"""The points that a rail raster was made from."""

from __future__ import annotations

from dataclasses import replace

from qgis.core import QgsCoordinateReferenceSystem

from ..core.crs import same_plane
from ..core.errors import CrsError, NoRailPointsError
from ..core.points import RailPoints, read_headers
from ..core.progress import Progress
from .clouds import Bounds, CloudSource, read_points
from .rasters import RasterHeader


def read_points_on(header: RasterHeader, cloud: CloudSource, progress: Progress) -> dict[int, RailPoints]:
    """Read the points of a raster's classes in its area, by class, all in one local frame.

    A cloud or a raster that states no coordinate system is taken to be in that of the other.

    Raises
    ------
    CrsError
        Cloud and raster are in different coordinate systems.
    NoRailPointsError
        The cloud has no points of a class there.
    """
    crs_wkt = read_headers(cloud.paths)[0].crs_wkt or cloud.crs_wkt
    if (
        crs_wkt
        and header.frame.crs_wkt
        and not same_plane(crs_wkt, header.frame.crs_wkt, tuple(header.frame.origin[:2]))
    ):
        raise CrsError(
            f"POINTS are in {_name(crs_wkt)} but the raster is in {_name(header.frame.crs_wkt)}: "
            "give the cloud that the raster was made from."
        )

    def bounds(crs: QgsCoordinateReferenceSystem) -> Bounds:
        return header.bounds

    source = replace(cloud, crs_wkt=cloud.crs_wkt or header.frame.crs_wkt)
    try:
        clouds = {points.class_code: points for points in read_points(source, header.class_codes, bounds, progress)}
    except NoRailPointsError:
        clouds = {}
    missing = [str(code) for code in header.class_codes if code not in clouds]
    if missing:
        raise NoRailPointsError(
            f"POINTS have no point of class {', '.join(missing)} in the raster's area: "
            "give the cloud that the raster was made from."
        )
    return clouds


def _name(wkt: str) -> str:
    return QgsCoordinateReferenceSystem(wkt).description()
