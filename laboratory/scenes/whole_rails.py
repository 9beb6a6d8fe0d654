"""Scenes whose rail class holds whole rails: head, web and foot, as most people classify them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from ...core.polyline import Polyline
from .raw import RawScene
from .raw_catalogue import DRONE, double_track, far_track, from_air, level_crossing, station, turnout
from .raw_scanner import MIXED, RawScanner
from .raw_world import FOOT
from .raw_world import TRAIN as PARKED
from .scene import RAIL, UNCLASSIFIED, Scene

BESIDE_M, BELOW_M, ABOVE_M = 0.12, 0.20, 0.03
"""Distances from a rail, across, below and above its top, of the points between two surfaces that are classified with
it: nobody tells them from the rail."""

STEP_M = 0.05
"""Distance of the places on rails from which these distances are measured."""

TRAIN_M = 0.5
"""Height above the rails up to which a share of a parked train is classified as rail."""


def classified(scene: RawScene, share: float = 1.0, train_share: float = 0.0, seed: int = 1) -> Scene:
    """Classify a raw cloud by what its points lie on.

    With all points on heads, a share of the points on webs and feet is classified as rail, and another one of wheels
    and bogies on the rails.
    """
    rng = np.random.RandomState(seed)
    chance = rng.random_sample(len(scene.kind))
    places = np.concatenate([Polyline(rail).resampled(STEP_M).xyz for rail in scene.rails])
    distance_m, place = cKDTree(places[:, :2]).query(scene.xyz[:, :2])
    above_m = scene.xyz[:, 2] - places[place, 2]
    mixed = (scene.kind == MIXED) & (above_m < ABOVE_M) & (share > 0)
    parked = (scene.kind == PARKED) & (above_m < TRAIN_M) & (chance < train_share)
    beside = (distance_m < BESIDE_M) & (above_m > -BELOW_M) & (mixed | parked)
    is_rail = scene.head | ((scene.kind == FOOT) & (chance < share)) | beside
    return Scene(
        scene.name,
        scene.xyz,
        np.where(is_rail, RAIL, UNCLASSIFIED).astype(np.uint8),
        scene.shown,
        scene.centerlines,
        scene.standard,
        scene.frame,
        scene.other_gauges_m,
        strips=scene.strips,
    )


def _made(make: Callable[[int], RawScene], share: float = 1.0, train_share: float = 0.0, seed: int = 7) -> Scene:
    """Scan and classify a scene from its seed."""
    return classified(make(seed), share, train_share, seed)


NOISY = RawScanner(profile_step_m=0.1, noise_m=0.006)
BESIDE = RawScanner(left_m=7.0, height_m=2.6)
"""A fast and noisy scanner, and one that drives beside the tracks."""

WHOLE: dict[str, Callable[..., Scene]] = {
    "whole": partial(_made, double_track),
    "whole_heads": partial(_made, double_track, 0.0),
    "whole_tenth": partial(_made, double_track, 0.1),
    "whole_third": partial(_made, double_track, 0.3),
    "whole_sparse": partial(_made, far_track),
    "whole_noisy": partial(_made, partial(double_track, scanner=NOISY)),
    "whole_side": partial(_made, partial(double_track, scanner=BESIDE)),
    "whole_air": partial(_made, partial(double_track, scanner=from_air(300, 0.01))),
    "whole_photo": partial(_made, partial(double_track, scanner=DRONE)),
    "whole_turnout": partial(_made, turnout),
    "whole_crossing": partial(_made, level_crossing),
    "whole_train": partial(_made, station, 1.0, 0.3),
}
"""By name: shares of web and foot, scanners, and places; every scene is seeded."""
