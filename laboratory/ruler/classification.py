"""Labels of raw scenes compared with the truth, point by point, and the lines that follow from them."""

from __future__ import annotations

import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.classify.settings import Settings
from ...core.clouds.points import RailPoints
from ...core.comparison import cut
from ...core.parameters import Parameters
from ...core.pipeline import extract_rails
from ...core.rails import RailNetwork, SearchFigures
from ..scenes.raw import RawScene
from ..scenes.scene import RAIL
from .lines import Match, match
from .whole_clouds import classify_cloud

FACE_M = 0.035
"""Depth of the side faces that count as head, as in the classified scenes."""

BESIDE_M, BESIDE_WIDE_M = 0.03, 0.05
"""Points this close beside a head, at its height, count as right: mixed pixels of a narrow and of a wide beam."""

NEAR_TOP_M = (-0.07, 0.05)
"""Heights that such points have above the top of the rail."""

ON_SURFACE_M = (-0.15, 0.10)
"""The same on a blunted surface, where the ridge of a rail is as wide as two heads and wavy."""


@dataclass(frozen=True)
class Score:
    """Labels compared with the truth.

    Attributes
    ----------
    recall : float
        Share of the points on heads that are labelled; NaN without any.
    precision : float
        Share of the labelled points that are on heads or right beside; NaN without any.
    wrong : int
        Labelled points elsewhere.
    seconds : float
        Processor time of the classification.
    peak_mib : float
        Peak memory of the process.
    """

    scene: str
    points: int
    recall: float
    precision: float
    wrong: int
    seconds: float
    peak_mib: float
    figures: SearchFigures


def settings_of(scene: RawScene, weights: Path | None = None) -> Settings:
    """Make the settings that fit a scene; with weights, for a trained network."""
    gauges_m = (scene.standard.gauge_m, *scene.other_gauges_m)
    return Settings(gauges_m, scene.standard.head_width_m, weights=weights)


def score(scene: RawScene, wide: bool = False, weights: Path | None = None) -> tuple[Score, np.ndarray]:
    """Classify a scene, by geometry or by trained weights, and compare the labels, (n,), with the truth.

    With `wide`, the beam is as wide as a head.
    """
    start = time.process_time()
    of_images = scene.classification is not None
    found = classify_cloud(scene.xyz, settings_of(scene, weights), sources=scene.strips, of_images=of_images)
    seconds = time.process_time() - start
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    head, beside = truth(scene, found.rail, wide)
    right = found.rail & (head | beside)
    result = Score(
        scene=scene.name,
        points=len(scene.xyz),
        recall=float((found.rail & head).sum() / head.sum()) if head.any() else np.nan,
        precision=float(right.sum() / found.rail.sum()) if found.rail.any() else np.nan,
        wrong=int((found.rail & ~right).sum()),
        seconds=seconds,
        peak_mib=peak_mib,
        figures=found.figures,
    )
    return result, found.rail


def hectares(scene: RawScene) -> float:
    """Return the area of a scene, by the square metres that hold points."""
    return len(np.unique(np.floor(scene.xyz[:, :2]).astype(int), axis=0)) / 1e4


def lines_from(scene: RawScene, rail: np.ndarray, model: str = Parameters.model) -> Match:
    """Extract rails from labelled points, (n,) bool, and compare them with the truth."""
    network = draw(scene, rail, model)
    return match([] if network is None else [line.xyz for line in network.rails], scene.shown)


def draw(scene: RawScene, rail: np.ndarray, model: str = Parameters.model) -> RailNetwork | None:
    """Extract rails from labelled points, (n,) bool; None without any."""
    if not rail.any():
        return None
    points = RailPoints(scene.xyz[rail], scene.frame, RAIL, found=True)
    gauge_m, head_width_m = scene.standard.gauge_m, scene.standard.head_width_m
    parameters = Parameters(gauge_m, head_width_m, other_gauges_m=scene.other_gauges_m, model=model, quality_step_m=1.0)
    return extract_rails([points], parameters)


def truth(scene: RawScene, rail: np.ndarray, wide: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points on heads down to `FACE_M`, and labelled points right beside a head, (n,) bool each.

    On a surface from images, points are on heads whose place is on a head, whatever their height.
    """
    head, beside = np.zeros(len(rail), dtype=bool), np.zeros(len(rail), dtype=bool)
    if not scene.rails:
        return head, beside
    chosen = np.flatnonzero(scene.head | rail)
    feet, _ = cut(scene.shown).nearest(scene.xyz[chosen])
    across = np.linalg.norm((scene.xyz[chosen] - feet)[:, :2], axis=1)
    above = scene.xyz[chosen, 2] - feet[:, 2]
    blunted = scene.crests is not None
    low_m, high_m = ON_SURFACE_M if blunted else NEAR_TOP_M
    head[chosen] = scene.head[chosen] & (above > (low_m if blunted else -FACE_M))
    half_m = scene.standard.head_width_m / 2 + (BESIDE_WIDE_M if wide or blunted else BESIDE_M)
    beside[chosen] = (across < half_m) & (above > low_m) & (above < high_m)
    return head, beside
