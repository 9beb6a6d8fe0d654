"""Rail points: read from classified clouds, in metres from a local origin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .crs import common_crs, is_geographic, parse_crs, units, utm_zone
from .errors import CrsError, NoRailPointsError, ParameterError
from .progress import SILENT, Progress

if TYPE_CHECKING:
    import pyproj

    from .las import CloudHeader

ORIGIN_STEP = 100.0
"""The local origin lies on multiples of this, in CRS units, so that nearby clouds mostly get the same."""


@dataclass(frozen=True)
class LocalFrame:
    """The way between a cloud's coordinates and metres from a local origin.

    Attributes
    ----------
    origin : (3,) array
        In units of the CRS.
    horizontal_unit_m, vertical_unit_m : float
        Metres in one unit of the CRS, in plan and in height.
    crs_wkt : str or None
        Coordinate system of the cloud, as WKT or a code like EPSG:32643; None where it is unknown.
    """

    origin: np.ndarray
    horizontal_unit_m: float = 1.0
    vertical_unit_m: float = 1.0
    crs_wkt: str | None = None

    def to_local(self, xyz_crs: np.ndarray) -> np.ndarray:
        """Turn (n, 3) coordinates of the cloud into local metres."""
        return (np.asarray(xyz_crs, dtype=float) - self.origin) * self._metres

    def to_crs(self, xyz_local: np.ndarray) -> np.ndarray:
        """Turn (n, 3) local metres into coordinates of the cloud."""
        return np.asarray(xyz_local, dtype=float) / self._metres + self.origin

    @property
    def _metres(self) -> np.ndarray:
        return np.array([self.horizontal_unit_m, self.horizontal_unit_m, self.vertical_unit_m])


@dataclass(frozen=True)
class RailPoints:
    """The points of one class.

    Attributes
    ----------
    xyz : (n, 3) array
        Local metres.
    frame : LocalFrame
    class_code : int
    """

    xyz: np.ndarray
    frame: LocalFrame
    class_code: int


def read_headers(paths: str | Path | Sequence[str | Path]) -> tuple[CloudHeader, ...]:
    """Read what the files say of themselves, without their points: count, extent and coordinate system.

    Parameters
    ----------
    paths : path or sequence of paths
        LAS, LAZ or COPC files, or folders of them.

    Raises
    ------
    CloudError
        A file is missing, damaged or no point cloud.
    """
    from .las import list_files, read_header

    return tuple(read_header(path) for path in list_files(paths))


def read_rail_points(
    paths: str | Path | Sequence[str | Path],
    class_codes: Sequence[int],
    crs_wkt: str | None = None,
    extent: tuple[float, float, float, float] | None = None,
    progress: Progress = SILENT,
) -> tuple[RailPoints, ...]:
    """Read the points of the wanted classes; memory grows with these alone.

    Parameters
    ----------
    paths : path or sequence of paths
        LAS, LAZ or COPC files, or folders of them.
    class_codes : sequence of int
        Classes that mean rail, 0 to 255.
    crs_wkt : str, optional
        Coordinate system, as WKT or code, of files that state none.
    extent : tuple of float, optional
        Smallest x, smallest y, largest x, largest y to keep, in units of the CRS.
    progress : Progress

    Returns
    -------
    tuple of RailPoints
        One for each wanted class that has points, by rising code, all in one local frame.

    Raises
    ------
    CloudError
        A file is missing, damaged or no point cloud.
    CrsError
        The files differ in their coordinate systems, or it is not made of lengths.
    NoRailPointsError
        No point of the wanted classes lies in the files and the extent.
    ParameterError
        A class code is none, or the extent is turned around.
    """
    _check_request(class_codes, extent)
    headers = read_headers(paths)
    crs = _shared_crs(headers, crs_wkt, progress)
    horizontal_unit_m, vertical_unit_m = (1.0, 1.0) if crs is None else units(crs)
    xyz, codes = _collect(headers, class_codes, extent, progress)
    origin = np.round(np.median(xyz, axis=0) / ORIGIN_STEP) * ORIGIN_STEP
    frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, None if crs is None else crs.to_wkt())
    local = frame.to_local(xyz)
    return tuple(RailPoints(local[codes == code], frame, int(code)) for code in np.unique(codes))


def _check_request(class_codes: Sequence[int], extent: tuple[float, float, float, float] | None) -> None:
    if not class_codes or not all(0 <= code <= 255 for code in class_codes):
        raise ParameterError(f"Rail classes must be numbers from 0 to 255, not {list(class_codes)}.")
    if extent is not None and not (extent[0] < extent[2] and extent[1] < extent[3]):
        raise ParameterError(f"The extent {extent} is empty: give xmin, ymin, xmax, ymax.")


def _shared_crs(headers: Sequence[CloudHeader], given: str | None, progress: Progress) -> pyproj.CRS | None:
    """Find the one coordinate system of all files, `given` standing in where a file states none."""
    texts = [header.crs_wkt or given for header in headers]
    parsed = {text: parse_crs(text) for text in set(texts) if text}
    crs = common_crs([(header.path.name, parsed.get(text)) for header, text in zip(headers, texts)])
    if crs is None:
        progress.warning("The cloud states no coordinate system: its coordinates are taken as metres.")
    elif is_geographic(crs):
        raise CrsError(
            f"{headers[0].path.name} is in degrees ({crs.name}), where lengths can't be measured: "
            f"reproject it, for example to {_fitting_zone(headers[0])}."
        )
    return crs


def _fitting_zone(header: CloudHeader) -> str:
    """Name the UTM zone that a cloud in degrees lies in."""
    xmin, ymin, xmax, ymax = header.extent
    longitude, latitude = (xmin + xmax) / 2, (ymin + ymax) / 2
    fits = abs(longitude) <= 180 and abs(latitude) <= 90
    return utm_zone(longitude, latitude) if fits else "the UTM zone of the place"


def _collect(
    headers: Sequence[CloudHeader],
    class_codes: Sequence[int],
    extent: tuple[float, float, float, float] | None,
    progress: Progress,
) -> tuple[np.ndarray, np.ndarray]:
    """Gather coordinates, (n, 3) in CRS units, and classes, (n,), of the wanted points of all files."""
    from .las import read_classes

    kept_xyz, kept_codes, census = [], [], np.zeros(256, dtype=np.int64)
    total = sum(header.point_count for header in headers)
    before = 0
    for header in headers:
        share = progress.span(before / total, (before + header.point_count) / total)
        before += header.point_count
        if extent is not None and not _overlap(header.extent, extent):
            continue
        for xyz, codes, counts in read_classes(header.path, class_codes, share):
            census += counts
            inside = slice(None) if extent is None else _inside(xyz, extent)
            kept_xyz.append(xyz[inside])
            kept_codes.append(codes[inside])
    if not sum(map(len, kept_codes)):
        raise NoRailPointsError(_explain_none(class_codes, census, extent))
    return np.concatenate(kept_xyz), np.concatenate(kept_codes)


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]


def _inside(xyz: np.ndarray, extent: tuple[float, float, float, float]) -> np.ndarray:
    xmin, ymin, xmax, ymax = extent
    return (xyz[:, 0] >= xmin) & (xyz[:, 0] <= xmax) & (xyz[:, 1] >= ymin) & (xyz[:, 1] <= ymax)


def _explain_none(
    class_codes: Sequence[int], census: np.ndarray, extent: tuple[float, float, float, float] | None
) -> str:
    """Say in one sentence which classes there are instead of the wanted ones."""
    wanted = ", ".join(str(code) for code in sorted(set(class_codes)))
    if extent is not None and (census.sum() == 0 or census[list(class_codes)].any()):
        return f"No point of class {wanted} lies inside the extent: choose a larger one."
    there = ", ".join(f"{code} ({census[code]})" for code in np.flatnonzero(census))
    return f"The cloud has no point of class {wanted}; its classes and their counts are {there}: set the rail classes."
