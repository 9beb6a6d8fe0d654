"""Where rails of different tracks meet: shared blades, the flangeways of frogs and the guard rails around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .tracks import Railhead, Track

FLANGEWAY_M = 0.044
"""Clear width that a wheel's flange needs beside a rail at frogs and guard rails (38 to 50 mm)."""

MEETING_M = 0.2
"""Rails nearer than this are looked at: head, flangeway and some room."""

CHECK_RAIL_M = 3.6
"""Length of the guard rail opposite a frog; two thirds of it lie ahead of the nose."""

WING_RAIL_M = (0.2, 1.8)
"""How far the wing rails of a frog reach before and behind the place where the axes of the rails cross."""

COARSE_SAMPLES = 50
"""Every so many samples of a head serve to tell whether two rails come near each other at all."""


@dataclass(frozen=True)
class Frog:
    """A place where a rail crosses one of another track.

    Attributes
    ----------
    track, side : int
        The rail; side is +1 for a left and -1 for a right one.
    sample : int
        Where on its track's curve.
    behind : int
        +1 if the nose lies ahead along the curve, seen from the crossing axes, -1 if it lies back.
    """

    track: int
    side: int
    sample: int
    behind: int


def laid_together(tracks: Sequence[Track], clouds: Sequence[np.ndarray], head_width_m: float) -> list[np.ndarray]:
    """Make the points of rails that were scanned one by one those of rails laid together.

    Where two heads overlap the later one gives no points; where two rails cross, the flangeway of either is cut through
    the other.

    Parameters
    ----------
    tracks : sequence of Track
    clouds : sequence of (n, 3) array
        Points of each running rail, in the order of the tracks and their sides.
    head_width_m : float
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
    """Lay a check rail beside the rail opposite each frog and a wing rail beside each rail that runs through it.

    Only crossings of a left and a right rail have them: the acute ones of turnouts and diamonds.
    """
    guards = []
    for frog in _frogs(tracks, head_width_m):
        track = tracks[frog.track]
        step_m = track.curve.step_m
        ahead = frog.sample * step_m - frog.behind * CHECK_RAIL_M / 6
        check = ahead - CHECK_RAIL_M / 2, ahead + CHECK_RAIL_M / 2
        before, after = WING_RAIL_M if frog.behind > 0 else WING_RAIL_M[::-1]
        wing = frog.sample * step_m - before, frog.sample * step_m + after
        inset_m = 2 * (head_width_m + FLANGEWAY_M)
        guards.append(track.piece(*check).inset(inset_m).railhead(-frog.side))
        guards.append(track.piece(*wing).inset(inset_m).railhead(frog.side))
    return guards


def _rails(tracks: Sequence[Track]) -> list[tuple[int, int, Railhead]]:
    """List track, side and head of every running rail."""
    return [(number, side, track.railhead(side)) for number, track in enumerate(tracks) for side in track.sides]


def _meetings(rails: Sequence[tuple[int, int, Railhead]]) -> Iterator[tuple[int, int]]:
    """List ordered pairs of rails of different tracks that come near each other."""
    coarse = [head.top[::COARSE_SAMPLES, :2] for _, _, head in rails]
    trees = [cKDTree(top) for top in coarse]
    for one, (track, _, head) in enumerate(rails):
        reach = MEETING_M + 2 * np.linalg.norm(head.top[1] - head.top[0]) * COARSE_SAMPLES
        for other, (other_track, _, _) in enumerate(rails):
            if track != other_track and trees[other].query(coarse[one])[0].min() < reach:
                yield one, other


def _offsets(points: np.ndarray, head: Railhead) -> tuple[np.ndarray, np.ndarray]:
    """Find the points near a head, and how far to the left of its axis each lies."""
    distance, sample = cKDTree(head.top).query(points, distance_upper_bound=MEETING_M)
    near = np.flatnonzero(np.isfinite(distance))
    sample = sample[near]
    return near, np.sum((points[near] - head.top[sample]) * head.across[sample], axis=1)


def _crosses(own: Railhead, head: Railhead, head_width_m: float) -> bool:
    """Tell whether a rail passes from one side of another to its other side."""
    _, left = _offsets(own.top, head)
    return len(left) > 0 and left.min() < -head_width_m / 2 and left.max() > head_width_m / 2


def _frogs(tracks: Sequence[Track], head_width_m: float) -> Iterator[Frog]:
    """Find the acute crossings of rails, each once for either rail."""
    rails = _rails(tracks)
    for one, other in _meetings(rails):
        (track, side, own), (_, other_side, head) = rails[one], rails[other]
        if side != other_side and _crosses(own, head, head_width_m):
            near, left = _offsets(own.top, head)
            sample = int(near[np.argmin(np.abs(left))])
            # Behind the nose each rail lies on the field side of the other.
            behind = 1 if left[-1] * other_side > left[0] * other_side else -1
            yield Frog(track, side, sample, behind)
