"""Beds, ground, pavements and everything else on and beside the tracks, drawn at random where there is room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..scenes import raw_things as things
from ..scenes.raw import Thing
from ..scenes.raw_world import (
    FASTENING,
    MAST,
    RAIL_HEIGHT_M,
    THIRD,
    TRAIN,
    WALL,
    Bedding,
    Way,
    World,
    ground,
    pavement,
    rail,
    rail_place,
    ways_of,
)
from .draws import chosen, even_in_log, maybe, one_of, stream
from .rails import cut_all, lay
from .railway import Railway
from .surveys import FROM_ABOVE, TRIPOD

BALLAST, SLAB, STREET = "ballast", "slab", "street"
BEDS = {
    "main line": {BALLAST: 92, SLAB: 8},
    "yard": {BALLAST: 100},
    "narrow gauge": {BALLAST: 100},
    "tram": {BALLAST: 35, SLAB: 15, STREET: 50},
    "metro": {BALLAST: 45, SLAB: 55},
}

FLAT, BANK, CUTTING, SIDE_SLOPE, TUNNEL, BRIDGE = "flat", "bank", "cutting", "side slope", "tunnel", "bridge"
LANDS = {
    "main line": {FLAT: 30, BANK: 25, CUTTING: 20, SIDE_SLOPE: 15, TUNNEL: 4, BRIDGE: 6},
    "yard": {FLAT: 80, BANK: 10, SIDE_SLOPE: 10},
    "narrow gauge": {FLAT: 30, BANK: 20, CUTTING: 20, SIDE_SLOPE: 25, TUNNEL: 2, BRIDGE: 3},
    "tram": {FLAT: 95, BRIDGE: 5},
    "metro": {FLAT: 30, BANK: 10, CUTTING: 10, TUNNEL: 50},
}

CLEAR_M = {"trough": 1.75, "low": 1.45, "high": 2.3}
"""Least distance from the axis of any track of what stands out of the ballast little, lies there, and stands high."""

WAGON_CLEAR_M = 3.0
"""Least distance of a track with wagons from others, and from the scanner."""

SECTION_M = 0.5
"""Distance of the places along the line at which room is looked for."""

LEAST_M = 6.0
"""Shortest section in which something is built."""


@dataclass(frozen=True)
class Surroundings:
    """What the tracks lie in: everything that a scanner may see, rails included, and the names of what was built.

    `rise` is the height of the ground above the tops of the rails, by the place to the left of the reference line;
    `paved_m`, the section along it in which rails are in a pavement, if there is one.
    """

    bed: str
    land: str
    bedding: Bedding
    whole: Thing
    names: tuple[str, ...]
    half_width_m: float
    rise: Callable[[float], float]
    paved_m: tuple[float, float] | None = None


def draw_surroundings(seed: int, railway: Railway, survey: str) -> Surroundings:
    """Draw what the tracks of a world lie in: no tunnel and no rails level with ballast seen from above."""
    rng = stream(seed, "surroundings")
    bed = chosen(rng, BEDS[railway.family])
    if bed == STREET and not railway.plain:
        bed = BALLAST
    land = chosen(rng, LANDS[railway.family])
    if (land in (TUNNEL, BRIDGE) and not railway.plain) or (land == TUNNEL and survey in FROM_ABOVE) or bed == STREET:
        land = FLAT
    bedding = _bedding(rng, railway, bed, survey)
    half_width_m = _half_width(rng, railway)
    built = _Built(rng, railway, bedding, half_width_m)
    crossing = _crossing(rng, railway, bed, land)
    terrain = Terrain.drawn(rng, railway, land)
    base = _base(rng, railway, bed, terrain, crossing)
    _furnish(built, bed, land, crossing, survey)
    names = (*(["level crossing"] if crossing else []), *built.names)
    whole = _together(seed, railway, (*base, *built.things))
    paved_m = (0.0, railway.reference.length_m) if bed == STREET else crossing
    return Surroundings(bed, land, bedding, whole, names, half_width_m, terrain.rise, paved_m)


def _together(seed: int, railway: Railway, built: Sequence[Thing]) -> Thing:
    """Build several things: heads as worn as the railway's, stones and plants the same in every pass of a scanner."""

    def build(world: World) -> None:
        before = world.rng.get_state()
        world.rng.set_state(stream(seed, "things").get_state())
        world.crown = railway.crown
        for thing in built:
            thing(world)
        world.rng.set_state(before)

    return build


