"""Scanners and cameras drawn at random: on trains and cars, on tripods, and in the air."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Union

import numpy as np

from ..curves import Curve
from ..scenes.raw import RawScene
from ..scenes.raw_catalogue import from_air
from ..scenes.raw_photogrammetry import Photogrammetry
from ..scenes.raw_scanner import RawScanner
from .draws import chosen, even_in_log, maybe, one_of, stream
from .railway import Railway

MOBILE, TRIPOD, DRONE, IMAGES = "mobile", "tripod", "drone", "images"
KINDS = {MOBILE: 0.55, TRIPOD: 0.10, DRONE: 0.18, IMAGES: 0.17}
"""Shares of the kinds of surveys."""

FROM_ABOVE = (DRONE, IMAGES)

MAX_POINTS = 1_400_000
"""About the number of points above which a survey is made with wider steps."""

MAX_STEPS = 2.2e-4
"""Greatest product of the step between profiles, metres, and the step between rays, radians.

It gives 100 points per metre of a head 7 cm wide at 3 m, of all passes together. A scanner beside the tracks is further
away.
"""

DOWN_SHARE = 0.62
"""About the share of the rays of a full turn that hit something within the width of a world."""

PASSES = {1: 60, 2: 27, 3: 8, 4: 5}
"""Numbers of passes of a mobile scanner, and their shares."""

APART_M = 0.030
"""Largest distance of two passes."""

STAND_STEP_M, STANDS_M = 0.05, (20.0, 45.0)
"""Distance of the profiles from which the points of a tripod are taken, and distance of its places."""

AROUND_SHARE = 0.25
"""About the share of the rays of half a sphere that hit something within the width of a world."""

START_S, PASS_S, SPEED_M_S = 1000.0, 1200.0, 10.0
"""Time of the first pass, time between the beginnings of two passes, and speed."""

Scanning = Union[RawScanner, Photogrammetry]


@dataclass(frozen=True)
class Survey:
    """How a world is surveyed: one of `KINDS`, and a scanner for each pass or for each place of a tripod.

    Points may state their pass and their time.
    """

    kind: str
    scanners: tuple[Scanning, ...]
    has_ids: bool = False
    has_times: bool = True

    @property
    def from_above(self) -> bool:
        """Whether a drone made it."""
        return self.kind in FROM_ABOVE


def draw_kind(seed: int) -> str:
    """Draw the kind of the survey of a world."""
    return chosen(stream(seed, "kind of survey"), KINDS)


def draw_survey(seed: int, railway: Railway, half_width_m: float, rise: Callable[[float], float], wide: bool) -> Survey:
    """Draw the survey of a world.

    Scanners stand on the ground, whose height above the rails `rise` gives by the place to the left; with `wide`, there
    is room beside the tracks, as there is not in a tunnel.
    """
    kind, rng, length_m = draw_kind(seed), stream(seed, "survey"), railway.reference.length_m
    if kind == MOBILE:
        return _mobile(rng, railway, length_m, rise, wide)
    if kind == TRIPOD:
        return _tripods(rng, railway, length_m, rise, wide)
    if kind == DRONE:
        return _drone(rng, half_width_m, length_m)
    return Survey(IMAGES, (_camera(rng, 2 * half_width_m * length_m),), has_times=False)


def _mobile(
    rng: np.random.RandomState, railway: Railway, length_m: float, rise: Callable[[float], float], wide: bool
) -> Survey:
    """Draw one to four passes on the first track, or beside the tracks."""
    count = chosen(rng, PASSES)
    beside = maybe(rng, 0.12) and wide
    low, high = railway.lefts_m
    if beside:
        side = one_of(rng, (1, -1))
        left_m = (high if side > 0 else low) + side * rng.uniform(4.0, 7.0)
        height_m = max(rise(left_m), 0.0) + rng.uniform(1.8, 3.0)
    else:
        left_m, height_m = rng.uniform(-0.8, 0.8), rng.uniform(2.0, 4.8)
    profile_m, ray_rad = even_in_log(rng, 0.02, 0.12), even_in_log(rng, 0.0010, 0.0035)
    points = count * DOWN_SHARE * 2 * np.pi / ray_rad * length_m / profile_m
    coarser = max(np.sqrt(points / MAX_POINTS), 1.0)
    coarser = min(coarser, np.sqrt(count * (MAX_STEPS / 2 if beside else MAX_STEPS) / (profile_m * ray_rad)))
    first = RawScanner(
        profile_step_m=profile_m * coarser,
        ray_step_rad=ray_rad * coarser,
        left_m=left_m,
        height_m=height_m,
        noise_m=even_in_log(rng, 0.001, 0.007),
        half_range_m=rng.uniform(18.0, 60.0),
        footprint_m=rng.uniform(0.003, 0.010),
        swing=rng.uniform(0.0, 0.2) if maybe(rng, 0.7) else rng.uniform(0.2, 0.6),
        turned=0.0 if maybe(rng, 0.6) else float(np.tan(rng.uniform(-0.8, 0.8))),
    )
    apart = _apart(rng, count)
    scanners = [
        replace(
            first,
            left_m=first.left_m + (0.0 if number == 0 else rng.uniform(-0.4, 0.4)),
            profile_step_m=first.profile_step_m * rng.uniform(0.9, 1.2),
            turned=first.turned * one_of(rng, (1, -1)) if number else first.turned,
            shift_m=tuple(apart[number]),
        )
        for number in range(count)
    ]
    return Survey(MOBILE, tuple(scanners), has_ids=maybe(rng, 0.5), has_times=maybe(rng, 0.7))


def _apart(rng: np.random.RandomState, count: int, most_m: float = APART_M) -> np.ndarray:
    """Draw the errors of passes, to the left and up, (count, 2) metres; their mean is 0, as the truth has no error."""
    if count == 1:
        return np.zeros((1, 2))
    size_m = even_in_log(rng, 0.001, most_m) if maybe(rng, 0.7) else 0.0
    error = rng.uniform(-1, 1, (count, 2)) * [1.0, 0.6]
    error -= error.mean(axis=0)
    widest = max(float(np.ptp(error[:, 0])), float(np.ptp(error[:, 1])), 1e-9)
    return error * size_m / widest


def _tripods(
    rng: np.random.RandomState, railway: Railway, length_m: float, rise: Callable[[float], float], wide: bool
) -> Survey:
    """Draw places of a tripod 20 to 45 m apart, on either side of the tracks."""
    count = int(np.ceil(length_m / rng.uniform(*STANDS_M)))
    low, high = railway.lefts_m
    ray_rad, noise_m, height_m = even_in_log(rng, 0.0008, 0.002), even_in_log(rng, 0.001, 0.004), rng.uniform(1.2, 2.2)
    ray_rad = max(ray_rad, np.sqrt(count * AROUND_SHARE * 2 * np.pi / MAX_POINTS))
    scanners, apart = [], _apart(rng, count, 0.002)
    for number in range(count):
        side = one_of(rng, (1, -1))
        left_m = (high if side > 0 else low) + side * rng.uniform(1.9, 4.0 if wide else 2.5)
        stand_m = (number + rng.uniform(0.25, 0.75)) * length_m / count
        scanners.append(
            RawScanner(
                profile_step_m=STAND_STEP_M,
                ray_step_rad=ray_rad,
                left_m=left_m,
                height_m=max(rise(left_m), 0.0) + height_m,
                noise_m=noise_m,
                half_range_m=rng.uniform(40.0, 100.0),
                swing=0.0,
                stand_m=stand_m,
                shift_m=tuple(apart[number]),
            )
        )
    return Survey(TRIPOD, tuple(scanners), has_ids=maybe(rng, 0.5), has_times=maybe(rng, 0.5))


def _drone(rng: np.random.RandomState, half_width_m: float, length_m: float) -> Survey:
    """Draw one to three strips of a drone's lidar."""
    per_m2, count = even_in_log(rng, 80.0, 500.0), one_of(rng, (1, 1, 2, 3))
    per_m2 = min(per_m2, MAX_POINTS / (2 * half_width_m * length_m))
    noise_m, height_m = even_in_log(rng, 0.005, 0.02), rng.uniform(40.0, 100.0)
    apart = _apart(rng, count) if maybe(rng, 0.5) else np.zeros((count, 2))
    scanners = [
        replace(
            from_air(per_m2 / count, noise_m, float(rng.uniform(-20.0, 20.0)), height_m),
            footprint_m=height_m * rng.uniform(0.0004, 0.0008),
            shift_m=tuple(apart[number]),
        )
        for number in range(count)
    ]
    return Survey(DRONE, tuple(scanners), has_ids=maybe(rng, 0.6), has_times=maybe(rng, 0.7))


