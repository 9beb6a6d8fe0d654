"""Guard rails and wing rails: short lines next to a running rail (docs/method.md section 4.12)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..lines.bridges import STAIRS_M
from ..lines.ends import even_points
from ..lines.network import LineNetwork

MAX_APART_M = 0.13
"""Largest distance between the axes of a guard or wing rail and its running rail: a head and a flangeway of 50 mm."""

MAX_LENGTH_M = 8.0
"""Longer lines this close to another one are not guard rails, but two rails of a very flat switch."""


def drop_guards(network: LineNetwork) -> LineNetwork:
    """Drop short lines next to a longer one over their whole length: guard rails, wing rails and duplicates."""
    lengths = network.lengths()
    short = np.flatnonzero(lengths < MAX_LENGTH_M)
    if not len(short):
        return network
    points = [even_points(line) for line in network.lines]
    line_of = np.repeat(np.arange(len(points)), [len(own) for own in points])
    tree = cKDTree(np.concatenate(points))
    keep = np.ones(len(lengths), dtype=bool)
    for number in short.tolist():
        near = tree.query_ball_point(points[number], MAX_APART_M + STAIRS_M)
        beside = set.intersection(*(set(line_of[own].tolist()) for own in near))
        keep[number] = not any(keep[other] and lengths[other] > lengths[number] for other in beside)
    return network.select(keep)
