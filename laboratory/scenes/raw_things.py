"""What stands on and beside tracks: guard and third rails, platforms, walls, fences, masts, wires, plants, trains."""

from __future__ import annotations

import numpy as np

from .raw_world import (
    FENCE,
    GROUND,
    GUARD,
    MAST,
    PAVEMENT,
    PLANT,
    PLATFORM,
    THIRD,
    TRAIN,
    WALL,
    WIRE,
    World,
    rail,
    rail_place,
)

FLANGEWAY_M = 0.045
"""Clear width between a rail and its guard rail."""

PLATFORM_EDGE_M = 1.70
"""From a track's axis to the edge of a platform."""

AXLES_M, WHEEL_M = (2.5, 5.0, 16.0, 18.5), 0.92
"""Places of the axles along a wagon of 21 m, and the diameter of its wheels."""

WAGON_M = 21.0


def guard_rail(world: World, track: int, side: int, start_m: float, end_m: float) -> None:
    """Lay a guard rail inside a running rail."""
    left, top = rail_place(world.ways[track], side, world.head_width_m + FLANGEWAY_M)
    rail(world, left, top + 0.01, world.between(start_m, end_m), (GUARD, GUARD))


def third_rail(world: World, track: int, side: int, start_m: float, end_m: float) -> None:
    """Lay a live rail on insulators outside a running rail."""
    left, top = rail_place(world.ways[track], side, -0.40)
    rail(world, left, top + 0.07, world.between(start_m, end_m), (THIRD, THIRD))


def trough(world: World, track: int, left_m: float, start_m: float, end_m: float) -> None:
    """Lay a cable trough of concrete that stands out of the ballast."""
    way = world.ways[track]
    world.box(way.left_m + left_m, way.top_m - 0.32, 0.34, 0.22, WALL, world.between(start_m, end_m))


def platform(world: World, track: int, side: int, start_m: float, end_m: float, height_m: float = 0.55) -> None:
    """Build a platform with an overhanging edge."""
    way = world.ways[track]
    at = way.left_m[:, None] + side * (PLATFORM_EDGE_M + np.array([0.12, 0.12, 0.0, 0.0, 4.0]))
    height = way.top_m[:, None] + height_m + np.array([-1.2, -0.12, -0.12, 0.0, 0.05])
    world.add(at, height, PLATFORM, world.between(start_m, end_m))


def wall(world: World, left_m: float, base_m: float, height_m: float, start_m: float, end_m: float) -> None:
    """Build a wall of 0.3 m beside the reference line."""
    world.box(left_m, _top(world) + base_m, 0.3, height_m, WALL, world.between(start_m, end_m))


def fence(world: World, left_m: float, base_m: float, start_m: float, end_m: float) -> None:
    """Build a fence of wire mesh between posts."""
    there = world.between(start_m, end_m)
    base = _top(world) + base_m
    world.box(left_m, base, 0.05, 1.5, FENCE, there & world.every(2.5, 0.06))
    count = 14
    low = base[:, None] + 1.5 * world.rng.random_sample((len(base), count))
    across = np.stack([np.full_like(low, left_m), np.full_like(low, left_m)], axis=2)
    height = np.stack([low, low + 0.03], axis=2)
    for number in range(count):
        world.add(across[:, number], height[:, number], FENCE, there)


def masts(world: World, left_m: float, step_m: float = 25.0, phase_m: float = 7.0) -> None:
    """Set masts on foundations, and lay wires over all tracks."""
    there = world.every(step_m, 0.3, phase_m)
    world.box(left_m, _top(world) - 0.4, 0.3, 8.0, MAST, there)
    world.box(left_m, _top(world) - 0.9, 0.8, 0.75, MAST, world.every(step_m, 0.8, phase_m - 0.25))
    for way in world.ways:
        for height_m in (5.5, 6.9):
            world.box(way.left_m, way.top_m + height_m, 0.014, 0.014, WIRE)