def _half_width(rng: np.random.RandomState, railway: Railway) -> float:
    """Draw how far the world reaches to either side."""
    widest = max(abs(left) for left in railway.lefts_m)
    branches = 0.0 if railway.plain else 3.0
    sharpest = float(np.abs(railway.reference.curvature).max())
    return float(min(widest + branches + rng.uniform(3.5, 8.0), 0.45 / max(sharpest, 1e-3) + 0.4 * widest))


def _bedding(rng: np.random.RandomState, railway: Railway, bed: str, survey: str) -> Bedding:
    """Draw the ballast, from 12 cm below the rails' feet to their heads, and the sleepers."""
    height_m = RAIL_HEIGHT_M * railway.standard.head_width_m / 0.072
    fill = chosen(rng, {"tidy": 60, "thin": 15, "full": 17, "buried": 8})
    fills = {"tidy": (0.0, 0.05), "thin": (0.05, 0.11), "full": (-0.10, 0.0), "buried": (-height_m + 0.01, -0.10)}
    if fill == "buried" and survey in FROM_ABOVE:  # 1 cm of a head, blurred, is less than the stones
        fill = "full"
    timber = maybe(rng, 0.35)
    return Bedding(
        fill_m=float(rng.uniform(*fills[fill])),
        roughness_m=float(rng.uniform(0.006, 0.018)),
        terrain_m=float(rng.uniform(0.3, 1.2)),
        terrain_roughness_m=float(even_in_log(rng, 0.01, 0.05)),
        slab=bed == SLAB,
        sleeper_step_m=float(rng.uniform(0.55, 0.75)),
        sleeper_width_m=float(rng.uniform(0.20, 0.26) if timber else rng.uniform(0.25, 0.32)),
        sleeper_length_m=float(railway.standard.gauge_m + rng.uniform(0.8, 1.2)),
        # Ballast heaped beside a track would bury the rails of a branch.
        heap_m=float(rng.uniform(-0.15, 0.15 if railway.plain else 0.0) if maybe(rng, 0.4) else 0.0),
    )


def _crossing(rng: np.random.RandomState, railway: Railway, bed: str, land: str) -> tuple[float, float] | None:
    """Draw the section of a level crossing."""
    worn = any(track.wear for track in railway.tracks)
    chance = {"main line": 0.10, "yard": 0.08, "narrow gauge": 0.15, "tram": 0.1}.get(railway.family, 0.0)
    if not railway.plain or worn or railway.other_gauges_m or bed == STREET or land in (TUNNEL, BRIDGE):
        chance = 0.0
    if not maybe(rng, chance):
        return None
    length_m = rng.uniform(3.5, 12.0)
    start_m = rng.uniform(8.0, railway.reference.length_m - length_m - 8.0)
    return float(start_m), float(start_m + length_m)


