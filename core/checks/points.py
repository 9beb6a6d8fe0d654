"""What points show before anything is computed: squares with too few of them for rails, gauge and railhead width.

Coordinates in another unit than the one that the file states, and points far from any rail, would take hours: the
raster follows the points wherever they are. See docs/method.md sections 1.3 and 7.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..clouds.points import AIRBORNE, RailPoints
from ..errors import CloudError
from ..polyline import project, runs
from ..progress import SILENT, Progress
from ..rails import RailLine
from ..raster import ROW
from ..standards import SPACING_RANGE_M
from ..tiles.grid import PointSource, Square, around, lay_out

WINDOW_M, MIN_IN_WINDOW = 4.0, 10
"""A point with fewer points than this in its cell of the window's size and the eight around it belongs to no rail: the
shortest rail that is drawn, 1 m with 20 points per metre, has twice as many."""

MAX_CHECKED = 20_000
"""Squares with more points than this are not checked for strays: these would be ten points per window everywhere."""

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

PLACES = 300
"""Number of places where the rails are looked at."""

HALF_LENGTH_M = 1.0
"""Points this far along the rail from a place are seen with it: a rail of 150 m radius is 3 mm off straight there."""

REACH_M = 0.15
"""Points this close across the rail are on it: guard rails are closer only where they end the gauge face."""

MAX_NEAR = 10_000
"""Most points looked at around a place. Heads seen by 1000 points per metre have fewer there; more make a head no
clearer, and a column of 200,000 points would take a minute."""

SEPARATE_M = 0.05
"""Gap across the track between the points of two rails; heads seen by few scan lines have smaller ones."""

MIN_POINTS = 12
"""Points on a head that give its axis to 6 mm."""

TOP_M = 0.030
"""Depth below the top that is part of the head on all profiles; web and foot are deeper."""

TOP_PERCENT = 95
"""Percentile of the heights that stands for the top."""

BIN_M, HALF_PEAK_M = 0.005, 0.015
"""Bin of the histogram of distances, and half the width of its peak: most track is within 15 mm of its gauge."""

MIN_SHARE = 0.1
"""Share of the places at which a distance must be found."""

SEEN_SHARE = 0.96
"""Width that `_head` finds, relative to the true one: it loses the rounded edges. Measured on the synthetic scenes."""


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


def occupied_squares(sources: Sequence[PointSource], source: PointSource) -> list[Square]:
    """List the squares of one of the sources in which rails can be; see `grid.lay_out`."""
    return [
        square
        for square in lay_out(sources, source)
        if square.is_whole_plane or source.counts[square.key] > MAX_CHECKED or not _holds_only_strays(source, square)
    ]


def warn_of_unexplained(source: PointSource, rails: Sequence[RailLine], progress: Progress = SILENT) -> None:
    """Warn the user if most points of a class are far from all rails, in its frame, as if it were another class."""
    near, total = 0, 0
    for square in _fullest(source)[:FULLEST]:
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


def fullest_square(source: PointSource) -> RailPoints:
    """Return the points of the square of a class that has the most."""
    return source.near(_fullest(source)[0], 0.0)


def _parts_near(line: np.ndarray, square: Square, margin_m: float) -> list[np.ndarray]:
    """Return the parts of a line, (n, 2), that can be at most `margin_m` from a square: all segments whose box is."""
    if square.is_whole_plane:
        return [line]
    low, high = np.minimum(line[:-1], line[1:]), np.maximum(line[:-1], line[1:])
    near = ((high >= -margin_m) & (low <= square.side_m + margin_m)).all(axis=1)
    return [line[first : last + 2] for first, last in runs(near)]


def _fullest(source: PointSource) -> list[Square]:
    """List the squares of a class in the order of their numbers of points, the largest first."""
    return sorted(lay_out([source], source), key=lambda square: -source.counts.get(square.key, 0))


def _holds_only_strays(source: PointSource, square: Square) -> bool:
    """Return whether no point of a square has company, be it across the border."""
    if sum(source.counts.get(key, 0) for key in around(square.key)) < MIN_IN_WINDOW:
        return True
    xyz = source.near(square, 2 * WINDOW_M).xyz
    number, company = _company(xyz, WINDOW_M, 1)
    return not (company[number][square.holds(xyz)] >= MIN_IN_WINDOW).any()


def _why_thin(source: PointSource) -> str | None:
    """Return a sentence if the points of a class are too thin for rails."""
    squares = _fullest(source)
    enough = np.searchsorted(np.cumsum([source.counts.get(square.key, 0) for square in squares]), MIN_JUDGED) + 1
    parts = [(square, source.near(square, 0.0).xyz) for square in squares[: max(FULLEST, enough)]]
    in_cell = np.concatenate([company[number] for number, company in (_company(xyz, CELL_M, 0) for _, xyz in parts)])
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


def _company(xyz: np.ndarray, side_m: float, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Count points, (n, 3), by cells of a side; points in the `rings` of cells around a cell count as well.

    Returns the number of the cell of each point, (n,), and the points in each cell and its rings, (m,).
    """
    columns, rows = np.floor(xyz[:, :2] / side_m).astype(np.int64).T
    cells, number, counts = np.unique(rows * ROW + columns, return_inverse=True, return_counts=True)
    company = np.zeros(len(cells), dtype=np.int64)
    for down in range(-rings, rings + 1):
        for right in range(-rings, rings + 1):
            other = cells + down * ROW + right
            place = np.minimum(np.searchsorted(cells, other), len(cells) - 1)
            company += np.where(cells[place] == other, counts[place], 0)
    return number.ravel(), company


