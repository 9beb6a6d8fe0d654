"""Every raw scene by its name: railways as scanners see them, and places without rails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Union

import numpy as np

from ...core.standards import STANDARDS
from ..curves import Curve, Element, trace
from ..rasters.turnouts import FORMS, branch
from .plain import canted, rolling, spacing
from .raw import BALLAST, RawScene, Thing, scan_world
from .raw_photogrammetry import Photogrammetry
from .raw_places import barriers_along, building_site, farmland, kerbed_car_park, motorway
from .raw_scanner import RawScanner
from .raw_things import (
    car_park,
    fence,
    guard_rail,
    hills,
    masts,
    plants,
    platform,
    street,
    third_rail,
    train,
    trees,
    trough,
    tunnel,
    viaduct,
    wall,
)
from .raw_world import Bedding, World, ground, pavement, running_rails
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]
TRAIN = RawScanner()
CAR = RawScanner(profile_step_m=0.06, ray_step_rad=0.003, left_m=0.0, height_m=2.4, noise_m=0.004)
DRONE = Photogrammetry()
BLUNT = Photogrammetry(blur_m=0.065, blur_varies=0.35, widening_m=0.025, wave_m=0.012, noise_m=0.009, stray_share=0.01)
"""Images of a drone, and less sharp ones."""

Scanning = Union[RawScanner, Photogrammetry]


def from_air(per_m2: float, noise_m: float, left_m: float = 8.0, height_m: float = 80.0) -> RawScanner:
    """Scanner in the air, by points per square metre; it flies along the track, to the side."""
    step_m = 1 / np.sqrt(per_m2)
    half = np.arctan2(16.0 + abs(left_m), height_m)
    return RawScanner(
        step_m, step_m / height_m, left_m, height_m, noise_m, 4 * height_m, 0.05, wide=True, view_rad=(-half, half)
    )


def another_day(camera: Photogrammetry) -> Photogrammetry:
    """Survey of the same place with other errors, registered some centimetres aside."""
    return replace(camera, epoch=camera.epoch + 1, shift_m=(0.03, -0.02, 0.025))


def line(length_m: float, curvature: float, heading: float) -> Curve:
    """Lay a plan of one curvature."""
    return trace([Element(length_m, curvature, curvature)], (3.0, 5.0), heading)


def parallel(curve: Curve, lefts_m: tuple[float, ...], cant_m: float = 0.0, standard=STANDARD) -> list[Track]:
    """Lay tracks beside each other."""
    cant = canted(curve, cant_m) if cant_m else 0.0
    return [Track(curve, spacing(standard), rolling(curve), cant, left) for left in lefts_m]


def thing(make: Callable[..., None], *args: object) -> Thing:
    """Hand arguments to something that is added to a world."""
    return lambda world: make(world, *args)


def double_track(
    seed: int,
    scanner: Scanning = TRAIN,
    second: Scanning | None = None,
    name: str = "double",
    curvature: float = 1 / 700,
    cant_m: float = 0.09,
) -> RawScene:
    """Double track in a curve with cant, masts and wires, a trough, plants beside the bed."""
    curve = line(60.0, curvature, 0.35)
    things: list[Thing] = [
        ground,
        running_rails,
        masts_at(-3.4),
        thing(trough, 0, 2.1, 0.0, 60.0),
        thing(plants, 60, (-9.0, -4.5)),
    ]
    scanners = [scanner] if second is None else [scanner, second]
    return scan_world(name, parallel(curve, (0.0, 4.2), cant_m), STANDARD, scanners, things, seed)


def masts_at(left_m: float) -> Thing:
    """Set masts at a distance from the reference line."""
    return thing(masts, left_m)


def station(seed: int, scanner: Scanning = TRAIN) -> RawScene:
    """Three tracks, platforms on both sides, and a train parked on the far track."""
    curve = line(70.0, 0.0, 1.2)
    things: list[Thing] = [
        ground,
        running_rails,
        thing(platform, 0, -1, 5.0, 65.0),
        thing(platform, 2, 1, 10.0, 60.0, 0.76),
        thing(train, 2, 22.0, 70.0),
        masts_at(6.6),
    ]
    return scan_world("station", parallel(curve, (0.0, 4.3, 8.8)), STANDARD, [scanner], things, seed)


def turnout(seed: int, form: str = "300-1:9", scanner: Scanning = TRAIN) -> RawScene:
    """Turnout with its check rails, and a second track."""
    shape = next(candidate for candidate in FORMS if candidate.name == form)
    main = trace([Element(40.0 + shape.arc_m)], (3.0, 5.0), heading=-0.7)
    side = branch(main, 15.0, shape, 1, 25.0)
    tracks = [Track(curve, spacing(STANDARD)) for curve in (main, side)]
    frog_m = 15.0 + np.sqrt(2 * shape.radius_m * spacing(STANDARD))
    things: list[Thing] = [ground, running_rails, thing(guard_rail, 0, -1, frog_m - 2.0, frog_m + 1.6)]
    return scan_world(f"turnout {form}", tracks, STANDARD, [scanner], things, seed)


def yard(seed: int) -> RawScene:
    """Yard filled with ballast to 9 cm below the tops, overgrown."""
    curve = line(60.0, 1 / 400, 2.6)
    things: list[Thing] = [
        ground,
        running_rails,
        thing(plants, 500, (-2.5, 11.0), (0.03, 0.35), (0.04, 0.2)),
        thing(fence, -4.5, -0.9, 0.0, 60.0),
    ]
    bedding = Bedding(fill_m=-0.09, terrain_m=0.25)
    return scan_world("yard", parallel(curve, (0.0, 4.5, 9.0)), STANDARD, [TRAIN], things, seed, bedding)


def narrow(seed: int) -> RawScene:
    """Metre gauge on 49E1 in a curve of 90 m with 60 mm cant."""
    standard = STANDARDS["EN_49E1_1000"]
    curve = line(50.0, -1 / 90, 0.2)
    things: list[Thing] = [
        ground,
        running_rails,
        thing(plants, 60, (-6.0, -3.0)),
        thing(wall, 3.2, -0.9, 1.8, 0.0, 50.0),
    ]
    return scan_world("narrow", parallel(curve, (0.0,), 0.06, standard), standard, [TRAIN], things, seed)


def thin_ballast(seed: int) -> RawScene:
    """Metre gauge in a curve of 90 m, on sleepers that stand 7 cm out of the ballast."""
    standard = STANDARDS["EN_49E1_1000"]
    tracks = parallel(line(60.0, -1 / 90, 0.2), (0.0,), 0.06, standard)
    things: list[Thing] = [ground, running_rails, thing(plants, 60, (-6.0, -3.0))]
    return scan_world("thin ballast", tracks, standard, [TRAIN], things, seed, Bedding(fill_m=0.07))


def metro(seed: int) -> RawScene:
    """Tunnel with slab track, a third rail and a guard rail along a curve of 150 m."""
    curve = line(50.0, 1 / 150, 0.9)
    things: list[Thing] = [
        ground,
        running_rails,
        thing(third_rail, 0, 1, 3.0, 50.0),
        thing(guard_rail, 0, -1, 0.0, 50.0),
        tunnel,
    ]
    return scan_world("metro", parallel(curve, (0.0,), 0.08), STANDARD, [TRAIN], things, seed, Bedding(slab=True))


def level_crossing(seed: int) -> RawScene:
    """Double track with a level crossing of 9 m."""
    curve = line(50.0, 0.0, 0.5)

    def crossing(world: World) -> None:
        road = world.between(20.0, 29.0)
        ground(world, where=~road)
        running_rails(world, ~road)
        pavement(world, road, (0.065, 0.06), 0.015)

    return scan_world("crossing", parallel(curve, (0.0, 4.0)), STANDARD, [TRAIN], [crossing], seed)


def tram(seed: int) -> RawScene:
    """Two tram tracks with grooved rails in a street, in a curve of 40 m."""
    standard = STANDARDS["EN_49E1_1435"]
    curve = line(45.0, 1 / 40, 2.0)
    scanner = RawScanner(profile_step_m=0.035, ray_step_rad=0.0015, height_m=2.8, left_m=0.3)

    def street_track(world: World) -> None:
        pavement(world, np.ones(len(world.station), dtype=bool), (0.042, 0.045), half_width_m=9.0)

    tracks = [Track(curve, spacing(standard), left_m=left) for left in (0.0, 3.1)]
    return scan_world("tram", tracks, standard, [scanner], [street_track, masts_at(-4.0)], seed, half_width_m=9.0)


def bridge(seed: int, second: RawScanner | None = None) -> RawScene:
    """Viaduct with parapets, seen from the train and from a road below."""
    curve = line(60.0, -1 / 900, 1.9)
    below = RawScanner(left_m=8.0, height_m=-6.5, profile_step_m=0.07)
    things: list[Thing] = [thing(viaduct, 5.5, 2.0), ground_above, running_rails]
    return scan_world("viaduct", parallel(curve, (0.0, 4.0)), STANDARD, [TRAIN, second or below], things, seed)


def ground_above(world: World) -> None:
    """Lay the ballast of a bridge only, without terrain."""
    ground(world, terrain_m=np.full((len(world.station), 1), -50.0))


def far_track(seed: int) -> RawScene:
    """Three tracks, the outer one 10 m from the scanner, in long profiles."""
    curve = line(60.0, 1 / 1500, -0.4)
    scanner = RawScanner(profile_step_m=0.08, ray_step_rad=0.0024, noise_m=0.005, height_m=4.2, left_m=-0.3)
    things: list[Thing] = [
        ground,
        running_rails,
        thing(plants, 80, (1.5, 12.0), (0.03, 0.25)),
        thing(fence, -5.0, -0.9, 0.0, 60.0),
    ]
    return scan_world("far track", parallel(curve, (0.0, 4.6, 9.8)), STANDARD, [scanner], things, seed)


def dual_gauge(seed: int) -> RawScene:
    """Scan three rails for standard and metre gauge."""
    standard, narrow_one = STANDARDS["EN_49E1_1435"], STANDARDS["EN_49E1_1000"]
    curve = line(50.0, 1 / 400, 0.9)
    third = Track(curve, spacing(narrow_one), left_m=-(spacing(standard) - spacing(narrow_one)) / 2, sides=(1,))
    tracks = [Track(curve, spacing(standard)), third]
    things: list[Thing] = [ground, running_rails, masts_at(3.3)]
    return scan_world("dual gauge", tracks, standard, [TRAIN], things, seed, other_gauges_m=(narrow_one.gauge_m,))


def air(seed: int, per_m2: float, noise_m: float) -> RawScene:
    """Double track with a turnout's length of wires, plants and a train on a siding, from the air."""
    curve = line(60.0, 1 / 700, 0.35)
    things: list[Thing] = [
        ground,
        running_rails,
        masts_at(-3.4),
        thing(plants, 200, (-13.0, -4.0), (0.1, 1.5), (0.1, 0.5), -0.9),
        thing(trees, 4, (-12.0, -8.0)),
        thing(wall, 7.5, -0.9, 1.5, 0.0, 60.0),
    ]
    name = f"air {per_m2:g} {1000 * noise_m:g} mm"
    return scan_world(name, parallel(curve, (0.0, 4.2), 0.09), STANDARD, [from_air(per_m2, noise_m)], things, seed)


