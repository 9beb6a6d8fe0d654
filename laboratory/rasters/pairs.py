"""Training pairs: a random layout in a random window at a random severity."""

from __future__ import annotations

import math

import numpy as np

from .distortion import Pair, draw_pair
from .drawing import Window
from .layouts import RARE_FAMILIES, random_layout
from .paths import TrackSize

SPACING_M = 1.5112
"""Distance between railhead centres in all layouts, as of 132RE."""
CELL_M = 0.04

RATIOS = (14.2, 25.2)
"""Smallest and largest ratio of gauge to railhead width among rail standards (docs/method.md section 10)."""
BASE_RATIO = 18.83
"""Ratio of 132RE, the example of Gribov and Chang."""
RATIO_TOLERANCE = 0.06
"""Mismatch of the ratio that a model must tolerate, so that a few models cover all standards."""
ODD_SHARE = 0.4
"""Share of pairs whose ratio is drawn from the whole range `RATIOS`, because the only model serves every standard."""

RARE_SHARE = 0.15
"""Share of training pairs of the rare families."""
THIN_SHARE, THIN_SEVERITY = 0.15, 0.5
"""Share of training pairs with thin rails, and the largest severity of these: beyond it no rail can be recognized."""
EMPTY_SHARE = 0.05
CLEAN_SHARE = 0.05
FAR_M = 1e5
"""Distance at which there is no track."""


def random_ratio(rng: np.random.Generator) -> float:
    """Draw a ratio of gauge to railhead width."""
    if rng.random() < ODD_SHARE:
        return math.exp(rng.uniform(math.log(RATIOS[0]), math.log(RATIOS[1])))
    return ratio_near(rng, BASE_RATIO)


def ratio_near(rng: np.random.Generator, ratio: float) -> float:
    """Draw a ratio that a model for `ratio` must tolerate."""
    return ratio * math.exp(rng.uniform(-RATIO_TOLERANCE, RATIO_TOLERANCE))


def training_pair(rng: np.random.Generator, size: int, ratio: float | None = None) -> Pair:
    """Draw a pair for training: as `random_pair` does, and some of rare layouts and of thin rails.

    The pair depends on the state of the generator alone. `ratio` is gauge divided by railhead width, by default
    `random_ratio`.
    """
    family = list(RARE_FAMILIES)[rng.integers(len(RARE_FAMILIES))] if rng.random() < RARE_SHARE else None
    thin = rng.random() < THIN_SHARE
    severity = rng.uniform(0.0, THIN_SEVERITY) if thin else None
    return random_pair(rng, size, severity, ratio, family, thin)


def random_pair(
    rng: np.random.Generator,
    size: int,
    severity: float | None = None,
    ratio: float | None = None,
    family: str | None = None,
    thin: bool = False,
) -> Pair:
    """Draw one pair.

    Parameters
    ----------
    rng : numpy Generator
        The pair depends on its state alone.
    size : int
        Cells along the side.
    severity : float, optional
        0 (clean) to 1. By default it is drawn uniformly, and some pairs are clean.
    ratio : float, optional
        Gauge divided by railhead width; by default, `random_ratio`.
    family : str, optional
        One of `layouts.FAMILIES` or `layouts.RARE_FAMILIES`. By default one of `FAMILIES` is drawn, and some pairs are
        empty.
    thin : bool
        Whether rails have few points; see `distortion.THIN_DENSITY`.
    """
    if severity is None:
        severity = 0.0 if rng.random() < CLEAN_SHARE else rng.random()
    track_size = TrackSize(SPACING_M, SPACING_M / (1 + (random_ratio(rng) if ratio is None else ratio)))
    layout = random_layout(rng, track_size, family)
    extent_m = size * CELL_M
    middle = layout.spots[rng.integers(len(layout.spots))] + rng.uniform(-0.45, 0.45, size=2) * extent_m
    if family is None and rng.random() < EMPTY_SHARE:
        middle = middle + FAR_M
    window = Window(size, CELL_M, middle[0] - 0.5 * extent_m, middle[1] + 0.5 * extent_m)
    return draw_pair(rng, layout, window, track_size.head_width_m, severity, thin)
