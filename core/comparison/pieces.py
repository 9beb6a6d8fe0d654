"""Lines as chords that are compared, and gauge and cant between two of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..polyline import Chords, Polyline

STEP_M = 0.05
"""Length of the chords that are compared; a chord of this length deviates from an arc of 25 m by 0.01 mm."""

ASTRAY_M = 0.10
"""Distance from its expected place, relative to the track, at which a line is not the rail of the track."""


def cut(lines: Sequence[np.ndarray]) -> Chords:
    """Cut lines, (n, 3) each, into chords of equal length, at most `STEP_M`."""
    return Chords.of([Polyline(line) for line in lines], STEP_M)


def spacing_and_cant(left: np.ndarray, right: np.ndarray, rails: Chords) -> np.ndarray:
    """Measure the distance in space of the two rails of a track, and the height of the left one above the right one.

    The rails are expected at `left` and `right`, (n, 2) metres, and found in the chords of all rails. Returns (n, 2)
    metres; NaN where a rail is missing.
    """
    sides = []
    for place in (left, right):
        feet, _ = rails.nearest(place)
        astray = ~(np.linalg.norm(feet[:, :2] - place, axis=1) <= ASTRAY_M)
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    plan = np.hypot(step[:, 0], step[:, 1])
    return np.column_stack([np.hypot(plan, np.nan_to_num(step[:, 2])), step[:, 2]])
