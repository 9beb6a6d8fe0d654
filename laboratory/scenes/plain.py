"""Scenes of tracks without switches: plain, canted, tram, noisy, sparse, dual gauge, in feet."""

from __future__ import annotations

import numpy as np

from ...core.frame import LocalFrame
from ...core.standards import STANDARDS, RailStandard
from ..curves import Curve, Element, trace, transition_curve
from .scanner import Scanner
from .scene import Clutter, Gaps, Plan, Scene, build
from .tracks import Track

WHOLE_ENDS_M = 3.0
"""Length without gaps at either end of a rail: beyond a gap, the end of a rail would be unknown."""

CALIFORNIA = LocalFrame(np.array([6100000.0, 2100000.0, 120.0]), 1200 / 3937, 1200 / 3937, "EPSG:2227")
"""Zone 3 of the state plane system, in US survey feet."""

INDIA = LocalFrame(np.array([578200.0, 2494300.0, 500.0]), crs_wkt="EPSG:32643")
"""South of Indore, on the route of a former metre-gauge line."""

PAPER_TRACKS = ((0.0, 0.0), (3.96, 0.03), (7.92, -0.02))
"""Offset of each axis to the left of the scanner's track, and height above it, metres: right, centre and left track."""


def spacing(standard: RailStandard) -> float:
    """Return the distance between the tops of the two heads of a track."""
    return standard.gauge_m + standard.head_width_m


def rolling(curve: Curve, gradient: float = 0.004, wave_m: float = 0.01, wave_length_m: float = 80.0) -> np.ndarray:
    """Return the heights, (n,), of a track with a constant gradient and small waves, as settled track has them."""
    return gradient * curve.chainage + wave_m * np.sin(2 * np.pi * curve.chainage / wave_length_m)


def canted(curve: Curve, largest_m: float) -> np.ndarray:
    """Return a cant in proportion to curvature, the outer rail high, up to `largest_m`."""
    sharpest = np.abs(curve.curvature).max()
    return -largest_m * curve.curvature / sharpest if sharpest > 0 else np.zeros(len(curve.xy))


def random_gaps(
    rng: np.random.RandomState, track: int, length_m: float, count: int, longest_m: float = 3.0
) -> dict[tuple[int, int], Gaps]:
    """Draw sections without points for both rails of a track: one in each of `count` equal parts."""
    gaps: dict[tuple[int, int], Gaps] = {}
    part_m = (length_m - 2 * WHOLE_ENDS_M) / count
    for side in (1, -1):
        gap_m = rng.uniform(0.3, min(longest_m, part_m), count)
        starts = WHOLE_ENDS_M + part_m * np.arange(count) + rng.random_sample(count) * (part_m - gap_m)
        gaps[track, side] = tuple(zip(starts, starts + gap_m))
    return gaps


def straight(seed: int = 1) -> Scene:
    """Build a straight track, 60E1, dense and clean, at an angle to the grid."""
    standard = STANDARDS["EN_60E1_1435"]
    curve = trace([Element(100.0)], heading=0.35)
    plan = Plan([Track(curve, spacing(standard), rolling(curve))], standard)
    return build("straight", plan, np.random.RandomState(seed))


def curved(seed: int = 2) -> Scene:
    """Build a curved track, 60E1: transitions and an arc of 600 m with 80 mm cant."""
    standard = STANDARDS["EN_60E1_1435"]
    curve = trace(transition_curve(20, 50, 60, 1 / 600), heading=1.1)
    plan = Plan([Track(curve, spacing(standard), rolling(curve), canted(curve, 0.08))], standard)
    return build("curved", plan, np.random.RandomState(seed))


def paper_like(seed: int = 3) -> Scene:
    """Build three metre-gauge tracks, as in Gribov and Chang; the left one is far from the scanner, with many gaps."""
    standard = STANDARDS["IN_75R_1000"]
    rng = np.random.RandomState(seed)
    curve = trace([Element(40), Element(40, 0, 1 / 1500), Element(80, 1 / 1500, 1 / 1500)], heading=0.42)
    heights, cant = rolling(curve), canted(curve, 0.02)
    tracks = [Track(curve, spacing(standard), heights + lift, cant, left) for left, lift in PAPER_TRACKS]
    plan = Plan(
        tracks,
        standard,
        Scanner(profile_step_m=0.03, ray_step_rad=0.00385, height_m=4.5, left_m=1.5, noise_m=0.005, half_range_m=40),
        gaps=random_gaps(rng, 2, curve.length_m, 8) | random_gaps(rng, 1, curve.length_m, 4),
        clutter=Clutter(weeds_near=30, weeds_between=40, stones=400, other_weeds=120, ground_step_m=0.25),
        frame=INDIA,
    )
    return build("paper_like", plan, rng)


