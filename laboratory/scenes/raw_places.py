"""Places with long, narrow, parallel things that are not rails: roads, car parks, building sites, fields."""

from __future__ import annotations

import numpy as np

from .raw_things import plants
from .raw_world import GROUND, PAVEMENT, TRAIN, WALL, World

ACROSS_STEP_M = 0.04
"""Distance of the places across at which surfaces are sampled."""

ASPHALT_M, SOIL_M = 0.0015, 0.012
"""Standard deviation of the heights of asphalt, and of soil and grass."""

CROSSFALL, VERGE_FALL = 0.025, 0.3

BARRIER_M = (
    *((-0.30, 0.0), (-0.30, 0.08), (-0.15, 0.33), (-0.10, 0.90)),
    *((0.10, 0.90), (0.15, 0.33), (0.30, 0.08), (0.30, 0.0)),
)
"""Cross-section of a concrete barrier, metres across and above its base."""

BEAM_M = ((0.0, 0.44), (0.08, 0.50), (0.08, 0.54), (0.0, 0.595), (0.08, 0.65), (0.08, 0.69), (0.0, 0.75))
"""Cross-section of a W-beam, metres in front of its posts and above the ground."""

POST_STEP_M, POST_M = 2.0, (0.10, 0.70)
"""Distance of the posts of a guard rail, their width and height."""

LANES_M = (1.0, 4.75, 8.5)
"""From the middle of a motorway to the first lane, to the second and to the hard shoulder."""

ROAD_HALF_M = 11.0
"""From the middle of a motorway to the edge of the asphalt."""

JOINTS_M, JOINT_M = (-8.3, -4.85, 4.85, 8.3), (0.015, 0.012)
"""Places of open joints between strips of asphalt; their width and depth."""

SEALS_M, SEAL_M = (-9.7, 9.7), (0.05, 0.005)
"""Places of joints that are sealed with bitumen; its width and thickness."""

RUT_M, RUT_WIDTH_M, RUTS_M = 0.008, 0.25, (2.03, 3.72, 5.78, 7.47)
"""Depth of the ruts in the lanes, standard deviation of their shape, distance from the middle of the motorway."""

MARKINGS_M, MARKING_M = ((1.0, 0.15, 18.0), (4.75, 0.15, 6.0), (8.5, 0.30, 18.0)), (18.0, 0.003)
"""Distance of the markings from the middle, width and length of a dash; distance of the dashes, and thickness."""

RUMBLE_M, RUMBLE_STEP_M = (8.9, 0.30, 0.18, 0.012), 0.40
"""Rumble strip: its distance from the middle of the motorway, and width, length and depth of its grooves."""

KERB_M = 0.12
"""Width of a kerbstone and its height above the road."""

CONTAINER_M = (2.44, 2.59, 6.06)
"""Width, height and length of a container."""

BEAM_SIZE_M = (0.08, 0.20)
"""Width and height of a beam of formwork."""


RIDGE_STEP_M, RIDGE_M = 0.75, 0.11
"""Distance of the ridges of potatoes, of which two are a gauge and a head apart, and half their height."""

POTATOES_M = (8.5 * RIDGE_STEP_M, 24.5 * RIDGE_STEP_M)
"""Where the ridges begin and end across: in furrows."""


def places(world: World, *edges: np.ndarray) -> np.ndarray:
    """Places across a world, (m,), the edges among them."""
    even = np.arange(-world.half_width_m, world.half_width_m + ACROSS_STEP_M, ACROSS_STEP_M)
    return np.unique(np.concatenate([even, *edges]))


def lay(world: World, across: np.ndarray, height: np.ndarray, kind: int, roughness_m: float) -> None:
    """Lay a rough surface through heights, (profiles, m) or (m,), at places across, (m,)."""
    world.add(across, height + roughness_m * world.rng.standard_normal((len(world.station), len(across))), kind)


def guard_beam(world: World, left_m: float, base_m: float | np.ndarray, front: int) -> None:
    """Set up a W-beam on posts; `front` is the side of its face, +1 for the left."""
    base = np.broadcast_to(base_m, len(world.station))
    shape = np.array(BEAM_M)
    world.add(left_m + front * shape[:, 0], base[:, None] + shape[:, 1], WALL)
    world.box(left_m - front * POST_M[0], base, POST_M[0], POST_M[1], WALL, world.every(POST_STEP_M, POST_M[0]))


def motorway(world: World) -> None:
    """Lay two carriageways with joints, ruts, markings, rumble strips, a concrete barrier and guard rails."""
    joints = np.add.outer(JOINTS_M, JOINT_M[0] * np.array([-0.5, -0.45, 0.45, 0.5])).ravel()
    across = places(world, joints)
    open_joint = np.abs(np.subtract.outer(across, JOINTS_M)).min(axis=1) < 0.46 * JOINT_M[0]
    middle, width, length, depth = RUMBLE_M
    milled = (np.abs(np.abs(across) - middle) < width / 2) & world.every(RUMBLE_STEP_M, length)[:, None]
    lay(world, across, _road(across) - JOINT_M[1] * open_joint - depth * milled, PAVEMENT, ASPHALT_M)
    for side in (1, -1):
        for place, width, dash in MARKINGS_M:
            _strip(world, side * place, width, MARKING_M[1], world.every(MARKING_M[0], dash))
        guard_beam(world, side * (ROAD_HALF_M + 0.3), float(_road(np.array(ROAD_HALF_M))), -side)
    for place in SEALS_M:
        _strip(world, place, *SEAL_M)
    barrier = np.array(BARRIER_M)
    world.add(barrier[:, 0], barrier[:, 1], WALL)