@dataclass(frozen=True)
class Terrain:
    """The ground beside the bed.

    Attributes
    ----------
    low_m, high_m : float
        Outermost tracks, to the left of the reference line.
    depth_m : float
        Below the tops of the rails.
    slope, tall_m : float
        Of banks and cuttings: rise for each metre, and height.
    reach_m : float
        From the axis of the outermost track to the edge of a slope.
    side : int
        +1 where the ground rises to the left.
    wave_m : float
        Length of waves along the line.
    """

    land: str
    low_m: float
    high_m: float
    depth_m: float
    slope: float
    tall_m: float
    reach_m: float
    side: int
    wave_m: float

    @classmethod
    def drawn(cls, rng: np.random.RandomState, railway: Railway, land: str) -> Terrain:
        """Draw the ground beside the tracks of a railway."""
        return cls(
            land,
            *railway.lefts_m,
            depth_m=rng.uniform(0.3, 1.2),
            slope=rng.uniform(0.4, 1.0),
            tall_m=rng.uniform(1.0, 4.0),
            reach_m=rng.uniform(2.8, 4.5),
            side=one_of(rng, (1, -1)),
            wave_m=rng.uniform(8.0, 30.0),
        )

    def beyond_m(self, across: np.ndarray) -> np.ndarray:
        """How far places across are beyond the edge of the slopes, (m,)."""
        return np.maximum(np.maximum(self.low_m - self.reach_m - across, across - self.high_m - self.reach_m), 0.0)

    def shape(self, across: np.ndarray) -> np.ndarray:
        """Heights above the tops of the rails at places across, (m,)."""
        rise = self.slope * self.beyond_m(across)
        if self.land == BANK:
            rise = -np.minimum(rise, self.tall_m)
        elif self.land == CUTTING:
            rise = np.minimum(rise, self.tall_m)
        elif self.land == SIDE_SLOPE:
            uphill = self.side * np.sign(across - (self.low_m + self.high_m) / 2)
            rise = np.clip(uphill * rise, -self.tall_m, self.tall_m)
        else:
            rise = np.full(len(across), {BRIDGE: -50.0, TUNNEL: -0.2}.get(self.land, 0.0))
        return rise - self.depth_m

    def rise(self, left_m: float) -> float:
        """Height above the tops of the rails at a place to the left of the reference line."""
        return float(self.shape(np.array([left_m]))[0])

    def heights(self, world: World) -> np.ndarray:
        """Heights of the ground of a world, (profiles, m)."""
        across, along, way = world.across_m, world.along_m, world.ways[0]
        top = np.interp(along, world.station + world.shear * np.nan_to_num(way.left_m), np.nan_to_num(way.top_m))
        wave = 0.08 * np.sin(2 * np.pi * along / self.wave_m) * (self.beyond_m(across) > 0)
        height = top + self.shape(across) + wave
        for way in world.ways:
            # Where branches enter a slope, it has been dug away.
            near = np.abs(across - way.left_m[:, None]) < 2.6
            with np.errstate(invalid="ignore"):
                height = np.where(near, np.minimum(height, way.top_m[:, None] - 0.45), height)
        return height


def _base(
    rng: np.random.RandomState, railway: Railway, bed: str, terrain: Terrain, crossing: tuple[float, float] | None
) -> list[Thing]:
    """Lay bed, ground, rails and pavement."""
    groove = rng.uniform(0.038, 0.075), rng.uniform(0.035, 0.065)
    gap_m, rough_m = float(one_of(rng, (0.0, 0.015))), float(rng.uniform(0.001, 0.004))
    lined, deck_m = rng.uniform(3.0, 4.0), rng.uniform(1.5, 3.0)
    depth_m = rng.uniform(4.0, 9.0)

    def paved(world: World, where: np.ndarray) -> None:
        # Profiles that are turned meet the rails of a track at different chainages.
        rails = [(one.left_m, one.top_m, one.side) for one in cut_all(world, railway.tracks)]
        pavement(world, where, groove, gap_m, roughness_m=rough_m, rails=rails)

    def laid(world: World) -> None:
        if bed == STREET:
            paved(world, np.ones(len(world.station), dtype=bool))
            return
        # On a street, rails are crowns between the stones: their feet are never seen.
        road = np.zeros(len(world.station), dtype=bool) if crossing is None else world.between(*crossing)
        ground(world, terrain.heights(world), ~road)
        lay(world, railway.tracks, ~road)
        if crossing is not None:
            paved(world, road)

    low, high = railway.lefts_m
    middle = (low + high) / 2
    if terrain.land == TUNNEL:
        return [laid, lambda world: things.tunnel(world, (high - low) / 2 + lined, middle)]
    if terrain.land == BRIDGE:
        return [laid, lambda world: things.viaduct(world, (high - low) / 2 + 1.7 + deck_m, middle, depth_m)]
    return [laid]


