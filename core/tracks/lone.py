"""Rails of no track: which they are, and which of them cannot be rails (docs/method.md section 8.10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import resample, unit_tangents
from ..rails import Centerline, RailLine

STEP_M = 1.0
"""Spacing of the places at which a lone line is compared with the tracks next to it."""

REACH_M = 10.0
"""Tracks further away than this do not tell the height of a rail."""

ABREAST = np.cos(np.radians(20.0))
"""Cosine of the angle between a line and a track up to which the line runs next to the track; bridges cross it."""

SAME_BED_M, MAX_STEP_M = 2.5, 0.3
"""Up to this distance from the axis of a track, a line is on the bed of that track, and no rail of it is further above
or below the track's rails than this: conductor rails and racks reach 0.15 m. Platforms begin at 0.38 m."""

BANK = 1 / 1.5
"""Slope of a bank: by how much per metre the bed of the next track may be higher or lower."""

MIN_OFF_SHARE, MIN_COMPARED_SHARE = 0.5, 0.5
"""Share of the compared places of a line that must be too high or too low, and share of the line that must be next to a
track, for the line to be left out."""


def assign_tracks(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline]
) -> tuple[list[RailLine], list[tuple[RailLine, float]]]:
    """State the tracks of each rail, and find lone lines that are too high or too low to be rails.

    Parameters
    ----------
    rails : sequence of RailLine
    centerlines : sequence of Centerline
        All tracks of these rails.

    Returns
    -------
    kept : list of RailLine
        With their `track_ids`.
    left_out : list of (RailLine, float)
        Lines that cannot be rails, and their height above the tracks next to them, metres.
    """
    kept: list[RailLine] = []
    left_out: list[tuple[RailLine, float]] = []
    for rail in rails:
        tracks = tuple(line.track_id for line in centerlines if rail.rail_id in (*line.left_ids, *line.right_ids))
        above_m = 0.0 if tracks else _off_level_m(rail, centerlines)
        if above_m:
            left_out.append((rail, above_m))
        else:
            kept.append(replace(rail, track_ids=tracks))
    return kept, left_out


def _off_level_m(rail: RailLine, centerlines: Sequence[Centerline]) -> float:
    """Return the height of a line above the tracks next to it if it is too high or too low for a rail, else 0."""
    if np.isnan(rail.xyz[:, 2]).any() or len(rail.xyz) < 2:
        return 0.0
    places, _ = resample(rail.xyz, STEP_M)
    directions = unit_tangents(places)
    apart, above = np.full(len(places), np.inf), np.zeros(len(places))
    for line in centerlines:
        if np.isnan(line.xyz[:, 2]).any() or not _near(line.xyz, places):
            continue
        stations, _ = resample(line.xyz, STEP_M)
        distance, nearest = cKDTree(stations[:, :2]).query(places[:, :2], distance_upper_bound=REACH_M)
        found = np.flatnonzero(np.isfinite(distance))
        nearest = nearest[found]
        along = np.abs(np.einsum("ij,ij->i", unit_tangents(stations)[nearest], directions[found])) > ABREAST
        closer = found[along & (distance[found] < apart[found])]
        apart[closer] = distance[closer]
        above[closer] = places[closer, 2] - stations[nearest[np.searchsorted(found, closer)], 2]
    compared = np.isfinite(apart)
    if np.count_nonzero(compared) < MIN_COMPARED_SHARE * len(places):
        return 0.0
    allowed = MAX_STEP_M + BANK * np.maximum(apart[compared] - SAME_BED_M, 0.0)
    off = np.abs(above[compared]) > allowed
    return float(np.median(above[compared])) if np.mean(off) > MIN_OFF_SHARE else 0.0


def _near(line: np.ndarray, places: np.ndarray) -> bool:
    """Return whether the extents of two lines are within reach of each other."""
    low, high = line[:, :2].min(axis=0) - REACH_M, line[:, :2].max(axis=0) + REACH_M
    return bool((places[:, :2].min(axis=0) < high).all() and (places[:, :2].max(axis=0) > low).all())
