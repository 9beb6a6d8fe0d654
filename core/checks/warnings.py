"""Warnings of what does not look like rails: points, before anything is computed, and the lines that they gave.

Coordinates in another unit than the one that the file states, and points far from any rail, would take hours: the
raster follows the points wherever they are. Lines may be lone ones beside tracks, of split classes, or displaced. See
docs/method.md sections 1.3, 7.1 and 8.9.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import AIRBORNE
from ..errors import CloudError, NoTrackError
from ..lines.smoothing import END_SHIFT, STATIONS_PER_SIGMA, filled, smooth_line
from ..parameters import Parameters
from ..polyline import Polyline, project, runs
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine
from ..tiles.grid import PointSource, Square, company_of, fullest
from ..tracks.centerlines import tracks_of_class

CELL_M, MIN_IN_CELL = 0.5, 3
"""A cell along the sparsest rail, with 20 points per metre, contains ten points. A cloud is thin if nine of ten points
have fewer than this in their cell."""

MAX_THIN_SHARE = 0.9

MIN_JUDGED = 100
"""Fewest points from which the density of a cloud is judged."""

FULLEST = 3
"""Squares with the most points, from which the density of a cloud is judged; more, if they have too few points."""

MAX_PER_METRE = 100_000
"""Most points per metre of the longer side of a cloud: ten times those of forty rails in front of a static scanner."""

SMALLEST_SPAN_M = 0.001
"""Stands in for the span of a cloud whose points share one place."""

EXPLAINED_M, MIN_EXPLAINED_SHARE = 0.2, 0.5
"""Distance from a rail within which a point can belong to it, more than half of its foot, and smallest share of such
points that gives no warning. In clouds with weeds and stones it is nine of ten."""

MAX_SAMPLE = 50_000
"""Most points of a square of which this share is computed: it is exact to 1 % then."""

AIRBORNE_SPACING_M, AIRBORNE_PER_METRE = 1.0, 12.0
"""Distance of points on rails below which a thin class may be that of an airborne cloud, and points per metre of rail
below which rails that were drawn are those of one: 40 points per square metre give nine."""

NO_LINE = (
    "The points found in the raw cloud give no rail: they are too few, or not on rails. Check the rail standard, the "
    "unit of the coordinates and MIN_LENGTH, or classify the rail points yourself."
)
"""What is said of points that look like those of rails and do not line up, such as those of kerbs and ditches."""

STEP_M = 1.0
"""Spacing of the places at which a lone line is compared with the tracks next to it."""

REACH_M = 10.0
"""Tracks further away than this do not tell the height of a rail."""

ABREAST = np.cos(np.radians(20.0))
"""Cosine of the angle between a line and a track up to which the line runs next to the track; bridges cross it."""

SAME_BED_M, MAX_STEP_M = 4.25, 0.3
"""Up to this distance from the axis of a track, a line is on its bed or on one that touches it: beds reach
2.5 m to either side of an axis, and the nearer rail is half a gauge before its own. No rail on them is further above or
below the track's rails than this: conductor rails and racks reach 0.15 m. Platforms begin at 0.38 m."""

BANK = 1 / 1.5
"""Slope of a bank: by how much per metre the bed of the next track may be higher or lower."""

MIN_OFF_SHARE, MIN_COMPARED_SHARE = 0.5, 0.5
"""Share of the compared places of a line that must be too high or too low, and share of the line that must be next to a
track, for the line to be left out."""

SAME_RAIL_M = 0.5
"""Ends of rails that are closer together belong to one rail: no two rails of any gauge end so close to each other."""


MAX_SHIFT_HEADS = 0.5
"""Largest displacement, in head widths, that points correct to within a centimetre, because the line is still above the
head. For a head of 72 mm in an arc of 15 m radius, 40 mm are corrected and 90 mm are not."""

MIN_RADIUS_M = 10.0
"""Radius of the tightest tram curve; a line that bends more sharply is not following a rail."""


def plausible(sources: Sequence[PointSource], progress: Progress = SILENT) -> list[PointSource]:
    """Return the classes whose points can be those of rails and warn of the others; raise CloudError if none is."""
    reasons = [_why_thin(source) for source in sources]
    if all(reasons):
        raise CloudError(str(reasons[0]))
    for source, reason in zip(sources, reasons):
        if reason:
            progress.warning(reason)
        elif sum(source.counts.values()) > MAX_PER_METRE * max(source.span_m, SMALLEST_SPAN_M):
            progress.warning(
                f"All points of class {source.class_code} are within {source.span_m:.3g} m of each other: if the "
                "coordinates are in kilometres, assign a coordinate system that says so."
            )
    return [source for source, reason in zip(sources, reasons) if not reason]


