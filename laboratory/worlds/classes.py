"""Raw worlds classified as imperfectly as people and their programs classify clouds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...core.polyline import Polyline
from ..scenes.raw import RawScene
from ..scenes.raw_scanner import MIXED
from ..scenes.raw_world import FASTENING, FOOT, GROUND, GUARD, HEAD, PAVEMENT, PLANT, SLEEPER
from ..scenes.scene import GROUND as GROUND_CLASS
from ..scenes.scene import RAIL, UNCLASSIFIED, Scene
from ..scenes.whole_rails import ABOVE_M, BELOW_M, BESIDE_M, STEP_M
from ..scenes.write import TONES
from .draws import chosen, even_in_log, maybe, stream

HEADS, FACES, WHOLE = "heads", "heads and faces", "whole rails"
STYLES = {HEADS: 0.2, FACES: 0.3, WHOLE: 0.5}
"""What the class holds, and the shares of it."""

CROWN_M = 0.012
"""Depth below the top to which a head is its crown and its upper corners."""

LEAK_M = 0.25
"""Distance from a rail within which other points come into its class."""

GAP_M = (0.3, 4.0)
"""Lengths of sections of a rail that were not classified."""

STRIP_M = {HEADS: (0.05, 0.07), FACES: (0.06, 0.09), WHOLE: (0.08, 0.12)}
"""Half the width of the strip that is classified along a rail in a survey from above: nobody sees the edges of a head
there, but a ridge that is wider than it by the beam, or by the blur of images, on either side."""

RIDGE_M = 0.08
"""Height of this ridge below the crest that the survey shows: half of what a rail stands out of its bed. Its flanks are
classified with the head."""

ASIDE_M = 0.01
"""Largest distance of the middle of such a strip from the axis of its rail."""

IN_STRIP = (HEAD, FOOT, GROUND, SLEEPER, FASTENING, PAVEMENT)
"""What the points of such a strip lie on: a train and plants on it are seen to be something else."""


@dataclass(frozen=True)
class Classification:
    """How a world is classified.

    Attributes
    ----------
    style : str
        One of `STYLES`.
    faces, feet : float
        Shares of the points on faces, and on webs and feet, that are classified as rail.
    feet_from, feet_to : float
        Part of the length of each rail, 0 to 1, in which webs and feet are.
    mixed, guards : bool
        Whether points between two surfaces, and guard rails, are classified as rail.
    leaks, weeds : float
        Shares of the points of the bed and of plants beside rails that are.
    missed : float
        Share of the points on rails that are not.
    gaps : int
        Sections of each rail without points, at most.
    strip_m, aside_m : float
        See `STRIP_M` and `ASIDE_M`.
    """

    style: str
    faces: float
    feet: float
    feet_from: float
    feet_to: float
    mixed: bool
    guards: bool
    leaks: float
    weeds: float
    missed: float
    gaps: int
    strip_m: float
    aside_m: float


def draw_classification(seed: int) -> Classification:
    """Draw how a world is classified."""
    rng = stream(seed, "classification")
    style = chosen(rng, STYLES)
    faces = 0.0 if style == HEADS else (rng.uniform(0.1, 1.0) if style == FACES else 1.0)
    feet = 0.0 if style != WHOLE else (1.0 if maybe(rng, 0.5) else even_in_log(rng, 0.03, 1.0))
    start, end = np.sort(rng.random_sample(2)) if maybe(rng, 0.25) else (0.0, 1.0)
    return Classification(
        style=style,
        faces=float(faces),
        feet=float(feet),
        feet_from=float(start),
        feet_to=float(end),
        mixed=style == WHOLE or maybe(rng, 0.3),
        guards=maybe(rng, 0.8),
        leaks=even_in_log(rng, 0.0005, 0.03) if maybe(rng, 0.5) else 0.0,
        weeds=rng.uniform(0.0, 0.5) if maybe(rng, 0.4) else 0.0,
        missed=rng.uniform(0.0, 0.4) if maybe(rng, 0.4) else 0.0,
        gaps=int(chosen(rng, {0: 50, 1: 20, 2: 20, 3: 10})),
        strip_m=rng.uniform(*STRIP_M[style]),
        aside_m=rng.uniform(0.0, ASIDE_M),
    )


def classified(scene: RawScene, how: Classification, seed: int, from_above: bool) -> Scene:
    """Classify a raw world.

    From above, heads are strips (see `STRIP_M`), and so are whole rails in images, whose other classes are those of
    their ground filter.
    """
    rng = stream(seed, "labels")
    chance = rng.random_sample(len(scene.kind))
    places, share, gap = _along(scene, how, rng)
    distance_m, place = cKDTree(places[:, :2]).query(scene.xyz[:, :2], distance_upper_bound=1.0)
    near = np.isfinite(distance_m)
    place = np.where(near, place, 0)
    above_m = scene.xyz[:, 2] - places[place, 2]
    kind = scene.kind
    if from_above and (how.style != WHOLE or scene.crests is not None):
        rail = np.isin(kind, IN_STRIP) & _in_strips(scene, how, rng) & ((above_m > -RIDGE_M) | (how.style == WHOLE))
    else:
        rail = (kind == HEAD) & ((above_m > -CROWN_M) | (chance < how.faces))
        inside = (share[place] >= how.feet_from) & (share[place] <= how.feet_to)
        rail |= (kind == FOOT) & inside & (chance < how.feet)
        rail |= (kind == MIXED) & how.mixed & (above_m < ABOVE_M) & (above_m > -BELOW_M) & (distance_m < BESIDE_M)
    rail |= (kind == GUARD) & how.guards & (above_m > -BELOW_M)
    rail &= rng.random_sample(len(kind)) >= how.missed
    rail &= ~(gap[place] & near & (distance_m < LEAK_M))
    rail |= np.isin(kind, (GROUND, SLEEPER, FASTENING)) & (distance_m < LEAK_M) & (chance < how.leaks)
    rail |= (kind == PLANT) & (distance_m < 2 * LEAK_M) & (chance < how.weeds)
    other = scene.classification
    if other is None:
        other = np.where(np.isin(kind, (GROUND, SLEEPER)), GROUND_CLASS, UNCLASSIFIED)
    return Scene(
        scene.name,
        scene.xyz,
        np.where(rail, RAIL, other).astype(np.uint8),
        scene.shown,
        scene.centerlines,
        scene.standard,
        scene.frame,
        scene.other_gauges_m,
        strips=scene.strips,
        times=scene.times,
        intensity=TONES[scene.kind] if scene.crests is None else None,
    )


def _in_strips(scene: RawScene, how: Classification, rng: np.random.RandomState) -> np.ndarray:
    """Return which points, (n,) bool, lie in strips along rails, each displaced by up to `aside_m`."""
    lines = [Polyline(rail[:, :2]).resampled(STEP_M) for rail in scene.rails]
    middles = [line.xy + rng.uniform(-how.aside_m, how.aside_m) * line.normals for line in lines]
    distance_m, _ = cKDTree(np.concatenate(middles)).query(scene.xyz[:, :2], distance_upper_bound=1.0)
    return distance_m <= how.strip_m


def _along(
    scene: RawScene, how: Classification, rng: np.random.RandomState
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places on the rails, (m, 3), as the cloud shows them, their part of its length, and which have no class."""
    places, shares, gaps = [], [], []
    for rail in scene.shown:
        line = Polyline(rail).resampled(STEP_M)
        place, at = line.xyz, line.t
        hidden = np.zeros(len(place), dtype=bool)
        for _ in range(rng.randint(how.gaps + 1)):
            start = rng.uniform(0.0, at[-1])
            hidden |= (at > start) & (at < start + rng.uniform(*GAP_M))
        places.append(place)
        shares.append(at / at[-1])
        gaps.append(hidden)
    return np.concatenate(places), np.concatenate(shares), np.concatenate(gaps)
