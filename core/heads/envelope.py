"""Upper boundary of a union of equal discs, and the surface along which a disc rolls (docs/method.md section 6.4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

MANY_COVERED = 0.05
"""Share of the discs that a round has to leave out, so that another one is faster than looking at each."""


@dataclass(frozen=True)
class Boundary:
    """The points whose discs form the upper boundary, from left to right.

    A disc of the same radius that rolls along the points from above touches these points, one after the other.

    Attributes
    ----------
    x, y : (m,) arrays
        Coordinates of the points; x is increasing.
    start : (m,) array
        Abscissa from which each point's disc forms the boundary, increasing.
    radius : float
    """

    x: np.ndarray
    y: np.ndarray
    start: np.ndarray
    radius: float

    def upper(self, x: np.ndarray) -> np.ndarray:
        """Return the height of the upper boundary at `x`, (k,); -inf where there is no disc."""
        number = np.clip(np.searchsorted(self.start, x, side="right") - 1, 0, None)
        return self._disc(number, x)

    def closing(self, x: np.ndarray) -> np.ndarray:
        """Return the height of the rolling disc's lower side at `x`, (k,), between the first and the last point.

        Between two successive points of the boundary the disc rests on both, with its centre where their discs meet.
        """
        if len(self.x) == 1:
            return np.full(len(x), self.y[0])
        left = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        centre_x = self.start[left + 1]
        # If one point is more than a radius above the next, the disc drops along it to the lower one.
        centre_y = np.minimum(self._disc(left, centre_x), self._disc(left + 1, centre_x))
        return centre_y - np.sqrt(np.maximum(self.radius**2 - (x - centre_x) ** 2, 0.0))

    def _disc(self, number: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the height of the upper half of numbered discs at `x`, (k,)."""
        beside = self.radius**2 - (x - self.x[number]) ** 2
        tolerance = 1e-9 * self.radius**2
        return np.where(beside < -tolerance, -np.inf, self.y[number] + np.sqrt(np.maximum(beside, 0.0)))


def extremal_boundary(x: np.ndarray, y: np.ndarray, radius: float) -> Boundary:
    """Find the upper boundary of the union of discs of one radius around points.

    Two discs change over at most once: the left one is higher before that place, the right one after it. One pass from
    left to right with a stack is therefore enough: each new disc removes from the top of the stack the discs that it
    covers from before their own start. Every point is pushed once and popped at most once, so the pass is linear after
    sorting (Gribov and Chang's directional extremal boundary; Gribov, arXiv 2503.21711).

    Parameters
    ----------
    x, y : (n,) arrays
        Centres of the discs in any order, at least one.
    radius : float
        In units of x and y.
    """
    order = np.lexsort((-y, x))
    x, y = x[order], y[order]
    highest = np.diff(x, prepend=-np.inf) > 0
    x, y = _outer(x[highest], y[highest], radius)
    stack_x: list[float] = []
    stack_y: list[float] = []
    starts: list[float] = []
    for x_new, y_new in zip(x.tolist(), y.tolist()):
        start = x_new - radius
        while stack_x:
            start = _handover(stack_x[-1], stack_y[-1], x_new, y_new, radius)
            if start > starts[-1]:
                break
            stack_x.pop()
            stack_y.pop()
            starts.pop()
        stack_x.append(x_new)
        stack_y.append(y_new)
        starts.append(start)
    return Boundary(np.array(stack_x), np.array(stack_y), np.array(starts), radius)


def _outer(x: np.ndarray, y: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Leave out discs that their two neighbours cover, while that leaves out many; `x` is increasing.

    All at once is right: the highest disc at a place is not covered, so it stays.
    """
    left_out = len(x)
    while left_out > MANY_COVERED * len(x) and len(x) > 2:
        dx, dy = np.diff(x), np.diff(y)
        squared = dx * dx + dy * dy
        with np.errstate(invalid="ignore"):
            start = 0.5 * (x[:-1] + x[1:]) - dy * np.sqrt(radius * radius / squared - 0.25)
        meet = (dx < 2 * radius) & (squared < 2 * radius * dx)
        kept = np.ones(len(x), dtype=bool)
        kept[1:-1] = ~(meet[:-1] & meet[1:] & (start[1:] <= start[:-1]))
        left_out = len(x) - int(kept.sum())
        x, y = x[kept], y[kept]
    return x, y


def _handover(x_left: float, y_left: float, x_right: float, y_right: float, radius: float) -> float:
    """Return the abscissa at which the boundary passes from the left disc's upper half to the right one's."""
    dx, dy = x_right - x_left, y_right - y_left
    if dx >= 2 * radius:
        return x_right - radius
    squared = dx * dx + dy * dy
    if squared >= 2 * radius * dx:  # one upper half is above the other wherever both exist
        return x_right - radius if dy > 0 else x_left + radius
    return 0.5 * (x_left + x_right) - dy * sqrt(radius * radius / squared - 0.25)
