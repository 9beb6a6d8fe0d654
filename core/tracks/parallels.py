"""Where rails run next to each other: a quick comparison of stations before the exact matching.

See docs/method.md section 8.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..progress import SILENT, Progress
from ..rails import RailLine
from ..standards import Gauge

SAMPLE_STEP_M = 0.5
"""Spacing of the stations along rails and tracks that are compared: six on the shortest section; in a tram curve of 25
m, their chords deviate by 1 mm."""

MAX_SPACING_M = 2.2
"""Rails further apart than this belong to two tracks: the widest gauge in use is 1676 mm."""

MIN_SPACING_M = 0.45
"""Lines closer than this are not a track: the narrowest gauge is 500 mm, less its tolerance."""

MAX_TURN = np.radians(10.0)
"""Angle from which rails cross, those of a track being parallel within it; and within which sections that continue each
other point at each other, as the ends of rails do, where they miss each other by the tolerance of the gauge at most."""

SPACING_BIN_M = 0.01
"""Width of the bins in which the most common spacing is sought: the spacing of one track varies by less."""

STATIONS_AT_ONCE = 5_000
"""Stations searched at once, with some hundred thousand neighbours, and 8 million at most: limits the memory."""

CROWD_M, CROWD = 1.0, 75
"""A square of this side with more stations than this, of 25 lines or more, shows no rails but copies of lines: at most
ten heads of rails fit next to each other. Each pair of lines would be compared."""

CROWDED = (
    "More than 25 lines are within 1 m of each other on {:.0f} m of their length, which is not paired: remove copies "
    "of lines."
)


@dataclass(frozen=True)
class Parallels:
    """Pairs of stations that are abreast on two rails, (n,) arrays each.

    `a` < `b` are the numbers of the rails, `t_a` and `t_b` the plan chainages of the stations along them. `left_m` is
    the distance of the second rail, positive if it is to the left of the first; `same`, whether both have the same
    direction.
    """

    a: np.ndarray
    b: np.ndarray
    t_a: np.ndarray
    t_b: np.ndarray
    left_m: np.ndarray
    same: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Parallels:
        return Parallels(*(column[which] for column in vars(self).values()))

    def groups(self) -> Iterator[Parallels]:
        """Split by rails, side and direction."""
        if not len(self.a):
            return
        key = np.column_stack([self.a, self.b, self.left_m > 0, self.same])
        order = np.lexsort((self.t_a, *key.T[::-1]))
        borders = np.flatnonzero(np.any(np.diff(key[order], axis=0) != 0, axis=1)) + 1
        for mine in np.split(order, borders):
            yield self[mine]


def find_parallels(rails: Sequence[RailLine], reach_m: float = MAX_SPACING_M, progress: Progress = SILENT) -> Parallels:
    """Find stations that are abreast on two rails of one class, at most `reach_m` apart."""
    codes = np.array([rail.class_code for rail in rails])
    columns = _stations(rails)
    crowded = _is_crowded(columns[1])
    number, stations, t, tangents, normals = (column[~crowded] for column in columns)
    if crowded.any():
        progress.warning(CROWDED.format(SAMPLE_STEP_M * crowded.sum()))
    tree = cKDTree(stations)
    found = []
    for start in progress.follow(range(0, len(stations), STATIONS_AT_ONCE)):
        block = cKDTree(stations[start : start + STATIONS_AT_ONCE])
        near = block.sparse_distance_matrix(tree, reach_m + SAMPLE_STEP_M, output_type="ndarray")
        p, q = near["i"] + start, near["j"]
        other = (number[p] < number[q]) & (codes[number[p]] == codes[number[q]])
        p, q = p[other], q[other]
        between = stations[q] - stations[p]
        along = np.einsum("ij,ij->i", between, tangents[p])
        left = np.einsum("ij,ij->i", between, normals[p])
        turn = tangents[p, 0] * tangents[q, 1] - tangents[p, 1] * tangents[q, 0]
        abreast = (np.abs(along) <= SAMPLE_STEP_M / 2) & (np.abs(left) <= reach_m) & (np.abs(turn) < np.sin(MAX_TURN))
        p, q = p[abreast], q[abreast]
        same = np.einsum("ij,ij->i", tangents[p], tangents[q]) > 0
        found.append((number[p], number[q], t[p], t[q], left[abreast], same))
    if not found:
        none = np.empty(0, dtype=int)
        return Parallels(none, none, np.empty(0), np.empty(0), np.empty(0), none > 0)
    return Parallels(*(np.concatenate(column) for column in zip(*found)))


def _is_crowded(stations: np.ndarray) -> np.ndarray:
    """Return which stations are in a square with more stations than rails can have, (n,) bool."""
    squares = np.floor(stations / CROWD_M) @ [1.0, 2.0**26]  # a number for each square
    _, square, counts = np.unique(squares, return_inverse=True, return_counts=True)
    return (counts > CROWD)[square]


def _stations(rails: Sequence[RailLine]) -> tuple[np.ndarray, ...]:
    """Return rail number, place, chainage, direction and left normal of the stations along all rails."""
    sampled = [rail.line.resampled(SAMPLE_STEP_M) for rail in rails]
    number = np.repeat(np.arange(len(rails)), [len(one.t) for one in sampled])
    columns = zip(*((one.xy, one.t, one.tangents, one.normals) for one in sampled))
    return (number, *(np.concatenate(column) for column in columns))


def most_common_spacing(rails: Sequence[RailLine], min_length_m: float) -> float | None:
    """Measure the distance between rail lines, metres, at which the greatest length of neighbours is parallel.

    None if no rails are parallel over at least `min_length_m`.
    """
    if len(rails) < 2:
        return None
    spacing = np.abs(find_parallels(rails).left_m)
    spacing = spacing[spacing >= MIN_SPACING_M]
    if not len(spacing) or len(spacing) * SAMPLE_STEP_M < min_length_m:
        return None
    counts = np.convolve(np.bincount((spacing / SPACING_BIN_M).astype(int)), np.ones(3), mode="same")
    if counts.max() * SAMPLE_STEP_M < min_length_m:
        return None
    middle = (np.argmax(counts) + 0.5) * SPACING_BIN_M
    return float(np.median(spacing[np.abs(spacing - middle) <= 2 * SPACING_BIN_M]))


def widths_by_gauge(rails: Sequence[RailLine], gauges: Sequence[Gauge], tolerance_m: float) -> np.ndarray:
    """Return the width of the head of each rail, (n,) metres: that of the gauge at which it runs for the most part.

    The first gauge decides where a rail has no partner, or is common to tracks of two gauges over the same length.
    `tolerance_m` is the largest deviation of a track from its gauge.
    """
    widths_m = np.array([width_m for _, width_m in gauges])
    if not len(rails) or np.all(widths_m == widths_m[0]):
        return np.full(len(rails), widths_m[0])
    found = find_parallels(rails, max(map(sum, gauges)) + tolerance_m)
    off_m = np.abs(np.abs(found.left_m)[:, None] - np.array([sum(one) for one in gauges]))
    at_gauge = off_m.min(axis=1) <= tolerance_m
    nearest = off_m.argmin(axis=1)[at_gauge]
    stations = np.zeros((len(rails), len(gauges)))
    for sides in (found.a, found.b):
        np.add.at(stations, (sides[at_gauge], nearest), 1)
    return widths_m[stations.argmax(axis=1)]
