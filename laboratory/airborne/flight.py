"""The flight: strips of scan lines, a beam with a footprint, noise, plants and wires."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .ground import World

RAYS = 19
"""Places in a footprint at which the surface is sampled."""

POINTS_AT_ONCE = 20_000
"""Beams computed at once, which limits the memory."""

GOLDEN_RAD = np.pi * (3 - np.sqrt(5))
"""Angle between neighbours in a sunflower pattern, which fills a disc evenly."""


@dataclass(frozen=True)
class Flight:
    """How a cloud is scanned.

    Attributes
    ----------
    density : float
        Points per square metre, of all strips together.
    footprint_m : float
        Diameter of the beam on the ground.
    noise_m : float
        Standard deviation of the range.
    strip_up_m, strip_across_m : float
        Distance between the strips in height and in plan; the truth lies in the middle.
    aspect : float
        Distance between scan lines, divided by that between the points on them.
    directions_deg : tuple of float
        Of the scan lines of each strip.
    plants, wires : float
        Share of the ground under plants, and of the points on wires.
    """

    density: float = 10.0
    footprint_m: float = 0.25
    noise_m: float = 0.03
    strips: int = 2
    strip_up_m: float = 0.05
    strip_across_m: float = 0.05
    aspect: float = 1.5
    directions_deg: tuple[float, ...] = (25.0, 160.0)
    plants: float = 0.08
    wires: float = 0.015


@dataclass(frozen=True)
class AirborneCloud:
    """Points of a flight, (n, 3) metres, and the strip of each, (n,)."""

    xyz: np.ndarray
    strip: np.ndarray


def beam(footprint_m: float) -> np.ndarray:
    """Return places in a footprint about its middle, (RAYS, 2)."""
    radius = np.sqrt((np.arange(RAYS) + 0.5) / RAYS) * footprint_m / 2
    angle = np.arange(RAYS) * GOLDEN_RAD
    return radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def fly(world: World, where: np.ndarray, width_m: float, flight: Flight, seed: int = 0) -> AirborneCloud:
    """Scan a world within `width_m` of the line `where`, (k, 2)."""
    rng = np.random.RandomState(seed)
    turn = rng.uniform(0, 2 * np.pi)
    shift_direction = np.array([np.cos(turn), np.sin(turn)])
    parts = []
    for strip in range(flight.strips):
        side = strip - (flight.strips - 1) / 2
        heading = np.radians(flight.directions_deg[strip % len(flight.directions_deg)])
        places = _places(where, width_m, flight.density / flight.strips, flight.aspect, heading, rng)
        height = np.concatenate(
            [
                world.heights(places[first : first + POINTS_AT_ONCE], beam(flight.footprint_m))
                for first in range(0, len(places), POINTS_AT_ONCE)
            ]
        )
        height += _clutter(world, places, flight, rng) + rng.normal(0, flight.noise_m, len(height))
        places = places + side * flight.strip_across_m * shift_direction
        parts.append(np.column_stack([places, height + side * flight.strip_up_m, np.full(len(height), strip)]))
    points = np.concatenate(parts)
    points = points[rng.permutation(len(points))]
    return AirborneCloud(points[:, :3].copy(), points[:, 3].astype(np.int32))


def _places(
    where: np.ndarray, width_m: float, density: float, aspect: float, heading: float, rng: np.random.RandomState
) -> np.ndarray:
    """Return where the beams of a strip meet the ground, (n, 2): scan lines with some jitter."""
    from scipy.spatial import cKDTree

    line_m = np.sqrt(aspect / density)
    point_m = 1 / (density * line_m)
    across = np.array([-np.sin(heading), np.cos(heading)])
    along = np.array([np.cos(heading), np.sin(heading)])
    tree, found = cKDTree(where), []
    for block in np.array_split(where, max(len(where) // 200, 1)):
        low = np.column_stack([block @ across, block @ along]).min(axis=0) - width_m
        high = np.column_stack([block @ across, block @ along]).max(axis=0) + width_m
        rows = np.arange(np.floor(low[0] / line_m), high[0] / line_m)
        columns = np.arange(np.floor(low[1] / point_m), high[1] / point_m)
        grid = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
        grid = (grid + rng.normal(0, 0.12, grid.shape)) * [line_m, point_m]
        places = grid[:, :1] * across + grid[:, 1:] * along
        distance, nearest = tree.query(places, distance_upper_bound=width_m)
        first = int(np.flatnonzero((where == block[0]).all(axis=1))[0])
        mine = np.isfinite(distance) & (nearest >= first) & (nearest < first + len(block))
        found.append(places[mine])
    return np.concatenate(found)


def _clutter(world: World, places: np.ndarray, flight: Flight, rng: np.random.RandomState) -> np.ndarray:
    """Return how high above the surface points lie, (n,): plants and wires."""
    lift = np.where(world.patches(places, flight.plants), rng.exponential(0.12, len(places)), 0.0)
    wires = rng.random_sample(len(places)) < flight.wires
    return np.where(wires, 5.5 + rng.normal(0, 0.5, len(places)), lift)
