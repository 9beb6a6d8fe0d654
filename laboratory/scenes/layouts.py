"""Layouts that mislead the pairing of rails into tracks: tracks 3 m apart, a flyover, a loop, a train alongside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.standards import STANDARDS
from ..curves import Element, trace
from .plain import canted, rolling, spacing
from .scanner import Scanner
from .scene import Gaps, Plan, Scene, build
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]
TRAM_STANDARD = STANDARDS["EN_49E1_1435"]
SCANNER = Scanner(noise_m=0.004, half_range_m=40.0)

NEAR_M = 3.0
"""Distance between the axes of tram tracks, whose inner rails are then 14 mm off the gauge from each other."""

FLYOVER_M, FLYOVER_DEG = 6.0, 1.5
"""Height of a flyover above the track below, and angle between them: their rails are at gauge over several metres."""

COACH_M = 27.0
"""Length of a coach, which hides the nearer rail of the next track."""


def near_tracks(seed: int = 61) -> Scene:
    """Build three tram tracks 3 m apart in a curve of 200 m."""
    curve = trace([Element(60.0, 1 / 200, 1 / 200)], heading=0.6)
    tracks = [Track(curve, spacing(TRAM_STANDARD), rolling(curve), left_m=number * NEAR_M + 0.2) for number in range(3)]
    return build("near_tracks", Plan(tracks, TRAM_STANDARD, SCANNER, ridden=1), np.random.RandomState(seed))


def flyover(seed: int = 62) -> Scene:
    """Build a track and a second one 6 m higher beside it, which draws away at a small angle."""
    angle = np.radians(FLYOVER_DEG)
    below = trace([Element(80.0)], heading=0.35)
    left = np.array([-np.sin(0.35), np.cos(0.35)])
    above = trace([Element(80.0)], tuple(below.xy[0] + 2.6 * left), heading=0.35 + angle)
    tracks = [Track(below, spacing(STANDARD)), Track(above, spacing(STANDARD), FLYOVER_M)]
    return build("flyover", Plan(tracks, STANDARD, SCANNER), np.random.RandomState(seed))


def loop(seed: int = 63, radius_m: float = 25.0) -> Scene:
    """Build the closed loop at the end of a tramway."""
    curve = trace([Element(2 * np.pi * radius_m, 1 / radius_m, 1 / radius_m)], heading=0.8)
    plan = Plan([Track(curve, spacing(TRAM_STANDARD))], TRAM_STANDARD, Scanner(noise_m=0.004, half_range_m=10.0))
    return build("loop", plan, np.random.RandomState(seed))


def parked_train(seed: int = 64) -> Scene:
    """Build two tracks of which a coach alongside hides one rail over 27 m, and both over 3 m at its bogies."""
    curve = trace([Element(80.0, 1 / 900, 1 / 900)], heading=-0.4)
    tracks = [Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.05), left_m=left) for left in (0.0, 4.5)]
    hidden: dict[tuple[int, int], Gaps] = {
        (1, -1): ((25.0, 25.0 + COACH_M),),
        (1, 1): ((28.0, 31.0), (45.0, 48.0)),
    }
    return build("parked_train", Plan(tracks, STANDARD, SCANNER, gaps=hidden), np.random.RandomState(seed))


LAYOUTS: dict[str, Callable[..., Scene]] = {
    "near_tracks": near_tracks,
    "flyover": flyover,
    "loop": loop,
    "parked_train": parked_train,
}
"""By name; every scene is seeded, and another `seed` changes the noise."""
