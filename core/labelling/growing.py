"""Rails grown from seeds in clouds of any size, and classified copies of the files with their points.

Only points within reach of the seeds are read; they are sorted into squares on disk, and memory holds those around the
place where a rail is followed (docs/growing.md).
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import Request
from ..disk import writing
from ..errors import OffCloudError, OffRailError
from ..grow.growth import Growth, Stop, grow, on_rails
from ..grow.on_heads import OnHeads
from ..grow.points import Buckets
from ..grow.settings import GrowSettings
from ..grow.start import PATCH_M
from ..polyline import length_along, resample
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from ..raster import BORDER_CELLS, cell_size
from ..squares.grid import Key, points_by_square
from ..tasks import Runner
from .files import Choice, Labels, Output, Result, write_labelled
from .finding import POINT, append, file_of, read_searched

SIDE_M = 10.0
"""Side of the squares on disk: four of them hold what a window needs, and 0.5 million points of a dense cloud each."""

KEPT_POINTS = 6_000_000
"""Points of squares that are kept in memory: 24 bytes each."""

LINE_STEP_M = 20.0
"""Distance between the places of a line at which rails are looked for; those that a rail has reached are skipped."""

SAME_M = 0.26
"""Two windows of 0.5 m this close are the same piece of rail."""


def grow_files(
    request: Request,
    seeds: Sequence[np.ndarray],
    settings: GrowSettings,
    choice: Choice,
    output: Output,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> Result:
    """Follow rails from seeds and write the files of a cloud with the classes of their points.

    Parameters
    ----------
    request : Request
        Files, `standards.SEARCHED_CLASSES` classes and extent.
    seeds : sequence of (k, 2) array
        Places on railheads, k = 1, or lines along them, in units of the CRS.
    settings : GrowSettings
    choice : Choice
    output : Output
        From `files.plan_output`, for the files of the request.
    folder : Path
        Existing folder for temporary files, 36 bytes per point within reach; the caller removes it.
    runner : Runner
        Writes the files.
    progress : Progress

    Raises
    ------
    CloudError
        A file is damaged.
    DiskError
        The disk is full, or another program has changed an output.
    ParameterError
        No seed is in the cloud.
    RailExtractError
        No seed is on a rail.
    """
    growing, rewriting = progress.divide((7.0, 3.0))
    labels = Labels(request, folder)

    def keep(points: np.ndarray) -> None:
        with writing(folder):
            labels.add(points["number"])

    growths, figures = grow_points(request, seeds, settings, folder, keep, growing)
    write_labelled(request, choice, labels, output, runner, rewriting)
    return Result(output.file, labels.point_count, figures, _stops(growths))


def grow_points(
    request: Request,
    seeds: Sequence[np.ndarray],
    settings: GrowSettings,
    folder: Path,
    keep: Callable[[np.ndarray], None],
    progress: Progress = SILENT,
) -> tuple[list[Growth], SearchFigures]:
    """Follow rails from seeds, and hand the points on them, (n,) `finding.POINT` in metres, to `keep` by squares.

    The other parameters, and errors, are those of `grow_files`.
    """
    finding, labelling = progress.divide((6.0, 1.0))
    squares, growths = grow_all(request, seeds, settings, folder, finding)
    figures = _lengths(growths)
    for key in labelling.follow(squares.keys()):
        points = squares.read(key)
        points = points[_on_rails(points["xyz"], growths, settings)]
        if len(points):
            keep(points)
            figures += _figures(points["xyz"], settings)
    _report(growths, figures, settings, request, progress)
    return growths, figures


def grow_all(
    request: Request, seeds: Sequence[np.ndarray], settings: GrowSettings, folder: Path, progress: Progress = SILENT
) -> tuple[Squares, list[Growth]]:
    """Follow rails from seeds; returns the points that were read, and what grew, in metres.

    Parameters and errors are those of `grow_files`.
    """
    reading, growing = progress.divide((1.0, 1.0))
    local = [request.zero.to_local(np.column_stack([seed[:, :2], np.zeros(len(seed))]))[:, :2] for seed in seeds]
    places = [resample(seed, LINE_STEP_M)[0] if len(seed) > 1 else seed for seed in local]
    squares = Squares(request, np.concatenate(places), settings, folder / "squares")
    request.announce(progress)
    squares.fill(reading)
    progress.status("Following the rails")
    growths: list[Growth] = []
    missed = 0
    heads = OnHeads(squares, settings)
    for seed, share in zip(places, growing.split(len(places))):
        grown = list(_grow_along(squares, heads, seed, settings, share))
        growths += grown
        missed += not grown
    parameters = settings.parameters
    if not growths:
        raise OffRailError(
            f"No seed is on a rail: put seeds within {parameters.search_m:g} m of railheads that stand "
            f"{parameters.min_height_m:g} m above the bed, and check the rail standard and the unit of the coordinates."
        )
    if missed:
        progress.warning(f"{missed} of {len(places)} seeds are not on a rail: move them onto railheads.")
    return squares, growths


def _grow_along(
    squares: Squares, heads: OnHeads, places: np.ndarray, settings: GrowSettings, progress: Progress
) -> Iterator[Growth]:
    """Grow from a seed: from both ends of a line, and from those of its places that no rail has reached."""
    reached = np.empty((0, 2))
    for place in (*places[:1], *places[:0:-1]):
        if len(reached) and np.hypot(*(reached - place).T).min() <= settings.parameters.search_m + SAME_M:
            continue
        grown = grow(squares, place, settings, progress, heads)
        if grown is not None:
            yield grown
            reached = np.concatenate([reached, grown.rails[0].xyz[:, :2]])


class Squares:
    """Points within reach of seeds, sorted into squares on disk; a `grow.points.Points`.

    Parameters
    ----------
    request : Request
    places : (k, 2) array
        Seeds, metres from the zero of the coordinate system.
    settings : GrowSettings
    folder : Path
        To be created.

    Raises
    ------
    ParameterError
        No seed is in the cloud.
    """

    def __init__(self, request: Request, places: np.ndarray, settings: GrowSettings, folder: Path) -> None:
        self._request, self._folder = request, folder
        reach_m = settings.parameters.max_length_m + PATCH_M[1]
        steps = np.arange(-int(reach_m / SIDE_M) - 1, int(reach_m / SIDE_M) + 2)
        around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        around = around[np.hypot(*around.T) <= reach_m / SIDE_M + np.sqrt(2)]
        own = np.unique(np.floor(places / SIDE_M).astype(np.int64), axis=0)
        self._wanted = {(int(column), int(row)) for one in own for column, row in one + around}
        self._low, self._high = places.min(axis=0) - reach_m, places.max(axis=0) + reach_m
        self._inside(places)
        self._kept: OrderedDict[Key, Buckets] = OrderedDict()

    def _inside(self, places: np.ndarray) -> None:
        """Refuse seeds of which none is in the cloud; headers may state an extent that is not a number."""
        extents = np.array([header.extent for header in self._request.headers], dtype=float)
        if not np.isfinite(extents).all():
            return
        corners = np.column_stack([extents.reshape(-1, 2), np.zeros(2 * len(extents))])
        corners = self._request.zero.to_local(corners)[:, :2].reshape(-1, 2, 2)
        inside = (places[:, None] >= corners[:, 0] - PATCH_M[0]) & (places[:, None] <= corners[:, 1] + PATCH_M[0])
        if not inside.all(axis=2).any():
            raise OffCloudError("No seed is in the cloud: check the place and the coordinate system of the seeds.")

    def fill(self, progress: Progress) -> None:
        """Read the points of the cloud that are within reach."""
        first = 0
        with writing(self._folder.parent):
            self._folder.mkdir()
        for header, share in zip(self._request.headers, self._request.shares(progress)):
            if self._may_reach(header.extent):
                self._sort(header.path, first, share)
            first += header.point_count

    def _may_reach(self, extent: tuple[float, float, float, float]) -> bool:
        """Return whether a file may have points within reach."""
        corners = self._request.zero.to_local(np.column_stack([np.reshape(extent, (2, 2)), np.zeros(2)]))[:, :2]
        return not ((corners[0] > self._high).any() or (corners[1] < self._low).any())

    def _sort(self, path: Path, first: int, progress: Progress) -> None:
        """Append the points of a file to the files of their squares."""
        for points in read_searched(self._request, path, first, progress):
            points["xyz"] = self._request.zero.to_local(points["xyz"])
            places = points["xyz"][:, :2]
            points = points[((places >= self._low) & (places <= self._high)).all(axis=1)]
            squares = points_by_square(points["xyz"], SIDE_M) if len(points) else {}
            append(points, {key: number for key, number in squares.items() if key in self._wanted}, self._folder)

    def keys(self) -> list[Key]:
        """List the squares with points."""
        return sorted(key for key in self._wanted if file_of(self._folder, key).exists())

    def read(self, key: Key) -> np.ndarray:
        """Return the points of a square, (n,) `finding.POINT` in metres."""
        file = file_of(self._folder, key)
        return np.fromfile(file, POINT) if file.exists() else np.empty(0, POINT)

    def around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """See `grow.points.Points`."""
        low, high = (np.floor((xy + step) / SIDE_M).astype(np.int64) for step in (-reach_m, reach_m))
        keys = [(c, r) for c in range(int(low[0]), int(high[0]) + 1) for r in range(int(low[1]), int(high[1]) + 1)]
        return np.concatenate([self._buckets(key).around(xy, reach_m) for key in keys])

    def _buckets(self, key: Key) -> Buckets:
        """Return the points of a square from memory, or read them and forget those that were not used for long."""
        if key not in self._kept:
            self._kept[key] = Buckets(np.ascontiguousarray(self.read(key)["xyz"]))
            while len(self._kept) > 4 and sum(len(one) for one in self._kept.values()) > KEPT_POINTS:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


def _on_rails(xyz: np.ndarray, growths: Sequence[Growth], settings: GrowSettings) -> np.ndarray:
    """Return which points of a square, (n, 3), are on rails, (n,) bool."""
    low, high = xyz[:, :2].min(axis=0) - SIDE_M, xyz[:, :2].max(axis=0) + SIDE_M
    rails = [
        rail
        for growth in growths
        for rail in growth.rails
        if ((rail.xyz[:, :2] >= low) & (rail.xyz[:, :2] <= high)).all(axis=1).any()
    ]
    return on_rails(rails, xyz, settings)


def _figures(xyz: np.ndarray, settings: GrowSettings) -> SearchFigures:
    """Count the rail points of a square, (n, 3), and their cells."""
    cells = np.floor(xyz[:, :2] / cell_size(settings.gauge_m, settings.head_width_m) + BORDER_CELLS)
    return SearchFigures(points=len(xyz), cells=len(np.unique(cells, axis=0)))


def _lengths(growths: Sequence[Growth]) -> SearchFigures:
    """Sum up the length of rails with and without a partner; what several seeds reach counts once."""
    known, paired_m, single_m = np.empty((0, 2)), 0.0, 0.0
    for growth in growths:
        for rail in growth.rails:
            xy = rail.xyz[:, :2]
            new = np.isinf(cKDTree(known).query(xy, distance_upper_bound=SAME_M)[0]) if len(known) else True
            length_m = float((np.gradient(length_along(xy)) * new * rail.seen).sum())
            if len(growth.rails) > 1:
                paired_m += length_m
            else:
                single_m += length_m
            known = np.concatenate([known, xy])
    return SearchFigures(paired_m=paired_m, single_m=single_m)


def _stops(growths: Sequence[Growth]) -> tuple[Stop, ...]:
    """List where rails were not followed further; what several seeds reach counts once."""
    stops: list[Stop] = []
    for stop in (stop for growth in growths for stop in growth.stops):
        if all(np.hypot(*(stop.xyz - one.xyz)[:2]) > SAME_M for one in stops):
            stops.append(stop)
    return tuple(stops)


def _report(
    growths: Sequence[Growth], figures: SearchFigures, settings: GrowSettings, request: Request, progress: Progress
) -> None:
    """Inform the user of what grew, and where and why it stops."""
    for growth in growths:
        progress.info(described(growth, request))
    single = sum(len(growth.rails) == 1 for growth in growths)
    if settings.parameters.both and single:
        progress.warning(
            f"{single} of {len(growths)} followed rails have no other rail at the gauge: check that their seeds are on "
            "rails, and the rail standard."
        )
    progress.info(
        f"Found {figures.points} rail points: {figures.paired_m:.0f} m of rails with a partner and "
        f"{figures.single_m:.0f} m of single rails."
    )


def described(growth: Growth, request: Request | None = None) -> str:
    """Say how far rails were followed, why they end and, given the request for the points, where."""
    first, last = (
        f"{_place(stop.xyz, request)}, where {stop.reason.value}" if request else f"where {stop.reason.value}"
        for stop in growth.stops
    )
    lengths = " and ".join(f"{rail.length_m:.0f} m" for rail in growth.rails)
    return f"Followed {lengths} of rail from {first}, to {last}."


def _place(xyz: np.ndarray, request: Request) -> str:
    """Write a place in units of the CRS."""
    x, y = request.zero.to_crs(xyz)[:2]
    return f"{x:.1f}, {y:.1f}"
