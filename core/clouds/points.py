"""Rail points: the points of the rail classes of a classified cloud, in metres from a local origin."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeVar

import numpy as np

from ..errors import CloudError, CrsError, EmptyCloudError, NoRailPointsError, ParameterError, UnclassifiedError
from ..frame import ORIGIN_STEP, LocalFrame
from ..progress import SILENT, Progress, counted
from ..run.tasks import READ_S, Runner, Task
from ..standards import LAST_CLASS
from .crs import common_crs, is_geographic, name_of, parse_crs, units, utm_zone, warn_of_scale
from .mask import Mask
from .passes import number_passes
from .readers import (
    Chunk,
    CloudHeader,
    Extent,
    Paths,
    either,
    list_files,
    read_classes,
    read_header,
    shows_scanner,
)

Result = TypeVar("Result")

SAMPLE_POINTS = 200_000
"""Number of points in a sample: at least some ten metres of the densest track."""

PLACE_M = 40.0
"""Side of the squares in which passes are told apart by their times."""

MAX_PASSED = 5_000_000
"""Number of points of any class after which a sample ends."""

FEW_FILES = 3
"""Files whose first points are asked whether a scanner measured them."""

STRETCH_M = 200.0
"""Length of line in a rectangle in which points along it are read."""

AIRBORNE = "Track Centerlines from Airborne Lidar"
AIRBORNE_SIDE_M, AIRBORNE_DENSITY = 20.0, (0.5, 60.0)
"""Least side and points per square metre of a cloud that covers an area and shows no single railheads."""


@dataclass(frozen=True)
class RailPoints:
    """The points of one class, `xyz` (n, 3) local metres.

    `strips`, (n,), has the number of the strip, a pass of the scanner, that each point belongs to; None if all points
    are of one strip. If `found`, they are from a raw cloud, and not by their class: in a blunt one they are whole
    ridges. `blunt` says whether the cloud blunts heads, as its lines have shown; None before there are any. `scanned`
    says whether a scanner is known to have measured them, and not a camera.

    Where the file states no strips and the heads have shown them, `apart`, (s, 4), has how far the strips 1 to s are
    off the mean of all passes, x, y and z, and the number of passes in each.
    """

    xyz: np.ndarray
    frame: LocalFrame
    class_code: int
    strips: np.ndarray | None = None
    found: bool = False
    blunt: bool | None = None
    apart: np.ndarray | None = None
    scanned: bool = False

    def kept(self, which: np.ndarray) -> RailPoints:
        """Return some of the points, by a mask (n,) bool or by their numbers (k,)."""
        return replace(self, xyz=self.xyz[which], strips=None if self.strips is None else self.strips[which])


def strips_of(xyz: np.ndarray, marks: np.ndarray) -> np.ndarray:
    """Return the strips, (n,), of points, (n, 3) local metres, by their marks."""
    found, number = np.unique(marks, return_inverse=True)
    places = np.floor(xyz[:, :2] / PLACE_M).astype(np.int64)
    rows = np.unique(np.column_stack([number.ravel(), places]), axis=0)
    passes = number_passes(found[rows[:, 0]], rows[:, 1:])
    return np.array([passes[mark] for mark in found.tolist()], dtype=np.int32)[number.ravel()]


def several(strips: np.ndarray) -> np.ndarray | None:
    """Return strips, (n,), if there are several, else None."""
    return strips if len(strips) and (strips != strips[0]).any() else None


def read_rail_points(
    paths: Paths,
    class_codes: Sequence[int],
    crs_wkt: str | None = None,
    extent: Extent | None = None,
    progress: Progress = SILENT,
) -> tuple[RailPoints, ...]:
    """Read the points of the rail classes; memory grows only with their number.

    Parameters
    ----------
    paths : path or sequence of paths
        LAS, LAZ or COPC files, virtual point clouds (.vpc), or folders of tiles.
    class_codes : sequence of int
        Rail classes, 0 to 255.
    crs_wkt : str, optional
        Coordinate system, as WKT or EPSG code, used where files state none.
    extent : tuple of float, optional
        Smallest x, smallest y, largest x, largest y of the points to keep, in units of the CRS.

    Returns
    -------
    tuple of RailPoints
        One for each rail class that has points, in ascending order of the code, all in one local frame.

    Raises
    ------
    CloudError
        A file is missing, damaged or not a point cloud.
    CrsError
        The files have different coordinate systems, or theirs is in degrees.
    NoRailPointsError
        The files have no points of the rail classes inside the extent.
    ParameterError
        A class code is out of range, or the extent is empty.

    Examples
    --------
    >>> from pathlib import Path
    >>> import rail_extract
    >>> sample = Path(rail_extract.__file__).parent / "resources" / "sample" / "sample.laz"
    >>> (points,) = read_rail_points(sample, class_codes=[10])
    >>> points.class_code, points.xyz.shape
    (10, (75004, 3))
    """
    return read_requested(ask(paths, class_codes, crs_wkt, extent, progress), progress)


def read_requested(request: Request, progress: Progress = SILENT) -> tuple[RailPoints, ...]:
    """Read the points requested; results and errors as of `read_rail_points`."""
    xyz, codes, marks = _collect(request, progress)
    frame = request.frame_at([np.unique(column, return_counts=True) for column in origin_steps(xyz).T])
    local = frame.to_local(xyz)
    strips = strips_of(local, marks)
    classes, scanned = (codes == code for code in np.unique(codes)), request.is_scanned()
    return tuple(
        RailPoints(local[own], frame, int(codes[own][0]), several(strips[own]), scanned=scanned) for own in classes
    )


@dataclass(frozen=True)
class Request:
    """Which points to read from which files; extent and mask are in units of the CRS.

    The origin of `zero` is the zero of the files' coordinate system. `leave_out` has flags whose points are left out,
    as in `readers.read_classes`; if `merged`, all points requested count as points of the first class.
    """

    headers: tuple[CloudHeader, ...]
    class_codes: tuple[int, ...]
    extent: Extent | None
    zero: LocalFrame
    merged: bool = False
    mask: Mask | None = None
    leave_out: tuple[str, ...] = ()

    def read(self, header: CloudHeader, progress: Progress = SILENT) -> Iterator[Chunk]:
        """Read the points requested from a file chunk by chunk; see `readers.read_classes`."""
        if len(touching(np.reshape(self._areas(), (-1, 4)), header.extent)) < len(self._areas()):
            return
        chunks = read_classes(header.path, self.class_codes, progress, self._bounds(), self.leave_out)
        for xyz, codes, marks, census in chunks:
            inside = self.holds(xyz) if self._areas() else slice(None)
            found = np.full_like(codes, self.class_codes[0]) if self.merged else codes
            yield xyz[inside], found[inside], marks[inside], census

    def holds(self, xyz: np.ndarray) -> np.ndarray:
        """Return which places, (n, 3) in units of the CRS, are in the extent and the mask, (n,) bool."""
        inside = np.ones(len(xyz), dtype=bool) if self.extent is None else _inside(xyz, self.extent)
        if self.mask is not None:
            inside[inside] = self.mask.holds(xyz[inside])
        return inside

    def areas_along(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """Return rectangles that hold all places within reach of a line, (k, 4), given its vertices, (n, 2) metres."""
        length_m = float(np.hypot(*np.diff(xy, axis=0).T).sum())
        parts = np.array_split(xy, min(max(int(length_m / STRETCH_M), 1), len(xy)))
        low, high = (np.array([reduce(part, axis=0) for part in parts]) for reduce in (np.min, np.max))
        return np.column_stack([low - reach_m, high + reach_m]) / self.zero.horizontal_unit_m

    @property
    def where(self) -> str:
        """What limits the points, in a word."""
        return "mask" if self.mask is not None else "cloud" if self.extent is None else "extent"

    def announce(self, progress: Progress) -> None:
        """Say that the files are read now."""
        count = sum(header.point_count for header in self.headers)
        progress.info(f"Reading {counted(len(self.headers), 'file')} with {counted(count, 'point')}.")
        progress.reading()

    def _areas(self) -> list[Extent]:
        """List the rectangles outside of which no point is requested."""
        return [area for area in (self.extent, None if self.mask is None else self.mask.extent) if area is not None]

    def _bounds(self) -> Extent | None:
        """Return the rectangle in which points are requested; None if that is everywhere."""
        areas = self._areas()
        if not areas:
            return None
        xmin, ymin, xmax, ymax = zip(*areas)
        return max(xmin), max(ymin), min(xmax), min(ymax)

    def sample(self, count: int = SAMPLE_POINTS) -> tuple[np.ndarray, np.ndarray]:
        """Read the first points requested; takes a few seconds for any cloud, since `count` of them are enough.

        Returns them in metres from one of them, (n, 3), and the number of points of each class that were passed,
        (256,).
        """
        found, passed = [np.empty((0, 3))], np.zeros(LAST_CLASS + 1, dtype=np.int64)
        chunks = (chunk for header in self.headers for chunk in self.read(header))
        for xyz, _, _, census in chunks:
            found.append(xyz)
            passed += census
            if sum(map(len, found)) >= count or passed.sum() >= MAX_PASSED:
                break
        xyz = self.zero.to_local(np.concatenate(found))
        return xyz - xyz[:1], passed

    def shares(self, progress: Progress) -> list[Progress]:
        """Split the progress among the files in proportion to their points."""
        return progress.divide([header.point_count for header in self.headers])

    def frame_at(self, steps: Sequence[tuple[np.ndarray, np.ndarray]]) -> LocalFrame:
        """Return the frame with its origin at the points' median, from values and counts of `origin_steps` by axis."""
        middle = [values[np.searchsorted(np.cumsum(counts), counts.sum() / 2)] for values, counts in steps]
        return replace(self.zero, origin=np.array(middle) * ORIGIN_STEP)

    def explain_none(self, census: np.ndarray) -> NoRailPointsError:
        """Return the error for a cloud without the points requested; it names the classes found, (256,) counts."""
        wanted = ", ".join(str(code) for code in sorted(set(self.class_codes)))
        if self._areas() and (census.sum() == 0 or census[list(self.class_codes)].any()):
            return NoRailPointsError(
                f"The {self.where} contains no points of class {wanted}: choose a larger {self.where}."
            )
        if not census.any():
            flags = either("withheld", *map(str.lower, self.leave_out))
            return NoRailPointsError(
                f"All points of the cloud are marked as {flags}: export the valid points without this mark."
            )
        found = ", ".join(f"{code} ({census[code]:,})" for code in np.flatnonzero(census))
        airborne = f" For an airborne cloud, use {AIRBORNE}." if self.is_airborne else ""
        return UnclassifiedError(
            f"The cloud has no points of class {wanted}; its classes, with the number of points, are {found}: set the "
            f"rail classes or, if nobody has classified the cloud, CLASSIFY.{airborne}"
        )

    def is_scanned(self) -> bool:
        """Return whether the first points of all files asked have what only a scanner measures."""
        shown = self._show_scanner()
        return bool(shown) and all(shown)

    def is_of_images(self) -> bool:
        """Return whether no first point of the files asked has what only a scanner measures."""
        return not any(self._show_scanner())

    def _show_scanner(self) -> list[bool]:
        """Ask the first files, but those that can't be read; see `readers.shows_scanner`."""
        found = []
        for header in self.headers[:FEW_FILES]:
            with suppress(CloudError):
                found.append(shows_scanner(header.path))
        return found

    @property
    def is_airborne(self) -> bool:
        """Whether the cloud covers an area, not only a line, and is too thin to show single railheads."""
        sides = [
            (high - low) * self.zero.horizontal_unit_m
            for header in self.headers
            for low, high in ((header.extent[0], header.extent[2]), (header.extent[1], header.extent[3]))
        ]
        area_m2 = float(np.sum(np.prod(np.reshape(sides, (-1, 2)), axis=1)))
        count = sum(header.point_count for header in self.headers)
        return min(sides) > AIRBORNE_SIDE_M and AIRBORNE_DENSITY[0] < count / area_m2 < AIRBORNE_DENSITY[1]