def _camera(rng: np.random.RandomState, area_m2: float) -> Photogrammetry:
    """Draw a survey by images that blurs by 2 to 6 cm."""
    blur_m = rng.uniform(0.02, 0.06)
    return Photogrammetry(
        point_step_m=max(rng.uniform(0.025, 0.06), np.sqrt(area_m2 / MAX_POINTS)),
        irregular=rng.uniform(0.3, 0.9),
        blur_m=blur_m,
        blur_varies=rng.uniform(0.05, 0.3),
        widening_m=rng.uniform(0.0, 0.02),
        wave_m=even_in_log(rng, 0.002, 0.012),
        drift_m=even_in_log(rng, 0.001, 0.005),
        noise_m=even_in_log(rng, 0.002, 0.008),
        stray_share=even_in_log(rng, 0.001, 0.01),
        turned_rad=rng.uniform(0.05, np.pi / 4),
    )


def marked(scene: RawScene, survey: Survey, reference: Curve) -> RawScene:
    """Give the points of a scene the ids and times of their passes, as far as the survey has them."""
    passes = np.asarray(scene.passes, dtype=np.uint16)
    times = np.zeros(len(passes))
    if survey.has_times:
        way = reference.xy[-1] - reference.xy[0]
        along_m = (scene.xyz[:, :2] - reference.xy[0]) @ (way / np.hypot(*way))
        times = START_S + PASS_S * passes + along_m.clip(0.0) / SPEED_M_S
    return replace(scene, strips=passes + 1 if survey.has_ids else None, times=times)
