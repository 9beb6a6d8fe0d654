"""Scenes of several sources: a scanner on a train and a drone survey by images of the same place, in one cloud."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...core.polyline import Polyline
from .raw import RawScene
from .raw_catalogue import DRONE, TRAIN, another_day, double_track
from .scene import Scene
from .whole_rails import classified

SCANNED, IMAGED = 1, 2
"""Source ids of the points of the scanner and of the images."""


def mixed(seed: int, scanned: float = 1.0, imaged: float = 1.0) -> RawScene:
    """Scan a double track in a curve, and survey it by images that are registered some centimetres aside.

    Both sources show a share of its length: the scanner from its start, the images from its end. The true rails are the
    crests of the images where these are alone.
    """
    scene = double_track(seed, TRAIN, another_day(DRONE), "mixed")
    course = Polyline(scene.centerlines[0][:, :2])
    scanned_m, imaged_m = scanned * course.length_m, (1 - imaged) * course.length_m
    along_m = np.full(len(scene.xyz), np.nan)
    feet = course.feet(scene.xyz[:, :2], np.inf)
    along_m[feet.point] = feet.t
    passes = np.asarray(scene.passes)
    kept = np.where(passes == 0, along_m <= scanned_m, along_m >= imaged_m)
    rails = [_cut(rail, course, 0.0, scanned_m) for rail in scene.rails]
    tracks = [_cut(line, course, 0.0, scanned_m) for line in scene.centerlines]
    if scanned < 1:
        rails += [_cut(crest, course, scanned_m, course.length_m) for crest in scene.shown]
        shift_m = scene.shown[0][0] - scene.rails[0][0]
        tracks += [_cut(line + shift_m, course, scanned_m, course.length_m) for line in scene.centerlines]
    return replace(
        scene,
        xyz=scene.xyz[kept],
        kind=scene.kind[kept],
        rails=tuple(rails),
        centerlines=tuple(tracks),
        crests=None,
        classification=None,
        passes=passes[kept],
        strips=np.where(passes[kept] == 0, SCANNED, IMAGED).astype(np.uint16),
    )


def _cut(rail: np.ndarray, course: Polyline, start_m: float, end_m: float) -> np.ndarray:
    """Cut a rail, (k, 3), at two chainages of a line beside it."""
    line = Polyline(rail)
    stations = line.resampled(0.1)
    feet = course.feet(stations.xy, np.inf)
    inside = stations.t[feet.point[(feet.t >= start_m) & (feet.t <= end_m)]]
    return line.part(inside.min(), inside.max()).xyz


def _classified(seed: int = 7, **shares: float) -> Scene:
    """Build a scene from its seed, with whole rails in its class."""
    return classified(mixed(seed, **shares), seed=seed)


MIXED: dict[str, Callable[..., Scene]] = {
    "mixed": _classified,
    "mixed_few_images": partial(_classified, imaged=0.5),
    "mixed_half_scanned": partial(_classified, scanned=0.5),
}
"""Classified clouds, by what each source shows."""

RAW_MIXED: dict[str, Callable[[int], RawScene]] = {
    "mixed": mixed,
    "mixed half scanned": partial(mixed, scanned=0.5),
}
"""Raw clouds."""