@dataclass(frozen=True)
class Spacings:
    """Distances between the axes of two rails, (n,), seen from places on them, and the width of the head of each place.

    Of the places, `places` in number, some see several rails and some none.
    """

    distance_m: np.ndarray
    head_width_m: np.ndarray
    places: int

    def include(self, spacing_m: float, tolerance_m: float) -> bool:
        """Return whether rails are found at this distance."""
        return self._often(np.abs(self.distance_m - spacing_m) <= tolerance_m)

    def most_common(self) -> tuple[float, float] | None:
        """Return the most frequent distance and the width of the heads there; None if no distance is frequent."""
        peak = self._peak()
        if not peak.any():
            return None
        return float(np.median(self.distance_m[peak])), float(np.median(self.head_width_m[peak])) / SEEN_SHARE

    def width_error_m(self) -> float:
        """Return the standard error of the width of the heads at the most frequent distance; NaN without one."""
        widths = self.head_width_m[self._peak()]
        # The median of normally distributed values is 1.25 times as uncertain as their mean.
        return float(1.25 * widths.std() / np.sqrt(len(widths))) if len(widths) else float("nan")

    def _peak(self) -> np.ndarray:
        """Return which distances are near the most frequent one, (n,) bool; none if no distance is frequent."""
        if not len(self.distance_m):
            return np.zeros(0, bool)
        counts = np.convolve(np.bincount((self.distance_m / BIN_M).astype(int)), np.ones(3), mode="same")
        peak = np.abs(self.distance_m - (np.argmax(counts) + 0.5) * BIN_M) <= HALF_PEAK_M
        return peak if self._often(peak) else np.zeros_like(peak)

    def _often(self, mask: np.ndarray) -> bool:
        return bool(mask.sum() >= max(1.0, MIN_SHARE * self.places))


def measure_spacings(xyz: np.ndarray) -> Spacings:
    """Measure the distances between rails at some of their points, (n, 3) in local metres."""
    if len(xyz) < MIN_POINTS:
        return Spacings(np.empty(0), np.empty(0), 0)
    tree = cKDTree(xyz[:, :2])
    places = xyz[np.linspace(0, len(xyz) - 1, min(PLACES, len(xyz))).astype(int)]
    found = np.array([one for place in places for one in _spacings(xyz[_near(tree, place)] - place)]).reshape(-1, 2)
    return Spacings(found[:, 0], found[:, 1], len(places))


