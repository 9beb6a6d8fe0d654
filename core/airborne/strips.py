"""What the distance between two strips adds to the error across."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .refinement import REACHES_M, Refined, Seen
from .sections import ENOUGH_GAIN, STATION_M, fit_sections

SHIFT_LENGTH_M, STRIP_SHIFT_M, MIXED_SECTIONS = 50.0, 0.1, 7
"""Length of the sections in which strips are fitted alone, standard deviation of the shift between two strips, and the
sections over which a curve mixes them."""


def strip_error(refined: Refined) -> np.ndarray:
    """Return the standard error across by the distance between the two main strips, (n,) metres.

    Where both have as many points, the curve lies in their middle; where one is alone, it is off by half the distance.
    """
    seen, error = refined.seen, np.zeros(len(refined.t))
    strips, counts = np.unique(seen.corridor.strip, return_counts=True)
    main: Sequence[int] = strips[np.argsort(-counts)][:2].tolist()
    if len(main) < 2:
        return error
    section = np.clip(seen.corridor.section_of(STATION_M), 0, len(error) - 1)
    one, other = (
        np.bincount(section[seen.corridor.strip == strip], minlength=len(error)).astype(float) for strip in main
    )
    long = np.ones(min(MIXED_SECTIONS, len(error)))
    mixed = np.convolve(one - other, long, "same") / np.maximum(np.convolve(one + other, long, "same"), 1.0)
    normal = seen.axis.left_at(refined.t)
    return np.abs(mixed * (normal @ _strip_shift(seen, main))) / 2


def _strip_shift(seen: Seen, strips: Sequence[int]) -> np.ndarray:
    """Return how far one strip is shifted in plan against another, (2,) metres, as far as it shows across the track."""
    corridor, fits = seen.corridor, []
    for strip in strips:
        fits.append(fit_sections(corridor.kept(corridor.strip == strip), seen.shape, REACHES_M[-1], SHIFT_LENGTH_M))
    one, other = fits
    middles = corridor.start_m + (np.arange(len(one.offset)) + 0.5) * SHIFT_LENGTH_M
    normal = seen.axis.left_at(np.minimum(middles, seen.axis.t[-1]))
    good = (one.found.gain > ENOUGH_GAIN) & (other.found.gain > ENOUGH_GAIN)
    weight = np.where(good, 1 / (one.sigma**2 + other.sigma**2), 0.0)
    matrix = (normal * weight[:, None]).T @ normal + np.eye(2) / STRIP_SHIFT_M**2
    return np.linalg.solve(matrix, normal.T @ (weight * (one.offset - other.offset)))
