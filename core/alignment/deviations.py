"""How far measured tracks lie off given alignments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np

from ..errors import RailExtractError
from ..polyline import Polyline
from ..progress import Progress
from .elements import Alignment
from .measured import Track
from .stations import SAME_PLACE_M

BESIDE_M = 2.0
"""Largest median distance of a track from its alignment, metres: that of its neighbour is at least 3.4 m away."""


@dataclass(frozen=True)
class Deviations:
    """How far a track lies off its design, by the metre.

    `s`, (n,), is the distance along the design, metres, and `xyz`, (n, 3), the place on it, local metres. Slew, lift
    and difference of the cant, (n,), are measured minus design: across, positive to the left, and in height; NaN where
    unknown.
    """

    track_id: Optional[int]
    s: np.ndarray
    xyz: np.ndarray
    slew_mm: np.ndarray
    lift_mm: np.ndarray
    cant_diff_mm: np.ndarray


def beside(alignments: Sequence[Alignment], xy: np.ndarray) -> Optional[Alignment]:
    """Return the alignment along which a line with vertices, (n, 2) local metres, lies; None if it lies along none."""
    distances = [(_distance_m(alignment, xy), number) for number, alignment in enumerate(alignments)]
    nearest_m, number = min(distances, default=(np.inf, 0))
    return alignments[number] if nearest_m <= BESIDE_M else None


def _distance_m(alignment: Alignment, xy: np.ndarray) -> float:
    """Return the median distance of a line from an alignment; infinite if it lies past its ends."""
    foot = alignment.foot(xy)
    inside = foot.past_m == 0
    return float(np.median(np.abs(foot.across_m[inside]))) if np.count_nonzero(inside) > 1 else np.inf


def compared_with(
    alignments: Sequence[Alignment], tracks: Sequence[Track], progress: Progress
) -> list[tuple[Alignment, Deviations]]:
    """Return the deviations of each track, in the frame of the alignments, with the alignment beside it.

    Raises RailExtractError if none lies along an alignment; of some that do not, the user is told.
    """
    found, lost = [], []
    for track in tracks:
        alignment = beside(alignments, track.xyz[:, :2])
        if alignment is None:
            lost.append(str(track.track_id))
            continue
        along = Polyline(track.xyz).t
        found.append((alignment, deviations_of(alignment, track.track_id, track.xyz, along, track.cant)))
    if not found:
        raise RailExtractError("None of TRACKS lies along an alignment of INPUT: check the coordinate system of both.")
    if lost:
        progress.warning(f"Tracks {', '.join(lost)} do not lie along an alignment: they are left out.")
    return found


def deviations_of(
    alignment: Alignment, track_id: Optional[int], xyz: np.ndarray, along: np.ndarray, cant: np.ndarray
) -> Deviations:
    """Return how far a line, `xyz` (n, 3) in local metres, lies off an alignment, interpolated between its vertices.

    Some vertices may lie beside the alignment, and the line may run against it. `along`, (n,), is the plan distance of
    the vertices from the first one; `cant`, (k, 2), holds plan distance, increasing, and cant there, left rail minus
    right rail along the line, metres; empty if it is unknown.
    """
    foot = alignment.foot(xyz[:, :2])
    inside = foot.past_m == 0
    used = inside.copy()  # and the first vertex past either end, which lies beside the continued end
    used[1:] |= inside[:-1]
    used[:-1] |= inside[1:]
    order = np.argsort((foot.s + foot.past_m)[used], kind="stable")
    feet, across, z = (values[used][order] for values in (foot.s + foot.past_m, foot.across_m, xyz[:, 2]))
    first, last = max(feet[0], alignment.s_from), min(feet[-1], alignment.s_to)
    s = np.arange(np.ceil(first - SAME_PLACE_M), np.floor(last + SAME_PLACE_M) + 1.0)
    slew, lift = (np.interp(s, feet, values) for values in (across, z - alignment.heights(feet)))
    turned = foot.s[-1] < foot.s[0]
    cant_diff = np.full(len(s), np.nan)
    if len(cant):
        at = np.interp(cant[:, 0], along, foot.s)
        diff = np.where(turned, -cant[:, 1], cant[:, 1]) - alignment.cants(at)
        order = np.argsort(at, kind="stable")
        cant_diff = np.interp(s, at[order], diff[order], left=np.nan, right=np.nan)
    return Deviations(track_id, s, alignment.xyz(s), 1000 * slew, 1000 * lift, 1000 * cant_diff)
