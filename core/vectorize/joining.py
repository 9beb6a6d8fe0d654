"""Rail ends that face each other across a gap are joined by a curve that a rail could follow.

See docs/method.md section 4.8.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import (
    STAIRS_M,
    STEADY_TRANSITION_M,
    STEP_M,
    TRANSITION_M,
    Bridge,
    bridge,
    cut_back,
    even_points,
    tip_and_direction,
)
from ..lines.network import LineNetwork
from ..progress import SILENT, Progress
from .crossings import MAX_MERGED_M

DIRECTION_M = 2.0
"""Length over which the direction of an end is measured: stairs of a raster line are up to this long."""

HOOKS_M = (0.0, 1.0, 2.0)
"""Lengths cut off both ends before a join is tried, in this order. Weeds, guard rails and wing rails may have bent
the ends aside, even until they overlap side by side."""

MIN_PIECE_M = 0.25
"""Shorter pieces have no direction and are not joined."""

UNSEEN_M = 0.10
"""A place this far from all cells shows neither its rail nor one that is merged with it."""


def join_gaps(
    network: LineNetwork, seen: cKDTree, max_gap_m: float, gap_angle_deg: float, progress: Progress = SILENT
) -> LineNetwork:
    """Join ends that face each other across a gap.

    At least one of the two ends is free; the other may be in a node, as at a frog that was mistaken for a branching.
    Joining goes in rounds: each joins the pairs of ends that are each other's cheapest partner, because the direction
    of a joined line is known better.

    At most `max_gap_m` between the ends is away from all cells, `seen`, and each points at the other within
    `gap_angle_deg`. Where rails merge, lines end without a gap: up to `MAX_MERGED_M` are bridged there.
    """
    while True:
        joins = _possible_joins(network, seen, max_gap_m, gap_angle_deg, progress)
        best: dict[int, tuple[int, int]] = {}
        for ends in sorted(joins, key=lambda ends: (joins[ends].cost, ends), reverse=True):
            best[ends[0]] = best[ends[1]] = ends
        chosen = {ends: joins[ends] for ends in joins if best[ends[0]] == best[ends[1]] == ends}
        if not chosen:
            return network
        network = network.bridged(chosen, {})


def _possible_joins(
    network: LineNetwork, seen: cKDTree, max_gap_m: float, gap_angle_deg: float, progress: Progress
) -> dict[tuple[int, int], Bridge]:
    """Find every pair of ends that could be joined."""
    degrees = network.degrees()[network.ends.ravel()]
    ends = np.flatnonzero(degrees != 2)
    ends = ends[network.lengths()[ends // 2] >= MIN_PIECE_M]
    if len(ends) < 2:
        return {}
    tips = network.nodes[network.ends.ravel()[ends]]
    pairs = cKDTree(tips).query_pairs(max(max_gap_m, MAX_MERGED_M), output_type="ndarray")
    pairs = pairs[(degrees[ends[pairs]] == 1).any(axis=1)]
    joins: dict[tuple[int, int], Bridge] = {}
    for hook_m in HOOKS_M:
        progress.check()
        view = _view(network, ends, hook_m)
        (tip, way), (other_tip, other_way) = view[:, pairs[:, 0]], view[:, pairs[:, 1]]
        facing = _faces(tip, way, other_tip, gap_angle_deg) & _faces(other_tip, other_way, tip, gap_angle_deg)
        for one, other in ends[pairs[facing]].tolist():
            if (one, other) in joins:
                continue
            found = _across(network, (one, other), hook_m)
            if found is not None and unseen_m(found.points, seen) <= max_gap_m:
                joins[one, other] = found
    return joins


def _across(network: LineNetwork, ends: tuple[int, int], hook_m: float) -> Bridge | None:
    """Find the curve between two line ends without their hooks; a curve that replaces hooks must not swerve."""
    one, other = (cut_back(network.from_end(end), hook_m) for end in ends)
    found = bridge(one, other, transition_m=STEADY_TRANSITION_M if hook_m else TRANSITION_M)
    if found is None:
        return None
    return replace(found, cuts_m=(found.cuts_m[0] + hook_m, found.cuts_m[1] + hook_m))


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Measure the length of a curve away from all cells, given its points, one every `STEP_M`."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


def _view(network: LineNetwork, ends: np.ndarray, hook_m: float) -> np.ndarray:
    """Return line ends without their last `hook_m`, and unit vectors out of them, (2, k, 2); NaN for short lines."""
    lengths, found = network.lengths(), np.full((2, len(ends), 2), np.nan)
    for number, end in enumerate(ends.tolist()):
        if hook_m == 0 or lengths[end // 2] > hook_m + DIRECTION_M:
            points = even_points(cut_back(network.from_end(end), hook_m), DIRECTION_M)
            found[:, number] = tip_and_direction(points)
    return found


def _faces(tips: np.ndarray, outward: np.ndarray, others: np.ndarray, angle_deg: float) -> np.ndarray:
    """Mark the ends that point at other places, (k, 2) each, within an angle, (k,) bool; False for NaN."""
    across = others - tips
    ahead = (across * outward).sum(axis=1)
    aside = np.abs(across[:, 0] * outward[:, 1] - across[:, 1] * outward[:, 0])
    return (ahead > 0) & (aside <= ahead * np.tan(np.radians(angle_deg)) + STAIRS_M)