def _near(tree: cKDTree, place: np.ndarray) -> list[int]:
    """Return the points that may be on the rail of a place or on its partner, or an even selection of them."""
    near = tree.query_ball_point(place[:2], np.hypot(SPACING_RANGE_M[1] + REACH_M, HALF_LENGTH_M))
    return near[:: -(-len(near) // MAX_NEAR) or 1]


def _spacings(near: np.ndarray) -> Iterator[tuple[float, float]]:
    """Yield the distances of other rails from the rail at the origin, with the width of that rail's head.

    The points around the origin, (n, 3), include one on a rail there.
    """
    direction = _direction(near)
    if direction is None:
        return
    along, across = (near[:, :2] @ np.column_stack([direction, [-direction[1], direction[0]]])).T
    beside = np.flatnonzero(np.abs(along) < HALF_LENGTH_M)
    beside = beside[np.argsort(across[beside])]
    rails = np.split(beside, np.flatnonzero(np.diff(across[beside]) > SEPARATE_M) + 1)
    found = (_head(along[rail], across[rail], near[rail, 2]) for rail in rails if len(rail) >= MIN_POINTS)
    heads = [head for head in found if head is not None]
    own = [head for head in heads if abs(head[0]) < REACH_M]
    if len(own) != 1:
        return
    for axis, _ in heads:
        if SPACING_RANGE_M[0] <= abs(axis - own[0][0]) <= SPACING_RANGE_M[1]:
            yield abs(axis - own[0][0]), own[0][1]


def _direction(near: np.ndarray) -> np.ndarray | None:
    """Return the direction in plan of the rail at the origin, (2,); None if it has too few points."""
    mine = near[np.hypot(*near[:, :2].T) < HALF_LENGTH_M / 2, :2]
    for _ in range(2):  # the second time with the points of the whole length
        if len(mine) < MIN_POINTS:
            return None
        off = mine - mine.mean(axis=0)
        angle = 0.5 * np.arctan2(2 * (off[:, 0] @ off[:, 1]), off[:, 0] @ off[:, 0] - off[:, 1] @ off[:, 1])
        direction = np.array([np.cos(angle), np.sin(angle)])
        along, across = near[:, :2] @ direction, near[:, :2] @ [-direction[1], direction[0]]
        mine = near[(np.abs(along) < HALF_LENGTH_M) & (np.abs(across) < REACH_M), :2]
    return direction


def _head(along: np.ndarray, across: np.ndarray, height: np.ndarray) -> tuple[float, float] | None:
    """Return the axis and the width of a railhead from the points of a rail; None if too few are on top.

    Points that are spread evenly over a width have a standard deviation of this width over the root of twelve, and
    noise of a few millimetres hardly adds to it. In a curve they are spread about an arc: 6 mm off straight at a radius
    of 25 m.
    """
    along = along - along.mean()
    length = along @ along
    height = height - along * (along @ height / length if length else 0.0)
    on_top = height > _percentile(np.sort(height), TOP_PERCENT) - TOP_M
    top = np.sort(across[on_top])
    if len(top) < MIN_POINTS or top[-1] - top[0] > REACH_M:
        return None
    bend = along[on_top] ** 2
    bend, off = bend - bend.mean(), across[on_top] - top.mean()
    off = off - bend * (bend @ off) / (bend @ bend or 1.0)
    return 0.5 * (_percentile(top, 1) + _percentile(top, 99)), float(np.sqrt(12 * (off @ off) / (len(off) - 1)))


def _percentile(ascending: np.ndarray, percent: float) -> float:
    """Return what `np.percentile` returns, twenty times as fast on some hundred numbers."""
    place = percent / 100 * (len(ascending) - 1)
    below = min(int(place), len(ascending) - 2)
    return float(ascending[below] + (place - below) * (ascending[below + 1] - ascending[below]))
