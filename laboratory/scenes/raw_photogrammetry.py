"""Clouds of dense image matching: one surface seen from above, blunted, wavy, with holes beside vertical faces.

Matching compares windows of pixels. Each height is therefore a mean over some centimetres in plan, what stands out is
widened, and errors are alike over the metres that share images. Points lie on one surface, at even distances; there is
no intensity, no time and no second return.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates, maximum_filter

from .raw_scanner import Segments
from .raw_world import FENCE, PAVEMENT, PLANT, TRAIN, WALL, WIRE, World

CELL_M, PROFILE_STEP_M = 0.01, 0.025
"""Cells of the surface across and along the reference line: a quarter of the blur and less."""

CHUNK = 128
"""Profiles whose surface is computed at once."""

UNSEEN = (WIRE, FENCE)
"""What is too thin to be matched."""

REACHES_M = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
"""Distances at which something higher is looked for that hides a place."""

WAVES = 100
"""Plane waves that make the errors of a survey."""

GROUND_CLASS, LOW_CLASS, HIGH_CLASS, BUILDING_CLASS, ROAD_CLASS = 2, 3, 5, 6, 11
"""Classes of a ground filter: LAS 1.4, table 17. Rails are ground to it."""

HIGH_PLANT_M = 2.0
"""Height above the ground from which plants are of the class of high vegetation."""


@dataclass(frozen=True)
class Photogrammetry:
    """A drone survey by images; the defaults suit images of 1.5 cm a pixel.

    Attributes
    ----------
    point_step_m : float
        Mean distance between neighbouring points.
    irregular : float
        Part of this distance by which points lie off a grid.
    turned_rad : float
        Angle of this grid to the reference line: the images' rows do not follow a track.
    blur_m : float
        Standard deviation of the smoothing in plan.
    blur_varies : float
        Standard deviation of the blur from place to place, as a share of it.
    blur_patch_m : float
        Shortest length of the waves in which the blur varies; the longest is four times as long.
    widening_m : float
        Width that matching adds to each side of what stands out.
    wave_m, drift_m : float
        Standard deviation of the errors that are alike over metres, in height and in each direction of the plan.
    wave_lengths_m : tuple of float
        Shortest and longest of these waves.
    noise_m : float
        Standard deviation of the errors of single heights.
    stray_share, stray_m : float
        Share of the points that are matched wrongly, and the standard deviation of their heights.
    hidden_slope, hidden_rise_m : float
        A place is seen if nothing near it rises above it by more than this slope and this height.
    shift_m : tuple of float
        Error of the registration of the whole survey: x, y, z.
    epoch : int
        Number of the survey: another one of the same place has other errors.
    """

    point_step_m: float = 0.05
    irregular: float = 0.7
    turned_rad: float = 0.0
    blur_m: float = 0.042
    blur_varies: float = 0.2
    blur_patch_m: float = 1.0
    widening_m: float = 0.010
    wave_m: float = 0.010
    drift_m: float = 0.004
    wave_lengths_m: tuple[float, float] = (1.0, 10.0)
    noise_m: float = 0.005
    stray_share: float = 0.003
    stray_m: float = 0.08
    hidden_slope: float = 3.0
    hidden_rise_m: float = 0.2
    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    epoch: int = 0

    def stations(self, length_m: float) -> np.ndarray:
        """Places of the profiles along a reference line."""
        return np.arange(0.0, length_m, PROFILE_STEP_M)


@dataclass(frozen=True)
class Surface:
    """The surface that a survey would show without noise; (profiles, cells) arrays.

    Heights have the least and the most blur; `kind` is what lies uppermost. `left_m` is the place of the first cell, to
    the left of the reference line.
    """

    sharper: np.ndarray
    blunter: np.ndarray
    kind: np.ndarray
    classification: np.ndarray
    hidden: np.ndarray
    left_m: float

    def at(self, station: np.ndarray, left: np.ndarray, blunt: np.ndarray | float = 0.5) -> np.ndarray:
        """Heights at places along and to the left of the reference line, (n,), with a share of the most blur."""
        cells = self._cells(station, left)
        less, more = (map_coordinates(one, cells, order=1, mode="nearest") for one in (self.sharper, self.blunter))
        return less + blunt * (more - less)

    def nearest(self, values: np.ndarray, station: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Values of the cells in which places lie, (n,)."""
        row, column = np.rint(self._cells(station, left)).astype(int)
        return values[row.clip(0, len(values) - 1), column.clip(0, values.shape[1] - 1)]

    def _cells(self, station: np.ndarray, left: np.ndarray) -> np.ndarray:
        return np.stack([station / PROFILE_STEP_M, (left - self.left_m) / CELL_M])