def _road(across: np.ndarray) -> np.ndarray:
    """Heights of a motorway and its verges at places across, without what is narrow."""
    out = np.abs(across)
    ruts = RUT_M * np.exp(-0.5 * ((out[..., None] - RUTS_M) / RUT_WIDTH_M) ** 2).sum(axis=-1)
    return -CROSSFALL * np.minimum(out, ROAD_HALF_M) - ruts - VERGE_FALL * np.maximum(out - ROAD_HALF_M - 0.5, 0)


def _strip(world: World, left_m: float, width_m: float, thick_m: float, where: np.ndarray | None = None) -> None:
    """Lay a thin strip on a motorway."""
    across = left_m + width_m * np.array([-0.5, -0.49, 0.49, 0.5])
    world.add(across, _road(across) + thick_m * np.array([0, 1, 1, 0]), PAVEMENT, where)


def kerbed_car_park(world: World) -> None:
    """Lay a car park: islands between kerbs, a footpath between edging stones, wheel stops, a gutter, cars."""
    across = places(world)
    gutter = 0.03 * np.exp(-0.5 * (across / 0.12) ** 2)
    lay(world, across, 0.015 * np.abs(across) - gutter, PAVEMENT, ASPHALT_M)
    for left, width in ((-11.0, 2.0), (11.0, 1.55)):
        base = 0.015 * abs(left)
        for side in (1, -1):
            world.box(left + side * (width / 2 - KERB_M / 2), base, KERB_M, KERB_M, WALL, world.every(20.0, 17.0))
        world.add(left + (width / 2 - KERB_M) * np.array([-1, 1]), base + 0.08 * np.ones(2), GROUND)
    for row in (-8.0, 8.0):
        for start in np.arange(1.0, world.station[-1], 2.5):
            world.box(row, 0.015 * abs(row), 0.15, 0.10, WALL, world.between(start + 0.35, start + 2.15))
            if world.rng.random_sample() < 0.4:
                there = world.between(start + 0.35, start + 2.1)
                world.box(0.66 * row, 0.35, 4.3, 0.6, TRAIN, there)
                world.box(0.66 * row, 0.95, 2.2, 0.5, TRAIN, there)


def building_site(world: World) -> None:
    """Lay out a building site: rough soil with ruts, containers, beams and pipes in stacks, trenches, heaps."""
    rng, across = world.rng, places(world)
    rolling = 0.15 * np.sin(0.5 * across + 0.2 * world.station[:, None]) + 0.1 * np.sin(0.31 * world.station)[:, None]
    wander = 0.6 * np.sin(world.station / 9)[:, None]
    for rut in (-0.75, 0.75):
        rolling -= 0.10 * np.exp(-0.5 * ((across - 3.0 - wander - rut) / 0.14) ** 2)
    trench = np.clip((0.45 - np.abs(across + 6.0)) / 0.1, 0, 1) * world.between(10.0, 60.0)[:, None]
    heap = 1.8 * np.exp(-0.5 * (((across - 12.0) / 1.6) ** 2 + ((world.station[:, None] - 30.0) / 4.0) ** 2))
    soil = rolling - 1.1 * trench + heap
    lay(world, across, soil, GROUND, SOIL_M)

    def stand(left: float, width: float, height: float, start: float, length: float) -> None:
        base = soil[:, np.searchsorted(across, left)]
        world.box(left, base, width, height, WALL, world.between(start, start + length))

    for left, start, storeys in ((-12.0, 4.0, 2), (-12.0, 10.5, 1), (-9.4, 4.0, 1), (9.0, 50.0, 2), (11.6, 50.0, 1)):
        width, height, length = CONTAINER_M
        stand(left, width, storeys * height, start, length)
    for _ in range(25):
        left, start, length = rng.uniform(-16, 16), rng.uniform(0, world.station[-1] - 4), rng.uniform(1.5, 4.0)
        for number in range(rng.randint(1, 4)):
            stand(left + (BEAM_SIZE_M[0] + 0.01) * number, *BEAM_SIZE_M, start, length)


def farmland(world: World) -> None:
    """Lay fields: two farm tracks with ruts, one at the width of a gauge, ridges of potatoes, grass."""
    across = places(world)
    wander = 0.5 * np.sin(world.station / 17)[:, None]
    height = 0.2 * np.sin(0.12 * across + 0.05 * world.station[:, None])
    for middle, apart, depth in ((0.0, 1.5, 0.10), (-8.0, 1.8, 0.14)):
        for side in (1, -1):
            height -= depth * np.exp(-0.5 * ((across - middle - wander - side * apart / 2) / 0.16) ** 2)
    first_m, last_m = POTATOES_M
    height += RIDGE_M * (np.cos(2 * np.pi * across / RIDGE_STEP_M) + 1) * ((across > first_m) & (across < last_m))
    lay(world, across, height, GROUND, SOIL_M)
    plants(world, 1500, (-18.0, 5.5), (0.03, 0.25), (0.05, 0.25), 0.0)
    plants(world, 500, (6.0, 18.0), (0.1, 0.3), (0.1, 0.25), 0.1)


def barriers_along(world: World) -> None:
    """Lay a road with guard rails next to a railway, and a guard rail on the other side of it."""
    top = np.nan_to_num(world.ways[0].top_m)
    across = np.arange(7.6, world.half_width_m, ACROSS_STEP_M)
    rough = ASPHALT_M * world.rng.standard_normal((len(top), len(across)))
    world.add(across, top[:, None] - 0.7 + CROSSFALL * (across - 7.6) + rough, PAVEMENT)
    guard_beam(world, 7.9, top - 0.7, 1)
    guard_beam(world, -4.6, top - 0.9, 1)
    world.add(-6.0 + np.array(BARRIER_M)[:, 0], top[:, None] - 0.95 + np.array(BARRIER_M)[:, 1], WALL)