def empty_place(name: str, seed: int, scanner: Scanning, things: list[Thing]) -> RawScene:
    """Scan a place without rails."""
    return scan_world(name, [], STANDARD, [scanner], things, seed, BALLAST, line(45.0, 1 / 300, 0.6))


def wide_place(name: str, seed: int, scanner: Scanning, lay: Thing) -> RawScene:
    """Scan a third of a hectare without rails."""
    return scan_world(name, [], STANDARD, [scanner], [lay], seed, BALLAST, line(80.0, 1 / 600, 0.6), half_width_m=20.0)


def barriers(seed: int, scanner: Scanning) -> RawScene:
    """Scan double track between guard rails, next to a road."""
    curve = line(60.0, 1 / 900, 0.35)
    things: list[Thing] = [ground, running_rails, masts_at(-3.4), barriers_along]
    return scan_world("barriers", parallel(curve, (0.0, 4.2), 0.05), STANDARD, [scanner], things, seed)


def forest(seed: int, scanner: Scanning) -> RawScene:
    """Scan a hilly forest with undergrowth."""

    def floor(world: World) -> None:
        ground(world, hills(world, 0.03, 0.8))

    undergrowth = thing(plants, 900, (-13.5, 13.5), (0.1, 0.8), (0.1, 0.5), -0.3)
    return empty_place("forest", seed, scanner, [floor, undergrowth, thing(trees, 25, (-13.0, 13.0))])


