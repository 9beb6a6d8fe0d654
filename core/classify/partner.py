"""The other rail of the track, and what else runs inside a track.

A rail has a parallel line at the distance of the two heads. Guard, check and third rails have none; they run beside a
rail that has. So do kerbs and shoulders that are at this distance from the near rail of a track.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.ndimage import median
from scipy.spatial import cKDTree

from .lines import Lines, turns
from .pieces import LEAST_PAIRED, mean_of

STATIONS = (-0.6, -0.3, 0.0, 0.3, 0.6)
"""Places along the line, in reaches, where a partner is looked for: a gap or a frog hides some."""

SEARCH_M = 0.16
"""Distance from where the partner is expected: cells are found every 0.1 m and more on thin clouds."""

SPACING_M = 0.055
"""Deviation of the distance of the two heads: gauge widening of 35 mm, and 20 mm for both axes."""

ANGLE_RAD = 0.12
"""Angle between the two rails of a track: those of a turnout with a guard rail's mouth stay below."""

CANT = 0.12
"""Steepest slope of a track across, height per length: 180 mm over 1.5 m."""

NOISE_M = 0.02
"""Difference in height of the two heads of a track beyond its cant, which noise and stray points on them make."""

STEEP = 0.3
"""Steepest bed of a rail: the cant, and as much again for a plane of the bed that is laid through cells of a shoulder.
Measured: 0.22 at most, and 0.36 and more at crests whose far side is hidden."""

CANDIDATES = 6
"""Lines that are looked at for one station: other rails may be near at turnouts."""

TOO_WIDE_M = 0.03
"""How much further apart than the heads of a track two ridges are at most, over the length of a piece: tracks are
closed from 28 to 35 mm of widening on. Measured: rails 26 mm less to 2 mm more, the kerbs of a street 36 to 43 mm."""

INSIDE_M = 0.02
"""What runs along a rail, and is none, is this far beyond a head's width from it at least: a guard rail is on the other
side of a flangeway of 38 to 60 mm."""

PARALLEL_RAD = 0.07
"""Angle to the rail within which a line runs along it; the branch of a turnout leaves at 1:9 to 1:14."""

LEVEL_WITH_M = 0.25
"""Distance along the rail within which it is there beside a cell."""

MIN_STATIONS = 2
"""Stations with a partner from which a cell belongs to a pair of rails."""

MAJORITY = 0.5
"""Share of the cells of a line, or of a piece of rail, that decides for all."""


def have_partners(lines: Lines, spacings_m: Sequence[float], height_m: float, worse_m: float = np.inf) -> np.ndarray:
    """Return which cells belong to a pair of rails, (n,) bool, at the best of the distances of the two heads.

    `height_m` is the largest difference in height above the bed of either; see `partners` for `worse_m`.
    """
    return partner_sides(lines, spacings_m, height_m, worse_m) != 0


def partner_sides(lines: Lines, spacings_m: Sequence[float], height_m: float, worse_m: float = np.inf) -> np.ndarray:
    """Return where each cell's partner is at the best of the distances of the two heads, (n,): see `have_partners`.

    1 if it is to the left, -1 to the right, and 0 without one.
    """
    most, sides = np.full(len(lines.axis), MIN_STATIONS - 1), np.zeros(len(lines.axis), dtype=np.int64)
    for spacing_m in spacings_m:
        stations, side, _ = partners(lines, spacing_m, SPACING_M, height_m, worse_m)
        sides, most = np.where(stations > most, side, sides), np.maximum(stations, most)
    return sides


def off_gauge(lines: Lines, spacings_m: Sequence[float], tolerance_m: float, height_m: float) -> np.ndarray:
    """Return how much the distance of each cell's line from its partner differs from the best of those of two heads.

    Metres, (n,); infinite without a partner. See `partners` for the tolerances.
    """
    off_m = np.full(len(lines.axis), np.inf)
    for spacing_m in spacings_m:
        stations, _, apart_m = partners(lines, spacing_m, tolerance_m, height_m)
        off_m = np.where(stations >= MIN_STATIONS, np.fmin(np.abs(apart_m - spacing_m), off_m), off_m)
    return off_m


