"""Rail ends that face each other across a gap are joined by a curve a rail could follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.bridges import STAIRS_M, STEADY_TRANSITION_M, TRANSITION_M, Bridge, bridge
from ..lines.ends import STEP_M, cut_back, stretch, way_out
from ..lines.network import LineNetwork
from ..progress import SILENT, Progress
from .crossings import MERGED_M

DIRECTION_M = 2.0
"""Stretch over which an end's direction is measured; the stairs of a raster line are up to this long."""

HOOKS_M = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (0.0, 2.0))
"""Lengths at two ends that weeds, guard and wing rails may have bent aside, so that the ends even lie beside each
other; joins are tried without them, the shortest first."""

SHORTEST_M = 0.25
"""Shorter pieces have no direction and join nothing."""


UNSEEN_M = 0.10
"""A place this far from any cell has no points of its rail, nor of one that it is merged with."""


def join_gaps(
    network: LineNetwork,
    max_gap_m: float,
    gap_angle_deg: float,
    seen: cKDTree | None = None,
    at_nodes: bool = True,
    progress: Progress = SILENT,
) -> LineNetwork:
    """Join ends that face each other, both within `gap_angle_deg` of the way across, at most `max_gap_m` apart.

    At least one of the two is free; the other may end in a node, as at a frog that was taken for a branching, unless
    `at_nodes` is false. Joins happen in rounds, each end with the partner that costs least, for a joined line shows
    better where it leads.

    Parameters
    ----------
    network : LineNetwork
    max_gap_m, gap_angle_deg : float
    seen : cKDTree, optional
        Places of rail cells. Ends up to `MERGED_M` apart are joined too, if no more than `max_gap_m` of the way lies
        far from these: where rails merge, or points are too few for the network, an end is not a gap.
    at_nodes : bool
    progress : Progress
        Only asked for a cancel: how many rounds there will be is not known.
    """
    while True:
        joins = _possible_joins(network, max_gap_m, gap_angle_deg, seen, at_nodes, progress)
        best: dict[int, tuple[int, int]] = {}
        for ends in sorted(joins, key=lambda ends: (joins[ends].cost, ends), reverse=True):
            best[ends[0]] = best[ends[1]] = ends
        partner, bridges, cuts_m = {}, {}, {}
        for one, other in (ends for ends in joins if best[ends[0]] == best[ends[1]] == ends):
            partner[one], partner[other] = other, one
            cuts_m[one], cuts_m[other] = joins[one, other].cuts_m
            bridges[one], bridges[other] = joins[one, other].points, joins[one, other].points[::-1]
        if not partner:
            return network
        network = network.cut_back(cuts_m).weld(partner, bridges)


def _possible_joins(
    network: LineNetwork,
    max_gap_m: float,
    gap_angle_deg: float,
    seen: cKDTree | None,
    at_nodes: bool,
    progress: Progress,
) -> dict[tuple[int, int], Bridge]:
    """Find every pair of ends that could be joined."""
    degrees = network.degrees()[network.ends.ravel()]
    free = np.flatnonzero(degrees != 2) if at_nodes else np.flatnonzero(degrees == 1)
    free = free[network.lengths()[free // 2] >= SHORTEST_M]
    if len(free) < 2:
        return {}
    ways = {hook_m: _ways(network, free, hook_m) for hook_m in sorted({hook_m for both in HOOKS_M for hook_m in both})}
    reach_m = max_gap_m if seen is None else max(max_gap_m, MERGED_M)
    pairs = cKDTree(ways[0.0][0]).query_pairs(reach_m, output_type="ndarray")
    pairs = pairs[(degrees[free[pairs]] == 1).any(axis=1)]
    joins: dict[tuple[int, int], Bridge] = {}
    for hooks_m in HOOKS_M:
        progress.check()
        one, other = (tuple(part[pairs[:, side]] for part in ways[hook_m]) for side, hook_m in enumerate(hooks_m))
        facing = _faces(*one, other[0], gap_angle_deg) & _faces(*other, one[0], gap_angle_deg)
        for one, other in free[pairs[facing]].tolist():
            if (one, other) in joins:
                continue
            found = _across(network, (one, other), hooks_m)
            if found is not None and (seen is None or unseen_m(found.points, seen) <= max_gap_m):
                joins[one, other] = found
    return joins


def _across(network: LineNetwork, ends: tuple[int, int], hooks_m: tuple[float, float]) -> Bridge | None:
    """Find the curve from one line end to another once their hooks are off; such a one may not swerve."""
    one, other = (cut_back(network.from_end(end), hook_m) for end, hook_m in zip(ends, hooks_m))
    found = bridge(one, other, transition_m=STEADY_TRANSITION_M if any(hooks_m) else TRANSITION_M)
    if found is None:
        return None
    return replace(found, cuts_m=tuple(cut_m + hook_m for cut_m, hook_m in zip(found.cuts_m, hooks_m)))


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Length of a curve's points, one every `STEP_M`, that lie far from all cells."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


def _ways(network: LineNetwork, ends: np.ndarray, hook_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Tips and unit vectors out of line ends whose last `hook_m` are off, (k, 2) each; NaN for lines too short."""
    lengths = network.lengths()
    tips, outward = np.full((2, len(ends), 2), np.nan)
    for number, end in enumerate(ends.tolist()):
        if hook_m == 0 or lengths[end // 2] > hook_m + DIRECTION_M:
            seen = stretch(cut_back(network.from_end(end), hook_m), DIRECTION_M)
            tips[number], outward[number] = way_out(seen)
    return tips, outward


def _faces(tips: np.ndarray, outward: np.ndarray, others: np.ndarray, angle_deg: float) -> np.ndarray:
    """Tell which other points lie within the fan of half opening `angle_deg` before line ends, (n,) bool; NaN does not.

    All are (n, 2) arrays: line ends, unit vectors out of the lines there, and the other points.
    """
    across = others - tips
    ahead = (across * outward).sum(axis=1)
    aside = np.abs(across[:, 0] * outward[:, 1] - across[:, 1] * outward[:, 0])
    return (ahead > 0) & (aside <= ahead * np.tan(np.radians(angle_deg)) + STAIRS_M)
