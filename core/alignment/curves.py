"""The exact plan curve of an element, whose curvature changes linearly: line, arc or clothoid."""

from __future__ import annotations

import numpy as np

NODES = 12
"""Of the Gauss-Legendre rule: with panels of `PANEL_RAD`, the error is below 1e-12 m at a radius of 150 m."""

PANEL_RAD = 1.0
"""Largest turn that one application of the rule covers, radians."""

_ABSCISSAE, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)
UNIT_NODES, UNIT_WEIGHTS = 0.5 * (_ABSCISSAE + 1.0), 0.5 * _WEIGHTS
"""The rule on the interval from 0 to 1, (12,) each."""


def turned(u: np.ndarray, k_from: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return by how much the direction has turned at distance `u`, radians.

    Parameters
    ----------
    u, k_from, change : (n,) array
        Distance along the element in metres, curvature at its start in 1/m, and change of the curvature in 1/m².
    """
    return u * (k_from + 0.5 * change * u)


def displaced(u: np.ndarray, heading: np.ndarray, k_from: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the way from the start of an element to the place at distance `u`, (n, 2) metres.

    Parameters
    ----------
    u, k_from, change : (n,) array
        See `turned`.
    heading : (n,) array
        Direction at the start, radians counterclockwise from the x axis.
    """
    turn = np.abs(u) * (np.abs(k_from) + np.abs(change * u))
    panels = int(np.ceil(turn.max(initial=0.0) / PANEL_RAD)) or 1
    ends = u[:, None] * np.arange(panels + 1) / panels
    way = np.zeros((len(u), 2))
    for start, end in zip(ends.T[:-1], ends.T[1:]):
        at = start[:, None] + (end - start)[:, None] * UNIT_NODES
        angle = heading[:, None] + turned(at, k_from[:, None], change[:, None])
        way[:, 0] += (end - start) * (np.cos(angle) @ UNIT_WEIGHTS)
        way[:, 1] += (end - start) * (np.sin(angle) @ UNIT_WEIGHTS)
    return way
