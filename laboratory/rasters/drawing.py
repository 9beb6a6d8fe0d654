"""Rails in a square window of cells: the ideal label, and the points that a scanner finds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LATERAL_STEP_M = 0.01
"""Distance across a rail between the points of complete coverage: a quarter of a cell."""


@dataclass(frozen=True)
class Window:
    """A square of `size` by `size` cells with sides of `cell_m` and the north-west corner at (`x0`, `y0`)."""

    size: int
    cell_m: float
    x0: float
    y0: float

    @property
    def extent_m(self) -> float:
        """Length of the side."""
        return self.size * self.cell_m

    def near(self, xy: np.ndarray, margin_m: float) -> np.ndarray:
        """Return which points are in the window or at most a margin away from it, (n,) bool."""
        x, y = xy[:, 0] - self.x0, self.y0 - xy[:, 1]
        return (np.minimum(x, y) > -margin_m) & (np.maximum(x, y) < self.extent_m + margin_m)

    def cells_of(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and columns of the points that are in the window."""
        rows = np.floor((self.y0 - xy[:, 1]) / self.cell_m).astype(int)
        columns = np.floor((xy[:, 0] - self.x0) / self.cell_m).astype(int)
        inside = (rows >= 0) & (rows < self.size) & (columns >= 0) & (columns < self.size)
        return rows[inside], columns[inside]


def draw_label(
    target: np.ndarray, window: Window, xy: np.ndarray, normal: np.ndarray, width_m: float, value: int = 1
) -> None:
    """Set the cells whose centre is at most half a railhead away from a line to a value.

    Samples of the line, (n, 2), are at most a cell apart; normals are unit vectors.
    """
    kept = window.near(xy, width_m)
    if np.count_nonzero(kept) < 2:
        return
    step = float(np.median(np.linalg.norm(np.diff(xy, axis=0), axis=1)))
    xy, normal = xy[kept], normal[kept]
    reach = int(np.ceil(width_m / window.cell_m))
    offsets = np.arange(-reach, reach + 1)
    rows = np.floor((window.y0 - xy[:, 1]) / window.cell_m).astype(int)[:, None, None] + offsets[:, None]
    columns = np.floor((xy[:, 0] - window.x0) / window.cell_m).astype(int)[:, None, None] + offsets
    dx = window.x0 + (columns + 0.5) * window.cell_m - xy[:, 0, None, None]
    dy = window.y0 - (rows + 0.5) * window.cell_m - xy[:, 1, None, None]
    across = dx * normal[:, 0, None, None] + dy * normal[:, 1, None, None]
    along = dx * normal[:, 1, None, None] - dy * normal[:, 0, None, None]
    near = (np.abs(across) <= width_m / 2) & (np.abs(along) <= step)
    near &= (rows >= 0) & (rows < window.size) & (columns >= 0) & (columns < window.size)
    rows, columns = np.broadcast_arrays(rows, columns)
    target[rows[near], columns[near]] = value


def scan_coverage(xy: np.ndarray, normal: np.ndarray, right_m: np.ndarray, left_m: np.ndarray) -> np.ndarray:
    """Return points, (m, 2), that cover a rail completely, `LATERAL_STEP_M` apart across it.

    `right_m` and `left_m`, (n,), are the offsets of the head's two edges along the normal; the right one is negative.
    """
    if len(xy) == 0:
        return np.empty((0, 2))
    count = int(np.ceil((left_m - right_m).max() / LATERAL_STEP_M)) + 1
    share = np.linspace(0, 1, max(count, 2))
    across = right_m[:, None] + (left_m - right_m)[:, None] * share
    return (xy[:, None, :] + across[:, :, None] * normal[:, None, :]).reshape(-1, 2)


def scan_profiles(
    rng: np.random.Generator,
    xy: np.ndarray,
    normal: np.ndarray,
    right_m: np.ndarray,
    left_m: np.ndarray,
    seen: np.ndarray,
    density: float,
    profile_m: float,
) -> np.ndarray:
    """Return points, (m, 2), that a scanner finds on a rail, in profiles across it, `profile_m` apart.

    Edges are those of `scan_coverage`; `seen` says where the rail has points, `density` of them per metre on average.
    """
    if len(xy) < 2:
        return np.empty((0, 2))
    step = float(np.median(np.linalg.norm(np.diff(xy, axis=0), axis=1)))
    profiles = np.arange(rng.uniform(0, profile_m), step * len(xy), profile_m)
    hits = rng.poisson(density * profile_m, size=len(profiles))
    position = np.repeat(profiles, hits) + rng.normal(0, 0.1 * profile_m, size=hits.sum())
    sample = np.clip((position / step).astype(int), 0, len(xy) - 1)
    position, sample = position[seen[sample]], sample[seen[sample]]
    across = right_m[sample] + (left_m - right_m)[sample] * rng.random(len(sample))
    along = np.column_stack([normal[:, 1], -normal[:, 0]])[sample]
    rest = (position - sample * step)[:, None]
    return xy[sample] + across[:, None] * normal[sample] + np.clip(rest, -step, step) * along