class _Built:
    """What is built beside and on the tracks, each in a section where there is room for it."""

    def __init__(self, rng: np.random.RandomState, railway: Railway, bedding: Bedding, half_width_m: float) -> None:
        self.rng, self.railway, self.bedding, self.half_width_m = rng, railway, bedding, half_width_m
        self.station = np.arange(0.0, railway.reference.length_m, SECTION_M)
        self.ways = ways_of(railway.reference, self.station, railway.tracks)
        self.low_m, self.high_m = railway.lefts_m
        self.length_m = float(railway.reference.length_m)
        self.things: list[Thing] = []
        self.names: list[str] = []

    def add(self, name: str, thing: Thing) -> None:
        """Build something."""
        self.names.append(name)
        self.things.append(thing)

    def section(self, left_m: float, clear_m: float, but: Way | None = None) -> tuple[float, float] | None:
        """Draw a section along the line in which no track is closer to a place beside it; None without any."""
        free = np.ones(len(self.station), dtype=bool)
        for way in self.ways:
            if way is not but:
                free &= ~(np.abs(way.left_m - left_m) < clear_m)
        borders = np.flatnonzero(np.diff(np.concatenate([[0], free.astype(int), [0]])))
        sections = [(a * SECTION_M, b * SECTION_M) for a, b in zip(borders[::2], borders[1::2])]
        longest = max(sections, key=lambda one: one[1] - one[0], default=(0.0, 0.0))
        if longest[1] - longest[0] < LEAST_M:
            return None
        if maybe(self.rng, 0.5):
            return longest
        start, end = np.sort(self.rng.uniform(longest[0], longest[1], 2))
        return (float(start), float(end)) if end - start > LEAST_M else longest

    def beside(self, nearest_m: float, furthest_m: float) -> float:
        """Draw a place to the left or to the right of the parallel tracks."""
        distance_m = self.rng.uniform(nearest_m, furthest_m)
        return float(self.high_m + distance_m if maybe(self.rng, 0.5) else self.low_m - distance_m)


def _furnish(built: _Built, bed: str, land: str, crossing: tuple[float, float] | None, survey: str) -> None:
    """Build what the place suggests, each with its own chance."""
    rng, family = built.rng, built.railway.family
    open_land = land not in (TUNNEL, BRIDGE)
    for name, (chance, build) in FURNITURE.items():
        wanted = maybe(rng, chance)
        if not wanted or (name in OPEN_ONLY and not open_land) or (name in UNPAVED_ONLY and bed == STREET):
            continue
        if name in PLAIN_ONLY and (not built.railway.plain or crossing is not None or built.railway.other_gauges_m):
            continue
        if (name == "platform" and family == "yard") or (name == "cars" and survey == TRIPOD):
            continue
        build(built, name)


def _masts(built: _Built, name: str) -> None:
    left = built.beside(2.4, 3.4)
    if built.section(left, CLEAR_M["high"]) == (0.0, built.station[-1] + SECTION_M):
        step, phase = built.rng.uniform(25.0, 60.0), built.rng.uniform(0.0, 20.0)
        built.add(name, lambda world: things.masts(world, left, step, phase))


def _trough(built: _Built, name: str) -> None:
    left = built.beside(1.85, 2.8)
    section = built.section(left, CLEAR_M["trough"])
    if section:
        built.add(name, lambda world: things.trough(world, 0, left, *section))


def _platform(built: _Built, name: str) -> None:
    """Build a platform at an outer track, where no branch is in its way."""
    rng, side = built.rng, one_of(built.rng, (1, -1))
    outer = built.high_m if side > 0 else built.low_m
    number = int(np.argmin([np.abs(np.nanmean(way.left_m) - outer) for way in built.ways]))
    way = built.ways[number]
    height = float(one_of(rng, (0.3, 0.38, 0.55, 0.76, 0.96)))
    section = built.section(outer + side * 2.6, 2.59, way)
    if section and np.all(np.abs(way.left_m - outer) < 0.01):
        built.add(name, lambda world: things.platform(world, number, side, *section, height))