def noisy(seed: int = 4) -> Scene:
    """Build a 60E1 track with noise of 8 mm in each direction, gaps up to 4 m, and weeds and ballast everywhere."""
    standard = STANDARDS["EN_60E1_1435"]
    rng = np.random.RandomState(seed)
    curve = trace([Element(150, 1 / 900, 1 / 900)], heading=0.2)
    plan = Plan(
        [Track(curve, spacing(standard), rolling(curve), canted(curve, 0.05))],
        standard,
        Scanner(profile_step_m=0.06, ray_step_rad=0.0022, noise_m=0.008, face_share=0.6),
        gaps=random_gaps(rng, 0, curve.length_m, 12, longest_m=4.0),
        clutter=Clutter(weeds_near=50, weeds_between=80, stones=1000),
    )
    return build("noisy", plan, rng)


def main_line(seed: int = 5) -> Scene:
    """Build a double-track main line, 60E1: clothoids, an arc of 1200 m with 110 mm cant, a gradient of 8 per mille."""
    standard = STANDARDS["EN_60E1_1435"]
    rng = np.random.RandomState(seed)
    curve = trace(transition_curve(20, 90, 60, -1 / 1200), heading=-0.6)
    heights, cant = rolling(curve, 0.008, 0.02), canted(curve, 0.11)
    tracks = [Track(curve, spacing(standard), heights, cant, left) for left in (0.0, 4.5)]
    plan = Plan(
        tracks,
        standard,
        Scanner(left_m=1.0, noise_m=0.004),
        gaps=random_gaps(rng, 1, curve.length_m, 5, longest_m=2.0),
        clutter=Clutter(weeds_near=25, weeds_between=40, stones=300),
    )
    return build("main_line", plan, rng)


def tram(seed: int = 6) -> Scene:
    """Build a tramway in a curve of 30 m radius, 49E1, scanned from a short distance."""
    standard = STANDARDS["EN_49E1_1435"]
    rng = np.random.RandomState(seed)
    curve = trace(transition_curve(15, 6, 38, 1 / 30), heading=2.2)
    plan = Plan(
        [Track(curve, spacing(standard), rolling(curve))],
        standard,
        Scanner(profile_step_m=0.04, ray_step_rad=0.003, height_m=3.0, noise_m=0.004),
        gaps=random_gaps(rng, 0, curve.length_m, 4, longest_m=1.5),
        clutter=Clutter(weeds_near=8, weeds_between=10, stones=100),
    )
    return build("tram", plan, rng)


def dual_gauge(seed: int = 7) -> Scene:
    """Build dual gauge, standard and metre, 49E1, with three rails in a curve of 400 m; the right rail is shared."""
    standard = STANDARDS["EN_49E1_1435"]
    rng = np.random.RandomState(seed)
    narrow = STANDARDS["EN_49E1_1000"]
    curve = trace([Element(50), Element(60, 1 / 400, 1 / 400)], heading=0.9)
    third = Track(
        curve,
        spacing(narrow),
        rolling(curve),
        left_m=-(spacing(standard) - spacing(narrow)) / 2,
        sides=(1,),
    )
    plan = Plan(
        [Track(curve, spacing(standard), rolling(curve)), third],
        standard,
        Scanner(noise_m=0.004),
        gaps=random_gaps(rng, 0, curve.length_m, 3, longest_m=2.0),
        clutter=Clutter(weeds_near=15, weeds_between=15, stones=150),
        other_gauges_m=(narrow.gauge_m,),
    )
    return build("dual_gauge", plan, rng)


def sparse(seed: int = 8) -> Scene:
    """Build a track 10 m from the one of the scanner, 60E1: about 20 points per metre, all from one side, with gaps."""
    standard = STANDARDS["EN_60E1_1435"]
    rng = np.random.RandomState(seed)
    curve = trace([Element(60), Element(80, 1 / 1500, 1 / 1500)], heading=0.05)
    tracks = [Track(curve, spacing(standard), rolling(curve), left_m=left) for left in (0.0, 10.0)]
    plan = Plan(
        tracks,
        standard,
        Scanner(profile_step_m=0.05, ray_step_rad=0.0025, height_m=4.5, left_m=1.0, noise_m=0.005, half_range_m=14),
        gaps=random_gaps(rng, 1, curve.length_m, 6),
        clutter=Clutter(weeds_near=20, weeds_between=30, stones=250),
    )
    return build("sparse", plan, rng)


def feet(seed: int = 9) -> Scene:
    """Build a curve of 350 m, 115RE, with coordinates and heights in US survey feet."""
    standard = STANDARDS["US_115RE_1435"]
    curve = trace(transition_curve(15, 30, 40, -1 / 350), heading=-2.0)
    plan = Plan(
        [Track(curve, spacing(standard), rolling(curve), canted(curve, 0.1), inclination=1 / 40)],
        standard,
        Scanner(noise_m=0.004),
        clutter=Clutter(weeds_near=15, weeds_between=15, stones=100),
        frame=CALIFORNIA,
    )
    return build("feet", plan, np.random.RandomState(seed))
