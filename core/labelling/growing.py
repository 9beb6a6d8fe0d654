"""Rails grown from seeds in clouds of any size, and classified copies of the files with their points.

Only points within reach of the seeds are read; the squares that a rail runs through are classified (docs/growing.md).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..classify.guide import Guide
from ..clouds.points import Request
from ..disk import writing
from ..errors import OffCloudError, OffRailError
from ..grow.growth import APART, Growth, Growths, Stop, apart_first
from ..grow.heads import GrowSettings, OnHeads
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from ..raster import BORDER_CELLS, cell_size
from ..run.tasks import Runner
from ..tiles.grid import Key
from ..tiles.store import files_of, read_stored
from .files import ClassifiedFiles, Content, Labels, OutputFiles, write_labelled
from .finding import POINT, box_of, sort_files

LINE_STEP_M = 20.0
"""Distance between the places of a line at which rails are looked for; those that a rail has reached are skipped."""

NEAR_M = 3.0
"""Accuracy of the extents of files, within which a seed may be in the cloud."""

SAME_M = 0.26
"""Two windows of 0.5 m this close are the same piece of rail."""


def grow_files(
    request: Request,
    seeds: Sequence[np.ndarray],
    settings: GrowSettings,
    choice: Content,
    output: OutputFiles,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> ClassifiedFiles:
    """Follow rails from seeds and write the files of a cloud with the classes of their points.

    Seeds, (k, 2) in units of the CRS, are places on railheads, k = 1, or lines along them; the request has
    `standards.SEARCHED_CLASSES`. `output` is from `files.plan_output`, for the files of the request. The caller removes
    the folder, which gets 36 bytes per point within reach.
    """
    growing, rewriting = progress.divide((7.0, 3.0))
    labels = Labels(request, folder)

    def keep(points: np.ndarray) -> None:
        with writing(folder):
            labels.add(points["number"])

    growths, figures = grow_points(request, seeds, settings, folder, keep, growing)
    write_labelled(request, choice, labels, output, runner, rewriting)
    return ClassifiedFiles(output.file, labels.point_count, figures, _stops(growths))


def grow_points(
    request: Request,
    seeds: Sequence[np.ndarray],
    settings: GrowSettings,
    folder: Path,
    keep: Callable[[np.ndarray], None],
    progress: Progress = SILENT,
) -> tuple[Growths, SearchFigures]:
    """Follow rails from seeds, and hand the points on them, (n,) `finding.POINT`, to `keep` by squares.

    The other parameters, and errors, are those of `grow_files`.
    """
    finding, labelling = progress.divide((6.0, 1.0))
    cloud, growths = grow_all(request, seeds, settings, folder, finding)
    figures = _lengths(growths.grown)
    rails = [rail for growth in growths.grown for rail in growth.rails]
    for key, numbers in labelling.follow(list(cloud.heads.on(rails))):
        points = cloud.read(key)[numbers]
        keep(points)
        figures += _figures(request.zero.to_local(points["xyz"]), settings)
    _report(growths.grown, figures, settings, request, progress)
    return growths, figures


def grow_all(
    request: Request, seeds: Sequence[np.ndarray], settings: GrowSettings, folder: Path, progress: Progress = SILENT
) -> tuple[SeedCloud, Growths]:
    """Follow rails from seeds; returns the points that were read, and what grew, in metres.

    Parameters and errors are those of `grow_files`.
    """
    reading, growing = progress.divide((1.0, 1.0))
    owner, places = _in_cloud(request, seeds)
    request.announce(progress)
    cloud = SeedCloud(request, places, settings, folder, reading)
    progress.status("Following the rails")
    growths, is_on = Growths(cloud.heads, settings), np.zeros(len(seeds), dtype=bool)
    order = apart_first(places, APART * settings.parameters.max_length_m).tolist()
    for at, share in zip(order, growing.split(len(order))):
        is_on[owner[at]] |= growths.add(places[at], share)
    growths.reach_on(progress)
    parameters = settings.parameters
    if not growths.grown:
        raise OffRailError(
            f"No seed is on a rail: put seeds within {parameters.search_m:g} m of railheads that stand "
            f"{parameters.min_height_m:g} m above the bed, and check the rail standard and the unit of the coordinates."
        )
    missed = int(np.count_nonzero(~is_on))
    if missed:
        progress.warning(f"{missed} of {len(seeds)} seeds are not on a rail: move them onto railheads.")
    return cloud, growths


class SeedCloud:
    """Points within reach of seeds, sorted into the squares of the classification on disk.

    `places`, (k, 2), are the seeds, metres from the zero of the coordinate system.
    """

    def __init__(
        self, request: Request, places: np.ndarray, settings: GrowSettings, folder: Path, progress: Progress
    ) -> None:
        near = Guide(places, np.zeros_like(places), settings.parameters.max_length_m)
        squares = folder / "squares"
        with writing(folder):
            squares.mkdir()
        own = replace(settings.classification, guide=near)
        self._sorted, self._zero = sort_files(request, own, squares, Runner(), progress), request.zero
        self._local = lru_cache(maxsize=1)(lambda key: self._zero.to_local(self.read(key)["xyz"]))
        self.heads = OnHeads(self._local, settings)

    def read(self, key: Key) -> np.ndarray:
        """Return the points of a square and of its margin, (n,) `finding.POINT`."""
        return read_stored(files_of(key, self._sorted), POINT)


def _in_cloud(request: Request, seeds: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the seed, (k,) int, and the place, (k, 2) metres, of all places of seeds that may be in the cloud."""
    parts = [_places(request.zero.to_local(np.column_stack([seed[:, :2], np.zeros(len(seed))]))) for seed in seeds]
    owner, places = np.repeat(np.arange(len(seeds)), [len(part) for part in parts]), np.concatenate(parts)
    inside = _inside(places, [box_of(request, [header.extent]) for header in request.headers])
    if not inside.any():
        raise OffCloudError("No seed is in the cloud: check the place and the coordinate system of the seeds.")
    return owner[inside], places[inside]


