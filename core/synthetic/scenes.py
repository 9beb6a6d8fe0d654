"""Scenes: classified clouds of tracks with exact truth, for tests, benchmarks and the sample that ships.

Every scene is seeded. Random numbers come from `RandomState`, whose stream numpy promises never to change.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..points import LocalFrame, RailPoints
from ..standards import STANDARDS, RailStandard
from . import clutter
from .curves import Curve, Element, trace, transition_curve
from .scanner import Scanner, scan
from .tracks import Track

UNCLASSIFIED, GROUND, RAIL = 1, 2, 10
"""Classes of the LAS specification."""

Gaps = tuple[tuple[float, float], ...]
"""Stretches of one rail without points: start and end along it, metres."""

WHOLE_ENDS_M = 3.0
"""Rails have no gap within this distance of their ends: nothing could tell how far they go on."""


@dataclass(frozen=True)
class Scene:
    """A classified cloud and the truth about it.

    Attributes
    ----------
    name : str
    xyz : (n, 3) array
        All points, local metres.
    classification : (n,) uint8 array
    rails : tuple of (k, 3) array
        Tops of the heads on their own axes, local metres: left and right rail of the first track, of the second, ...
    centerlines : tuple of (k, 3) array
        Lines midway between the tops.
    standard : RailStandard
    frame : LocalFrame
        Where in the world the scene lies.
    """

    name: str
    xyz: np.ndarray
    classification: np.ndarray
    rails: tuple[np.ndarray, ...]
    centerlines: tuple[np.ndarray, ...]
    standard: RailStandard
    frame: LocalFrame

    def rail_points(self) -> RailPoints:
        """Give what `read_rail_points` would read of the scene's file."""
        return RailPoints(self.xyz[self.classification == RAIL], self.frame, RAIL)


@dataclass(frozen=True)
class Clutter:
    """How much of what is no rail a scene holds.

    Attributes
    ----------
    weeds_near, weeds_between : int
        Weeds classified as rail within 0.3 m of rails and within 2 m of tracks.
    stones : int
        Points of ballast and rail feet classified as rail.
    other_weeds : int
        Weeds that the classification told apart.
    ground_step_m : float or None
        Grid of the thinned ground; None leaves the ground out.
    """

    weeds_near: int = 0
    weeds_between: int = 0
    stones: int = 0
    other_weeds: int = 0
    ground_step_m: float | None = None


@dataclass(frozen=True)
class Plan:
    """All that makes a scene, before chance comes in.

    Attributes
    ----------
    tracks : sequence of Track
    standard : RailStandard
    scanner : Scanner
    ridden : int
        Track that the scanner rides on.
    gaps : dict of (track, side) to Gaps
        Where rails have no points; side is +1 for the left rail and -1 for the right one.
    clutter : Clutter
    frame : LocalFrame
    """

    tracks: Sequence[Track]
    standard: RailStandard
    scanner: Scanner = Scanner()
    ridden: int = 0
    gaps: dict[tuple[int, int], Gaps] = field(default_factory=dict)
    clutter: Clutter = Clutter()
    frame: LocalFrame = LocalFrame(np.zeros(3))


INDIA = LocalFrame(np.array([578200.0, 2494300.0, 500.0]), crs_wkt="EPSG:32643")
"""South of Indore, where a metre-gauge line ran until it was rebuilt."""

PAPER_TRACKS = ((0.0, 0.0), (3.96, 0.03), (7.92, -0.02))
"""Axis to the left of the ridden track's and height above it, metres: right, centre and left track."""


def build(name: str, plan: Plan, rng: np.random.RandomState) -> Scene:
    """Scan the rails of a plan and strew its clutter."""
    truths = [track.truth() for track in plan.tracks]
    rails = tuple(rail for left, right, _ in truths for rail in (left, right))
    centerlines = tuple(centerline for _, _, centerline in truths)
    clouds = _clouds(plan, rails, centerlines, rng)
    classification = np.repeat([code for code, _ in clouds], [len(points) for _, points in clouds])
    xyz = np.concatenate([points for _, points in clouds])
    return Scene(name, xyz, classification.astype(np.uint8), rails, centerlines, plan.standard, plan.frame)


def _clouds(
    plan: Plan, rails: Sequence[np.ndarray], centerlines: Sequence[np.ndarray], rng: np.random.RandomState
) -> list[tuple[int, np.ndarray]]:
    """Make the scene's points, by class."""
    path = plan.tracks[plan.ridden].centerline
    head_width_m = plan.standard.head_width_m
    clouds = []
    for number, track in enumerate(plan.tracks):
        for side in (1, -1):
            gaps = plan.gaps.get((number, side), ())
            points = scan(track.railhead(side), head_width_m, path, plan.scanner, rng, gaps)
            clouds.append((RAIL, points))
    amount = plan.clutter
    weed_height = (-clutter.HEAD_ABOVE_GROUND_M, 0.06)
    clouds.append((RAIL, clutter.weeds(rng, rails, amount.weeds_near, 0.3, weed_height)))
    clouds.append((RAIL, clutter.weeds(rng, centerlines, amount.weeds_between, 2.0, weed_height)))
    clouds.append((RAIL, clutter.stones(rng, rails, amount.stones, 0.2)))
    clouds.append((UNCLASSIFIED, clutter.weeds(rng, centerlines, amount.other_weeds, 4.0, (-0.15, 0.4))))
    if amount.ground_step_m is not None:
        clouds.append((GROUND, clutter.ground(rng, centerlines, 3.0, amount.ground_step_m)))
    return clouds


