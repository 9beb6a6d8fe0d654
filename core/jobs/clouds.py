"""Clouds that a run reads: their files, and which of their points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Optional

from ..errors import CloudError
from ..progress import Progress
from ..standards import RAIL_CLASS

if TYPE_CHECKING:
    from ..clouds.mask import Mask
    from ..clouds.points import RailPoints, Request
    from ..tiles.store import SpooledPoints

Bounds = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y."""

BoundsIn = Callable[[Optional[str]], Optional[Bounds]]
"""Returns the area to read in a coordinate system, given as WKT; None to read everything."""


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