def warn_of_unexplained(source: PointSource, rails: Sequence[RailLine], progress: Progress = SILENT) -> None:
    """Warn the user if most points of a class are far from all rails, in its frame, as if it were another class."""
    near, total = 0, 0
    for square in fullest(source)[:FULLEST]:
        shift = source.frame.shift_to(square.frame)
        xy = source.near(square, 0.0).xyz[:, :2]
        xy = xy[:: len(xy) // MAX_SAMPLE + 1]
        lines = [part for rail in rails for part in _parts_near(rail.xyz[:, :2] + shift[:2], square, EXPLAINED_M)]
        feet = project(lines, xy, EXPLAINED_M)
        near, total = near + len(np.unique(feet.point)), total + len(xy)
    if near < MIN_EXPLAINED_SHARE * total:
        progress.warning(
            f"Only {100 * near / total:.0f} % of the points of class {source.class_code} are within {EXPLAINED_M} m of "
            "a rail: check the rail classes and the rail standard."
        )


def warn_of_airborne(source: PointSource, rails: Sequence[RailLine], progress: Progress = SILENT) -> None:
    """Warn the user if rails were drawn from as few points as airborne clouds have on them; parameters as above."""
    length_m = sum(rail.line.length_m for rail in rails)
    per_metre = sum(source.counts.values()) / length_m
    if per_metre < AIRBORNE_PER_METRE:
        progress.warning(
            f"The rails have {per_metre:.1f} points per metre, as in airborne clouds, which show no single railheads: "
            f"use {AIRBORNE}, which is more accurate there."
        )


def _parts_near(line: np.ndarray, square: Square, margin_m: float) -> list[np.ndarray]:
    """Return the parts of a line, (n, 2), that can be at most `margin_m` from a square: all segments whose box is."""
    if square.is_whole_plane:
        return [line]
    low, high = np.minimum(line[:-1], line[1:]), np.maximum(line[:-1], line[1:])
    near = ((high >= -margin_m) & (low <= square.side_m + margin_m)).all(axis=1)
    return [line[first : last + 2] for first, last in runs(near)]


def _why_thin(source: PointSource) -> str | None:
    """Return a sentence if the points of a class are too thin for rails."""
    squares = fullest(source)
    enough = np.searchsorted(np.cumsum([source.counts.get(square.key, 0) for square in squares]), MIN_JUDGED) + 1
    parts = [(square, source.near(square, 0.0).xyz) for square in squares[: max(FULLEST, enough)]]
    in_cell = np.concatenate([company[number] for number, company in (company_of(xyz, CELL_M, 0) for _, xyz in parts)])
    if len(in_cell) < MIN_JUDGED or np.mean(in_cell < MIN_IN_CELL) < MAX_THIN_SHARE:
        return None
    places = np.concatenate([(xyz + square.frame.shift_to(source.frame))[:, :2] for square, xyz in parts])
    spacing_m = float(np.median(cKDTree(places).query(places, 2)[0][:, 1]))
    airborne = f" For an airborne cloud, use {AIRBORNE}." if spacing_m < AIRBORNE_SPACING_M else ""
    return (
        f"The points of class {source.class_code} are {spacing_m:.2g} m apart over {source.span_m:.0f} m, too far for "
        "rails: if the coordinates are in centimetres or millimetres, assign a coordinate system that says so."
        f"{airborne}"
    )


def _off_level_m(rail: RailLine, centerlines: Sequence[Centerline]) -> float:
    """Return the height of a line above the tracks next to it if it is too high or too low for a rail, else 0."""
    if np.isnan(rail.xyz[:, 2]).any() or len(rail.xyz) < 2:
        return 0.0
    own = rail.line.resampled(STEP_M)
    places, directions = own.xyz, own.tangents
    apart, above = np.full(len(places), np.inf), np.zeros(len(places))
    for line in centerlines:
        if np.isnan(line.xyz[:, 2]).any() or not _near(line.xyz, places):
            continue
        stations = line.line.resampled(STEP_M)
        distance, nearest = cKDTree(stations.xy).query(places[:, :2], distance_upper_bound=REACH_M)
        found = np.flatnonzero(np.isfinite(distance))
        nearest = nearest[found]
        along = np.abs(np.einsum("ij,ij->i", stations.tangents[nearest], directions[found])) > ABREAST
        closer = found[along & (distance[found] < apart[found])]
        apart[closer] = distance[closer]
        above[closer] = places[closer, 2] - stations.xyz[nearest[np.searchsorted(found, closer)], 2]
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


def warn_of_blunt_lines(rails: Sequence[RailLine], progress: Progress) -> None:
    """Warn the user of rails that only blunt points of a cloud show which has sharp ones as well."""
    if rails:
        length_m = sum(rail.length_m for rail in rails)
        progress.warning(
            "The cloud has sharp points and blunt ones, as of a scanner and of images. Where only blunt ones show a "
            f"rail, on {length_m:,.0f} m, it is a line of its own: sigma_mm and sigmaz_mm say how exact it is."
        )


def warn_of_rails(
    rails: Sequence[RailLine], class_code: int, parameters: Parameters, progress: Progress, raw: bool = False
) -> None:
    """Warn the user if a class has no rails, or if `smoothing_xy_m` moves lines off their rails.

    Points that were found in a `raw` cloud have no class that the user chose.
    """
    if not rails:
        checks = "check the rail classes, the standard and MIN_LENGTH"
        progress.warning(NO_LINE if raw else f"Class {class_code} has no rails: {checks}.")
    _warn_of_smoothing(rails, parameters.head_width_m, parameters.smoothing_xy_m, progress)


def _warn_of_smoothing(rails: Sequence[RailLine], head_width_m: float, smoothing_m: float, progress: Progress) -> None:
    """Warn the user if the smoothing in plan displaces lines in curves by more than the points can correct."""
    limit_m = MAX_SHIFT_HEADS * head_width_m
    if END_SHIFT * smoothing_m**2 / MIN_RADIUS_M <= limit_m:
        return
    largest_m = max((displacement(rail.xyz[:, :2], smoothing_m) for rail in rails), default=0.0)
    if largest_m > limit_m:
        best_m = math.floor(10 * smoothing_m * math.sqrt(limit_m / largest_m)) / 10
        progress.warning(
            f"SMOOTHING_XY of {smoothing_m:g} m displaces lines in curves by up to {1000 * largest_m:.0f} mm, more "
            f"than points can correct: set it to {best_m:g} m or less."
        )


def displacement(line: np.ndarray, smoothing_m: float) -> float:
    """Return the largest displacement of a line, (n, 2), by PAEK, metres.

    Applied to a line that follows its rail, it shows how far the line was displaced before.
    """
    own = Polyline(line)
    stations = filled(own.t, smoothing_m / STATIONS_PER_SIGMA)
    smoothed = smooth_line(line, smoothing_m, stations, closed=own.is_closed)
    return float(np.hypot(*(smoothed - own.at(stations)).T).max())


def with_tracks(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline], progress: Progress = SILENT
) -> list[RailLine]:
    """State the tracks of each rail, and leave out lone lines that are too high or too low to be rails."""
    kept: list[RailLine] = []
    left_out: list[tuple[RailLine, float]] = []
    for rail in rails:
        tracks = tuple(line.track_id for line in centerlines if rail.rail_id in (*line.left_ids, *line.right_ids))
        above_m = 0.0 if tracks else _off_level_m(rail, centerlines)
        if above_m:
            left_out.append((rail, above_m))
        else:
            kept.append(replace(rail, track_ids=tracks))
    if left_out:
        length_m = sum(line.length_m for line, _ in left_out)
        lines = "1 line" if len(left_out) == 1 else f"{len(left_out)} lines"
        heights = ", ".join(f"{height:+.1f} m" for height in sorted({round(above_m, 1) for _, above_m in left_out}))
        progress.warning(
            f"{lines} ({length_m:.0f} m) left out: too high or too low for a rail, compared with the tracks alongside "
            f"({heights}). Check the classification there."
        )
    return kept