def _spacing(standard: RailStandard) -> float:
    return standard.gauge_m + standard.head_width_m


def _rolling(curve: Curve, gradient: float = 0.004, wave_m: float = 0.01, wave_length_m: float = 80.0) -> np.ndarray:
    """Heights of a line that climbs and waves a little, as settled track does."""
    return gradient * curve.chainage + wave_m * np.sin(2 * np.pi * curve.chainage / wave_length_m)


def _canted(curve: Curve, largest_m: float) -> np.ndarray:
    """Cant in proportion to curvature, the outer rail high."""
    sharpest = np.abs(curve.curvature).max()
    return -largest_m * curve.curvature / sharpest if sharpest > 0 else np.zeros(len(curve.xy))


def straight(seed: int = 1) -> Scene:
    """Plain straight track, 60E1, dense and clean, at an angle to the grid."""
    standard = STANDARDS["EN_60E1_1435"]
    curve = trace([Element(100.0)], heading=0.35)
    plan = Plan([Track(curve, _spacing(standard), _rolling(curve))], standard)
    return build("straight", plan, np.random.RandomState(seed))


def curved(seed: int = 2) -> Scene:
    """Plain curved track, 60E1: transitions into an arc of 600 m with 80 mm cant."""
    standard = STANDARDS["EN_60E1_1435"]
    curve = trace(transition_curve(20, 50, 60, 1 / 600), heading=1.1)
    plan = Plan([Track(curve, _spacing(standard), _rolling(curve), _canted(curve, 0.08))], standard)
    return build("curved", plan, np.random.RandomState(seed))


def paper_like(seed: int = 3) -> Scene:
    """Three metre-gauge tracks like the paper's example: 160 m, the left one far from the scanner and full of gaps."""
    standard = STANDARDS["IN_75R_1000"]
    rng = np.random.RandomState(seed)
    curve = trace([Element(40), Element(40, 0, 1 / 1500), Element(80, 1 / 1500, 1 / 1500)], heading=0.42)
    heights, cant = _rolling(curve), _canted(curve, 0.02)
    tracks = [Track(curve, _spacing(standard), heights + lift, cant, left) for left, lift in PAPER_TRACKS]
    plan = Plan(
        tracks,
        standard,
        Scanner(profile_step_m=0.03, ray_step_rad=0.00385, height_m=4.5, left_m=1.5, noise_m=0.005, half_range_m=40),
        gaps=_random_gaps(rng, 2, curve.length_m, 8) | _random_gaps(rng, 1, curve.length_m, 4),
        clutter=Clutter(weeds_near=30, weeds_between=40, stones=400, other_weeds=120, ground_step_m=0.25),
        frame=INDIA,
    )
    return build("paper_like", plan, rng)


def noisy(seed: int = 4) -> Scene:
    """Heavy noise: 8 mm in each direction, gaps up to 4 m, weeds and ballast everywhere along one 60E1 track."""
    standard = STANDARDS["EN_60E1_1435"]
    rng = np.random.RandomState(seed)
    curve = trace([Element(150, 1 / 900, 1 / 900)], heading=0.2)
    plan = Plan(
        [Track(curve, _spacing(standard), _rolling(curve), _canted(curve, 0.05))],
        standard,
        Scanner(profile_step_m=0.06, ray_step_rad=0.0022, noise_m=0.008, face_share=0.6),
        gaps=_random_gaps(rng, 0, curve.length_m, 12, longest_m=4.0),
        clutter=Clutter(weeds_near=50, weeds_between=80, stones=1000),
    )
    return build("noisy", plan, rng)


def _random_gaps(
    rng: np.random.RandomState, track: int, length_m: float, count: int, longest_m: float = 3.0
) -> dict[tuple[int, int], Gaps]:
    """Draw stretches without points for either rail of a track: one somewhere in each of `count` equal parts."""
    gaps = {}
    part_m = (length_m - 2 * WHOLE_ENDS_M) / count
    for side in (1, -1):
        gap_m = rng.uniform(0.3, min(longest_m, part_m), count)
        starts = WHOLE_ENDS_M + part_m * np.arange(count) + rng.random_sample(count) * (part_m - gap_m)
        gaps[track, side] = tuple(zip(starts, starts + gap_m))
    return gaps


SCENES: dict[str, Callable[[], Scene]] = {
    "straight": straight,
    "curved": curved,
    "paper_like": paper_like,
    "noisy": noisy,
}
"""Every scene by its name."""
