"""Scenes of several strips: passes of a scanner whose positions differ, over the same place or one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...core.standards import STANDARDS
from ..curves import trace, transition_curve
from .plain import canted, rolling, spacing
from .scanner import Scanner
from .scene import Plan, Scene, build
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]

SECOND_TRACK_M = 4.5
"""Distance between the axes of two tracks."""


@dataclass(frozen=True)
class Pass:
    """One pass of the scanner along a part of the track; all its points lie this far to the left and above."""

    left_m: float
    up_m: float
    start_m: float = 0.0
    end_m: float = np.inf
    scanner: Scanner = Scanner(noise_m=0.004)


def passes(
    name: str, seed: int, of: Sequence[Pass], with_ids: bool = True, tracks: int = 1, radius_m: float = 800.0
) -> Scene:
    """Build a curve that is scanned several times; its true lines are those without any error.

    With ids, the points state their pass.
    """
    rng = np.random.RandomState(seed)
    curve = trace(transition_curve(15, 30, 30, 1 / radius_m), heading=0.4 + seed)
    plan = Plan(
        [
            Track(curve, spacing(STANDARD), rolling(curve), canted(curve, 0.05), left_m=number * SECOND_TRACK_M)
            for number in range(tracks)
        ],
        STANDARD,
    )
    scans = [_scan(name, plan, one, rng) for one in of]
    strips = np.repeat(np.arange(1, len(scans) + 1, dtype=np.uint16), [len(scan) for scan in scans])
    true = build(name, plan, rng)
    xyz = np.concatenate(scans)
    classification = np.full(len(xyz), true.classification[0], dtype=np.uint8)
    return replace(true, xyz=xyz, classification=classification, strips=strips if with_ids else None)


def _scan(name: str, plan: Plan, one: Pass, rng: np.random.RandomState) -> np.ndarray:
    """Scan a plan in one pass: (n, 3) points."""
    curve = plan.tracks[0].curve
    xyz = build(name, replace(plan, scanner=one.scanner), rng).xyz
    sample = cKDTree(curve.xy).query(xyz[:, :2])[1]
    xyz[:, :2] += one.left_m * curve.left_normal[sample]
    xyz[:, 2] += one.up_m
    return xyz[(curve.chainage[sample] >= one.start_m) & (curve.chainage[sample] < one.end_m)]


def two_passes(seed: int = 41, apart_m: float = 0.02, up_m: float = 0.0) -> Scene:
    """Build a curve that is scanned twice, 20 mm apart, from either side."""
    return passes(
        "two_passes",
        seed,
        [
            Pass(0.5 * apart_m, 0.5 * up_m, scanner=Scanner(noise_m=0.004, left_m=0.4)),
            Pass(-0.5 * apart_m, -0.5 * up_m, scanner=Scanner(noise_m=0.004, left_m=-0.5)),
        ],
    )


def three_passes(seed: int = 42) -> Scene:
    """Build two tracks that are scanned three times, by up to 24 mm apart and 9 mm in height."""
    return passes("three_passes", seed, [Pass(0.012, 0.0), Pass(-0.012, 0.006), Pass(0.0, -0.003)], tracks=2)


def meeting(seed: int = 43, overlap_m: float = 0.0, with_ids: bool = True) -> Scene:
    """Build a curve where one pass follows another with a step of 30 mm sideways and 15 mm in height."""
    half_m = 0.5 * overlap_m
    return passes(
        "strips_meet" if with_ids else "unmarked_meet",
        seed,
        [Pass(0.015, 0.0075, end_m=60.0 + half_m), Pass(-0.015, -0.0075, start_m=60.0 - half_m)],
        with_ids,
    )


def overlapping(seed: int = 44) -> Scene:
    """Build a curve where one pass follows another, 30 mm apart, with 25 m that both show."""
    return replace(meeting(seed, 25.0), name="strips_overlap")


def unmarked(seed: int = 45) -> Scene:
    """Build a curve that is scanned twice, 15 mm apart, without a mark of the pass."""
    return passes("unmarked_passes", seed, [Pass(0.0075, 0.0), Pass(-0.0075, 0.0)], with_ids=False)


def unmarked_heights(seed: int = 47) -> Scene:
    """Build a curve that is scanned twice, 12 mm apart in height, without anything that says so."""
    return passes("unmarked_heights", seed, [Pass(0.0, 0.012), Pass(0.0, 0.0)], with_ids=False)
