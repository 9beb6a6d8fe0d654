"""Direction, axis and continuity of the line that each cell is on, from the cells around it.

No trajectory, seed or drawn line is needed: each cell votes with the directions to its neighbours of the same height.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

BINS = 32
"""Bins of the histogram of directions, 5.6 degrees each."""

NEAREST_M = 0.12
"""Closer neighbours say nothing about the direction: the width of a head in cells."""

WEIGHT_M = 0.6
"""Distance up to which the weight of a neighbour grows with its distance."""

SMOOTHING = (0.7, 1.0, 0.7)
"""Kernel over neighbouring bins."""

FIRST_FIT_M, FIT_ROUNDS = 0.075, 2
"""Neighbours this near the line through the cell, which may be at the edge of the head, refine it; in later rounds
those near the line, which must not reach a guard rail."""

FIT_SLOPE, FIT_NEAR_M = 0.25, 0.04
"""They are also within this slope of the line, from a cell's width on."""

RIDGE_M2 = 0.01
"""Keeps the direction where neighbours are few and near."""

STATIONS = 10
"""Parts of the line within reach of which some must hold a cell."""

BESIDE_M = 0.10
"""Neighbours further across than this are beside the line."""

MIN_COVER, MIN_PURE = 0.35, 0.20
"""Least cover and purity of a line. Random surroundings have a purity of 0.07 to 0.12, a rail that runs beside two
others 0.25."""

SINGLE_COVER = 0.75
"""Cover of a line that may be a rail without a partner."""

REACH_POINTS_PER_M, REACH_M = 120.0, (1.0, 2.0)
"""Reach of a line: this divided by the points per square metre, within limits. Thin clouds need more length to see a
line; over more than 2 m, curves bend away from a straight one."""

MAX_NEIGHBOURS = 400
"""A cell with more neighbours within reach is in an area, not on a line: a line of cells has 25 to 50 at 1 m reach,
and with `MIN_PURE` of them on the line at most 250."""

CENTRE_M, CENTRE_ROUNDS = 0.5, 3
"""Distance within which the cells of a head give the middle of its axis, and rounds to find them."""

CHUNK = 4000
"""Cells whose neighbours are held in memory at once."""


@dataclass(frozen=True)
class Marks:
    """Cells that may belong to lines: `xy`, (n, 2) local metres, and height above the bed, (n,)."""

    xy: np.ndarray
    height: np.ndarray


@dataclass(frozen=True)
class Ground:
    """Heights of cells as such, `z`, (n,), and the slope of their beds to east and north, (n, 2).

    Heights are metres from any level, the same for all; slopes are NaN where the bed is steeper than any track.
    """

    z: np.ndarray
    slope: np.ndarray

    def of(self, chosen: np.ndarray) -> Ground:
        """Choose some of the cells."""
        return Ground(self.z[chosen], self.slope[chosen])


@dataclass(frozen=True)
class Lines:
    """The line through each cell.

    Attributes
    ----------
    axis : (n, 2) array
        The cell's place, moved across to the middle of what is on the line.
    height : (n,) array
        Above the bed.
    theta : (n,) array
        Direction, radians, from 0 to pi.
    cover : (n,) array
        Share of the parts of the line within reach that hold a cell.
    pure : (n,) array
        Share of the cells on the line among those on it and beside it: 0.07 to 0.12 in random surroundings.
    ground : Ground, optional
        Shows how high a line is above the bed of another one.
    """

    axis: np.ndarray
    height: np.ndarray
    theta: np.ndarray
    cover: np.ndarray
    pure: np.ndarray
    reach_m: float
    ground: Ground | None = None

    @property
    def along(self) -> np.ndarray:
        """Unit vectors along the lines, (n, 2)."""
        return np.column_stack([np.cos(self.theta), np.sin(self.theta)])

    @property
    def across(self) -> np.ndarray:
        """Unit vectors to the left, (n, 2)."""
        return np.column_stack([-np.sin(self.theta), np.cos(self.theta)])

    def good(self, cover: float = MIN_COVER, pure: float = MIN_PURE) -> np.ndarray:
        """Return the numbers of the cells that are on a line, (k,) int."""
        return np.flatnonzero((self.cover >= cover) & (self.pure >= pure))

    def moved(self, left_m: np.ndarray) -> Lines:
        """Move axes to the left, by (n,) metres."""
        return replace(self, axis=self.axis + left_m[:, None] * self.across)

    def of(self, chosen: np.ndarray) -> Lines:
        """Choose some of the cells."""
        return Lines(
            self.axis[chosen],
            self.height[chosen],
            self.theta[chosen],
            self.cover[chosen],
            self.pure[chosen],
            self.reach_m,
            None if self.ground is None else self.ground.of(chosen),
        )