def quarry(seed: int, scanner: Scanning) -> RawScene:
    """Scan a quarry: benches of rubble."""

    def rubble(world: World) -> None:
        heights = hills(world, 0.06, 0.5)
        across = np.linspace(-world.half_width_m, world.half_width_m, heights.shape[1])
        ground(world, heights + 2.5 * np.floor(across / 4.0))

    return empty_place("quarry", seed, scanner, [rubble])


MOBILE: dict[str, Callable[[int], RawScene]] = {
    "double": double_track,
    "two passes": lambda seed: double_track(
        seed, TRAIN, RawScanner(left_m=3.9, profile_step_m=0.08, shift_m=(0.006, 0.004)), "two passes"
    ),
    "fast": lambda seed: double_track(seed, RawScanner(profile_step_m=0.1, noise_m=0.005), None, "fast"),
    "station": station,
    "turnout 1:9": turnout,
    "turnout 1:18.5": partial(turnout, form="1200-1:18.5"),
    "yard": yard,
    "narrow": narrow,
    "thin ballast": thin_ballast,
    "metro": metro,
    "viaduct": bridge,
    "far track": far_track,
    "dual gauge": dual_gauge,
}
"""Ballasted and slab track seen from trains."""

FLUSH: dict[str, Callable[[int], RawScene]] = {"crossing": level_crossing, "tram": tram}
"""Rails in pavements."""

