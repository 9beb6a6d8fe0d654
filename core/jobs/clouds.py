"""Clouds that a run reads: their files, and which of their points, also in the area of a raster or of lines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
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
    """Read the points on the heads in an area, by class, all in one local frame; see `request_in`."""
    from ..clouds.on_heads import heads_of
    from ..clouds.points import read_requested

    return _all_of(area, lambda: map(heads_of, read_requested(request_in(area, cloud, progress), progress)))


def spool_points_in(
    area: Area, cloud: CloudSource, side_m: float, folder: Path, progress: Progress
) -> dict[int, SpooledPoints]:
    """Sort the points of an area into squares of `side_m` on disk, in `folder`, so that a cloud of any size fits."""
    from ..tiles.store import spool

    return _all_of(area, lambda: spool(request_in(area, cloud, progress), side_m, folder, progress))


def request_in(area: Area, cloud: CloudSource, progress: Progress) -> Request:
    """Check which points of an area are to be read; raise CrsError if cloud and area have different systems.

    If one of them states no coordinate system, that of the other is used.
    """
    check_same_plane("POINTS", crs_of(cloud), f"the {area.what}", area.frame)
    source = replace(cloud, crs_wkt=cloud.crs_wkt or area.frame.crs_wkt)
    return request_points(source, area.class_codes, lambda _: area.bounds, progress)


def _all_of(area: Area, read: Callable[[], Iterable[Points]]) -> dict[int, Points]:
    """Read points; raise NoRailPointsError if there is none of one of the classes."""
    try:
        clouds = {points.class_code: points for points in read()}
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