def read_each(
    request: Request,
    function: Callable[..., Result],
    arguments: Sequence[tuple],
    runner: Runner,
    progress: Progress = SILENT,
) -> list[Result]:
    """Run a task on each file of a request, given the arguments for each, and return the results in order.

    The function also gets the request without its files, and the header of the file; see `Task`. Raises CloudError if
    there are files and not one could be read.
    """
    alone = replace(request, headers=())
    tasks = {
        number: Task(
            f"Reading {header.path.name}", function, (alone, header, *own), weight=READ_S * (header.point_count + 1)
        )
        for number, (header, own) in enumerate(zip(request.headers, arguments))
    }
    found = [result for _, result in runner.run(tasks, progress)]
    if tasks and not found:
        raise CloudError(f"Not one file could be read; the last error was: {runner.failures[-1]}")
    return found


def ask(
    paths: Paths,
    class_codes: Sequence[int],
    crs_wkt: str | None = None,
    extent: Extent | None = None,
    progress: Progress = SILENT,
    unreadable: list[str] | None = None,
) -> Request:
    """Check a request for points and read the headers of its files; errors as for `read_rail_points`.

    If `unreadable` is given, files that can't be read are left out, unless all are, and the reasons are appended to it.
    Files without points are left out in any case.
    """
    _check_request(class_codes, extent)
    headers = _read_headers(paths, unreadable, progress)
    return Request(headers, tuple(class_codes), extent, _shared_system(headers, crs_wkt, progress))