AIR: dict[str, Callable[[int], RawScene]] = {
    "air 300": partial(air, per_m2=300, noise_m=0.010),
    "air 150": partial(air, per_m2=150, noise_m=0.012),
    "air 80": partial(air, per_m2=80, noise_m=0.012),
    "air 150 noisy": partial(air, per_m2=150, noise_m=0.025),
}
"""From the air: points per square metre; the noise is in the scene's name."""

SURVEYED: dict[str, Callable[..., RawScene]] = {
    "straight": partial(double_track, name="straight", curvature=0.0, cant_m=0.0),
    "curve": partial(double_track, name="curve", curvature=1 / 450, cant_m=0.13),
    "turnout": turnout,
    "station": station,
}
"""Places that drones survey; each takes a seed and the scanner."""

PHOTO: dict[str, Callable[[int], RawScene]] = {
    **{f"photo {name}": partial(make, scanner=DRONE) for name, make in SURVEYED.items()},
    "photo curve again": partial(SURVEYED["curve"], scanner=another_day(DRONE)),
    "photo curve blunt": partial(SURVEYED["curve"], scanner=BLUNT),
}
"""Surveys by images; the same curve twice, by two surveys."""

NEGATIVE: dict[str, Callable[[int], RawScene]] = {
    "forest": partial(forest, scanner=CAR),
    "forest from the air": partial(forest, scanner=from_air(150, 0.02)),
    "street": lambda seed: empty_place(
        "street", seed, CAR, [street, thing(fence, -6.2, 0.1, 0, 45), thing(masts, 5.5)]
    ),
    "street from the air": lambda seed: empty_place("street", seed, from_air(200, 0.015), [street]),
    "car park": lambda seed: empty_place("car park", seed, CAR, [car_park]),
    "quarry": partial(quarry, scanner=CAR),
    "quarry from the air": partial(quarry, scanner=from_air(120, 0.015)),
    "motorway": lambda seed: wide_place("motorway", seed, replace(CAR, left_m=3.0), motorway),
    "kerbs": lambda seed: wide_place("kerbs", seed, CAR, kerbed_car_park),
    "building site": lambda seed: wide_place("building site", seed, CAR, building_site),
    "farmland": lambda seed: wide_place("farmland", seed, replace(CAR, left_m=-8.0), farmland),
    "farmland from the air": lambda seed: wide_place("farmland", seed, from_air(200, 0.015), farmland),
    "photo street": lambda seed: empty_place("street", seed, DRONE, [street]),
    "photo quarry": partial(quarry, scanner=DRONE),
    "photo motorway": lambda seed: wide_place("motorway", seed, DRONE, motorway),
    "photo motorway blunt": lambda seed: wide_place("motorway", seed, BLUNT, motorway),
    "photo kerbs": lambda seed: wide_place("kerbs", seed, DRONE, kerbed_car_park),
    "photo building site": lambda seed: wide_place("building site", seed, DRONE, building_site),
    "photo farmland": lambda seed: wide_place("farmland", seed, DRONE, farmland),
}
"""Places without rails."""

BESIDE: dict[str, Callable[[int], RawScene]] = {
    "barriers": partial(barriers, scanner=TRAIN),
    "photo barriers": partial(barriers, scanner=DRONE),
}
"""Rails with something like rails next to them."""

RAW_SCENES = {**MOBILE, **FLUSH, **AIR, **PHOTO, **NEGATIVE, **BESIDE}