@dataclass(frozen=True)
class Survey:
    """Points of a survey before they are laid along the reference line; (n,) arrays."""

    station: np.ndarray
    left: np.ndarray
    height: np.ndarray
    kind: np.ndarray
    classification: np.ndarray
    surface: Surface


def survey(world: World, camera: Photogrammetry, rng: np.random.RandomState) -> Survey:
    """Match images of a world."""
    surface = _surface(world, camera)
    length_m, half_m = world.station[-1], world.half_width_m
    grid = _grid(length_m, half_m, camera)
    places = grid + camera.point_step_m * (0.5 + camera.irregular * (rng.random_sample(grid.shape) - 0.5))
    seen = ~surface.nearest(surface.hidden, *places)
    station, left = places[:, seen]
    patches_m = camera.blur_patch_m, 4 * camera.blur_patch_m
    blunt = (0.5 + waves(np.column_stack([station, left]), patches_m, rng) / 4).clip(0, 1)
    stray = rng.random_sample(len(station)) < camera.stray_share
    size_m = np.where(stray, camera.stray_m, camera.noise_m)
    height = surface.at(station, left, blunt) + size_m * rng.standard_normal(len(station))
    kind, classification = (surface.nearest(values, station, left) for values in (surface.kind, surface.classification))
    return Survey(station, left, height, kind, classification, surface)


def _grid(length_m: float, half_m: float, camera: Photogrammetry) -> np.ndarray:
    """Return the grid of a survey along and to the left of the reference line, (2, n)."""
    if camera.turned_rad == 0:
        return _even((0.0, length_m), (-half_m, half_m), camera.point_step_m)
    reach_m = float(np.hypot(length_m / 2, half_m))
    cosine, sine = np.cos(camera.turned_rad), np.sin(camera.turned_rad)
    grid = np.array([[cosine, -sine], [sine, cosine]]) @ _even(
        (-reach_m, reach_m), (-reach_m, reach_m), camera.point_step_m
    )
    return (grid + [[length_m / 2], [0.0]])[:, (np.abs(grid) <= [[length_m / 2], [half_m]]).all(axis=0)]


def _even(along_m: tuple[float, float], left_m: tuple[float, float], step_m: float) -> np.ndarray:
    """Return an even grid, (2, n)."""
    along, left = np.meshgrid(np.arange(*along_m, step_m), np.arange(*left_m, step_m), indexing="ij")
    return np.stack([along.ravel(), left.ravel()])


def misplaced(xyz: np.ndarray, camera: Photogrammetry, rng: np.random.RandomState) -> np.ndarray:
    """Return points, (n, 3), with the errors that are alike over metres, and the shift of the survey."""
    error_m = np.column_stack(
        [
            waves(xyz[:, :2], camera.wave_lengths_m, rng) * size_m
            for size_m in (camera.drift_m, camera.drift_m, camera.wave_m)
        ]
    )
    return xyz + error_m + np.asarray(camera.shift_m)


def waves(xy: np.ndarray, lengths_m: tuple[float, float], rng: np.random.RandomState) -> np.ndarray:
    """Return values of a random field of standard deviation 1 at places, (n,), made of plane waves of any direction."""
    length_m = lengths_m[0] * (lengths_m[1] / lengths_m[0]) ** rng.random_sample(WAVES)
    turn, phase = rng.uniform(0, 2 * np.pi, (2, WAVES))
    number = 2 * np.pi / length_m * np.stack([np.cos(turn), np.sin(turn)])
    # Single precision is enough for errors, and four times as fast.
    xy, number, phase = (values.astype(np.float32) for values in (xy - xy.mean(axis=0), number, phase))
    total = np.zeros(len(xy), dtype=np.float32)
    for one, start in zip(number.T, phase):
        total += np.cos(xy @ one + start)
    return total * np.sqrt(2 / WAVES)