def _wall(built: _Built, name: str) -> None:
    left, height = built.beside(2.6, 5.0), built.rng.uniform(0.4, 3.0)
    section = built.section(left, CLEAR_M["high"])
    if section:
        built.add(name, lambda world: things.wall(world, left, -0.9, height + 0.5, *section))


def _fence(built: _Built, name: str) -> None:
    left = built.beside(2.6, 6.0)
    section = built.section(left, CLEAR_M["high"])
    if section:
        built.add(name, lambda world: things.fence(world, left, -0.9, *section))


def _kerb(built: _Built, name: str) -> None:
    """Lay a kerb or the edge of a board, at any height near the rails' tops."""
    left, low = built.beside(1.75, 3.0), built.rng.uniform(-0.35, 0.0)
    width, height = built.rng.uniform(0.08, 0.20), built.rng.uniform(0.08, 0.25)
    section = built.section(left, CLEAR_M["low"])
    if section:
        built.add(
            name,
            lambda world: world.box(
                left, np.nan_to_num(world.ways[0].top_m) + low, width, height, WALL, world.between(*section)
            ),
        )


def _third_rail(built: _Built, name: str) -> None:
    number, side = built.rng.randint(len(built.ways)), one_of(built.rng, (1, -1))
    start, end = np.sort(built.rng.uniform(0.0, built.length_m, 2))
    built.add(name, lambda world: things.third_rail(world, number, side, start, end))


def _guard_rails(built: _Built, name: str) -> None:
    """Lay guard rails inside one rail or both, in a section."""
    number = built.rng.randint(len(built.ways))
    start, end = np.sort(built.rng.uniform(0.0, built.length_m, 2))
    sides = one_of(built.rng, ((1,), (-1,), (1, -1)))

    def guards(world: World) -> None:
        for side in sides:
            things.guard_rail(world, number, side, start, end)

    built.add(name, guards)


def _spare_rail(built: _Built, name: str) -> None:
    """Lay a spare rail in the four-foot, upright or on its side."""
    number, start = built.rng.randint(len(built.ways)), built.rng.uniform(0.0, built.length_m * 0.7)
    end = start + built.rng.uniform(10.0, 36.0)
    inward = built.rng.uniform(0.25, built.railway.standard.gauge_m / 2)
    low, lying = built.rng.uniform(-0.02, 0.01), maybe(built.rng, 0.4)

    def spare(world: World) -> None:
        left, top = rail_place(world.ways[number], 1, inward)
        drop = 0.09 * world.head_width_m / 0.072 if lying else 0.0
        rail(world, left, top - drop + low, world.between(start, end), (THIRD, THIRD), np.pi / 2 if lying else 0.0)

    built.add(name, spare)


def _train(built: _Built, name: str) -> None:
    """Park wagons on a track that the scanner does not ride, where no other track is too close."""
    start = built.rng.uniform(-5.0, built.length_m * 0.6)
    end = start + built.rng.randint(1, 4) * things.WAGON_M
    there = (built.station > start - 1.0) & (built.station < end + 1.0)
    free = [
        number
        for number, way in enumerate(built.ways)
        if all(
            not np.any(np.abs(other.left_m - way.left_m)[there] < WAGON_CLEAR_M)
            for other in built.ways
            if other is not way
        )
        and np.all(np.abs(way.left_m[there]) > WAGON_CLEAR_M)
    ]
    if free:
        number = one_of(built.rng, free)
        built.add(name, lambda world: things.train(world, number, start, end))