def warn_of_split_classes(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> None:
    """Warn the user if rails of different classes seem to be the rails of one track, or parts of one rail."""
    codes = {rail.rail_id: rail.class_code for rail in rails}
    if len(set(codes.values())) < 2:
        return
    lone = [replace(rail, class_code=0) for rail in rails if not rail.track_ids]
    try:
        tracks = tracks_of_class(lone, parameters, SILENT)
    except NoTrackError:
        tracks = ()
    at_gauge = {tuple({codes[one] for one in (*track.left_ids, *track.right_ids)}) for track in tracks}
    split = sorted({code for group in at_gauge | _in_line(rails) if len(group) > 1 for code in group})
    if split:
        progress.warning(
            f"Rails of the classes {', '.join(map(str, split))} form tracks or continue each other, but classes are "
            "paired separately. If they are of the same tracks, set MERGE_CLASSES."
        )


def _in_line(rails: Sequence[RailLine]) -> set[tuple[int, ...]]:
    """Return the pairs of classes of which one has a rail that begins where a rail of the other ends."""
    ends = np.concatenate([rail.xyz[[0, -1], :2] for rail in rails])
    codes = [rail.class_code for rail in rails for _ in range(2)]
    return {(codes[a], codes[b]) for a, b in cKDTree(ends).query_pairs(SAME_RAIL_M) if codes[a] != codes[b]}
