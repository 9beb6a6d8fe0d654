"""Clouds that a run reads: their files, and which of their points, also in the area of a raster or of lines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Optional, TypeVar

from ..errors import CloudError, CrsError, NoRailPointsError
from ..progress import Progress
from ..standards import RAIL_CLASS

if TYPE_CHECKING:
    from ..clouds.mask import Mask
    from ..clouds.points import RailPoints, Request
    from ..frame import LocalFrame
    from ..tiles.store import SpooledPoints

Bounds = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y."""

BoundsIn = Callable[[Optional[str]], Optional[Bounds]]
"""Returns the area to read in a coordinate system, given as WKT; None to read everything."""

Points = TypeVar("Points", "RailPoints", "SpooledPoints")


@dataclass(frozen=True)
class CloudSource:
    """The files of a cloud: files, virtual point clouds, or folders of tiles.

    `crs_wkt` is set by the user for files that state none. `mask`, in the coordinate system of the cloud, limits the
    area, and `leave_out` has the flags of points that are left out.
    """

    paths: tuple[Path, ...]
    crs_wkt: str | None = None
    mask: Mask | None = None
    leave_out: tuple[str, ...] = ()


def request_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    progress: Progress,
    unreadable: list[str] | None = None,
) -> Request:
    """Check which points of which files are to be read, and read the headers of the files.

    `unreadable` gets what is wrong with files that can't be read; without it, one ends the run.
    """
    from ..clouds.points import ask

    bounds_of_all = bounds(crs_of(source))
    request = ask(source.paths, class_codes, source.crs_wkt, bounds_of_all, progress, unreadable=unreadable)
    return replace(request, mask=source.mask, leave_out=source.leave_out)


def read_points(
    source: CloudSource,
    class_codes: Sequence[int],
    bounds: BoundsIn,
    progress: Progress,
) -> tuple[RailPoints, ...]:
    """Read the points on the heads of the rail classes; `bounds` returns the extent, given the coordinate system."""
    from ..clouds.on_heads import heads_of
    from ..clouds.points import read_requested

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
    """Sort the points of the rail classes into squares of `side_m` in `folder`, so that a cloud of any size fits."""
    from ..tiles.store import spool

    return spool(request_points(source, class_codes, bounds, progress), side_m, folder, progress)


def crs_of(source: CloudSource) -> str | None:
    """Return the coordinate system of a cloud's first file as WKT; reading the points checks that all files agree."""
    from ..clouds.readers import first_header

    return first_header(source.paths).crs_wkt or source.crs_wkt


def checked_crs(source: CloudSource) -> str | None:
    """Return the coordinate system of a cloud's points as WKT, by the header of the first file.

    None where there is none; also where the file is damaged, which the run reports. Raises CrsError if the coordinate
    system does not measure lengths.
    """
    from ..clouds.points import ask
    from ..clouds.readers import first_header

    try:
        return ask(first_header(source.paths).path, (RAIL_CLASS,), source.crs_wkt).zero.crs_wkt
    except CloudError:
        return None


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


def check_same_plane(name: str, crs_wkt: str | None, other_name: str, other: LocalFrame) -> None:
    """Check that two inputs, of these names, have the same coordinate system in plan.

    An unknown one is taken to be the other. Raises CrsError if both are known and differ, or the second is unknown and
    the first is not in metres.
    """
    from ..clouds.crs import parse_crs, same_plane, units

    if crs_wkt and other.crs_wkt and not same_plane(crs_wkt, other.crs_wkt, tuple(other.origin[:2])):
        raise CrsError(
            f"{name} are in {_title(crs_wkt)} but {other_name} in {_title(other.crs_wkt)}: give both in the "
            "same coordinate system."
        )
    if crs_wkt and not other.crs_wkt and units(parse_crs(crs_wkt))[0] != other.horizontal_unit_m:
        raise CrsError(
            f"{name} are in {_title(crs_wkt)}, whose unit is not the metre: assign a coordinate system to {other_name} "
            "too."
        )


def _title(wkt: str) -> str:
    from ..clouds.crs import name_of, parse_crs

    return name_of(parse_crs(wkt))
