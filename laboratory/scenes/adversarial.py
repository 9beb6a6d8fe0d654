"""Scenes that mislead: what else is classified as rail next to tracks, wrong parameters, and long gaps.

Each scene is short, so that all of them can be run after a change. `benchmarks/adversarial.py` prints what comes out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...core.standards import STANDARDS
from ..curves import Element, trace, transition_curve
from . import strips, switches
from .plain import canted, rolling, spacing
from .scanner import Scanner
from .scene import RAIL, Gaps, Plan, Scene, build
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]

LID_FROM_RAIL_M = 1.475
"""Distance between the axis of a rail and the edge of the lids of a cable trough: 32 mm less than between two rails."""

LID_LENGTH_M, LID_ASKEW_M = 1.0, 0.008
"""Length of a lid, and standard deviation of its position across and in height."""

NEXT_TRACK_M = 4.5
"""Distance between the axes of two tracks."""

Extra = Callable[[np.random.RandomState, Track], np.ndarray]
"""Draws points that are classified as rail, given the track that they lie next to: (n, 3)."""


def strip(
    rng: np.random.RandomState,
    track: Track,
    left_m: float | np.ndarray,
    up_m: float | np.ndarray,
    width_m: float,
    points_per_m: float,
    noise_m: float = 0.004,
) -> np.ndarray:
    """Draw points, (n, 3), of a strip along a track, whose middle is `left_m` beside and `up_m` above the track's axis.

    `noise_m` is the standard deviation in each of x, y and z.
    """
    curve, axis = track.curve, track.centerline
    at = rng.randint(len(curve.xy), size=int(points_per_m * curve.length_m))
    across = np.broadcast_to(left_m, len(axis))[at] + width_m * rng.uniform(-0.5, 0.5, len(at))
    points = axis[at]
    points[:, :2] += across[:, None] * curve.left_normal[at]
    points[:, 2] += np.broadcast_to(up_m, len(axis))[at]
    return points + noise_m * rng.standard_normal(points.shape)


def lids(rng: np.random.RandomState, track: Track) -> np.ndarray:
    """Draw the edge of the lids of a cable trough to the right of a track, each lid a little askew."""
    number = (track.curve.chainage / LID_LENGTH_M).astype(int)
    across, up = LID_ASKEW_M * rng.standard_normal((2, number[-1] + 1))
    right_m = 0.5 * track.spacing_m + LID_FROM_RAIL_M
    return strip(rng, track, -right_m + across[number], -0.06 + up[number], 0.07, 150)


def ballast(rng: np.random.RandomState, track: Track) -> np.ndarray:
    """Draw a band of ballast to the left of a track, whose middle wanders about 2 m from the rail."""
    chainage = track.curve.chainage
    left_m = 0.5 * track.spacing_m + 1.75 + 0.25 * np.sin(chainage / 5.0 + rng.uniform(0, 6))
    return strip(rng, track, left_m, -0.12, 0.12, 200, noise_m=0.02)


def along(left_m: float, up_m: float, width_m: float, points_per_m: float = 150) -> Extra:
    """Draw a strip at a constant place; see `strip`."""
    return lambda rng, track: strip(rng, track, left_m, up_m, width_m, points_per_m)


def contact_wire(rng: np.random.RandomState, track: Track) -> np.ndarray:
    """Draw a contact wire 5.3 m above a track, which runs from side to side between masts 50 m apart."""
    zigzag = 0.3 * (np.abs((track.curve.chainage / 50.0) % 2 - 1) * 2 - 1)
    return strip(rng, track, zigzag, 5.3, 0.03, 120)


def rack(rng: np.random.RandomState, track: Track) -> np.ndarray:
    """Draw the two bars of a rack in the middle of a track, 50 mm above its rails."""
    return np.concatenate([strip(rng, track, left_m, 0.05, 0.03, 100) for left_m in (-0.05, 0.05)])


def beside(name: str, seed: int, extras: Sequence[Extra], length_m: float = 60.0, radius_m: float = 900.0) -> Scene:
    """Build a curve next to which other things, drawn by `extras`, are classified as rail."""
    rng = np.random.RandomState(seed)
    curve = trace([Element(length_m, 1 / radius_m, 1 / radius_m)], heading=0.3 + seed)
    track = Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.06))
    scene = build(name, Plan([track], STANDARD, Scanner(noise_m=0.004)), rng)
    return with_points(scene, [extra(rng, track) for extra in extras])


def with_points(scene: Scene, clouds: Sequence[np.ndarray]) -> Scene:
    """Add points that are classified as rail to a scene."""
    more = np.concatenate(clouds)
    classification = np.append(scene.classification, np.full(len(more), RAIL, dtype=np.uint8))
    return replace(scene, xyz=np.concatenate([scene.xyz, more]), classification=classification)


def widened(seed: int = 31) -> Scene:
    """Build a curve of 150 m radius whose gauge is widened by 20 mm, with the lids of a cable trough next to it."""
    rng = np.random.RandomState(seed)
    curve = trace(transition_curve(10, 15, 20, 1 / 150), heading=0.7)
    track = Track(curve, spacing(STANDARD) + 0.02, rolling(curve), canted(curve, 0.1))
    scene = build("widened", Plan([track], STANDARD, Scanner(noise_m=0.004)), rng)
    return with_points(scene, [lids(rng, track)])


def narrow_heads(seed: int = 32) -> Scene:
    """Build a track with heads of 62 mm whose standard states 72 mm."""
    true = replace(STANDARD, head_width_m=0.062)
    curve = trace([Element(50.0, 1 / 700, 1 / 700)], heading=0.5)
    scene = build(
        "narrow_heads",
        Plan([Track(curve, spacing(true), rolling(curve))], true, Scanner(noise_m=0.004)),
        np.random.RandomState(seed),
    )
    return replace(scene, standard=STANDARD)


def hole(seed: int = 33, hole_m: float = 80.0) -> Scene:
    """Build a track of 160 m in a curve of 600 m, of which the middle 80 m have no points."""
    curve = trace([Element(80 + hole_m, 1 / 600, 1 / 600)], heading=0.1)
    gaps: dict[tuple[int, int], Gaps] = {(0, side): ((40.0, 40.0 + hole_m),) for side in (1, -1)}
    plan = Plan([Track(curve, spacing(STANDARD), rolling(curve))], STANDARD, Scanner(noise_m=0.004), gaps=gaps)
    return build("hole", plan, np.random.RandomState(seed))


def gaps(seed: int = 34, gap_m: float = 4.5, every_m: float = 12.0) -> Scene:
    """Build a curve of 250 m with transitions of 25 m, and gaps of 4.5 m in both rails every 12 m."""
    curve = trace(transition_curve(10, 25, 20, 1 / 250), heading=0.9)
    starts = np.arange(6.0, curve.length_m - 9.0, every_m)
    missing = tuple((float(start), float(start + gap_m)) for start in starts)
    track = Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.08))
    plan = Plan([track], STANDARD, Scanner(noise_m=0.004), gaps={(0, side): missing for side in (1, -1)})
    return build("gaps", plan, np.random.RandomState(seed))


def thin_points(seed: int = 35, points_per_m: float = 10.0) -> Scene:
    """Build a track with 10 points per metre of rail and 15 m without points, in gaps of 3 m."""
    rng = np.random.RandomState(seed)
    curve = trace([Element(60.0, 1 / 800, 1 / 800)], heading=1.3)
    missing = {(0, 1): ((10.0, 13.0), (30.0, 33.0), (44.0, 47.0)), (0, -1): ((20.0, 23.0), (38.0, 41.0))}
    plan = Plan([Track(curve, spacing(STANDARD), rolling(curve))], STANDARD, Scanner(noise_m=0.004), gaps=missing)
    scene = build("thin_points", plan, rng)
    seen_m = 2 * curve.length_m - sum(end - start for own in missing.values() for start, end in own)
    kept = rng.random_sample(len(scene.xyz)) < points_per_m * seen_m / len(scene.xyz)
    return replace(scene, xyz=scene.xyz[kept], classification=scene.classification[kept])


def from_the_side(
    name: str,
    seed: int,
    angle_deg: float,
    face_share: float = 1.0,
    noise_m: float = 0.005,
    length_m: float = 60.0,
    top_share: float = 1.0,
) -> Scene:
    """Build a track that is scanned from the next one only, with the side faces of its rails in the class.

    The angle is that of the scanner above the horizontal; the shares are those of points on side faces and on the crown
    that are classified as rail.
    """
    rng = np.random.RandomState(seed)
    curve = trace([Element(length_m, 1 / 800, 1 / 800)], heading=0.2 * seed)
    track = Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.05))
    height_m = NEXT_TRACK_M * float(np.tan(np.radians(angle_deg)))
    scanner = Scanner(
        left_m=NEXT_TRACK_M * (-1) ** seed,
        height_m=height_m,
        noise_m=noise_m,
        face_share=face_share,
        half_range_m=25.0,
        top_share=top_share,
    )
    return build(name, Plan([track], STANDARD, scanner), rng)


def all_faces(seed: int = 39, noise_m: float = 0.005) -> Scene:
    """Build a track that is scanned from a train on it, with all points of the side faces in the class."""
    rng = np.random.RandomState(seed)
    curve = trace([Element(60.0, 1 / 800, 1 / 800)], heading=0.4)
    track = Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.05))
    return build("all_faces", Plan([track], STANDARD, Scanner(noise_m=noise_m, face_share=1.0)), rng)


def crossing(
    seed: int = 40,
    length_m: float = 15.0,
    inside_m: float = 0.066,
    depth_m: float = 0.035,
    noise_m: float = 0.004,
) -> Scene:
    """Build a road crossing where dirt in the flangeways is classified as rail, and the heads are not.

    The dirt is `inside_m` from the axes of the rails towards the middle of the track, and `depth_m` below their tops.
    """
    rng = np.random.RandomState(seed)
    curve = trace([Element(70.0, 1 / 1500, 1 / 1500)], heading=0.3 * seed)
    track = Track(curve, spacing(STANDARD), rolling(curve))
    start_m = 28.0
    missing: dict[tuple[int, int], Gaps] = {(0, side): ((start_m, start_m + length_m),) for side in (1, -1)}
    scene = build("crossing", Plan([track], STANDARD, Scanner(noise_m=noise_m), gaps=missing), rng)
    road = track.piece(start_m, start_m + length_m)
    across_m = 0.5 * track.spacing_m - inside_m
    return with_points(
        scene, [strip(rng, road, side * across_m, -depth_m, 0.045, 250, noise_m=0.005) for side in (1, -1)]
    )


def standing_train(
    name: str = "standing_train",
    seed: int = 41,
    head_share: float = 0.1,
    length_m: float = 62.0,
    noise_m: float = 0.004,
) -> Scene:
    """Build a track on which a train stands, whose wheels, bogies and frames are classified as rail.

    The scanner sees `head_share` of the points on the heads below the train, in places half a metre long.
    """
    rng = np.random.RandomState(seed)
    curve = trace([Element(110.0, 1 / 2000, 1 / 2000)], heading=0.25 * seed)
    track = Track(curve, spacing(STANDARD), rolling(curve))
    start_m = 24.0
    hidden: dict[tuple[int, int], Gaps] = {}
    for side in (1, -1):
        places = start_m + 0.5 * np.flatnonzero(rng.random_sample(int(2 * length_m)) >= head_share)
        hidden[0, side] = tuple((float(place), float(place) + 0.5) for place in places)
    scene = build(name, Plan([track], STANDARD, Scanner(noise_m=noise_m), gaps=hidden), rng)
    below = track.piece(start_m, start_m + length_m)
    wheels = np.abs((below.curve.chainage + 1.0) % 9.0 - 1.25) < 1.2
    up_m = np.where(wheels, 0.12, 0.28)
    clouds = []
    for side in (1, -1):
        middle_m = side * 0.5 * track.spacing_m
        clouds.append(strip(rng, below, middle_m, up_m, 0.08, 120))
        clouds.append(strip(rng, below, middle_m, up_m + 0.05, 0.1, 60, 0.04))
    return with_points(scene, clouds)


def grooved(seed: int = 42, road_m: float = 0.07, noise_m: float = 0.004) -> Scene:
    """Build grooved rails with a strip of the road, `road_m` wide, on their outer sides in the class."""
    rng = np.random.RandomState(seed)
    standard = replace(STANDARD, head_width_m=0.056)
    curve = trace([Element(60.0, 1 / 400, 1 / 400)], heading=0.2 * seed)
    track = Track(curve, spacing(standard), rolling(curve))
    scene = build("grooved", Plan([track], standard, Scanner(noise_m=noise_m, height_m=3.0)), rng)
    outside_m = 0.5 * (track.spacing_m + standard.head_width_m + road_m)
    return with_points(scene, [strip(rng, track, side * outside_m, 0.0, road_m, 250, noise_m) for side in (1, -1)])


ADVERSARIAL: dict[str, Callable[..., Scene]] = {
    "trough": partial(beside, "trough", seed=1, extras=[lids], length_m=80.0),
    "ballast": partial(beside, "ballast", seed=2, extras=[ballast]),
    "platform": partial(beside, "platform", seed=3, extras=[along(-1.65, 0.55, 0.08)]),
    "fence": partial(beside, "fence", seed=4, extras=[along(3.0, 1.2, 0.05)]),
    "contact_wire": partial(beside, "contact_wire", seed=5, extras=[contact_wire]),
    "conductor": partial(beside, "conductor", seed=6, extras=[along(1.16, 0.08, 0.07)]),
    "rack": partial(beside, "rack", seed=7, extras=[rack]),
    "widened": widened,
    "narrow_heads": narrow_heads,
    "hole": hole,
    "gaps": gaps,
    "thin_points": thin_points,
    "two_passes": strips.two_passes,
    "three_passes": strips.three_passes,
    "strips_meet": strips.meeting,
    "strips_overlap": strips.overlapping,
    "unmarked_passes": strips.unmarked,
    "double_slip": switches.double_slip,
    "three_way": switches.three_way,
    "three_way_apart": partial(switches.three_way, apart_m=1.5, name="three_way_apart"),
    "unmarked_meet": partial(strips.meeting, with_ids=False),
    "side_17": partial(from_the_side, "side_17", seed=36, angle_deg=17.0),
    "side_30": partial(from_the_side, "side_30", seed=37, angle_deg=30.0, face_share=0.5),
    "side_45": partial(from_the_side, "side_45", seed=38, angle_deg=45.0),
    "one_face": partial(from_the_side, "one_face", seed=44, angle_deg=20.0, noise_m=0.004, top_share=0.0),
    "all_faces": all_faces,
    "crossing": crossing,
    "standing_train": standing_train,
    "hidden_heads": partial(standing_train, "hidden_heads", seed=43, head_share=0.0),
    "grooved": grooved,
}
"""By name; every scene is seeded, and another `seed` changes the noise."""
