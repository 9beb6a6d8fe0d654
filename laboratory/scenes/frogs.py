"""Places where rails of different tracks meet: shared blades, flangeways and the guard rails at frogs.

See `rasters.fittings` for the same guard rails in plan, and for the differences.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..rasters import fittings
from ..rasters.fittings import guard_offset
from .tracks import Railhead, Track

FLANGEWAY_M = sum(fittings.FLANGEWAY_M) / 2
"""Clear width next to a rail at frogs and guard rails: 44 mm."""

MEETING_M = 0.2
"""Distance below which rails are compared: head, flangeway and some clearance."""

CHECK_RAIL_M = 3.6
"""Length of the guard rail opposite a frog; two thirds of it are ahead of the nose."""

WING_RAIL_M = (0.2, 1.8)
"""Lengths of a wing rail before and behind the point where the axes of the rails cross."""

COARSE_SAMPLES = 50
"""Step, in samples, of the search for rails that come near each other."""


@dataclass(frozen=True)
class Frog:
    """A place where a rail, +1 the left and -1 the right one, crosses a rail of another track.

    `sample` is that of the curve of its track; `behind` is +1 if the nose follows the crossing of the axes along the
    curve, -1 if it precedes it.
    """

    track: int
    side: int
    sample: int
    behind: int


def laid_together(tracks: Sequence[Track], clouds: Sequence[np.ndarray], head_width_m: float) -> list[np.ndarray]:
    """Remove from the points of rails, (n, 3) each by track and side, those that other rails make impossible.

    The rails were scanned one by one. Where two heads overlap, the later one has no points. Where two rails cross, the
    flangeway of each is cut through the other.
    """
    clouds = list(clouds)
    rails = _rails(tracks)
    for one, other in _meetings(rails):
        own, (_, side, head) = rails[one][2], rails[other]
        crossing = _crosses(own, head, head_width_m)
        near, left = _offsets(clouds[one], head)
        hidden = np.abs(left) <= head_width_m / 2 if one > other else np.zeros(len(left), dtype=bool)
        if crossing:
            into_gauge = -side * left - head_width_m / 2
            hidden |= (into_gauge > 0) & (into_gauge <= FLANGEWAY_M)
        clouds[one] = np.delete(clouds[one], near[hidden], axis=0)
    return clouds


def frog_guards(tracks: Sequence[Track], head_width_m: float) -> list[Railhead]:
    """Lay a check rail opposite each frog and a wing rail along each rail that passes through it.

    Only crossings of a left and a right rail have them: the acute crossings of turnouts and diamonds.
    """
    guards = []
    for frog in _frogs(tracks, head_width_m):
        track = tracks[frog.track]
        step_m = track.curve.step_m
        ahead = frog.sample * step_m - frog.behind * CHECK_RAIL_M / 6
        check = ahead - CHECK_RAIL_M / 2, ahead + CHECK_RAIL_M / 2
        before, after = WING_RAIL_M if frog.behind > 0 else WING_RAIL_M[::-1]
        wing = frog.sample * step_m - before, frog.sample * step_m + after
        inner = replace(track, spacing_m=2 * guard_offset(track.spacing_m, head_width_m, FLANGEWAY_M))
        guards.append(inner.piece(*check).railhead(-frog.side))
        guards.append(inner.piece(*wing).railhead(frog.side))
    return guards


def _rails(tracks: Sequence[Track]) -> list[tuple[int, int, Railhead]]:
    """Return track, side and head of each running rail."""
    return [(number, side, track.railhead(side)) for number, track in enumerate(tracks) for side in track.sides]


def _meetings(rails: Sequence[tuple[int, int, Railhead]]) -> Iterator[tuple[int, int]]:
    """Yield the ordered pairs of rails of different tracks that come near each other."""
    coarse = [head.top[::COARSE_SAMPLES, :2] for _, _, head in rails]
    trees = [cKDTree(top) for top in coarse]
    for one, (track, _, head) in enumerate(rails):
        reach = MEETING_M + 2 * np.linalg.norm(head.top[1] - head.top[0]) * COARSE_SAMPLES
        for other, (other_track, _, _) in enumerate(rails):
            if track != other_track and trees[other].query(coarse[one])[0].min() < reach:
                yield one, other


def _offsets(points: np.ndarray, head: Railhead) -> tuple[np.ndarray, np.ndarray]:
    """Return which points are near a head, and their offsets to the left of its axis."""
    distance, sample = cKDTree(head.top).query(points, distance_upper_bound=MEETING_M)
    near = np.flatnonzero(np.isfinite(distance))
    sample = sample[near]
    return near, np.sum((points[near] - head.top[sample]) * head.across[sample], axis=1)


def _crosses(own: Railhead, head: Railhead, head_width_m: float) -> bool:
    """Return whether a rail passes from one side of another rail to the other side."""
    _, left = _offsets(own.top, head)
    return len(left) > 0 and left.min() < -head_width_m / 2 and left.max() > head_width_m / 2


def _frogs(tracks: Sequence[Track], head_width_m: float) -> Iterator[Frog]:
    """Yield the acute crossings of rails, once for each of the two rails."""
    rails = _rails(tracks)
    for one, other in _meetings(rails):
        (track, side, own), (_, other_side, head) = rails[one], rails[other]
        if side != other_side and _crosses(own, head, head_width_m):
            near, left = _offsets(own.top, head)
            sample = int(near[np.argmin(np.abs(left))])
            # Behind the nose, each rail is on the field side of the other.
            behind = 1 if left[-1] * other_side > left[0] * other_side else -1
            yield Frog(track, side, sample, behind)
