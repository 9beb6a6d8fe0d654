"""Training pairs: a random layout, seen through a random window, at a random severity."""

from __future__ import annotations

import math

import numpy as np

from .distortion import Pair, draw_pair
from .drawing import Window
from .layouts import random_layout

SPACING_M = 1.5112
"""Distance between railhead centres at which layouts are drawn: 132RE."""
CELL_M = 0.04

RATIOS = (14.2, 25.2)
"""Least and greatest ratio of gauge to railhead width among the world's rail standards (ALGORITHMS.md section 7)."""
BASE_RATIO = 18.83
"""Ratio of 132RE, the paper's example."""
RATIO_TOLERANCE = 0.06
"""Mismatch of the ratio that a model must bear, so that a handful of models serves all standards."""
ODD_SHARE = 0.4
"""Share of pairs whose ratio is drawn from all of `RATIOS`: while the zoo holds one model, it serves every standard."""

EMPTY_SHARE = 0.05
CLEAN_SHARE = 0.05


def random_ratio(rng: np.random.Generator) -> float:
    """Draw a ratio of gauge to railhead width."""
    if rng.random() < ODD_SHARE:
        return math.exp(rng.uniform(math.log(RATIOS[0]), math.log(RATIOS[1])))
    return BASE_RATIO * math.exp(rng.uniform(-RATIO_TOLERANCE, RATIO_TOLERANCE))


def random_pair(rng: np.random.Generator, size: int, severity: float | None = None, ratio: float | None = None) -> Pair:
    """Draw one training pair.

    Parameters
    ----------
    rng : numpy Generator
        The pair is a function of its state alone.
    size : int
        Cells along the side.
    severity : float, optional
        0 (clean) to 1; drawn evenly where it is not given, with some tiles clean.
    ratio : float, optional
        Gauge over railhead width; see `random_ratio`.
    """
    if severity is None:
        severity = 0.0 if rng.random() < CLEAN_SHARE else rng.random()
    head_width_m = SPACING_M / (1 + (random_ratio(rng) if ratio is None else ratio))
    layout = random_layout(rng, SPACING_M, head_width_m)
    extent = size * CELL_M
    spot = layout.spots[rng.integers(len(layout.spots))] + rng.uniform(-0.45, 0.45, size=2) * extent
    if rng.random() < EMPTY_SHARE:
        spot = spot + 1e5
    window = Window(size, CELL_M, spot[0] - extent / 2, spot[1] + extent / 2)
    return draw_pair(rng, layout, window, head_width_m, severity)
