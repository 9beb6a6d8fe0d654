"""What belongs to crossing rails and is no running rail: openings, guard, wing and check rails."""

from __future__ import annotations

import numpy as np

from ..curves import Curve
from .paths import Layout, RailPath, TrackSize, beside

FLANGEWAY_M = (0.038, 0.050)
OPENING_M = (0.030, 0.060)
"""Gap of a rail where another one's flangeway cuts it."""
GUARD_LENGTH_M = (2.5, 5.0)
WING_LENGTH_M = (0.8, 2.0)
FLARE_M, FLARED_SHARE = 0.05, 0.2
"""Guard rails bend away from their rail over this share of each half."""
COARSE = 25
"""Samples between those compared first when a crossing is sought."""


def crossing(first: np.ndarray, second: np.ndarray) -> tuple[int, int] | None:
    """Find where two lines cross: the nearest samples of (n, 2) and (m, 2), or None where they stay apart."""
    i, j = (COARSE * place for place in _nearest(first[::COARSE], second[::COARSE]))
    low, high = max(i - 2 * COARSE, 0), max(j - 2 * COARSE, 0)
    near, far = first[low : i + 2 * COARSE], second[high : j + 2 * COARSE]
    i, j = _nearest(near, far)
    step = np.linalg.norm(first[1] - first[0])
    return (low + i, high + j) if np.linalg.norm(near[i] - far[j]) < 2 * step else None


def _nearest(first: np.ndarray, second: np.ndarray) -> tuple[int, int]:
    apart = ((first[:, None] - second[None]) ** 2).sum(axis=2)
    i, j = np.unravel_index(apart.argmin(), apart.shape)
    return int(i), int(j)


def guard(
    rng: np.random.Generator, axis: Curve, at: int, side: int, size: TrackSize, length_m: tuple[float, float]
) -> RailPath:
    """Lay a rail inside one of a track's rails, a flangeway apart and flared at both ends.

    Parameters
    ----------
    rng : numpy Generator
    axis : Curve
        Of the track.
    at : int
        Sample beside which the guard's middle lies.
    side : int
        1 for the left rail, -1 for the right one.
    size : TrackSize
    length_m : tuple of float
        Least and greatest length.
    """
    half = int(0.5 * rng.uniform(*length_m) / axis.step_m)
    first, last = max(at - half, 0), min(at + half, len(axis.xy))
    piece = Curve(axis.xy[first:last], axis.heading[first:last], axis.curvature[first:last], axis.step_m)
    along = np.abs(np.linspace(-1, 1, len(piece.xy)))
    flare = FLARE_M * np.clip((along - 1 + FLARED_SHARE) / FLARED_SHARE, 0, 1)
    return beside(piece, side * (0.5 * size.spacing_m - size.head_width_m - rng.uniform(*FLANGEWAY_M) - flare))


def check_rail(rng: np.random.Generator, axis: Curve, side: int, size: TrackSize) -> RailPath:
    """Lay a check rail along the inner rail of a sharp curve, `side` 1 where the curve turns left."""
    length_m = rng.uniform(8.0, 40.0)
    return guard(rng, axis, len(axis.xy) // 2 + int(rng.uniform(-5.0, 5.0) / axis.step_m), side, size, (length_m,) * 2)


def frog(rng: np.random.Generator, main: Curve, side: Curve, hand: int, size: TrackSize) -> tuple[Layout, int]:
    """Fit out the crossing of a main track's rail with its branch's, both tracks running from the toe.

    Returns
    -------
    Layout
        The opening, and mostly two guard rails opposite the frog and two wing rails in it. The spot is the frog.
    int
        Sample of the main track beside the frog; the end where the rails do not cross.
    """
    places = crossing(main.offset(0.5 * hand * size.spacing_m), side.offset(-0.5 * hand * size.spacing_m))
    if places is None:
        return Layout(), len(main.xy) - 1
    on_main, on_side = places
    nose = main.offset(0.5 * hand * size.spacing_m)[on_main]
    lines = []
    if rng.random() < 0.8:
        ahead = int(0.5 / main.step_m)
        lines += [guard(rng, main, on_main - ahead, -hand, size, GUARD_LENGTH_M)]
        lines += [guard(rng, side, on_side - ahead, hand, size, GUARD_LENGTH_M)]
    if rng.random() < 0.6:
        behind = int(0.8 / main.step_m)
        lines += [guard(rng, main, on_main + behind, hand, size, WING_LENGTH_M)]
        lines += [guard(rng, side, on_side + behind, -hand, size, WING_LENGTH_M)]
    lines = [line for line in lines if len(line.xy) > 1]
    return Layout((), tuple(lines), ((nose, rng.uniform(*OPENING_M)),), (nose,)), on_main