def reach_at(per_m2: float) -> float:
    """Return the reach of lines in a cloud with this number of points per square metre."""
    return float(np.clip(REACH_POINTS_PER_M / per_m2, *REACH_M))


def joined(one: Lines, other: Lines) -> Lines:
    """Put the lines of further cells behind those of some, of the same reach."""
    columns = ((one.axis, other.axis), (one.height, other.height), (one.theta, other.theta))
    shares = ((one.cover, other.cover), (one.pure, other.pure))
    axis, height, theta, cover, pure = (np.concatenate(pair) for pair in (*columns, *shares))
    ground = None
    if one.ground is not None and other.ground is not None:
        z, slope = np.append(one.ground.z, other.ground.z), np.concatenate([one.ground.slope, other.ground.slope])
        ground = Ground(z, slope)
    return Lines(axis, height, theta, cover, pure, one.reach_m, ground)


def turns(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return by how much directions turn to others, radians from minus to plus a quarter turn: lines have no sense."""
    return (other - one + np.pi / 2) % np.pi - np.pi / 2


def find_lines(
    marks: Marks, reach_m: float, along_m: float, beside_line_m: float, wanted: np.ndarray | None = None
) -> Lines:
    """Find the line through each cell, compared with those within `reach_m`; with `wanted`, others get no cover.

    Neighbours on a line differ by at most `along_m` in height, and are at most `beside_line_m` across from it.
    """
    count = len(marks.xy)
    wanted = np.arange(count) if wanted is None else wanted
    theta, offset, cover, pure = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    for chosen, number, step in _neighbours(marks, wanted, reach_m, along_m):
        theta[chosen], offset[chosen] = _fitted(_main_direction(len(chosen), number, step), number, step, beside_line_m)
        cover[chosen], pure[chosen] = _measured(theta[chosen], offset[chosen], number, step, reach_m, beside_line_m)
    axis = marks.xy + offset[:, None] * np.column_stack([-np.sin(theta), np.cos(theta)])
    return Lines(axis, marks.height, theta, cover, pure, reach_m)


def _neighbours(
    marks: Marks, wanted: np.ndarray, reach_m: float, along_m: float
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield wanted cells, chunk by chunk, with their neighbours of the same height.

    A chunk is the cells, (k,), and, (m,) each, a cell's number in them and the step, (m, 2), from it to its neighbour.
    """
    if len(marks.xy) < 2 or not len(wanted):
        return
    tree = cKDTree(marks.xy)
    crowd = tree.query_ball_point(marks.xy[wanted], reach_m, return_length=True)
    lonely = wanted[crowd <= MAX_NEIGHBOURS + 1]
    for start in range(0, len(lonely), CHUNK):
        chosen = lonely[start : start + CHUNK]
        near = cKDTree(marks.xy[chosen]).sparse_distance_matrix(tree, reach_m, output_type="ndarray")
        number, other = near["i"], near["j"]
        level = np.abs(marks.height[other] - marks.height[chosen[number]]) < along_m
        level &= near["v"] > 0
        number, other = number[level], other[level]
        yield chosen, number, marks.xy[other] - marks.xy[chosen[number]]


def _main_direction(count: int, number: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Direction in which most neighbours are, (count,) radians from 0 to pi."""
    distance = np.hypot(*step.T)
    angle = np.arctan2(step[:, 1], step[:, 0]) % np.pi
    bins = np.minimum((angle * (BINS / np.pi)).astype(np.int64), BINS - 1)
    weight = np.where(distance > NEAREST_M, np.minimum(distance, WEIGHT_M), 0.0)
    votes = np.bincount(number * BINS + bins, weight, count * BINS).reshape(count, BINS)
    before, here, after = SMOOTHING
    votes = before * np.roll(votes, 1, axis=1) + here * votes + after * np.roll(votes, -1, axis=1)
    return (np.argmax(votes, axis=1) + 0.5) * (np.pi / BINS)


def _fitted(
    theta: np.ndarray, number: np.ndarray, step: np.ndarray, beside_line_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fit a straight line to the neighbours near each line: its direction and its distance to the left, (count,) each.

    The cell itself counts as well. Near the end of a rail, all neighbours are on one side: a line that had to pass
    through the cell, which may be at the edge of the head, would be turned.
    """
    count = len(theta)
    offset = np.zeros(count)
    for limit_m in (FIRST_FIT_M, *FIT_ROUNDS * (beside_line_m,)):
        ahead, left = _turned(theta, number, step)
        beside = np.abs(left - offset[number])
        on = (beside < limit_m) & (beside < FIT_SLOPE * np.abs(ahead) + FIT_NEAR_M)
        row, x, y = number[on], ahead[on], left[on]
        some = 1 + np.bincount(row, minlength=count)
        mean_x, mean_y = np.bincount(row, x, count) / some, np.bincount(row, y, count) / some
        spread = np.bincount(row, x * x, count) - some * mean_x**2
        common = np.bincount(row, x * y, count) - some * mean_x * mean_y
        slope = common / np.maximum(spread, RIDGE_M2)
        theta, offset = (theta + np.arctan(slope)) % np.pi, (mean_y - slope * mean_x) / np.sqrt(1 + slope**2)
    return theta, offset


def _turned(theta: np.ndarray, number: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn steps: along and across the line of their cell, (m,) each."""
    cosine, sine = np.cos(theta)[number], np.sin(theta)[number]
    return step[:, 0] * cosine + step[:, 1] * sine, step[:, 1] * cosine - step[:, 0] * sine


def _measured(
    theta: np.ndarray, offset: np.ndarray, number: np.ndarray, step: np.ndarray, reach_m: float, beside_line_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cover and purity of the line of each cell, (count,) each."""
    count = len(theta)
    ahead, left = _turned(theta, number, step)
    left = np.abs(left - offset[number])
    on = left < beside_line_m
    beside = np.bincount(number[left > BESIDE_M], minlength=count)
    station = np.clip((ahead[on] + reach_m) * (STATIONS / (2 * reach_m)), 0, STATIONS - 1).astype(np.int64)
    hits = np.bincount(number[on] * STATIONS + station, minlength=count * STATIONS).reshape(count, STATIONS)
    members = hits.sum(axis=1)
    return (hits > 0).mean(axis=1), members / np.maximum(members + beside, 1)


def centred(lines: Lines, cells: Marks, half_m: float, along_m: float) -> Lines:
    """Move axes to the middle of all narrow cells of their heads: those that were thinned are to one side or the other.

    A cell's top is at most `half_m` from the axis of its head, which is half the head and noise, short of a guard rail,
    and at most `along_m` from it in height.
    """
    if not len(lines.axis):
        return lines
    near = cKDTree(lines.axis).sparse_distance_matrix(cKDTree(cells.xy), CENTRE_M, output_type="ndarray")
    own, other = near["i"], near["j"]
    level = np.abs(cells.height[other] - lines.height[own]) < along_m
    own, other = own[level], other[level]
    step = cells.xy[other] - lines.axis[own]
    left = np.einsum("ij,ij->i", step, lines.across[own])
    offset = np.zeros(len(lines.axis))
    for _ in range(CENTRE_ROUNDS):
        on = np.abs(left - offset[own]) < half_m
        members = np.bincount(own[on], minlength=len(offset))
        offset = np.bincount(own[on], left[on], len(offset)) / np.maximum(members, 1)
    return lines.moved(offset)
