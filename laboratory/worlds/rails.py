"""Rails laid in cross-sections exactly where the truth has them: inclined, with flangeways and the rails at frogs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..scenes.frogs import FLANGEWAY_M, frog_guards
from ..scenes.raw_world import FOOT, GUARD, HEAD, World, along_and_left, fasten, rail
from ..scenes.tracks import Railhead, Track

ABOVE_M = 0.01
"""Height of guard rails above the running rails."""


@dataclass(frozen=True)
class Laid:
    """A rail in the profiles, (profiles,) arrays; NaN where a profile does not cut it.

    Place of the top, and the turn of the head to the left in radians; `side` is +1 for the left rail of a track and -1
    for the right one.
    """

    left_m: np.ndarray
    top_m: np.ndarray
    lean: np.ndarray
    side: int = 0


def cut(world: World, head: Railhead, side: int = 0) -> Laid:
    """Cut a railhead with the profiles of a world."""
    sample, at, left = along_and_left(world.reference, head.top[:, :2])
    lean = np.arctan2(-np.sum(head.axis[:, :2] * world.reference.left_normal[sample], axis=1), head.axis[:, 2])
    at = at - world.shear * left
    order = np.argsort(at)
    place, top, turn = (
        np.interp(world.station, at[order], one[order], np.nan, np.nan) for one in (left, head.top[:, 2], lean)
    )
    return Laid(place, top, turn, side)


def cut_all(world: World, tracks: Sequence[Track]) -> list[Laid]:
    """Cut the railheads of tracks with the profiles of a world."""
    return [cut(world, track.railhead(side), side) for track in tracks for side in track.sides]


def lay(world: World, tracks: Sequence[Track], where: np.ndarray | None = None) -> None:
    """Lay the rails of tracks in some profiles with fastenings, and check and wing rails at their frogs.

    All tracks run in the direction of the reference line.
    """
    laid = cut_all(world, tracks)
    for number, one in enumerate(laid):
        whole = ~_in_flangeways(one, [other for other in laid if other is not one], world.head_width_m)
        seen = whole if where is None else whole & where
        rail(world, one.left_m, one.top_m, seen, (HEAD, FOOT), np.nan_to_num(one.lean))
        fasten(world, one.left_m, one.top_m, [other.left_m for other in laid[:number]], seen)
    for head in frog_guards(tracks, world.head_width_m):
        one = cut(world, head)
        rail(world, one.left_m, one.top_m + ABOVE_M, where, (GUARD, GUARD), np.nan_to_num(one.lean))


def _in_flangeways(one: Laid, others: Sequence[Laid], head_width_m: float) -> np.ndarray:
    """Profiles in which the flangeway of a rail that crosses it is cut through a rail, (profiles,) bool."""
    hidden = np.zeros(len(one.left_m), dtype=bool)
    for other in others:
        off_m = one.left_m - other.left_m
        there = off_m[np.isfinite(off_m)]
        if len(there) and there.min() < -head_width_m and there.max() > head_width_m:
            into_gauge = -other.side * off_m - head_width_m / 2
            with np.errstate(invalid="ignore"):
                hidden |= (into_gauge > 0) & (into_gauge <= FLANGEWAY_M)
    return hidden