def _read_headers(paths: Paths, unreadable: list[str] | None, progress: Progress) -> tuple[CloudHeader, ...]:
    headers: list[CloudHeader] = []
    last: CloudError | None = None
    for path in list_files(paths):
        try:
            headers.append(read_header(path))
        except EmptyCloudError as error:
            progress.info(f"{path.name} has no points and is left out.")
            last = error
        except CloudError as error:
            if unreadable is None:
                raise
            unreadable.append(str(error))
            last = error
    if not headers and last is not None:
        raise last
    return tuple(headers)


def origin_steps(xyz_crs: np.ndarray) -> np.ndarray:
    """Round coordinates, (n, 3) in units of the CRS, to multiples of `ORIGIN_STEP`; return (n, 3) numbers of steps.

    Rounding keeps the order, so the median step is that of the median point, and counts of steps, added up over the
    files, are enough to find it.
    """
    return np.round(xyz_crs / ORIGIN_STEP)


def _check_request(class_codes: Sequence[int], extent: Extent | None) -> None:
    if not class_codes or not all(0 <= code <= LAST_CLASS for code in class_codes):
        raise ParameterError(f"Rail classes must be numbers from 0 to {LAST_CLASS}, not {list(class_codes)}.")
    if extent is not None and not (extent[0] < extent[2] and extent[1] < extent[3]):
        raise ParameterError(f"The extent {extent} is empty: give xmin, ymin, xmax, ymax.")