def _places(seed: np.ndarray) -> np.ndarray:
    """Return the places at which a seed, (k, 3) metres, looks for rails, (n, 2): of a line, its ends first."""
    xy = Polyline(seed).resampled(LINE_STEP_M).xy if len(seed) > 1 else seed[:, :2]
    return np.concatenate([xy[:1], xy[:0:-1]])


def _inside(xy: np.ndarray, boxes: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return which places, (k, 2), are in a box or near it, (k,) bool; a box of NaN may be anywhere."""
    inside = np.zeros(len(xy), dtype=bool)
    for low, high in boxes:
        inside |= ~((xy < low - NEAR_M) | (xy > high + NEAR_M)).any(axis=1)
    return inside


def _figures(xyz: np.ndarray, settings: GrowSettings) -> SearchFigures:
    """Count the rail points of a square, (n, 3), and their cells."""
    cells = np.floor(xyz[:, :2] / cell_size(settings.gauge_m, settings.head_width_m) + BORDER_CELLS)
    return SearchFigures(points=len(xyz), cells=len(np.unique(cells, axis=0)))


def _lengths(growths: Sequence[Growth]) -> SearchFigures:
    """Sum up the length of rails with and without a partner; what several seeds reach counts once."""
    rails = [(rail, len(growth.rails) > 1) for growth in growths for rail in growth.rails]
    owner = np.repeat(np.arange(len(rails)), [len(rail.xyz) for rail, _ in rails])
    pairs = cKDTree(np.concatenate([rail.xyz[:, :2] for rail, _ in rails])).query_pairs(SAME_M, output_type="ndarray")
    known = np.zeros(len(owner), dtype=bool)
    known[pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]], 1]] = True
    lengths_m = {True: 0.0, False: 0.0}
    for number, (rail, is_paired) in enumerate(rails):
        own_m = np.gradient(Polyline(rail.xyz).t) * ~known[owner == number] * rail.seen
        lengths_m[is_paired] += float(own_m.sum())
    return SearchFigures(paired_m=lengths_m[True], single_m=lengths_m[False])


def _stops(growths: Growths) -> tuple[Stop, ...]:
    """List where rails were not followed further; what several seeds reach counts once."""
    stops: list[Stop] = []
    for stop in growths.stops():
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
    lengths = " and ".join(f"{rail.length_m:.0f} m" for rail in growth.rails)
    places = [_place(stop.xyz, request) if request else "" for stop in growth.stops]
    reasons = [stop.reason.value for stop in growth.stops]
    if len(set(reasons)) == 1:
        between = f" from {places[0]} to {places[1]}" if request else ""
        return f"Followed {lengths} of rail{between}: at both ends, {reasons[0]}."
    first, last = (", ".join(filter(None, (place, f"where {reason}"))) for place, reason in zip(places, reasons))
    return f"Followed {lengths} of rail from {first}, to {last}."


def _place(xyz: np.ndarray, request: Request) -> str:
    """Write a place in units of the CRS."""
    x, y = request.zero.to_crs(xyz)[:2]
    return f"{x:.1f}, {y:.1f}"
