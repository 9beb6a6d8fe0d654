"""Cross-sections of a railway: beds, sleepers, rails with head, web and foot, and what stands around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from ...core.polyline import runs
from ..curves import Curve
from .raw_scanner import Segments
from .tracks import Track

KINDS = (
    *("ground", "sleeper", "fastening", "head", "foot", "guard", "third", "pavement"),
    *("platform", "wall", "fence", "mast", "wire", "plant", "train", "mixed"),
)
"""Kinds of points; mixed ones lie between two surfaces, see `raw_scanner.MIXED`."""

GROUND, SLEEPER, FASTENING, HEAD, FOOT, GUARD, THIRD, PAVEMENT = range(8)
PLATFORM, WALL, FENCE, MAST, WIRE, PLANT, TRAIN = range(8, 15)

RAIL_HEIGHT_M = 0.172
"""Height of a rail with a head of 72 mm (60E1); others are scaled by the width of their heads."""

# Right half of 60E1 (EN 13674-1), from the bottom's middle to the lower end of the head's face, in metres across and
# above the bottom
_FOOT_AND_WEB = np.array(
    [
        (0.0, 0.0),
        (0.075, 0.0),
        (0.075, 0.0115),
        (0.030, 0.024),
        (0.012, 0.036),
        (0.00825, 0.060),
        (0.00825, 0.105),
        (0.012, 0.1254),
        (0.03717, 0.1345),
    ]
)
_ARCS = ((0.013, 0.036, 5), (0.080, 0.02603, 2), (0.300, 0.01023, 1))
"""Arcs of the head from its face to its middle: radius, half the width at the lower end, and chords, which deviate from
them by 0.1 mm. The face below widens by 1 in 20."""


SLEEPER_STEP_M, SLEEPER_WIDTH_M, SLEEPER_LENGTH_M = 0.60, 0.26, 2.6
PAD_M = 0.010
"""Gap between the rail's bottom and the sleeper's top."""

SHOULDER_M, SLOPE = 0.45, 1 / 1.5
"""Ballast beyond the ends of the sleepers, and the fall of its edge."""

STONE_M, STONE_HEIGHT_M = 0.045, 0.013
"""Size of the stones and standard deviation of their tops."""

ACROSS_STEP_M = 0.025
"""Distance of the places across at which the ground is sampled."""


@dataclass(frozen=True)
class Bedding:
    """How the tracks lie.

    Attributes
    ----------
    fill_m : float
        Top of the ballast below the top of the sleepers; negative above it.
    roughness_m : float
        Standard deviation of the ballast's tops.
    terrain_m : float
        Ground beside the bed, below the top of the rails.
    slab : bool
        Whether the track lies on concrete, without ballast.
    heap_m : float
        What the ballast beyond the sleepers' ends is higher than that between them; negative where it has fallen off.
    """

    fill_m: float = 0.02
    roughness_m: float = STONE_HEIGHT_M
    terrain_m: float = 0.95
    terrain_roughness_m: float = 0.02
    slab: bool = False
    sleeper_step_m: float = SLEEPER_STEP_M
    sleeper_width_m: float = SLEEPER_WIDTH_M
    sleeper_length_m: float = SLEEPER_LENGTH_M
    heap_m: float = 0.0


@dataclass(frozen=True)
class Way:
    """A track in the profiles, (profiles,) arrays; NaN where a profile does not cross it.

    Place of the axis to the left of the reference line, height of the rails' tops, sine of the tilt of the plane of
    both rails to the left, and length in the profile of what is 1 m long across the track.
    """

    left_m: np.ndarray
    top_m: np.ndarray
    slope: np.ndarray
    secant: np.ndarray
    spacing_m: float


@dataclass
class World:
    """Cross-sections along a reference line, by chainage, to which things are added.

    `crown` is the height of the crown of the heads as a share of a new one: wear makes them flat. `shear` is how far a
    profile lies ahead of its station for each metre to the left.
    """

    reference: Curve
    station: np.ndarray
    ways: list[Way]
    head_width_m: float
    bedding: Bedding
    rng: np.random.RandomState
    half_width_m: float = 14.0
    crown: float = 1.0
    shear: float = 0.0
    _parts: list[Segments] = field(default_factory=list)

    def add(self, across: np.ndarray, height: np.ndarray, kind: int, where: np.ndarray | None = None) -> None:
        """Add polylines, (profiles, m) each, in the profiles `where`; NaN leaves a vertex out."""
        across, height = np.broadcast_arrays(np.asarray(across, float), np.asarray(height, float))
        across = np.broadcast_to(across, (len(self.station), across.shape[-1]))
        height = np.broadcast_to(height, across.shape)
        there = np.isfinite(across[:, :-1] + across[:, 1:] + height[:, :-1] + height[:, 1:])
        if where is not None:
            there &= where[:, None]
        profile, number = np.nonzero(there)
        start = np.column_stack([across[profile, number], height[profile, number]])
        end = np.column_stack([across[profile, number + 1], height[profile, number + 1]])
        self.add_segments(profile, start, end, kind)

    def add_segments(self, profile: np.ndarray, start: np.ndarray, end: np.ndarray, kind: int) -> None:
        """Add segments, (k,) profiles and (k, 2) ends."""
        self._parts.append(Segments(profile, start, end, np.full(len(profile), kind, dtype=np.uint8)))

    def segments(self) -> Segments:
        """All segments, by profile."""
        parts = [[getattr(part, name) for part in self._parts] for name in ("profile", "start", "end", "kind")]
        profile, start, end, kind = (np.concatenate(part) for part in parts)
        order = np.argsort(profile, kind="stable")
        return Segments(profile[order], start[order], end[order], kind[order])

    def between(self, start_m: float, end_m: float) -> np.ndarray:
        """Profiles in a section of the reference line, (profiles,) bool."""
        return (self.station >= start_m) & (self.station <= end_m)

    def every(self, step_m: float, length_m: float, phase_m: float = 0.0) -> np.ndarray:
        """Profiles that cut something repeated, (profiles,) bool."""
        return (self.station - phase_m) % step_m < length_m

    @property
    def across_m(self) -> np.ndarray:
        """Places across at which the ground is sampled, (m,)."""
        return np.arange(-self.half_width_m, self.half_width_m + ACROSS_STEP_M, ACROSS_STEP_M)

    @property
    def along_m(self) -> np.ndarray:
        """Chainages of the places at which the ground is sampled, (profiles, m)."""
        return self.station[:, None] + self.shear * self.across_m

    def box(
        self,
        left_m: np.ndarray | float,
        base_m: np.ndarray | float,
        width_m: float,
        height_m: float,
        kind: int,
        where: np.ndarray | None = None,
    ) -> None:
        """Add a box that stands on a base, given by its middle, in the profiles `where`."""
        left = np.broadcast_to(np.asarray(left_m, float), len(self.station))[:, None]
        base = np.broadcast_to(np.asarray(base_m, float), len(self.station))[:, None]
        half = width_m / 2
        self.add(
            left + np.array([-half, -half, half, half, -half]), base + np.array([0, 1, 1, 0, 0]) * height_m, kind, where
        )


def ways_of(reference: Curve, station: np.ndarray, tracks: Sequence[Track], shear: float = 0.0) -> list[Way]:
    """Cut tracks with the profiles of a reference line; see `World.shear`."""
    ways = []
    for track in tracks:
        axis = track.centerline
        cant = np.broadcast_to(track.cant_m, len(axis)) / track.spacing_m
        if track.curve is reference:
            at = reference.chainage
            left = np.full(len(axis), float(track.left_m))
            secant = np.ones(len(axis))
        else:
            sample, at, left = along_and_left(reference, axis[:, :2])
            secant = 1 / np.cos(track.curve.heading - reference.heading[sample])
        at = at - shear * left
        order = np.argsort(at)
        at, left, axis, cant, secant = at[order], left[order], axis[order], cant[order], secant[order]
        place, top, slope, secant = (
            np.interp(station, at, values, left=np.nan, right=np.nan) for values in (left, axis[:, 2], cant, secant)
        )
        ways.append(Way(place, top, slope, secant, track.spacing_m))
    return ways


def along_and_left(reference: Curve, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nearest sample of a reference line to each place, (n,), its chainage and its distance to the left."""
    sample = cKDTree(reference.xy).query(xy)[1]
    step = xy - reference.xy[sample]
    forward = np.column_stack([np.cos(reference.heading), np.sin(reference.heading)])[sample]
    left = np.sum(step * reference.left_normal[sample], axis=1)
    # Beside a curve, steps along the line are longer or shorter than at the same place on it.
    at = reference.chainage[sample] + np.sum(step * forward, axis=1) / (1 - left * reference.curvature[sample])
    return sample, at, left


