"""A clothoid that leaves one point in a given direction and reaches another in a given direction."""

from __future__ import annotations

import math

import numpy as np

from .curves import Element

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_T, _W = 0.5 * (_NODES + 1), 0.5 * _WEIGHTS
_NEWTON_STEPS = 12
_CLOSED = 1e-13


def connect(
    start: tuple[float, float], start_heading: float, end: tuple[float, float], end_heading: float
) -> Element | None:
    """Solve the G1 Hermite problem with one clothoid (Bertolazzi and Frego; ALGORITHMS.md section 6.1).

    Parameters
    ----------
    start, end : tuple of float
        Points, metres.
    start_heading, end_heading : float
        Directions, radians.

    Returns
    -------
    Element or None
        The clothoid, to be traced from `start` along `start_heading`; None where Newton's method finds none.
    """
    chord = math.hypot(end[0] - start[0], end[1] - start[1])
    direction = math.atan2(end[1] - start[1], end[0] - start[0])
    first, last = _wrap(start_heading - direction), _wrap(end_heading - direction)
    turn = last - first
    sharpness = 3.0 * (first + last)
    for _ in range(_NEWTON_STEPS):
        angle = sharpness * _T**2 + (turn - sharpness) * _T + first
        miss = _W @ np.sin(angle)
        if abs(miss) < _CLOSED:
            break
        sharpness -= miss / (_W @ ((_T**2 - _T) * np.cos(angle)))
    else:
        return None
    reach = _W @ np.cos(sharpness * _T**2 + (turn - sharpness) * _T + first)
    if reach <= 0:
        return None
    length = chord / reach
    return Element(length, (turn - sharpness) / length, (turn + sharpness) / length)


def _wrap(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)
