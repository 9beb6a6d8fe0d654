"""Scenes of rails that are not as designed: waves, dipped welds, worn or flat heads, another rail, and ridges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.standards import STANDARDS
from ..curves import Element, trace
from .adversarial import NEXT_TRACK_M
from .plain import canted, rolling, spacing
from .scanner import NEW, Profile, Scanner
from .scene import RAIL, Plan, Scene, build
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]

WAVES_ACROSS = ((0.0015, 8.0), (0.0005, 3.0))
WAVES_UP = ((0.0010, 6.0), (0.0004, 3.0))
"""Amplitude and length, metres, of the waves of rails in service."""

WELD_EVERY_M, WELD_DIP_M, WELD_HALF_M = 18.0, 0.0015, 0.5
"""Distance between welds, their dip, and the length on either side over which it falls to a third."""

CORRUGATION_M, CORRUGATION_LENGTH_M = 0.00015, 0.3
"""Amplitude and length of the corrugation next to welds, over the length of the dip."""

WORN = Profile(crown_radius_m=0.8, corner_radius_m=0.009)
"""A head worn flat, with the burr that wear leaves at its corners."""

FLAT = Profile(crown_radius_m=20.0, corner_radius_m=0.002)
"""A head without a crown, as profiles are that software draws."""

RIDGE_M, RIDGE_SPREAD_M, RIDGE_REACH_M, RIDGE_PER_M = 0.12, 0.05, 0.075, 400
"""A rail in the dense matching of photographs is a ridge: its height, spread, half width, and points per metre."""

RIDGE_NOISE_M, RIDGE_WANDER_M, RIDGE_WANDER_LENGTH_M = 0.004, 0.004, 6.0
"""Noise of its points, and standard deviation and length of the errors that neighbouring points share."""


def uneven(rng: np.random.RandomState, chainage: np.ndarray) -> np.ndarray:
    """Draw how far the top of one rail is to the left of its design and above it, (n, 2) metres, by chainage."""
    off = np.zeros((len(chainage), 2))
    for column, waves in enumerate((WAVES_ACROSS, WAVES_UP)):
        for amplitude_m, length_m in waves:
            off[:, column] += amplitude_m * np.sin(2 * np.pi * (chainage / length_m + rng.random_sample()))
    phase_m = rng.uniform(0.3, 0.7) * WELD_EVERY_M
    from_weld_m = np.abs((chainage - phase_m + 0.5 * WELD_EVERY_M) % WELD_EVERY_M - 0.5 * WELD_EVERY_M)
    near = np.exp(-from_weld_m / WELD_HALF_M)
    off[:, 1] += near * (CORRUGATION_M * np.sin(2 * np.pi * chainage / CORRUGATION_LENGTH_M) - WELD_DIP_M)
    return off


def plain_track(
    name: str,
    seed: int,
    scanner: Scanner,
    rough: bool = False,
    shape: Profile = NEW,
    true_head_m: float = STANDARD.head_width_m,
    kept: float = 1.0,
) -> Scene:
    """Build a track of 60 m in a curve of 800 m, said to be of 60E1.

    Rough rails have waves and welds; `true_head_m` is the true width of the heads, and `kept` the share of the points
    that the cloud has.
    """
    rng = np.random.RandomState(seed)
    true = replace(STANDARD, head_width_m=true_head_m)
    curve = trace([Element(60.0, 1 / 800, 1 / 800)], heading=0.2 * seed)
    wear = {side: uneven(rng, curve.chainage) for side in (1, -1)} if rough else {}
    track = Track(curve, spacing(true), rolling(curve), canted(curve, 0.05), wear=wear)
    scene = build(name, Plan([track], true, scanner, shape=shape), rng)
    chosen = rng.random_sample(len(scene.xyz)) < kept
    return replace(scene, standard=STANDARD, xyz=scene.xyz[chosen], classification=scene.classification[chosen])


def rough(seed: int) -> Scene:
    """Build rails with waves and dipped welds, scanned from a train on them."""
    return plain_track("rough", seed, Scanner(noise_m=0.004), rough=True)


def rough_side(seed: int) -> Scene:
    """Build rails with waves and dipped welds, scanned from the next track."""
    left_m = NEXT_TRACK_M * (-1) ** seed
    scanner = Scanner(left_m=left_m, height_m=2.6, noise_m=0.005, face_share=0.5, half_range_m=25.0)
    return plain_track("rough_side", seed, scanner, rough=True)


def rough_thin(seed: int) -> Scene:
    """Build rails with waves and dipped welds, with a tenth of the usual points."""
    return plain_track("rough_thin", seed, Scanner(noise_m=0.004), rough=True, kept=0.1)


def worn(seed: int) -> Scene:
    """Build rails with waves and worn heads."""
    return plain_track("worn", seed, Scanner(noise_m=0.004), rough=True, shape=WORN)


def flat(seed: int) -> Scene:
    """Build heads that are flat to their edges."""
    return plain_track("flat", seed, Scanner(noise_m=0.004), shape=FLAT)


def other_rail(seed: int) -> Scene:
    """Build rails 54E1, whose heads are 2 mm narrower than the stated ones."""
    return plain_track("other_rail", seed, Scanner(noise_m=0.004), true_head_m=0.070)


def ridge(seed: int) -> Scene:
    """Build rails as dense matching of photographs shows them: round ridges, whose errors neighbours share."""
    rng = np.random.RandomState(seed)
    curve = trace([Element(80.0, 1 / 800, 1 / 800)], heading=0.2 * seed)
    track = Track(curve, spacing(STANDARD), rolling(curve))
    scene = build("ridge", Plan([track], STANDARD), rng)
    xyz = np.concatenate([_ridge(rng, track, side) for side in (1, -1)])
    return replace(scene, xyz=xyz, classification=np.full(len(xyz), RAIL, dtype=np.uint8))


def _ridge(rng: np.random.RandomState, track: Track, side: int) -> np.ndarray:
    """Draw the points of one ridge, (n, 3)."""
    top, chainage = track.railhead(side).top, track.curve.chainage
    at = rng.randint(len(top), size=int(RIDGE_PER_M * track.curve.length_m))
    left_m = RIDGE_REACH_M * rng.uniform(-1, 1, len(at))
    up_m = RIDGE_M * (np.exp(-0.5 * (left_m / RIDGE_SPREAD_M) ** 2) - 1)
    wander_m = np.zeros((len(chainage), 2))
    for _ in range(4):
        frequency = 2 * np.pi / RIDGE_WANDER_LENGTH_M * rng.uniform(0.5, 1.5)
        phases = rng.uniform(0, 2 * np.pi, 2)
        wander_m += RIDGE_WANDER_M / np.sqrt(2) * np.sin(frequency * chainage[:, None] + phases)
    points = top[at] + RIDGE_NOISE_M * rng.standard_normal((len(at), 3))
    points[:, :2] += (left_m + wander_m[at, 0])[:, None] * track.curve.left_normal[at]
    points[:, 2] += up_m + wander_m[at, 1]
    return points
