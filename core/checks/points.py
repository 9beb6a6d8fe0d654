"""What points show before anything is computed: squares with too few of them for rails, gauge and railhead width.

Coordinates in another unit than the one that the file states, and points far from any rail, would take hours: the
raster follows the points wherever they are. See docs/method.md sections 1.3 and 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import AIRBORNE
from ..errors import CloudError
from ..polyline import project, runs
from ..progress import SILENT, Progress
from ..rails import RailLine
from ..tiles.grid import PointSource, Square, company_of, fullest

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
