"""The trained models, and the choice of one for a rail standard."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..errors import ModelError

FOLDER = Path(__file__).resolve().parents[2] / "models"

MIN_RATIO, MAX_RATIO = 13.4, 26.7
"""Ratios of gauge to railhead: those of the training, 14.2 to 25.2, and 6 % beyond, which a model tolerates."""


@dataclass(frozen=True)
class Model:
    """Trained weights and their rail standard.

    Attributes
    ----------
    name : str
        Option of the parameter MODEL, and value in raster tags.
    gauge_m, head_width_m : float
    file : str
        Name of the .npz file in the folder `models`.
    """

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


MODELS = (Model("base", 1.435, 0.0762, "frpdf_base.npz"),)


def choose(gauge_m: float, head_width_m: float) -> Model:
    """Choose the model whose ratio of gauge to railhead is nearest (Gribov and Chang, section 7).

    Raises
    ------
    ModelError
        No model was trained for such a ratio.
    """
    ratio = gauge_m / head_width_m
    if not MIN_RATIO <= ratio <= MAX_RATIO:
        raise ModelError(
            f"A gauge of {1000 * gauge_m:.0f} mm is {ratio:.1f} times a railhead of {1000 * head_width_m:.1f} mm, and"
            f" the models cover {MIN_RATIO} to {MAX_RATIO} times: check GAUGE and HEAD_WIDTH."
        )
    return min(MODELS, key=lambda model: abs(math.log(ratio / model.ratio)))
