"""Landscapes without a railway: what resembles a track."""

from __future__ import annotations

import numpy as np

from ..curves import Element, trace
from .designs import Design
from .ground import STEP_M, Axis, Band, World

LENGTH_M, WIDTH_M = 300.0, 70.0
"""Length of a landscape and distance from its middle line up to which it is flown: 4.2 ha."""

HALVES = {
    "road with kerbs": [[0.0, 0.07], [3.0, 0.0], [3.05, 0.12], [4.6, 0.12]],
    "lane": [[0.0, 0.12], [1.5, 0.08], [1.6, 0.0]],
    "sunken path": [[0.8, -0.08], [0.85, 0.0]],
    "hedge": [[0.45, 1.1], [0.5, 0.0]],
    "two hedges": [[0.5, 0.0], [0.55, 0.3], [0.95, 0.3], [1.0, 0.0]],
    "ditch": [[0.4, -0.6], [1.5, 0.0]],
    "wheel tracks": [[0.6, 0.0], [0.7, -0.06], [1.1, -0.06], [1.2, 0.0]],
    "low wall": [[0.13, 0.3]],
    "bank": [[1.2, 0.9], [3.0, 0.0]],
    "barriers": [[0.65, 0.0], [0.66, 0.75], [0.94, 0.75], [0.95, 0.0]],
    "car park": [[5.0, 0.0], [5.05, 0.1], [5.2, 0.1]],
}
"""Left halves of symmetric cross-sections, metres to the left and above the ground."""

SUNKEN = ("sunken path", "ditch", "wheel tracks")
"""Those that lie below the ground."""

FURROW_M, FURROW_UP_M, FIELD_M = 0.75, 0.18, 15.0
"""Distance and height of the ridges of a potato field, and half its width."""

CAR_EVERY_M, CAR_LENGTH_M = 2.6, 1.8
"""Distance of parked cars from each other, and their width, in a row."""

FIRST_M, STEP_ASIDE_M = 14.0, 9.0
"""Distance of the things from the middle line, and from each other."""


def countryside(seed: int) -> Design:
    """Return a landscape without a railway: roads, paths, hedges, ditches, fields and a car park along a curve."""
    rng = np.random.RandomState(seed)
    middle = _middle(rng)
    world = World([], _things(middle, rng), seed=seed)
    return Design(world, (), middle.xyz[::4, :2], width_m=WIDTH_M)


def _middle(rng: np.random.RandomState) -> Axis:
    """Return a line of a few gentle arcs at height 0."""
    elements = [Element(LENGTH_M / 3, one, one) for one in rng.uniform(-1 / 300, 1 / 300, 3)]
    curve = trace(elements, heading=rng.uniform(0, 2 * np.pi), step_m=STEP_M)
    return Axis(np.column_stack([curve.xy, np.zeros(len(curve.xy))]), curve.heading, np.zeros(len(curve.xy)))


def _things(middle: Axis, rng: np.random.RandomState) -> list[Band]:
    """Lay all things side by side in an order that the seed chooses, on both sides of a line."""
    names = [*HALVES, "field"]
    bands: list[Band] = []
    sides = {1: FIRST_M, -1: FIRST_M}
    for number, name in enumerate(rng.permutation(names).tolist()):
        side = 1 if number % 2 else -1
        wide_m = FIELD_M if name == "field" else 0.0
        left_m = side * (sides[side] + wide_m)
        sides[side] += STEP_ASIDE_M + 2 * wide_m
        bands += _laid(name, middle.beside(left_m))
    return bands


def _laid(name: str, axis: Axis) -> list[Band]:
    """Return the bands of a thing along an axis."""
    if name == "field":
        across = np.arange(-FIELD_M, FIELD_M, FURROW_M / 2)
        up = np.where(np.arange(len(across)) % 2, FURROW_UP_M, 0.0)
        return [Band(axis, np.column_stack([across, up]))]
    half = np.array(HALVES[name])
    profile = np.concatenate([half[::-1] * [-1, 1], half[half[:, 0] > 0]])
    bands = [Band(axis, profile, covers=name not in SUNKEN)]
    if name == "car park":
        car = np.array([[-2.1, 0.5], [-1.2, 1.4], [1.0, 1.4], [2.1, 0.9]])
        rows = (axis.beside(left) for left in (-2.6, 2.6))
        bands += [Band(row, car, every_m=CAR_EVERY_M, length_m=CAR_LENGTH_M) for row in rows]
    return bands
