"""The trained models, and the choice of one for a rail standard."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..errors import ModelError
from ..parameters import Parameters
from . import AUTO

FOLDER = Path(__file__).resolve().parents[2] / "models"

MIN_RATIO, MAX_RATIO = 13.4, 26.7
"""Ratios of gauge to railhead: those of the training, 14.2 to 25.2, and 6 % beyond, which a model tolerates."""


@dataclass(frozen=True)
class Model:
    """Trained weights and their rail standard; `name` is an option of MODEL, and the value in raster tags."""

    name: str
    gauge_m: float
    head_width_m: float
    file: str

    @property
    def ratio(self) -> float:
        """Gauge divided by railhead width: the only difference between standards once cells are scaled."""
        return self.gauge_m / self.head_width_m

    @property
    def path(self) -> Path:
        """Path of the weights file."""
        return FOLDER / self.file


MODELS = (Model("base", 1.435, 0.0762, "frpdf_base.npz"), Model("fast", 1.435, 0.0762, "frpdf_fast.npz"))

NAMES = (AUTO, *(model.name for model in MODELS))
"""Values of the parameter MODEL."""

AUTOMATIC = ("fast",)
"""Names of the models among which AUTO chooses by ratio; models/MODEL_CARD.md compares both."""


def choose(gauge_m: float, head_width_m: float, name: str = Parameters.model) -> Model:
    """Return the model of a name; with AUTO, that whose ratio of gauge to railhead is nearest (paper, section 7).

    Raises ModelError if no model was trained for such a ratio.
    """
    ratio = gauge_m / head_width_m
    if not MIN_RATIO <= ratio <= MAX_RATIO:
        raise ModelError(
            f"A gauge of {1000 * gauge_m:.0f} mm is {ratio:.1f} times a railhead of {1000 * head_width_m:.1f} mm, and"
            f" the models cover {MIN_RATIO} to {MAX_RATIO} times: check GAUGE and HEAD_WIDTH."
        )
    named = [model for model in MODELS if model.name in (AUTOMATIC if name == AUTO else (name,))]
    return min(named, key=lambda model: abs(math.log(ratio / model.ratio)))