def outline(head_width_m: float, crown: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Outline of a rail from the right end of its foot over the head to the left one, and which parts of it are head.

    Places, (m, 2), are metres across and above the top; for the crown, see `World`.
    """
    below = _FOOT_AND_WEB[1:] - np.array([0.0, RAIL_HEIGHT_M])
    right = np.concatenate([below, _crown() * np.array([1.0, crown])]) * (head_width_m / 0.072)
    whole = np.concatenate([right, right[-2::-1] * np.array([-1.0, 1.0])])
    number = np.arange(len(whole) - 1)
    first = len(below) - 1
    return whole, (number >= first) & (number < len(whole) - 1 - first)


def _crown() -> np.ndarray:
    """Right half of the top of a head of 72 mm, from the upper end of the face to the middle, (m, 2)."""
    at, chords, turn = np.zeros(2), [np.zeros((1, 2))], 0.0
    for radius, half, count in _ARCS[::-1]:
        end = np.arcsin(min(np.sin(turn) + (half - at[0]) / radius, 1.0))
        angle = np.linspace(turn, end, count + 1)[1:]
        chords.append(at + radius * np.column_stack([np.sin(angle) - np.sin(turn), np.cos(angle) - np.cos(turn)]))
        at, turn = chords[-1][-1], end
    return np.concatenate(chords)[::-1]


def rail(
    world: World,
    left_m: np.ndarray,
    top_m: np.ndarray,
    where: np.ndarray | None = None,
    kinds: tuple[int, int] = (HEAD, FOOT),
    lean: np.ndarray | float = 0.0,
) -> None:
    """Add a whole rail whose top lies at a place in each profile; `lean` turns it about its top, to the left."""
    shape, head = outline(world.head_width_m, world.crown)
    turn = np.broadcast_to(lean, len(world.station))[:, None]
    across = np.asarray(left_m)[:, None] + np.cos(turn) * shape[:, 0] - np.sin(turn) * shape[:, 1]
    height = np.asarray(top_m)[:, None] + np.sin(turn) * shape[:, 0] + np.cos(turn) * shape[:, 1]
    for kind, chosen in ((kinds[0], head), (kinds[1], ~head)):
        for first, last in runs(chosen):  # of segments: they have one more end
            world.add(across[:, first : last + 2], height[:, first : last + 2], kind, where)


def running_rails(world: World, hidden: np.ndarray | None = None) -> None:
    """Add the rails of all tracks with their fastenings; where heads overlap, rays hit the outline of both."""
    laid: list[np.ndarray] = []
    for way in world.ways:
        for side in (1, -1):
            left, top = rail_place(way, side)
            rail(world, left, top, hidden)
            fasten(world, left, top, laid, hidden)
            laid.append(left)


def fasten(
    world: World, left_m: np.ndarray, top_m: np.ndarray, laid: Sequence[np.ndarray], where: np.ndarray | None = None
) -> None:
    """Fasten a rail to its sleepers, except where the rails that were laid before leave no room."""
    if world.bedding.slab:
        return
    middle = world.every(world.bedding.sleeper_step_m, 0.12, (world.bedding.sleeper_width_m - 0.12) / 2)
    bottom = top_m - RAIL_HEIGHT_M * world.head_width_m / 0.072
    for across in (-1, 1):
        clear = np.min(
            [np.where(np.isnan(one), 9.0, np.abs(left_m + across * 0.075 - one)) for one in laid]
            or [np.full(len(left_m), 9.0)],
            axis=0,
        )
        world.box(
            np.where(clear > 0.09, left_m + across * 0.075, np.nan),
            bottom,
            0.07,
            0.065,
            FASTENING,
            middle if where is None else middle & where,
        )


def rail_place(way: Way, side: int, inward_m: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Place and height of a rail's top in each profile; `inward_m` moves it towards the axis."""
    from_axis = side * (way.spacing_m / 2 - inward_m)
    across = from_axis * np.sqrt(1 - way.slope**2) * way.secant
    return way.left_m + across, way.top_m + from_axis * way.slope


def ground(world: World, terrain_m: np.ndarray | None = None, where: np.ndarray | None = None) -> None:
    """Add ballast, sleepers and terrain."""
    across, bedding = world.across_m, world.bedding
    stones = _stones(world, across)
    height = np.full((len(world.station), len(across)), -np.inf)
    kind = np.full(height.shape, GROUND, dtype=np.uint8)
    reference = world.ways[0].top_m[:, None] if world.ways else np.zeros((len(world.station), 1))
    terrain = reference - bedding.terrain_m if terrain_m is None else terrain_m
    terrain = np.broadcast_to(terrain, height.shape) + bedding.terrain_roughness_m / STONE_HEIGHT_M * stones
    sleeper = world.along_m % bedding.sleeper_step_m < bedding.sleeper_width_m
    half_m = bedding.sleeper_length_m / 2
    below = RAIL_HEIGHT_M * world.head_width_m / 0.072 + PAD_M
    for way in world.ways:
        x = across - way.left_m[:, None]
        plane = way.top_m[:, None] + x * way.slope[:, None] - below
        beyond = np.maximum(np.abs(x) - half_m - SHOULDER_M, 0.0)
        bed = plane - bedding.fill_m - SLOPE * beyond + bedding.heap_m * (np.abs(x) > half_m)
        bed = bed + (0.0005 / STONE_HEIGHT_M if bedding.slab else bedding.roughness_m / STONE_HEIGHT_M) * stones
        bed = np.where(np.isnan(bed), -np.inf, bed)
        height = np.maximum(height, bed)
        if not bedding.slab:
            on = sleeper & (np.abs(x) < half_m) & (plane > height)
            height, kind = np.where(on, plane, height), np.where(on, np.uint8(SLEEPER), kind)
    kind = np.where(terrain > height, np.uint8(GROUND), kind)
    height = np.maximum(height, terrain)
    for one in (GROUND, SLEEPER):
        _add_where(world, across, height, kind[:, :-1] == one, one, where)


def pavement(
    world: World,
    where: np.ndarray,
    groove_m: tuple[float, float],
    gap_m: float = 0.0,
    half_width_m: float | None = None,
    roughness_m: float = 0.0015,
    lift_m: float = 0.0,
    rails: Sequence[tuple[np.ndarray, np.ndarray, int]] | None = None,
) -> None:
    """Pave profiles up to the top of the rails, with a groove, width and depth, inside each rail.

    `gap_m` is a gap at the outer side of the rails; without `half_width_m`, the whole section is paved. `rails` are the
    place to the left, height and side of each; without them, they are those of even tracks cut at right angles.
    """
    half, head = half_width_m or world.half_width_m, world.head_width_m / 2
    cuts = []
    for left, top, side in rails or [(*rail_place(way, side), side) for way in world.ways for side in (1, -1)]:
        inner = left - side * (head + groove_m[0])
        outer = left + side * (head + gap_m)
        cuts.append((np.minimum(inner, outer), np.maximum(inner, outer), left, top, side))
    count = len(world.station)
    order = np.argsort([np.nanmean(cut[2]) for cut in cuts])
    edge, level = np.full(count, -half), cuts[order[0]][3] + lift_m
    for number in [*order, None]:
        end = np.full(count, half) if number is None else cuts[number][0]
        before, level = level, level if number is None else cuts[number][3] + lift_m
        share = np.linspace(0, 1, 240)
        across = edge[:, None] + (end - edge)[:, None] * share
        rough = roughness_m * world.rng.standard_normal(across.shape)
        world.add(across, before[:, None] + (level - before)[:, None] * share + rough, PAVEMENT, where)
        if number is not None:
            low, high, left, top, side = cuts[number]
            inner, wall = left - side * (head + groove_m[0]), left - side * head
            world.add(
                np.stack([inner, inner, wall, wall], axis=1),
                np.stack([level, top - groove_m[1], top - groove_m[1], top - 0.014], axis=1),
                PAVEMENT,
                where,
            )
            crown = np.array([-1, -0.85, -0.5, 0, 0.5, 0.85, 1]) * head
            drop = np.array([-0.014, -0.004, -0.001, 0, -0.001, -0.004, -0.014])
            if gap_m == 0:
                # The pavement joins the outer edge of the head.
                drop = np.where(np.sign(crown) == side, np.where(np.abs(crown) > 0.9 * head, -0.004, drop), drop)
            world.add(left[:, None] + crown, top[:, None] + drop, HEAD, where)
            if gap_m > 0:
                outer, face = left + side * (head + gap_m), left + side * head
                world.add(
                    np.stack([outer, outer, face, face], axis=1),
                    np.stack([level, top - 0.02, top - 0.02, top - 0.014], axis=1),
                    PAVEMENT,
                    where,
                )
            edge = high


def _add_where(
    world: World, across: np.ndarray, height: np.ndarray, chosen: np.ndarray, kind: int, where: np.ndarray | None
) -> None:
    """Add the segments of polylines that are chosen, (profiles, m - 1)."""
    if where is not None:
        chosen = chosen & where[:, None]
    profile, number = np.nonzero(chosen)
    start = np.column_stack([across[number], height[profile, number]])
    end = np.column_stack([across[number + 1], height[profile, number + 1]])
    world.add_segments(profile, start, end, kind)


def _stones(world: World, across: np.ndarray) -> np.ndarray:
    """Heights of stones in all profiles, with the standard deviation `STONE_HEIGHT_M`, (profiles, m)."""
    rows = world.station / STONE_M
    columns = (across - across[0]) / STONE_M
    grid = STONE_HEIGHT_M * 1.3 * world.rng.standard_normal((int(rows.max()) + 2, int(columns.max()) + 2))
    row, down = rows.astype(int), (rows % 1)[:, None]
    lines = (1 - down) * grid[row] + down * grid[row + 1]
    column, right = columns.astype(int), columns % 1
    return (1 - right) * lines[:, column] + right * lines[:, column + 1]
