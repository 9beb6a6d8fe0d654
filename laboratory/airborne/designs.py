"""Designs of railways as they are flown: lines with transitions and cant, yards, and what misleads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..curves import Curve, Element, trace
from ..scenes.tracks import Track
from .ground import STEP_M, Axis, Band, World

SPACING_M = 1.507
"""Distance between the middles of the heads on standard gauge."""


@dataclass(frozen=True)
class Design:
    """A railway, flown along the line `where`, (n, 2), up to `width_m` from it.

    `parked` are trains: the track that each hides, and the chainages of its ends.
    """

    world: World
    tracks: tuple[Track, ...]
    where: np.ndarray
    width_m: float = 12.0
    parked: tuple[tuple[int, float, float], ...] = ()

    def is_hidden(self, number: int, along_m: np.ndarray) -> np.ndarray:
        """Return which chainages of a track lie under a train, or within half a section of its ends, (n,) bool."""
        hidden = np.zeros(len(along_m), dtype=bool)
        for track, start_m, end_m in self.parked:
            if track == number:
                hidden |= (along_m > start_m - 5.0) & (along_m < end_m + 5.0)
        return hidden

    def truth(self, number: int) -> np.ndarray:
        """Return the true centerline of a track, (n, 3), top of rails, every `STEP_M`."""
        return self.tracks[number].centerline


def curved_line(
    seed: int, length_m: float = 600.0, tracks: int = 2, cant_m: float | None = None, radius_m: float | None = None
) -> Design:
    """Return a line with a canted curve between transitions: trough, platform, parked train and plants.

    The seed chooses radius, cant, gradient, direction, spacing and what lies beside the line, unless `cant_m` and
    `radius_m` are given.
    """
    rng = np.random.RandomState(seed)
    radius_m = rng.choice([300.0, 450.0, 700.0, 1200.0, 2500.0]) if radius_m is None else radius_m
    cant_m = min(11.8 * 60**2 / radius_m / 1000, 0.15) if cant_m is None else cant_m
    side = rng.choice([-1, 1])
    easement = min(0.2 * length_m, max(60.0, 600 * cant_m))
    straight = 0.12 * length_m
    arc = length_m - 2 * (easement + straight)
    elements = [
        Element(straight),
        Element(easement, 0.0, side / radius_m),
        Element(arc, side / radius_m, side / radius_m),
        Element(easement, side / radius_m, 0.0),
        Element(straight),
    ]
    curve = trace(elements, heading=rng.uniform(0, 2 * np.pi), step_m=STEP_M)
    cant = -cant_m * curve.curvature * radius_m  # the outer rail is higher
    height = _heights(curve, rng)
    spacing_m = rng.uniform(3.8, 4.6)
    beside = (np.arange(tracks) - (tracks - 1) / 2) * spacing_m
    laid = tuple(Track(curve, SPACING_M, height, cant, left_m=float(left)) for left in beside)
    world = World(laid, ballast_m=rng.uniform(0.0, 0.04), six_foot_m=rng.uniform(0.25, 0.45), seed=seed)
    parked = _furnish(world, length_m, rng)
    return Design(world, laid, curve.xy[::4], parked=parked)


def canted_curve(seed: int) -> Design:
    """Return a double track in a curve with 150 mm of cant."""
    return curved_line(seed, cant_m=0.15, radius_m=np.random.RandomState(seed).choice([300.0, 400.0, 550.0]))


def yard(seed: int) -> Design:
    """Return a station: two main tracks, and sidings that leave them through turnouts; 300 m long."""
    rng = np.random.RandomState(seed)
    main = trace([Element(300.0)], heading=rng.uniform(0, 2 * np.pi), step_m=STEP_M)
    height = _heights(main, rng)
    laid = [Track(main, SPACING_M, height, 0.0, left_m=left) for left in (-2.0, 2.0)]
    for number, (toe_m, side) in enumerate(((40.0, 1), (75.0, -1), (110.0, 1), (150.0, -1))):
        start = main.piece(toe_m, 300.0)
        left = 2.0 * side
        radius_m = rng.choice([190.0, 300.0])
        turned = rng.uniform(1 / 9.5, 1 / 8.0)
        apart = rng.uniform(4.5, 5.0) * (1 + number // 2)
        arc = radius_m * turned
        slant = max((apart - radius_m * turned**2) / turned, 1.0)
        run = [
            Element(arc, side / radius_m, side / radius_m),
            Element(slant),
            Element(arc, -side / radius_m, -side / radius_m),
        ]
        run.append(Element(max(300.0 - toe_m - sum(one.length_m for one in run) - 5.0, 20.0)))
        first = start.offset(left)[0]
        branch = trace(run, (float(first[0]), float(first[1])), float(start.heading[0]), STEP_M)
        z = height[int(toe_m / STEP_M) :]
        laid.append(Track(branch, SPACING_M, np.interp(branch.chainage, start.chainage, z), 0.0))
    world = World(tuple(laid), ballast_m=rng.uniform(0.0, 0.04), six_foot_m=0.25, seed=seed)
    return Design(world, tuple(laid), main.xy[::4], width_m=24.0)


def _heights(curve: Curve, rng: np.random.RandomState) -> np.ndarray:
    """Return the heights of a track along its curve: a gradient with gentle waves."""
    grade, phase = rng.uniform(-0.012, 0.012), rng.uniform(0, 2 * np.pi)
    return 100.0 + grade * curve.chainage + 0.4 * np.sin(curve.chainage / 180.0 + phase)


def _furnish(world: World, length_m: float, rng: np.random.RandomState) -> tuple[tuple[int, float, float], ...]:
    """Lay troughs, a platform, and a parked train; return which track the train hides, and where."""
    axes = [Axis.of_track(track) for track in world.tracks]
    lid = box(0.17, rng.uniform(-0.16, -0.02))
    if len(axes) > 1 and rng.random_sample() < 0.6:
        middle = float(world.tracks[1].left_m - world.tracks[0].left_m) / 2
        world.bands.append(Band(axes[0].beside(middle), lid, 0.1 * length_m, 0.5 * length_m))
    world.bands.append(Band(axes[0].beside(-rng.uniform(2.1, 2.6)), lid, 0.3 * length_m, 0.9 * length_m))
    edge = axes[-1].beside(rng.uniform(1.65, 1.75) + 2.0)
    world.bands.append(Band(edge, box(2.0, rng.uniform(0.38, 0.76)), 0.55 * length_m, 0.8 * length_m))
    if rng.random_sample() < 0.5:
        start = rng.uniform(0.1, 0.4) * length_m
        world.bands.append(Band(axes[-1].beside(0.0), box(1.5, 3.7), start, start + 90.0))
        return ((len(axes) - 1, start, start + 90.0),)
    return ()


def box(half_m: float, up_m: float) -> np.ndarray:
    """Return the profile of something with a level top."""
    return np.array([[-half_m, up_m], [half_m, up_m]])


def drawn_together(tracks: Sequence[Track], seed: int, off_m: float = 0.0) -> list[np.ndarray]:
    """Return the guides of all tracks of a line, whose slow waves agree, as they do where one picture was drawn."""
    rng = np.random.RandomState(seed)
    wave = rng.uniform(0.0, 1.5)
    guides = []
    for number, track in enumerate(tracks):
        xy, normal = track.centerline[:, :2], track.curve.left_normal
        pick = np.unique(np.append(np.arange(0, len(xy), int(40.0 / STEP_M)), len(xy) - 1))
        own = np.random.RandomState(seed + 100 + number).normal(0, 0.4, len(pick))
        off = off_m + wave * np.sin(2 * np.pi * pick * STEP_M / 600.0 + seed) + own
        guides.append(xy[pick] + off[:, None] * normal[pick])
    return guides
