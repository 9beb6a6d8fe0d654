"""Openings, guard rails, wing rails and check rails, for layouts in plan.

`scenes.frogs` lays guard rails in space. Both take their offset from `guard_offset` and their flangeway from
`FLANGEWAY_M`. Lengths and positions are random and ends are flared here; there they are fixed, without flares.
"""

from __future__ import annotations

import numpy as np

from ..curves import Curve
from .paths import Layout, RailPath, TrackSize, beside

FLANGEWAY_M = (0.038, 0.050)
"""Smallest and largest clear width for wheel flanges next to a rail, in European, Indian and American practice."""
OPENING_M = (0.030, 0.060)
"""Gap in a rail where the flangeway of another rail cuts it."""
GUARD_LENGTH_M = (2.5, 5.0)
WING_LENGTH_M = (0.8, 2.0)
FLARE_M, FLARED_SHARE = 0.05, 0.2
"""Distance by which the ends of a guard rail bend away from their rail, and share of each half that is bent."""
COARSE = 25
"""Step, in samples, of the first search for a crossing."""


def crossing(first: np.ndarray, second: np.ndarray) -> tuple[int, int] | None:
    """Return the nearest samples of two lines, (n, 2) and (m, 2), where they cross, or None where they do not."""
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


def guard_offset(spacing_m: float, head_width_m: float, flangeway_m: float) -> float:
    """Return the distance from the axis of a track to the axis of a guard rail: a head and a flangeway inside the rail.

    `spacing_m` is the distance between the two railhead centres; rail and guard rail have one width.
    """
    return 0.5 * spacing_m - head_width_m - flangeway_m


def guard(
    rng: np.random.Generator, axis: Curve, at: int, side: int, size: TrackSize, length_m: tuple[float, float]
) -> RailPath:
    """Lay a guard rail inside one of the rails of a track, flared at both ends.

    `at` is the sample of the axis at its middle; `side` is 1 for the left rail and -1 for the right one; `length_m` has
    the smallest and largest length.
    """
    half = int(0.5 * rng.uniform(*length_m) / axis.step_m)
    first, last = max(at - half, 0), min(at + half, len(axis.xy))
    piece = Curve(axis.xy[first:last], axis.heading[first:last], axis.curvature[first:last], axis.step_m)
    along = np.abs(np.linspace(-1, 1, len(piece.xy)))
    flare = FLARE_M * np.clip((along - 1 + FLARED_SHARE) / FLARED_SHARE, 0, 1)
    offset_m = guard_offset(size.spacing_m, size.head_width_m, rng.uniform(*FLANGEWAY_M))
    return beside(piece, side * (offset_m - flare))


def check_rail(rng: np.random.Generator, axis: Curve, side: int, size: TrackSize) -> RailPath:
    """Lay a check rail along the inner rail of a sharp curve, which turns left with `side` 1 and right with -1."""
    length_m = rng.uniform(8.0, 40.0)
    return guard(rng, axis, len(axis.xy) // 2 + int(rng.uniform(-5.0, 5.0) / axis.step_m), side, size, (length_m,) * 2)


def frog(rng: np.random.Generator, main: Curve, side: Curve, hand: int, size: TrackSize) -> tuple[Layout, int]:
    """Lay the opening, guard rails and wing rails of a turnout's frog; returns the sample of the main track there.

    Both axes begin at the toe; `hand` is 1 where the branch leaves to the left and -1 to the right. Most frogs have two
    guard rails opposite and two wing rails. The frog is the spot of the layout; its sample is the last one where the
    rails do not cross.
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
