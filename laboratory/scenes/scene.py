"""A scene: a classified cloud of tracks with exact truth, scanned from a plan.

Every scene has a fixed seed. Random numbers come from `RandomState`, whose stream NumPy promises never to change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core.clouds.points import RailPoints
from ...core.frame import LocalFrame
from ...core.standards import RailStandard
from . import clutter
from .frogs import frog_guards, laid_together
from .scanner import NEW, Profile, Scanner, scan
from .tracks import Track

UNCLASSIFIED, GROUND, RAIL = 1, 2, 10
"""Class codes of the LAS specification."""

Gaps = tuple[tuple[float, float], ...]
"""Sections of one rail without points: start and end along the rail, metres."""


@dataclass(frozen=True)
class Scene:
    """A classified cloud and its truth.

    Attributes
    ----------
    xyz : (n, 3) array
        All points, local metres.
    classification : (n,) uint8 array
    rails : tuple of (k, 3) array
        Tops of the heads on the axes of the heads, local metres: left and right rail of each track in turn.
    centerlines : tuple of (k, 3) array
        Midlines between the tops.
    frame : LocalFrame
        Position of the scene in its coordinate system.
    other_gauges_m : tuple of float
        Gauges of tracks that do not have the gauge of the standard.
    gaps_m : float
        Length of rail without points.
    strips : (n,) array or None
        Strip of each point; None if there is one only.
    times : (n,) array or None
        Seconds; None where the file states none.
    intensity : (n,) uint16 array or None
        As a scanner measures it; None where the file states none.
    """

    name: str
    xyz: np.ndarray
    classification: np.ndarray
    rails: tuple[np.ndarray, ...]
    centerlines: tuple[np.ndarray, ...]
    standard: RailStandard
    frame: LocalFrame
    other_gauges_m: tuple[float, ...] = ()
    gaps_m: float = 0.0
    strips: np.ndarray | None = None
    times: np.ndarray | None = None
    intensity: np.ndarray | None = None

    def rail_points(self) -> RailPoints:
        """Return the points that `read_rail_points` would read from the file of the scene."""
        points = RailPoints(self.xyz, self.frame, RAIL, self.strips, scanned=self.intensity is not None)
        return points.kept(self.classification == RAIL)


@dataclass(frozen=True)
class Clutter:
    """Number of points in a scene that are not on rails.

    Weeds within 0.3 m of rails and within 2 m of tracks, and stones of ballast and rail feet, are classified as rail;
    other weeds are not. Without a step of their grid, there are no ground points.
    """

    weeds_near: int = 0
    weeds_between: int = 0
    stones: int = 0
    other_weeds: int = 0
    ground_step_m: float | None = None


@dataclass(frozen=True)
class Plan:
    """Everything that defines a scene, apart from random numbers.

    Attributes
    ----------
    tracks : sequence of Track
        A branch follows the track from which it departs.
    ridden : int
        Track on which the scanner rides.
    gaps : dict of (track, side) to Gaps
        Sections without points; side is +1 for the left rail and -1 for the right one.
    other_gauges_m : tuple of float
        See `Scene`.
    shape : Profile
        Shape of the heads.
    """

    tracks: Sequence[Track]
    standard: RailStandard
    scanner: Scanner = Scanner()
    ridden: int = 0
    gaps: dict[tuple[int, int], Gaps] = field(default_factory=dict)
    clutter: Clutter = Clutter()
    frame: LocalFrame = LocalFrame(np.zeros(3))
    other_gauges_m: tuple[float, ...] = ()
    shape: Profile = NEW


def build(name: str, plan: Plan, rng: np.random.RandomState) -> Scene:
    """Scan the rails of a plan, with the guard rails at its frogs, and add its clutter."""
    rails = tuple(rail for track in plan.tracks for rail in track.rails())
    centerlines = tuple(track.thinned(track.centerline) for track in plan.tracks)
    clouds = [(RAIL, points) for points in _scanned(plan, rng)] + _clutter(plan.clutter, rails, centerlines, rng)
    classification = np.repeat([code for code, _ in clouds], [len(points) for _, points in clouds])
    xyz = np.concatenate([points for _, points in clouds])
    return Scene(
        name,
        xyz,
        classification.astype(np.uint8),
        rails,
        centerlines,
        plan.standard,
        plan.frame,
        plan.other_gauges_m,
        sum(end - start for own in plan.gaps.values() for start, end in own),
    )


def _scanned(plan: Plan, rng: np.random.RandomState) -> list[np.ndarray]:
    """Scan each running rail and each guard rail; where two rails share a place, one of them has points."""
    path = plan.tracks[plan.ridden].centerline
    head_width_m = plan.standard.head_width_m
    running = [
        scan(track.railhead(side), head_width_m, path, plan.scanner, rng, plan.gaps.get((number, side), ()), plan.shape)
        for number, track in enumerate(plan.tracks)
        for side in track.sides
    ]
    running = laid_together(plan.tracks, running, head_width_m)
    guards = frog_guards(plan.tracks, head_width_m)
    return running + [scan(guard, head_width_m, path, plan.scanner, rng, shape=plan.shape) for guard in guards]


def _clutter(
    amount: Clutter, rails: Sequence[np.ndarray], centerlines: Sequence[np.ndarray], rng: np.random.RandomState
) -> list[tuple[int, np.ndarray]]:
    """Draw the points that are not on rails, by class."""
    weed_height = (-clutter.HEAD_ABOVE_GROUND_M, 0.06)
    clouds = [
        (RAIL, clutter.weeds(rng, rails, amount.weeds_near, 0.3, weed_height)),
        (RAIL, clutter.weeds(rng, centerlines, amount.weeds_between, 2.0, weed_height)),
        (RAIL, clutter.stones(rng, rails, amount.stones, 0.2)),
        (UNCLASSIFIED, clutter.weeds(rng, centerlines, amount.other_weeds, 4.0, (-0.15, 0.4))),
    ]
    if amount.ground_step_m is not None:
        clouds.append((GROUND, clutter.ground(rng, centerlines, 3.0, amount.ground_step_m)))
    return clouds