def plants(
    world: World,
    count: int,
    lefts_m: tuple[float, float],
    height_m: tuple[float, float] = (0.05, 0.5),
    radius_m: tuple[float, float] = (0.05, 0.25),
    base_m: float = -0.2,
    leaves: int = 10,
) -> None:
    """Let plants grow in a range across from the reference line: balls of leaves above a base.

    They root at `base_m` relative to the rails, and have as many leaves in each of their profiles.
    """
    rng = world.rng
    middle = rng.uniform(0, world.station[-1], count)
    left, high = rng.uniform(*lefts_m, size=count), rng.uniform(*height_m, size=count)
    radius = rng.uniform(*radius_m, size=count)
    first, last = np.searchsorted(world.station, middle - radius), np.searchsorted(world.station, middle + radius)
    sizes = (last - first) * leaves
    plant = np.repeat(np.arange(count), sizes)
    profile = first[plant] + (np.arange(len(plant)) - (np.cumsum(sizes) - sizes)[plant]) // leaves
    start = np.column_stack(
        [
            left[plant] + radius[plant] * rng.uniform(-1, 1, len(plant)),
            _top(world)[profile] + base_m + high[plant] * rng.random_sample(len(plant)),
        ]
    )
    turn = rng.uniform(0, np.pi, len(plant))
    size = rng.uniform(0.01, 0.05, len(plant)) * np.clip(high[plant] / 0.5, 0.5, 4)
    world.add_segments(profile, start, start + size[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]), PLANT)


def trees(world: World, count: int, lefts_m: tuple[float, float], base_m: float = -0.5) -> None:
    """Plant trees: a trunk and a crown of leaves."""
    rng = world.rng
    for _ in range(count):
        left, at = rng.uniform(*lefts_m), rng.uniform(0, world.station[-1])
        world.box(left, _top(world) + base_m - 0.5, 0.3, 8.0, PLANT, np.abs(world.station - at) < 0.15)
    plants(world, count, lefts_m, (6.0, 14.0), (1.5, 3.0), base_m + 2.0, leaves=60)


def train(world: World, track: int, start_m: float, end_m: float) -> None:
    """Park wagons on a track."""
    way = world.ways[track]
    there = world.between(start_m, end_m)
    left, top = way.left_m, way.top_m
    world.box(left, top + 1.05, 2.9, 2.7, TRAIN, there & ((world.station - start_m) % WAGON_M < WAGON_M - 1.2))
    for axle in AXLES_M:
        along = np.abs((world.station - start_m) % WAGON_M - axle)
        half = np.sqrt(np.maximum((WHEEL_M / 2) ** 2 - along**2, 0))
        wheel = there & (half > 0.02)
        for side in (1, -1):
            for across, width in ((0.0, 0.13), (side * 0.30, 0.2)):
                middle = left + side * way.spacing_m / 2 + across
                low = np.where(across == 0, top + WHEEL_M / 2 - half, top + 0.35)
                high = np.where(across == 0, top + WHEEL_M / 2 + half, top + 0.65)
                corners = middle[:, None] + width / 2 * np.array([-1, -1, 1, 1, -1])
                world.add(corners, np.stack([low, high, high, low, low], axis=1), TRAIN, wheel)


def tunnel(world: World, radius_m: float = 3.4, middle_m: float = 0.0) -> None:
    """Line the world with a tube."""
    turn = np.linspace(-0.35 * np.pi, 1.35 * np.pi, 60) - 0.0
    across = middle_m + radius_m * np.cos(turn)
    height = _top(world)[:, None] + 2.0 + radius_m * np.sin(turn)
    world.add(np.broadcast_to(across, height.shape), height, WALL)


