"""Random track axes in plan, and axes derived from other axes."""

from __future__ import annotations

import math

import numpy as np

from ..curves import Curve, Element, trace
from .paths import STEP_M

MIN_RADIUS_M, MAX_RADIUS_M = 25.0, 4000.0
"""The smallest radius of tramways, and one of main lines beyond which a curve looks straight in a raster."""

HALF_LENGTH_M = 60.0
"""Length of track on either side of the place that a raster shows; a raster of 1024 cells is 41 m wide."""

TRACK_SPACING_M = (3.5, 6.0)


def random_radius(rng: np.random.Generator, min_radius_m: float, max_radius_m: float = MAX_RADIUS_M) -> float:
    """Draw a radius whose logarithm is uniformly distributed."""
    return math.exp(rng.uniform(math.log(min_radius_m), math.log(max_radius_m)))


def straight(rng: np.random.Generator) -> Curve:
    """Draw a straight axis through the origin, in any direction."""
    return centred([Element(2 * HALF_LENGTH_M)], rng.uniform(-math.pi, math.pi))


def bend(rng: np.random.Generator, radius_m: float, turns: tuple[int, ...]) -> Curve:
    """Draw arcs of similar radius with transitions between them and straights at both ends.

    `radius_m` is the smallest radius. Turns are 1 for an arc to the left and -1 for one to the right: (1, -1) is a
    reverse curve. Some arcs have no transition, as in turnouts and yards.
    """
    elements, curvature = [Element(HALF_LENGTH_M)], 0.0
    for turn in (*turns, 0):
        target = turn / (radius_m * rng.uniform(1.0, 1.4))
        if rng.random() < 0.8:
            elements.append(Element(rng.uniform(4.0, 30.0), curvature, target))
        if turn:
            elements.append(Element(min(rng.uniform(6.0, 60.0), 2.0 * radius_m), target, target))
        curvature = target
    elements.append(Element(HALF_LENGTH_M))
    return centred(elements, rng.uniform(-math.pi, math.pi))


def random_alignment(rng: np.random.Generator, min_radius_m: float = MIN_RADIUS_M) -> Curve:
    """Draw straights, arcs and clothoids in random order, with their middle at the origin."""
    elements: list[Element] = []
    curvature = 0.0
    while sum(element.length_m for element in elements) < 2 * HALF_LENGTH_M:
        target = rng.choice([-1, 1]) / random_radius(rng, min_radius_m) if rng.random() < 0.7 else 0.0
        if target != curvature and rng.random() < 0.8:
            elements.append(Element(rng.uniform(4.0, 40.0), curvature, target))
        elements.append(Element(rng.uniform(5.0, 60.0), target, target))
        curvature = target
    return centred(elements, rng.uniform(-math.pi, math.pi))


def centred(elements: list[Element], heading: float) -> Curve:
    """Return `HALF_LENGTH_M` of the curve of elements on either side of its middle, with the middle at the origin."""
    whole = trace(elements, heading=heading, step_m=STEP_M)
    curve = whole.piece(0.5 * whole.length_m - HALF_LENGTH_M, 0.5 * whole.length_m + HALF_LENGTH_M)
    return Curve(curve.xy - curve.xy[len(curve.xy) // 2], curve.heading, curve.curvature, curve.step_m)


def shifted(axis: Curve, left_m: float) -> Curve:
    """Return the parallel axis; it has the same samples, so its steps are shorter or longer in curves."""
    curvature = axis.curvature / (1 - left_m * axis.curvature)
    return Curve(axis.offset(left_m), axis.heading, curvature, axis.step_m)


def bent(axis: Curve, local: Curve) -> Curve:
    """Transform a curve, given relative to a straight axis (x along it, y to the left), so that it follows `axis`."""
    along, left = local.xy[:, 0], local.xy[:, 1]
    kept = (along >= 0) & (along <= axis.length_m)
    along, left = along[kept], left[kept]
    base = np.column_stack([np.interp(along, axis.chainage, column) for column in axis.xy.T])
    heading = np.interp(along, axis.chainage, axis.heading)
    xy = base + left[:, None] * np.column_stack([-np.sin(heading), np.cos(heading)])
    curvature = np.interp(along, axis.chainage, axis.curvature) + local.curvature[kept]
    return Curve(xy, heading + local.heading[kept], curvature, local.step_m)
