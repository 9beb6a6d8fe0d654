"""Rail ends that face each other across a gap are joined by a curve that a rail could follow.

See docs/method.md section 4.9.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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

HOOKS_M = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (0.0, 2.0))
"""Lengths cut off the two ends before a join is tried, in this order. Weeds, guard rails and wing rails may have bent
the ends aside, even until they overlap side by side."""

MIN_PIECE_M = 0.25
"""Shorter pieces have no direction and are not joined."""

UNSEEN_M = 0.10
"""A place this far from all cells shows neither its rail nor one that is merged with it."""


def join_gaps(
    network: LineNetwork,
    max_gap_m: float,
    gap_angle_deg: float,
    seen: cKDTree | None = None,
    progress: Progress = SILENT,
) -> LineNetwork:
    """Join ends that face each other across a gap.

    At least one of the two ends is free; the other may be in a node, as at a frog that was mistaken for a branching.
    Joining goes in rounds: each joins the pairs of ends that are each other's
    cheapest partner, because the direction of a joined line is known better.

    Parameters
    ----------
    network : LineNetwork
    max_gap_m, gap_angle_deg : float
        Ends at most this far apart are joined if each points at the other within this angle.
    seen : cKDTree, optional
        Places of rail cells. Ends up to `MAX_MERGED_M` apart are joined too if at most `max_gap_m` of the curve is away
        from all cells: where rails merge, lines end without a gap.
    progress : Progress
        Only asked for a cancel, because the number of rounds is unknown.
    """
    while True:
        joins = _possible_joins(network, max_gap_m, gap_angle_deg, seen, progress)
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
    progress: Progress,
) -> dict[tuple[int, int], Bridge]:
    """Find every pair of ends that could be joined."""
    degrees = network.degrees()[network.ends.ravel()]
    ends = np.flatnonzero(degrees != 2)
    ends = ends[network.lengths()[ends // 2] >= MIN_PIECE_M]
    if len(ends) < 2:
        return {}
    views = {hook_m: _view(network, ends, hook_m) for hook_m in sorted({hook_m for both in HOOKS_M for hook_m in both})}
    reach_m = max_gap_m if seen is None else max(max_gap_m, MAX_MERGED_M)
    pairs = cKDTree(views[0.0].tips).query_pairs(reach_m, output_type="ndarray")
    pairs = pairs[(degrees[ends[pairs]] == 1).any(axis=1)]
    joins: dict[tuple[int, int], Bridge] = {}
    for hooks_m in HOOKS_M:
        progress.check()
        view, other_view = (views[hook_m].of(pairs[:, side]) for side, hook_m in enumerate(hooks_m))
        facing = view.faces(other_view.tips, gap_angle_deg) & other_view.faces(view.tips, gap_angle_deg)
        for one, other in ends[pairs[facing]].tolist():
            if (one, other) in joins:
                continue
            found = _across(network, (one, other), hooks_m)
            if found is not None and (seen is None or unseen_m(found.points, seen) <= max_gap_m):
                joins[one, other] = found
    return joins


def _across(network: LineNetwork, ends: tuple[int, int], hooks_m: tuple[float, float]) -> Bridge | None:
    """Find the curve between two line ends without their hooks; a curve that replaces hooks must not swerve."""
    one, other = (cut_back(network.from_end(end), hook_m) for end, hook_m in zip(ends, hooks_m))
    found = bridge(one, other, transition_m=STEADY_TRANSITION_M if any(hooks_m) else TRANSITION_M)
    if found is None:
        return None
    return replace(found, cuts_m=(found.cuts_m[0] + hooks_m[0], found.cuts_m[1] + hooks_m[1]))


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Measure the length of a curve away from all cells, given its points, one every `STEP_M`."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


@dataclass(frozen=True)
class _View:
    """Line ends and where they point, (k, 2) arrays; NaN for lines that are too short.

    Attributes
    ----------
    tips, outward : (k, 2) arrays
        Places of the ends, and unit vectors out of their lines.
    """

    tips: np.ndarray
    outward: np.ndarray

    def of(self, numbers: np.ndarray) -> _View:
        """Select ends by their numbers, repeated at will."""
        return _View(self.tips[numbers], self.outward[numbers])

    def faces(self, others: np.ndarray, angle_deg: float) -> np.ndarray:
        """Mark the ends that point at other places, (k, 2), within an angle, (k,) bool; False for NaN."""
        across = others - self.tips
        ahead = (across * self.outward).sum(axis=1)
        aside = np.abs(across[:, 0] * self.outward[:, 1] - across[:, 1] * self.outward[:, 0])
        return (ahead > 0) & (aside <= ahead * np.tan(np.radians(angle_deg)) + STAIRS_M)


def _view(network: LineNetwork, ends: np.ndarray, hook_m: float) -> _View:
    """See line ends without their last `hook_m`."""
    lengths = network.lengths()
    tips, outward = np.full((2, len(ends), 2), np.nan)
    for number, end in enumerate(ends.tolist()):
        if hook_m == 0 or lengths[end // 2] > hook_m + DIRECTION_M:
            points = even_points(cut_back(network.from_end(end), hook_m), DIRECTION_M)
            tips[number], outward[number] = tip_and_direction(points)
    return _View(tips, outward)