def _point_machine(built: _Built, name: str) -> None:
    """Set boxes beside the sleepers' ends: point machines, balises, boxes of cables."""
    places = [
        (built.rng.randint(len(built.ways)), one_of(built.rng, (1, -1)), built.rng.uniform(5.0, built.length_m - 5.0))
        for _ in range(built.rng.randint(1, 4))
    ]

    def machines(world: World) -> None:
        for number, side, at in places:
            way = world.ways[number]
            left = way.left_m + side * (way.spacing_m / 2 + 0.75)
            world.box(left, way.top_m - 0.22, 0.45, 0.30, FASTENING, world.between(at, at + 0.9))

    if all(_aside(built, number, side) for number, side, _ in places):
        built.add(name, machines)


def _aside(built: _Built, number: int, side: int) -> bool:
    """Return whether there is room beside a track over its whole length."""
    way = built.ways[number]
    left = way.left_m + side * (way.spacing_m / 2 + 0.75)
    others = [one for one in built.ways if one is not way]
    return all(not np.any(np.abs(one.left_m - left) < 1.2) for one in others)


def _signals(built: _Built, name: str) -> None:
    left = built.beside(2.3, 3.0)
    if built.section(left, 2.2) is not None:
        at = built.rng.uniform(5.0, built.length_m - 5.0)
        near = [np.interp(at, built.station, np.nan_to_num(way.left_m, nan=99.0)) for way in built.ways]
        if min(abs(one - left) for one in near) > 2.2:
            built.add(
                name,
                lambda world: world.box(
                    left, np.nan_to_num(world.ways[0].top_m) - 0.8, 0.2, 5.0, MAST, world.between(at, at + 0.2)
                ),
            )


def _weeds(built: _Built, name: str) -> None:
    """Let weeds grow in the tracks."""
    count = int(built.length_m * built.rng.uniform(0.5, 6.0))
    height = built.rng.uniform(0.08, 0.35)
    band = built.low_m - 2.5, built.high_m + 2.5
    built.add(name, lambda world: things.plants(world, count, band, (0.03, height), (0.04, 0.2)))


def _grass(built: _Built, name: str) -> None:
    """Let plants grow beside the tracks."""
    count, side = int(built.length_m * built.rng.uniform(1.0, 5.0)), one_of(built.rng, (1, -1))
    edge = built.high_m + 2.2 if side > 0 else built.low_m - 2.2
    far = side * built.half_width_m
    if side * (far - edge) > 1.0 and built.railway.plain:
        band = min(edge, far), max(edge, far)
        tall = built.rng.uniform(0.2, 1.2)
        built.add(name, lambda world: things.plants(world, count, band, (0.1, tall), (0.1, 0.5), -0.9))


def _parked(built: _Built, name: str) -> None:
    """Park cars beside the tracks."""
    left = built.beside(3.0, 4.0)
    section = built.section(left, 2.7)
    if section:

        def cars(world: World) -> None:
            top = np.nan_to_num(world.ways[0].top_m)
            there = world.between(*section) & world.every(6.5, 4.3)
            world.box(left, top - 0.2, 1.75, 1.4, TRAIN, there)

        built.add(name, cars)


FURNITURE: dict[str, tuple[float, Callable[[_Built, str], None]]] = {
    "masts": (0.45, _masts),
    "trough": (0.35, _trough),
    "platform": (0.14, _platform),
    "wall": (0.15, _wall),
    "fence": (0.18, _fence),
    "kerb": (0.18, _kerb),
    "third rail": (0.07, _third_rail),
    "guard rails": (0.07, _guard_rails),
    "spare rail": (0.06, _spare_rail),
    "train": (0.14, _train),
    "point machines": (0.15, _point_machine),
    "signal": (0.2, _signals),
    "weeds": (0.3, _weeds),
    "grass": (0.5, _grass),
    "cars": (0.06, _parked),
}
"""What may be built, its chance, and who builds it."""

OPEN_ONLY = ("masts", "wall", "fence", "grass", "cars", "trough")
UNPAVED_ONLY = ("third rail", "guard rails", "spare rail", "point machines", "weeds", "trough", "kerb")
PLAIN_ONLY = ("third rail", "guard rails", "spare rail")
"""What is not built in tunnels and on bridges, in streets, and at switches and crossings."""