def _shared_system(headers: Sequence[CloudHeader], given: str | None, progress: Progress) -> LocalFrame:
    """Return the frame of the coordinate system that all files share; `given` applies to files that state none."""
    texts = [header.crs_wkt or given or "" for header in headers]
    parsed = {text: parse_crs(text) for text in set(texts) if text}
    crs = common_crs([(header.path.name, parsed.get(text)) for header, text in zip(headers, texts)])
    if crs is None:
        progress.warning(
            "The cloud has no coordinate system: its coordinates are taken as metres. If it has one, choose it as CRS."
        )
        return LocalFrame(np.zeros(3))
    name = headers[0].path.name
    if is_geographic(crs):
        raise CrsError(
            f"{name} is in degrees ({name_of(crs)}), where lengths can't be measured: reproject it, for example to "
            f"{_fitting_zone(headers[0])}."
        )
    try:
        units_m = units(crs)
    except CrsError as error:
        raise CrsError(f"{name}: {error}") from error
    xmin, ymin, xmax, ymax = headers[0].extent
    warn_of_scale(crs, list(product((xmin, xmax), (ymin, ymax))), f"{name} is", progress)
    return LocalFrame(np.zeros(3), *units_m, crs.to_wkt())


def _fitting_zone(header: CloudHeader) -> str:
    """Name the UTM zone of a cloud in degrees."""
    xmin, ymin, xmax, ymax = header.extent
    longitude, latitude = (xmin + xmax) / 2, (ymin + ymax) / 2
    fits = abs(longitude) <= 180 and abs(latitude) <= 90
    return utm_zone(longitude, latitude) if fits else "the UTM zone of the place"


def _collect(request: Request, progress: Progress) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return coordinates, (n, 3) in CRS units, classes and marks, (n,), of the points requested from all files."""
    kept, census = [], np.zeros(256, dtype=np.int64)
    for header, share in zip(request.headers, request.shares(progress)):
        for *points, counts in request.read(header, share):
            census += counts
            kept.append(points)
    xyz, codes, marks = (np.concatenate(column) for column in zip(*kept)) if kept else (np.empty(0),) * 3
    if not len(codes):
        raise request.explain_none(census)
    return xyz, codes, marks


def touching(areas: np.ndarray, extent: Extent) -> np.ndarray:
    """Return the rectangles, (k, 4), that touch an extent; one of NaN, as a header may state it, may be anywhere."""
    low, high = np.array(extent[:2]), np.array(extent[2:])
    return areas[~((areas[:, :2] > high) | (areas[:, 2:] < low)).any(axis=1)]


def _inside(xyz: np.ndarray, extent: Extent) -> np.ndarray:
    xmin, ymin, xmax, ymax = extent
    return (xyz[:, 0] >= xmin) & (xyz[:, 0] <= xmax) & (xyz[:, 1] >= ymin) & (xyz[:, 1] <= ymax)