def viaduct(world: World, half_width_m: float, middle_m: float = 0.0, depth_m: float = 9.0) -> None:
    """Carry the tracks on a deck with parapets over the ground far below."""
    top = _top(world)
    for side in (1, -1):
        world.box(middle_m + side * (half_width_m - 0.15), top - 0.9, 0.3, 1.7, WALL)
    world.box(middle_m, top - 1.9, 2 * half_width_m, 1.0, WALL)
    across = np.linspace(-world.half_width_m, world.half_width_m, 600)
    height = top[:, None] - depth_m + 0.03 * world.rng.standard_normal((len(top), len(across)))
    world.add(np.broadcast_to(across, height.shape), height, GROUND)


def street(world: World) -> None:
    """Lay a street: lanes, kerbs, pavements, a strip of lawn between two kerbs, parked cars."""
    top = _top(world)
    kerb = np.array(
        [
            (-14, 0.16),
            (-6.0, 0.13),
            (-5.85, 0.12),
            (-5.85, 0.0),
            (-2.0, 0.05),
            (-2.0, 0.13),
            (-1.85, 0.13),
            (-1.85, 0.06),
            (-0.45, 0.07),
            (-0.45, 0.13),
            (-0.3, 0.13),
            (-0.3, 0.05),
            (5.0, 0.0),
            (5.0, 0.12),
            (5.15, 0.13),
            (14, 0.2),
        ]
    )
    for (left, low), (right, high) in zip(kerb, kerb[1:]):
        share = np.linspace(0, 1, max(int((right - left) / 0.04), 1) + 1)
        height = top[:, None] + low + (high - low) * share + 0.002 * world.rng.standard_normal((len(top), len(share)))
        world.add(np.broadcast_to(left + (right - left) * share, height.shape), height, PAVEMENT)
    for start in np.arange(3.0, world.station[-1], 7.0):
        there = world.between(start, start + 4.3)
        world.box(-4.7, top + 0.25, 1.75, 1.1, TRAIN, there)
        for axle in (0.8, 3.4):
            near = np.abs(world.station - start - axle) < 0.3
            for across in (-0.75, 0.75):
                world.box(-4.7 + across, top, 0.2, 0.6, TRAIN, near)
    plants(world, 120, (-1.8, -0.5), (0.03, 0.25), (0.05, 0.2), 0.07)


def car_park(world: World) -> None:
    """Lay a flat car park with rows of cars and low walls."""
    top = _top(world)
    across = np.linspace(-14, 14, 700)
    height = top[:, None] + 0.01 * across + 0.002 * world.rng.standard_normal((len(top), len(across)))
    world.add(np.broadcast_to(across, height.shape), height, PAVEMENT)
    for row in (-9.5, -4.0, 4.0, 9.5):
        for start in np.arange(1.0, world.station[-1], 2.6):
            if world.rng.random_sample() < 0.7:
                there = world.between(start, start + 1.75)
                world.box(row, top + 0.25 + 0.01 * row, 4.3, 0.6, TRAIN, there)
                world.box(row, top + 0.85 + 0.01 * row, 2.2, 0.5, TRAIN, there)
                for axle in (-1.3, 1.3):
                    world.box(
                        row + axle, top + 0.01 * row, 0.6, 0.6, TRAIN, there & ((world.station - start) % 1.5 < 0.2)
                    )
    for left in (-6.8, 6.8):
        world.box(left, top + 0.01 * left, 0.12, 0.12, WALL, world.every(10.0, 8.0))


def hills(world: World, roughness_m: float, height_m: float) -> np.ndarray:
    """Heights of open ground, (profiles, m), for `raw_world.ground`."""
    count = int(round(2 * world.half_width_m / 0.025)) + 1
    across = np.linspace(-world.half_width_m, world.half_width_m, count)
    waves = sum(
        height_m / (number + 1) * np.sin((number + 1) * (0.21 * across + 0.17 * world.station[:, None]) + 2.0 * number)
        for number in range(4)
    )
    return waves + roughness_m * world.rng.standard_normal((len(world.station), count))


def _top(world: World) -> np.ndarray:
    """Height of the first track's rails, (profiles,); zero without tracks."""
    return np.nan_to_num(world.ways[0].top_m) if world.ways else np.zeros(len(world.station))
