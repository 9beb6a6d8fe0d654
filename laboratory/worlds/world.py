"""A world: a railway, what surrounds it, and its survey, all drawn from one seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..scenes.raw import RawScene, scan_world
from ..scenes.raw_world import HEAD
from ..scenes.scene import RAIL, Scene
from ..scenes.write import write_cloud, write_raw
from .classes import Classification, classified, draw_classification
from .railway import Railway, draw_railway
from .surroundings import TUNNEL, Surroundings, draw_surroundings
from .surveys import Survey, draw_kind, draw_survey, marked

VERSION = 17
"""Changes when a seed gives another world: results of different versions are never mixed."""

RAW, CLASSIFIED = "raw", "classified"
CLOUDS = (RAW, CLASSIFIED)
"""What the rail points of a cloud are: to be found, or classified."""


@dataclass(frozen=True)
class World:
    """A world and its cloud, which is raw without a classification."""

    seed: int
    railway: Railway
    surroundings: Surroundings
    survey: Survey
    scene: RawScene
    classification: Classification | None

    @cached_property
    def classified(self) -> Scene | None:
        """The classified cloud; None of a raw one."""
        if self.classification is None:
            return None
        return classified(self.scene, self.classification, self.seed, self.survey.from_above)

    @property
    def heads(self) -> np.ndarray:
        """Points on heads that the extraction can use, (n,) bool."""
        on_head = self.scene.kind == HEAD
        return on_head if self.classified is None else on_head & (self.classified.classification == RAIL)

    def write(self, path: Path) -> None:
        """Write the cloud."""
        if self.classified is None:
            write_raw(self.scene, path)
        else:
            write_cloud(self.classified, path)

    def describe(self) -> dict[str, object]:
        """Return what was drawn, in words."""
        railway, around, survey = self.railway, self.surroundings, self.survey
        curvature = np.abs(railway.reference.curvature).max()
        words: dict[str, object] = {
            "survey": survey.kind,
            "passes": len(survey.scanners),
            "family": railway.family,
            "layout": railway.layout,
            "tracks": len(railway.tracks),
            "standard": railway.standard.name,
            "radius_m": round(1 / curvature) if curvature > 1e-6 else None,
            "cant_mm": round(1000 * max(float(np.abs(track.cant_m).max()) for track in railway.tracks)),
            "bed": around.bed,
            "fill_cm": round(100 * around.bedding.fill_m),
            "land": around.land,
            "things": list(around.names),
            "points": len(self.scene.xyz),
        }
        if self.classification is not None:
            words["class"] = self.classification.style
        return words


def make(seed: int, cloud: str = RAW) -> World:
    """Make the world of a seed, with one of `CLOUDS`: it is the same, and raw or classified."""
    railway = draw_railway(seed)
    around = draw_surroundings(seed, railway, draw_kind(seed))
    survey = draw_survey(seed, railway, around.half_width_m, around.rise, around.land != TUNNEL)
    scene = scan_world(
        f"world {seed}",
        railway.tracks,
        railway.standard,
        survey.scanners,
        [around.whole],
        seed,
        around.bedding,
        railway.reference,
        railway.other_gauges_m,
        around.half_width_m,
    )
    scene = marked(scene, survey, railway.reference)
    return World(seed, railway, around, survey, scene, draw_classification(seed) if cloud == CLASSIFIED else None)
