"""The surface that an airborne scanner sees: track beds with sleepers and rails, and what lies along or beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from ..scenes.tracks import Track

STEP_M = 0.25
"""Distance between the samples of a line."""

REACH_M = 40.0
"""Distance from a line up to which things along it are looked for."""

SLEEPER_STEP_M, SLEEPER_WIDTH_M, SLEEPER_HALF_M = 0.60, 0.26, 1.30
SLEEPER_TOP_M, BALLAST_TOP_M = -0.180, -0.205
"""Tops of the sleepers and of the ballast between them, above the top of the rails."""

SHOULDER_M, SHOULDER_SLOPE, FORMATION_M = 1.65, 1 / 1.5, -0.75
"""End of the level ballast from the axis, fall of its edge, and the formation below the top of the rails."""

HEAD_HALF_M, FOOT_HALF_M, FOOT_TOP_M = 0.036, 0.075, -0.165
"""Half the width of a rail's head, and of its foot with the fastenings; their height above the top of the rail."""

SIX_FOOT_M = 3.0
"""Distance from the axis up to which a track shares its ballast with the next one."""

LATTICE = 512
"""Cells of the random fields, which repeat after as many cells."""


@dataclass(frozen=True)
class Axis:
    """A line along which things lie: (n, 3) samples every `STEP_M`, with the height of rail tops or the thing's zero.

    `heading` is the direction in radians, `slope` the rise per metre to the left, (n,) each.
    """

    xyz: np.ndarray
    heading: np.ndarray
    slope: np.ndarray

    @classmethod
    def of_track(cls, track: Track) -> Axis:
        """Sample a track, whose curve has steps of `STEP_M`."""
        slope = np.broadcast_to(np.asarray(track.cant_m, float) / track.spacing_m, len(track.curve.xy))
        return cls(track.centerline, track.curve.heading, slope)

    def beside(self, left_m: float, up_m: float = 0.0) -> Axis:
        """Return the line at a distance to the left, without a slope across."""
        left = np.column_stack([-np.sin(self.heading), np.cos(self.heading), np.zeros(len(self.heading))])
        lift = np.column_stack([np.zeros((len(self.heading), 2)), np.full(len(self.heading), up_m)])
        return Axis(self.xyz + left_m * left + lift, self.heading, np.zeros(len(self.heading)))

    def under(
        self, tree: cKDTree, places: np.ndarray, beam: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Find the beams, at places (n, 2), that meet the ground beside the line.

        Returns the k beams, the chainage and the distance to the left of each place in them, (k, m) each, and the
        sample next to each, (k,).
        """
        distance, nearest = tree.query(places, distance_upper_bound=REACH_M)
        found = np.flatnonzero(np.isfinite(distance))
        nearest = nearest[found]
        cos, sin = np.cos(self.heading[nearest])[:, None], np.sin(self.heading[nearest])[:, None]
        step = (places[found] - self.xyz[nearest, :2])[:, None] + beam
        ahead, left = step[..., 0] * cos + step[..., 1] * sin, step[..., 1] * cos - step[..., 0] * sin
        last = len(self.xyz) - 1
        past = ((nearest == 0) & (ahead[:, 0] < -STEP_M)) | ((nearest == last) & (ahead[:, 0] > STEP_M))
        return found[~past], (nearest[:, None] * STEP_M + ahead)[~past], left[~past], nearest[~past]


@dataclass(frozen=True)
class Band:
    """Something with the same cross-section along a line: a road, a ditch, a platform, a trough, a train.

    The profile, (k, 2), has metres to the left of the line, rising, and above it. A band that `covers` hides only what
    is lower; others replace the ground, as a ditch does. With `every_m` and `length_m` it is repeated in pieces of this
    length, such as parked cars.
    """

    axis: Axis
    profile: np.ndarray
    start_m: float = -np.inf
    end_m: float = np.inf
    covers: bool = True
    every_m: float = 0.0
    length_m: float = 0.0

    def height(self, along: np.ndarray, left: np.ndarray, axis_m: np.ndarray) -> np.ndarray:
        """Return the height, NaN outside."""
        across, up = self.profile.T
        found = axis_m + np.interp(left, across, up, left=np.nan, right=np.nan)
        there = (along >= self.start_m) & (along <= self.end_m)
        if self.every_m:
            there &= along % self.every_m < self.length_m
        return np.where(there, found, np.nan)


@dataclass
class World:
    """Tracks on their beds, bands in the order in which they are laid, and rough ground.

    The curves of tracks have steps of `STEP_M`. `ballast_m` is ballast piled above its usual top, where 0 shows 18 cm
    of the rail above the sleepers; `six_foot_m`, ballast between two tracks below the rail tops of the lower one.
    """

    tracks: Sequence[Track]
    bands: list[Band] = field(default_factory=list)
    ballast_m: float = 0.0
    six_foot_m: float = 0.36
    seed: int = 0

    def __post_init__(self) -> None:
        rng = np.random.RandomState(self.seed + 1000)
        self._stones, self._waves, self._patches = rng.standard_normal((3, LATTICE, LATTICE))
        self._axes = [Axis.of_track(track) for track in self.tracks]
        self._trees: dict[int, cKDTree] = {}

    def heights(self, places: np.ndarray, beam: np.ndarray) -> np.ndarray:
        """Return the mean height of the surface under beams at places, (n, 2).

        `beam`, (m, 2), has places within the footprint about its middle.
        """
        shape = (len(places), len(beam))
        bed, covered, fill = np.full(shape, -np.inf), np.zeros(shape), np.full(shape, np.inf)
        for axis, track in zip(self._axes, self.tracks):
            found, along, left, nearest = axis.under(self._tree(axis), places, beam)
            top, slope = axis.xyz[nearest, 2][:, None], axis.slope[nearest][:, None]
            plane = top + slope * np.clip(left, -SHOULDER_M, SHOULDER_M)
            bed[found] = np.maximum(bed[found], plane + self._cross_section(along, left, track.spacing_m))
            near = np.abs(left) < SIX_FOOT_M
            covered[found] += near
            fill[found] = np.where(near, np.minimum(fill[found], plane - self.six_foot_m), fill[found])
        bed = np.where(covered > 1, np.maximum(bed, fill), bed)
        height = np.maximum(bed, self._terrain(places)[:, None])
        height += self._roughness((places[:, None] + beam).reshape(-1, 2)).reshape(shape)
        for band in self.bands:
            found, along, left, nearest = band.axis.under(self._tree(band.axis), places, beam)
            laid = band.height(along, left, band.axis.xyz[nearest, 2][:, None])
            there = np.isfinite(laid) & ((laid > height[found]) | (not band.covers))
            height[found] = np.where(there, laid, height[found])
        return height.mean(axis=1)

    def patches(self, xy: np.ndarray, share: float) -> np.ndarray:
        """Return which places, (n, 2), lie in patches of plants that cover a share of the ground."""
        noise = _lattice(self._patches, xy, 6.0)
        return noise > np.quantile(self._patches, 1 - share) * 0.66  # interpolation narrows the distribution

    def _tree(self, axis: Axis) -> cKDTree:
        if id(axis) not in self._trees:
            self._trees[id(axis)] = cKDTree(axis.xyz[:, :2])
        return self._trees[id(axis)]

    def _cross_section(self, along: np.ndarray, left: np.ndarray, spacing_m: float) -> np.ndarray:
        """Return the height of bed and rails above the plane of the rails' tops."""
        side = np.abs(left)
        sleeper = (along % SLEEPER_STEP_M < SLEEPER_WIDTH_M) & (side < SLEEPER_HALF_M)
        height = np.where(sleeper, np.maximum(SLEEPER_TOP_M, BALLAST_TOP_M + self.ballast_m), 0.0)
        height = np.where(sleeper, height, BALLAST_TOP_M + self.ballast_m)
        edge = BALLAST_TOP_M - (side - SHOULDER_M) * SHOULDER_SLOPE
        height = np.where(side > SHOULDER_M, np.maximum(edge, FORMATION_M), height)
        height = np.where(side > 5.0, -np.inf, height)
        from_rail = np.abs(side - spacing_m / 2)
        height = np.where(from_rail < FOOT_HALF_M, np.maximum(height, FOOT_TOP_M), height)
        return np.where(from_rail < HEAD_HALF_M, 0.0, height)

    def _terrain(self, xy: np.ndarray) -> np.ndarray:
        """Ground beside the line: below the formation of the first track, with waves."""
        axis = self._axes[0] if self._axes else None
        base = np.zeros(len(xy))
        if axis is not None:
            base = axis.xyz[self._tree(axis).query(xy)[1], 2] - 0.9
        return base + 0.06 * _lattice(self._waves, xy, 9.0)

    def _roughness(self, xy: np.ndarray) -> np.ndarray:
        cells = np.floor(xy / 0.06).astype(np.int64) % LATTICE
        return 0.018 * _lattice(self._waves, xy, 0.7) + 0.02 * self._stones[cells[:, 0], cells[:, 1]]


def _lattice(noise: np.ndarray, xy: np.ndarray, cell_m: float) -> np.ndarray:
    """Interpolate a random field bilinearly."""
    at = xy / cell_m
    low = np.floor(at).astype(np.int64)
    u, v = (at - low).T
    i, j = low.T % LATTICE
    k, m = (i + 1) % LATTICE, (j + 1) % LATTICE
    return (noise[i, j] * (1 - v) + noise[i, m] * v) * (1 - u) + (noise[k, j] * (1 - v) + noise[k, m] * v) * u
