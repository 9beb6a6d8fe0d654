"""Rail points: read from classified clouds, in metres from a local origin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CloudError, CrsError, NoRailPointsError, ParameterError
from ..frame import ORIGIN_STEP, LocalFrame
from ..progress import SILENT, Progress
from ..standards import LAST_CLASS
from .crs import common_crs, is_geographic, parse_crs, units, utm_zone, warn_of_stretch

if TYPE_CHECKING:
    import pyproj

    from .las import CloudHeader


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
    request = ask(paths, class_codes, crs_wkt, extent, progress)
    xyz, codes = _collect(request, progress)
    frame = request.frame_at([np.unique(column, return_counts=True) for column in origin_steps(xyz).T])
    local = frame.to_local(xyz)
    return tuple(RailPoints(local[codes == code], frame, int(code)) for code in np.unique(codes))


@dataclass(frozen=True)
class Request:
    """Which points of which files are wanted.

    Attributes
    ----------
    headers : tuple of CloudHeader
    class_codes : tuple of int
    extent : tuple of float or None
        In units of the CRS.
    zero : LocalFrame
        Metres from the zero of the files' coordinate system.
    """

    headers: tuple[CloudHeader, ...]
    class_codes: tuple[int, ...]
    extent: tuple[float, float, float, float] | None
    zero: LocalFrame

    def read(
        self, header: CloudHeader, progress: Progress = SILENT
    ) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Read the wanted points of a file chunk by chunk: coordinates, classes and census; see `las.read_classes`."""
        from .las import read_classes

        if self.extent is not None and not _overlap(header.extent, self.extent):
            return
        for xyz, codes, census in read_classes(header.path, self.class_codes, progress):
            inside = slice(None) if self.extent is None else _inside(xyz, self.extent)
            yield xyz[inside], codes[inside], census

    def shares(self, progress: Progress) -> list[Progress]:
        """Give each file the share of the progress that its points have."""
        counts = np.array([header.point_count for header in self.headers], dtype=float)
        after = np.cumsum(counts) / counts.sum()
        return [progress.span(end - count / counts.sum(), end) for end, count in zip(after, counts)]

    def frame_at(self, steps: Sequence[tuple[np.ndarray, np.ndarray]]) -> LocalFrame:
        """Make the frame whose origin lies amid the points, given values and counts of their `origin_steps` by axis."""
        middle = [values[np.searchsorted(np.cumsum(counts), counts.sum() / 2)] for values, counts in steps]
        return replace(self.zero, origin=np.array(middle) * ORIGIN_STEP)

    def explain_none(self, census: np.ndarray) -> NoRailPointsError:
        """Say in one sentence which classes there are, (256,) counts, instead of the wanted ones."""
        wanted = ", ".join(str(code) for code in sorted(set(self.class_codes)))
        if self.extent is not None and (census.sum() == 0 or census[list(self.class_codes)].any()):
            return NoRailPointsError(f"No point of class {wanted} lies inside the extent: choose a larger one.")
        if not census.any():
            return NoRailPointsError(
                "All points of the cloud are marked as withheld: export those that count unmarked."
            )
        there = ", ".join(f"{code} ({census[code]})" for code in np.flatnonzero(census))
        return NoRailPointsError(
            f"The cloud has no point of class {wanted}; its classes and their counts are {there}: set the rail classes."
        )


def ask(
    paths: str | Path | Sequence[str | Path],
    class_codes: Sequence[int],
    crs_wkt: str | None = None,
    extent: tuple[float, float, float, float] | None = None,
    progress: Progress = SILENT,
    unreadable: list[str] | None = None,
) -> Request:
    """Check what is wanted, and read the headers; parameters and errors as those of `read_rail_points`.

    With a list `unreadable`, files that can't be read are left out as long as there is another; what is wrong with
    them is added to the list.
    """
    _check_request(class_codes, extent)
    headers = _read_headers(paths, unreadable)
    crs = _shared_crs(headers, crs_wkt, progress)
    units_m = (1.0, 1.0) if crs is None else units(crs)
    return Request(
        headers, tuple(class_codes), extent, LocalFrame(np.zeros(3), *units_m, None if crs is None else crs.to_wkt())
    )


def _read_headers(paths: str | Path | Sequence[str | Path], unreadable: list[str] | None) -> tuple[CloudHeader, ...]:
    from .las import list_files, read_header

    headers, last = [], None
    for path in list_files(paths):
        try:
            headers.append(read_header(path))
        except CloudError as error:
            if unreadable is None:
                raise
            unreadable.append(str(error))
            last = error
    if not headers and last is not None:
        raise last
    return tuple(headers)


def origin_steps(xyz_crs: np.ndarray) -> np.ndarray:
    """Round coordinates, (n, 3) in units of the CRS, to multiples of `ORIGIN_STEP`, (n, 3) numbers of steps.

    The middle one of these is the middle point's: it can be told from their counts alone, file by file.
    """
    return np.round(xyz_crs / ORIGIN_STEP)


def _check_request(class_codes: Sequence[int], extent: tuple[float, float, float, float] | None) -> None:
    if not class_codes or not all(0 <= code <= LAST_CLASS for code in class_codes):
        raise ParameterError(f"Rail classes must be numbers from 0 to {LAST_CLASS}, not {list(class_codes)}.")
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
    else:
        xmin, ymin, xmax, ymax = headers[0].extent
        warn_of_stretch(crs, list(product((xmin, xmax), (ymin, ymax))), f"{headers[0].path.name} is", progress)
    return crs


def _fitting_zone(header: CloudHeader) -> str:
    """Name the UTM zone that a cloud in degrees lies in."""
    xmin, ymin, xmax, ymax = header.extent
    longitude, latitude = (xmin + xmax) / 2, (ymin + ymax) / 2
    fits = abs(longitude) <= 180 and abs(latitude) <= 90
    return utm_zone(longitude, latitude) if fits else "the UTM zone of the place"


def _collect(request: Request, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Gather coordinates, (n, 3) in CRS units, and classes, (n,), of the wanted points of all files."""
    kept_xyz, kept_codes, census = [], [], np.zeros(256, dtype=np.int64)
    for header, share in zip(request.headers, request.shares(progress)):
        for xyz, codes, counts in request.read(header, share):
            census += counts
            kept_xyz.append(xyz)
            kept_codes.append(codes)
    if not sum(map(len, kept_codes)):
        raise request.explain_none(census)
    return np.concatenate(kept_xyz), np.concatenate(kept_codes)


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    """Tell whether two extents have a place in common; one that a header states as NaN may be anywhere."""
    return not (a[0] > b[2] or b[0] > a[2] or a[1] > b[3] or b[1] > a[3])


def _inside(xyz: np.ndarray, extent: tuple[float, float, float, float]) -> np.ndarray:
    xmin, ymin, xmax, ymax = extent
    return (xyz[:, 0] >= xmin) & (xyz[:, 0] <= xmax) & (xyz[:, 1] >= ymin) & (xyz[:, 1] <= ymax)
