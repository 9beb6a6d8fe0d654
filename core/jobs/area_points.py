"""Reads the points of a cloud in the area of a raster or of lines made from that cloud."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from ..clouds.points import RailPoints
from ..errors import NoRailPointsError
from ..frame import LocalFrame
from ..progress import Progress
from .clouds import Bounds, BoundsIn, CloudSource, crs_of, read_points, spool_points
from .reading import check_same_plane

if TYPE_CHECKING:
    from ..tiles.store import SpooledPoints

Points = TypeVar("Points", RailPoints, "SpooledPoints")


@dataclass(frozen=True)
class Area:
    """The area and the classes of the points to read.

    `what` covers the area, "raster" or "rails" in messages; `bounds` are smallest x and y, largest x and y, in units of
    the coordinate system.
    """

    what: str
    class_codes: tuple[int, ...]
    bounds: Bounds
    frame: LocalFrame


def read_points_in(area: Area, cloud: CloudSource, progress: Progress) -> dict[int, RailPoints]:
    """Read the points of an area, by class, all in one local frame.

    If the cloud or the area states no coordinate system, that of the other is used; if they differ, CrsError is raised.
    Raises NoRailPointsError if the cloud has no points of one of the classes in the area.
    """
    return _all_of(area, cloud, lambda source, codes, bounds: read_points(source, codes, bounds, progress))


def spool_points_in(
    area: Area, cloud: CloudSource, side_m: float, folder: Path, progress: Progress
) -> dict[int, SpooledPoints]:
    """Sort the points of an area into squares of `side_m` on disk, in `folder`, so that a cloud of any size fits."""
    return _all_of(
        area, cloud, lambda source, codes, bounds: spool_points(source, codes, bounds, side_m, folder, progress)
    )


def _all_of(
    area: Area, cloud: CloudSource, read: Callable[[CloudSource, Sequence[int], BoundsIn], Sequence[Points]]
) -> dict[int, Points]:
    """Read points with `read`, and check that there are some of each class."""
    check_same_plane("POINTS", crs_of(cloud), f"the {area.what}", area.frame)

    def bounds(_: str | None) -> Bounds:
        return area.bounds

    source = replace(cloud, crs_wkt=cloud.crs_wkt or area.frame.crs_wkt)
    try:
        clouds = {points.class_code: points for points in read(source, area.class_codes, bounds)}
    except NoRailPointsError:
        clouds = {}
    missing = [str(code) for code in area.class_codes if code not in clouds]
    if missing:
        raise NoRailPointsError(
            f"POINTS have no point of class {', '.join(missing)} in the area of the {area.what}: "
            f"give the cloud from which the {area.what} came."
        )
    return clouds