def _surface(world: World, camera: Photogrammetry) -> Surface:
    """See a world from above, and blunt it."""
    height, kind = from_above(world.segments(), len(world.station), world.half_width_m)
    hidden = _hidden(height, camera)
    wide = 2 * int(round(camera.widening_m / CELL_M)) + 1
    long = 2 * int(round(camera.widening_m / PROFILE_STEP_M)) + 1
    widened, spread_m = maximum_filter(height, (long, wide)), 2 * camera.blur_varies * camera.blur_m
    sharper, blunter = (
        gaussian_filter(widened, (blur_m / PROFILE_STEP_M, blur_m / CELL_M))
        for blur_m in (camera.blur_m - spread_m, camera.blur_m + spread_m)
    )
    return Surface(sharper, blunter, kind, _classes(height, kind), hidden, -world.half_width_m + CELL_M / 2)


def from_above(segments: Segments, profiles: int, half_width_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Height and kind of what lies uppermost in each cell, (profiles, cells) each; empty cells are filled."""
    cells = int(round(2 * half_width_m / CELL_M))
    height, kind = np.full((profiles, cells), np.nan, dtype=np.float32), np.zeros((profiles, cells), dtype=np.uint8)
    borders = np.searchsorted(segments.profile, np.arange(0, profiles + CHUNK, CHUNK))
    for first, last in zip(borders, borders[1:]):
        part = np.arange(first, last)[~np.isin(segments.kind[first:last], UNSEEN)]
        start, end = segments.start[part], segments.end[part]
        ends = np.stack([start[:, 0], end[:, 0]])
        low, high = np.ceil((np.sort(ends, axis=0) + half_width_m) / CELL_M - 0.5).astype(int).clip(0, cells)
        number = np.repeat(np.arange(len(part)), high - low)
        column = low[number] + np.arange(len(number)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
        place = (column + 0.5) * CELL_M - half_width_m
        share = (place - start[number, 0]) / (end[number, 0] - start[number, 0])
        z = start[number, 1] + share * (end[number, 1] - start[number, 1])
        # The highest one is written last.
        order = np.argsort(z, kind="stable")
        row, column = segments.profile[part][number[order]], column[order]
        height[row, column], kind[row, column] = z[order], segments.kind[part][number[order]]
    empty = np.isnan(height)
    if empty.any():
        filled = distance_transform_edt(empty, return_distances=False, return_indices=True)
        height, kind = height[tuple(filled)], kind[tuple(filled)]
    return height, kind


def _hidden(height: np.ndarray, camera: Photogrammetry) -> np.ndarray:
    """Places beside vertical faces that too few images see, (profiles, cells) bool."""
    hidden = np.zeros(height.shape, dtype=bool)
    for reach_m in REACHES_M:
        size = 2 * int(reach_m / PROFILE_STEP_M) + 1, 2 * int(reach_m / CELL_M) + 1
        hidden |= maximum_filter(height, size) - height > camera.hidden_slope * reach_m + camera.hidden_rise_m
    return hidden


def _classes(height: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Classes that a ground filter gives to a surface, (profiles, cells) uint8."""
    ground = np.median(height)
    classes = np.full(kind.shape, GROUND_CLASS, dtype=np.uint8)
    classes[kind == PAVEMENT] = ROAD_CLASS
    classes[np.isin(kind, (TRAIN, WALL)) & (height > ground + HIGH_PLANT_M)] = BUILDING_CLASS
    classes[kind == PLANT] = LOW_CLASS
    classes[(kind == PLANT) & (height > ground + HIGH_PLANT_M)] = HIGH_CLASS
    return classes