def are_within_gauge(lines: Lines, piece: np.ndarray, spacings_m: Sequence[float], height_m: float) -> np.ndarray:
    """Return which pieces, of (n,) cells, are near enough to their partners for a track, (pieces,) bool.

    The median over a piece decides, and enough of it must have a partner that differs by at most `height_m` in height
    above the bed. Axes and heights of cells must be steady.
    """
    count = int(piece.max()) + 1 if len(piece) else 0
    fit = np.zeros(count, dtype=bool)
    for spacing_m in spacings_m:
        apart_m = partners(lines, spacing_m, SPACING_M, height_m)[2]
        seen = np.isfinite(apart_m)
        if seen.any():
            near = median(apart_m[seen], piece[seen], np.arange(count)) < spacing_m + TOO_WIDE_M
            fit |= near & (mean_of(seen, piece) >= LEAST_PAIRED)
    return fit


def partners(
    lines: Lines, spacing_m: float, tolerance_m: float, height_m: float, worse_m: float = np.inf
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the partners of each cell's line on the better side: `spacing_m` away, give or take `tolerance_m`.

    They differ by at most `height_m` in height above the bed of either. A rail has one partner: what is at gauge from
    one that has a partner on its other side, nearer to `spacing_m` by `worse_m`, has none. Returns, (n,) each, the
    number of stations with a partner, 0 to 5, the side, 1 if the partner is to the left and -1 to the right, and its
    mean distance, NaN without one.
    """
    count = len(lines.axis)
    if count < 2:
        return np.zeros(count, dtype=np.int64), np.ones(count, dtype=np.int64), np.full(count, np.nan)
    tree = cKDTree(lines.axis)
    found = [
        [_partnered(lines, tree, side * spacing_m, share, tolerance_m, height_m) for share in STATIONS]
        for side in (1, -1)
    ]
    other, apart_m = (np.array([[one[number] for one in side] for side in found]) for number in (0, 1))
    if np.isfinite(worse_m):
        apart_m[_belongs_to_another(lines, other, apart_m, spacing_m, worse_m)] = np.nan
    stations, mean_m = _summed_up(apart_m)
    left = stations[0] >= stations[1]
    return np.where(left, *stations), np.where(left, 1, -1), np.where(left, *mean_m)


def _summed_up(apart_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count the stations with a partner on each side, (2, stations, n), and their mean distance: (2, n) each."""
    stations, apart_m = np.isfinite(apart_m).sum(axis=1), np.abs(apart_m)
    return stations, np.where(stations > 0, np.nansum(apart_m, axis=1) / np.maximum(stations, 1), np.nan)


def _belongs_to_another(
    lines: Lines, other: np.ndarray, apart_m: np.ndarray, spacing_m: float, worse_m: float
) -> np.ndarray:
    """Return where a partner, a cell at a distance, (2, stations, n), has a better one on its other side, bool."""
    stations, mean_m = _summed_up(apart_m)
    off_m = np.where(stations >= MIN_STATIONS, np.abs(mean_m - spacing_m), np.inf)
    same = np.einsum("skij,ij->ski", lines.across[other], lines.across) > 0  # lines have no direction
    to_left = np.array([True, False])[:, None, None]
    beyond_m = off_m[np.where(same == to_left, 0, 1), other]
    return beyond_m + worse_m < off_m[:, None]


def _partnered(
    lines: Lines, tree: cKDTree, left_m: float, share: float, tolerance_m: float, height_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cell of each line's partner at one station, (n,), and its distance to the left, (n,); NaN without one."""
    places = lines.axis + share * lines.reach_m * lines.along + left_m * lines.across
    _, near = tree.query(places, k=np.arange(1, min(CANDIDATES, tree.n) + 1), distance_upper_bound=SEARCH_M)
    own, rank = np.nonzero(near < tree.n)
    other = near[own, rank]
    apart = np.einsum("ij,ij->i", lines.axis[other] - lines.axis[own], lines.across[own])
    fits = np.abs(apart - left_m) < tolerance_m
    fits &= _are_level(lines, own, other, height_m)
    fits &= np.abs(turns(lines.theta[other], lines.theta[own])) < ANGLE_RAD
    cell, found = np.zeros(len(lines.axis), dtype=np.int64), np.full(len(lines.axis), np.nan)
    # Written from the farthest to the nearest, the nearest one stays.
    cell[own[fits][::-1]], found[own[fits][::-1]] = other[fits][::-1], apart[fits][::-1]
    return cell, found


def _are_level(lines: Lines, own: np.ndarray, other: np.ndarray, height_m: float) -> np.ndarray:
    """Return which pairs of cells differ by less than `height_m` in height above their beds, or above the bed of one.

    The head of a far rail may hide all of its own bed: what is lowest there is its foot or its face.
    """
    level = np.abs(lines.height[other] - lines.height[own]) < height_m
    if lines.ground is None:
        return level
    for bed in (own, other):
        level |= np.abs(rise_above(lines, own, other, bed)) < height_m
    distance_m = np.hypot(*(lines.axis[other] - lines.axis[own]).T)
    return level & (np.abs(lines.ground.z[other] - lines.ground.z[own]) < CANT * distance_m + NOISE_M)


def rise_above(lines: Lines, own: np.ndarray, other: np.ndarray, bed: np.ndarray) -> np.ndarray:
    """By how much cells `other` are higher than cells `own`, above the bed of cells `bed`, (k,) metres, or NaN."""
    if lines.ground is None:
        return np.full(len(own), np.nan)
    step, rise = lines.axis[other] - lines.axis[own], lines.ground.z[other] - lines.ground.z[own]
    return rise - np.einsum("ij,ij->i", step, lines.ground.slope[bed])


def runs_inside(
    lines: Lines,
    rank: np.ndarray,
    links: np.ndarray,
    gauges_m: Sequence[float],
    head_width_m: float,
    beyond_m: float = SPACING_M,
    more: float = 0.0,
    fits: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Return which cells belong to something that runs along what is rather a rail, nearer than a track, (n,) bool.

    That has a `rank`, (n,), higher by `more`, and is at most `beyond_m` further away than the other rail of its track;
    `links`, (m, 2), are pairs of cells on one line, and `fits` says which cells and cells of such a rail, (k,) numbers
    each, may be such a pair.
    """
    inside = np.zeros(len(lines.axis), dtype=bool)
    if not len(rank):
        return inside
    single, rails = np.flatnonzero(rank < rank.max()), np.flatnonzero(rank > rank.min())
    if not len(single) or not len(rails):
        return inside
    too_far_m = max(gauges_m) + head_width_m + beyond_m
    reach_m = np.hypot(too_far_m, LEVEL_WITH_M)
    near = cKDTree(lines.axis[single]).sparse_distance_matrix(
        cKDTree(lines.axis[rails]), reach_m, output_type="ndarray"
    )
    own, rail = single[near["i"]], rails[near["j"]]
    step = lines.axis[own] - lines.axis[rail]
    left = np.abs(np.einsum("ij,ij->i", step, lines.across[rail]))
    ahead = np.abs(np.einsum("ij,ij->i", step, lines.along[rail]))
    beside = (left > head_width_m + INSIDE_M) & (left < too_far_m) & (ahead < LEVEL_WITH_M)
    beside &= np.abs(turns(lines.theta[own], lines.theta[rail])) < PARALLEL_RAD
    beside &= rank[own] + more < rank[rail]
    if fits is not None:
        beside &= fits(own, rail)
    inside[own[beside]] = True
    return _majority(inside, links)


def _majority(flag: np.ndarray, links: np.ndarray) -> np.ndarray:
    """Give each cell the flag of most cells on its line."""
    both = np.concatenate([links, links[:, ::-1]])
    votes = flag + np.bincount(both[:, 0], flag[both[:, 1]], len(flag))
    voters = 1 + np.bincount(both[:, 0], minlength=len(flag))
    return votes > MAJORITY * voters
