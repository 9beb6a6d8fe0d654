"""The points along a line: everything about the head of the line is measured from them.

See docs/method.md section 6.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..polyline import length_along, project
from ..progress import SILENT, Progress
from .edges import Widths, histograms, search_distance, widest
from .level import AXIS_SHARE, MIN_NOISE_M, OFF_TOP_SIGMAS, cross_slope, robust_sigma, rough_level
from .neighbours import free_edges

MIN_ON_HEAD = 80
"""Points needed on a head to find its top; fewer do not determine a slope."""

MAX_DEPTH_M, MAX_DEPTH_SIGMAS = 0.006, 1.5
"""Depth below the top, in metres and in standard deviations of the noise, beyond which a point may be on a side face or
a corner. Tighter than the noise requires: points on top are lost evenly across the head, so the estimate stays
unbiased."""

MAX_ABOVE_SIGMAS = 3.0
"""Height above the top, in standard deviations of the noise, beyond which a point is a weed."""

BLENDED_M = 0.006
"""Fall of both rims of a head below its crown from which beams blend the head and the ballast, as those from the air
do. Seen by narrow beams, the round corners fall by 1 to 2 mm, and the rim of a line that is off the head by more, but
not both."""

CROWN_HEADS, RIM_HEADS, SHOULDER_HEADS = 0.2, (0.3, 0.5), (0.55, 0.75)
"""Parts of the head width on either side of the axis: the crown, the rims, and what is beyond a head that is not
blurred."""

SHOULDER_SHARE = 0.2
"""Points per width on either shoulder, as a share of those on the crown, from which a blurred head goes on there."""


@dataclass(frozen=True)
class HeadPoints:
    """A line, and the points near it in order along the line.

    Attributes
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left of the line and height, metres.
    width_m : float
        Width of the head.
    line : (k, 2) array
    free : (2, s) bool array
        Where the right and the left edge of the head are free of other heads; see `neighbours.free_edges`.
    strips : (n,) int array or None
        See `RailPoints`.
    """

    t: np.ndarray
    across: np.ndarray
    z: np.ndarray
    width_m: float
    line: np.ndarray
    free: np.ndarray
    strips: np.ndarray | None = None

    def __getitem__(self, which: np.ndarray) -> HeadPoints:
        strips = None if self.strips is None else self.strips[which]
        return replace(self, t=self.t[which], across=self.across[which], z=self.z[which], strips=strips)

    @cached_property
    def along(self) -> np.ndarray:
        """Chainage of the vertices of the line, (k,)."""
        return length_along(self.line)

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self.along[-1])

    def within(self, share: float) -> np.ndarray:
        """Return which points are this close to the line, in head widths, (n,) bool."""
        return np.abs(self.across) <= share * self.width_m

    @cached_property
    def is_blended(self) -> bool:
        """Whether heights fall from the crown to both sides, so that the head has no edges that could be seen.

        Beams from the air show this on the rims of the head, dense matching of photographs on shoulders beyond them.
        """
        near = self[self.within(SHOULDER_HEADS[1])]
        head = near.within(RIM_HEADS[1])
        if head.sum() < MIN_ON_HEAD:
            return False
        level = rough_level(near.t[head], near.z[head])
        above, heads = near.z - np.interp(near.t, near.t[head], level), near.across / self.width_m
        crown = np.abs(heads) < CROWN_HEADS
        if not crown.any():
            return False
        for low, high in (RIM_HEADS, SHOULDER_HEADS):
            sides = [(side * heads > low) & (side * heads <= high) for side in (1, -1)]
            least = max(SHOULDER_SHARE * (high - low) / (2 * CROWN_HEADS) * crown.sum(), 1) if low > RIM_HEADS[0] else 1
            if min(side.sum() for side in sides) >= least:
                fall_m = np.median(above[crown]) - max(np.median(above[side]) for side in sides)
                if fall_m > BLENDED_M:
                    return True
        return False

    @cached_property
    def top(self) -> tuple[np.ndarray, float]:
        """Points on the top of the head, (n,) bool, allowing for its slope across, and the noise of their heights."""
        head = self.within(0.5)
        if head.sum() < MIN_ON_HEAD:
            return np.zeros(len(self.t), dtype=bool), MIN_NOISE_M
        _, flat = self._flat(head)
        noise = robust_sigma(flat[head & (np.abs(flat) < 2 * MAX_DEPTH_M)])
        noise = robust_sigma(flat[head & (np.abs(flat) < max(2 * MAX_DEPTH_M, OFF_TOP_SIGMAS * noise))])
        lowest, highest = -max(MAX_DEPTH_M, MAX_DEPTH_SIGMAS * noise), max(MAX_DEPTH_M, MAX_ABOVE_SIGMAS * noise)
        return (flat >= lowest) & (flat <= highest), noise

    @cached_property
    def histograms(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `edges.histograms`: of the points on top."""
        top, _ = self.top
        return histograms(self.t[top], self.across[top], self.length_m, self.width_m)

    def in_frame(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the points in the frame of their head: offset to the left and height, (n,), from the top on the line.

        The third array is the height of this top, (n,). All are NaN if the crown has too few points.
        """
        crown = self.within(AXIS_SHARE)
        if crown.sum() < MIN_ON_HEAD:
            nothing = np.full(len(self.t), np.nan)
            return nothing, nothing, nothing
        slope, flat = self._flat(crown)
        return self.across + slope * flat, flat, self.z - slope * self.across - flat

    def _flat(self, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the slope across and the height without it, (n,) each, above the points that show the `level`."""
        t, head = self.t, self.within(0.5)
        above = self.z - np.interp(t, t[level], rough_level(t[level], self.z[level]))
        slope = np.interp(t, t[head], cross_slope(t[head], self.across[head], above[head], self.width_m))
        flat = above - slope * self.across
        return slope, flat - np.interp(t, t[level], rough_level(t[level], flat[level]))


def near_lines(
    lines: Sequence[np.ndarray],
    xyz: np.ndarray,
    widths: Widths,
    strips: np.ndarray | None = None,
    progress: Progress = SILENT,
) -> list[HeadPoints]:
    """Find the points of each line.

    Parameters
    ----------
    lines : sequence of (k, 2) arrays
    xyz : (n, 3) array
    widths : float or (l,) array
        Width of the heads, of all lines or of each, metres.
    strips : (n,) int array or None
        See `RailPoints`.
    progress : Progress
    """
    feet = project(lines, xyz[:, :2], search_distance(widest(widths)), progress)
    free = free_edges(lines, widest(widths))
    z, own = xyz[feet.point, 2], None if strips is None else strips[feet.point]
    heads = []
    for number, width_m in enumerate(np.broadcast_to(widths, len(lines)).tolist()):
        mine = slice(*np.searchsorted(feet.line, [number, number + 1]))
        strip = None if own is None else own[mine]
        heads.append(HeadPoints(feet.t[mine], feet.across[mine], z[mine], width_m, lines[number], free[number], strip))
    return heads
