"""Slips: crossings of two rails at a small angle whose four legs curves connect on either side.

Each rail of a slip curve touches both rails of the crossing, inside the frogs. The raster separates the four rails only
over the few metres in the middle, too short for their parting to be measured. A curve that touches two straight lines
has one unknown, however, and cells far from both lines show it. See docs/method.md section 4.13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import STEP_M, even_points, tip_and_direction
from ..lines.network import LineNetwork
from ..polyline import runs
from .junctions import DIRECTION_M, points_of, weld_pairs

CLEAR_M = (8.0, 11.0, 14.0)
"""Distances from the middle of a slip from which its legs are taken for those of the crossing, tried in this order."""

CLEAR_SHARE = 0.7
"""Smallest part of the tangent length at which they are: a slip curve of 190 m at 1:9 touches the legs at 10.5 m and is
26 mm from them at 7.4 m. The frogs are at 13.6 m."""

SAME_M = 0.5
"""Crossings this close to each other are one: those of the two rails of a track are a gauge apart."""

NODE_M, NEAR_M = 4.0, 1.5
"""Largest distance from the middle of a slip to a junction that the raster makes of it, and to a place between two."""

APPROACH_M = 0.5
"""Distance of two lines within which one may be the slip curve of the other: that of 190 m passes 0.29 m beside a
crossing of 1:9, one of 300 m 0.46 m."""

MAX_MISS_M, STRAY_M = 0.2, 0.1
"""Largest distance between two legs of one rail, across: 16 m times the error of a direction, half a cell on 2.5 m. And
largest distance of a line from the straight legs of a slip."""

MAX_BEND_DEG = 4.0
"""Largest angle between opposite legs: 16 m of a curve of 230 m."""

MIN_ANGLE_DEG, MAX_ANGLE_DEG = 2.0, 12.0
"""Angles of crossings with slips: from 1:18.5 (3 degrees) to those of old yards (1:5)."""

MIN_LEG_SHARE = 0.6
"""Shortest part of a leg, in `DIRECTION_M`, that shows its direction."""

SIDE_M = 0.15
"""Width beside the outer rails of a slip from which lines are removed: they stray by the width of merged rails."""

MIN_RADIUS_M = 80.0
"""Least radius of a slip curve: 190 and 215 m are usual, 100 m in old yards."""

SEPARATE_M, MIN_SEEN_M = 0.11, 5.0
"""Distance between the axes of a slip curve and of the rails that cross from which there is a cell between their heads,
and shortest length on which a slip curve is that far from both: 8 m for 190 m at 1:9, 6 m for 50 m at 1:4. What wing
rails and check rails at frogs look like is that far from both for less than 5 m."""

SPACINGS_M = (0.6, 1.8)
"""Distances between the axes of the rails of a track: gauges of 600 to 1676 mm. At a crossing, left rails cross each
other this far from where the right rails cross."""

BESIDE_M = (1.07, 1.507)
"""How far to either side the other two rails may cross: metre and standard gauge. `NEAR_M` covers the others."""

SHIFT_M = 1.0
"""Largest distance along the crossing between these two places: 10 cm across at an angle of 1:9."""

HALF_HEAD_M = 0.036
"""Distance from its axis within which cells are on a rail."""

BIN_M, COVER_M = 0.01, 0.25
"""Bins of the distance between the curve and the crossing, and of the length along the curve."""

MIN_COVERED = 0.8
"""Share of the length in the middle of both rails of a slip curve on which there are cells. Either rail alone may be
hidden on more: one of world 10340 is seen on 0.70."""


class Curve(NamedTuple):
    """One rail of a slip curve: how far from the crossing it passes, on which side, 1 for the left, and what is seen.

    `covered` is the share of the length on which it is apart from the rails that cross on which there are cells.
    """

    height: float
    side: float
    covered: float


@dataclass(frozen=True)
class _Cross:
    """Where two lines cross: the place, unit vectors along and across the mean of them, (2, 2), and half the angle."""

    place: np.ndarray
    axes: np.ndarray
    half_angle: float

    @classmethod
    def of(cls, tips: np.ndarray) -> _Cross | None:
        """Find where two straight lines cross, given two points on either, (4, 2); None if they hardly do."""
        ways = [tips[1] - tips[0], tips[3] - tips[2]]
        ways[1] = ways[1] * np.sign(ways[0] @ ways[1])
        first, second = (way / np.hypot(*way) for way in ways)
        turn = first[0] * second[1] - first[1] * second[0]
        half_angle = 0.5 * abs(float(np.arcsin(np.clip(turn, -1.0, 1.0))))
        if not np.radians(MIN_ANGLE_DEG) <= 2 * half_angle <= np.radians(MAX_ANGLE_DEG):
            return None
        step = tips[2] - tips[0]
        place = tips[0] + first * (step[0] * second[1] - step[1] * second[0]) / turn
        along = (first + second) / np.hypot(*(first + second))
        return cls(place, np.array([along, [-along[1], along[0]]]), half_angle)

    def curve_on(self, side: float, cells: np.ndarray, longest_m: float) -> Curve | None:
        """Find the curve that touches both lines on one side of the crossing, 1 for the left, -1 for the right.

        A curve of radius R passes e = R h² / 2 above a crossing of half angle h, and touches the lines at R h = 2 e / h
        from the middle, at most `longest_m`. At x it is y = e + x² h² / (4 e) above it, so every cell, (n, 2), states
        an e. None if cells show no such curve, or so little of it that no other rail makes up for it.
        """
        x, y = self.axes @ (cells - self.place).T
        y = side * y
        inside = y > np.abs(x) * self.half_angle
        x, y = x[inside], y[inside]
        height = 0.5 * (y + np.sqrt(y**2 - (x * self.half_angle) ** 2))
        reach = self._seen_m(height) / 2
        lowest, highest = 0.5 * MIN_RADIUS_M * self.half_angle**2, 0.5 * longest_m * self.half_angle
        # The lower half of a head would show a curve that is too low, so all of the highest one is looked at.
        used = (np.abs(x) <= reach) & (height >= lowest) & (height <= highest + 2 * HALF_HEAD_M)
        x, height = x[used], height[used]
        if not len(x):
            return None
        counts = np.bincount((height / BIN_M).astype(int))
        width = int(round(2 * HALF_HEAD_M / BIN_M))
        mode = (np.argmax(np.convolve(counts, np.ones(width), "same")) + 0.5) * BIN_M
        on_head = np.abs(height - mode) <= HALF_HEAD_M
        found = float(np.median(height[on_head]))
        if found > highest:
            return None
        length = float(self._seen_m(found))
        if length < MIN_SEEN_M:
            return None
        parts = np.unique(np.floor(x[np.abs(height - found) <= HALF_HEAD_M] / COVER_M))
        covered = min(len(parts) * COVER_M / length, 1.0)
        return Curve(found, side, covered) if covered + 1.0 >= 2 * MIN_COVERED else None

    def _seen_m(self, height: np.ndarray | float) -> np.ndarray:
        """Return the length on which curves at such heights are `SEPARATE_M` from both lines.

        At the share s of the tangent length from the middle, they are e (1 - s)² from the nearer one.
        """
        share = np.maximum(1 - np.sqrt(SEPARATE_M / np.maximum(height, 1e-9)), 0.0)
        return 2 * share * 2 * height / self.half_angle

    def line_of(self, curve: Curve) -> np.ndarray:
        """Draw a curve between the places where it touches the lines that cross, (n, 2)."""
        tangent = 2 * curve.height / self.half_angle
        x = np.linspace(-tangent, tangent, int(2 * tangent / STEP_M) + 2)
        return self.place + np.column_stack([x, curve.side * self.height_at(x, curve)]) @ self.axes

    def height_at(self, x: np.ndarray, curve: Curve) -> np.ndarray:
        """Return the distance of a curve from the mean of both lines at places `x` along this, (n,) metres."""
        return curve.height + (x * self.half_angle) ** 2 / (4 * curve.height)


@dataclass(frozen=True)
class Slip:
    """A crossing with curves that connect its legs, which are clear from `clear_m` from the middle."""

    cross: _Cross
    clear_m: float
    curves: tuple[Curve, ...]

    def holds(self, places: np.ndarray) -> np.ndarray:
        """Return which places, (n, 2), are inside: between the legs and the curves, or on them."""
        x, y = self.cross.axes @ (places - self.cross.place).T
        low, top = (np.abs(x) * self.cross.half_angle + side_m for side_m in (-SIDE_M, SIDE_M))
        for curve in self.curves:
            curved = self.cross.height_at(x, curve) + SIDE_M
            top = np.where(curve.side * y > 0, np.maximum(top, curved), top)
        return (np.abs(x) < self.clear_m) & (np.abs(y) < top) & (np.abs(y) > low)

    def is_beside(self, other: Slip) -> bool:
        """Return whether another slip is that of the other two rails of the same two tracks."""
        x, y = self.cross.axes @ (other.cross.place - self.cross.place)
        return bool(abs(x) < SHIFT_M and SPACINGS_M[0] < abs(y) < SPACINGS_M[1])

    def line_of_leg(self, way: np.ndarray) -> int | None:
        """Return on which of the two lines, 0 or 1, a way, (n, 2), given from the border of the slip, is a leg.

        None if it is on neither. The rails of the other crossing may reach the border as well, but at the opposite
        angle.
        """
        x, y = self.cross.axes @ (way[0] - self.cross.place)
        ahead, aside = self.cross.axes @ tip_and_direction(even_points(way, DIRECTION_M))[1]
        slope = np.sign(x * y) * self.cross.half_angle
        turns = abs(aside - slope * ahead) > self.cross.half_angle * abs(ahead)
        off_m = abs(abs(y) - abs(x) * self.cross.half_angle)
        return None if turns or off_m > STRAY_M else int(x * y > 0)


def open_slips(network: LineNetwork, seen: cKDTree) -> tuple[LineNetwork, list[Slip]]:
    """Draw the crossings inside slips as two straight lines that cross, and find the slip curves.

    The lines have no passes, and `seen` holds the places of rail cells. The slips are what `add_curves` adds once the
    joins have been chosen.
    """
    slips = _paired(_find(network, seen))
    for slip in slips:
        network = _as_crossing(network, slip)
    return network, slips


def _find(network: LineNetwork, seen: cKDTree) -> list[Slip]:
    """Find crossings with curves; each is drawn before the next is sought, which it may disturb."""
    slips: list[Slip] = []
    parts = None
    places = list(_candidates(network))
    while places:
        place = places.pop(0)
        parts = parts or _Parts.of(network)
        slip = _slip(parts, place, seen)
        if slip is not None and all(np.hypot(*(slip.cross.place - one.cross.place)) > SAME_M for one in slips):
            slips.append(slip)
            network, parts = _as_crossing(network, slip), None
            places += [slip.cross.place + side * m * slip.cross.axes[1] for m in BESIDE_M for side in (1.0, -1.0)]
    return slips


def _paired(found: Sequence[Slip]) -> list[Slip]:
    """Keep the slip curves that have a partner, the other rail of the track that they carry, if both are seen."""
    kept = []
    for slip in found:
        others = [one for one in found if one is not slip and slip.is_beside(one)]
        curves = tuple(
            curve
            for curve in slip.curves
            if any(
                curve.side * slip.cross.axes[1] @ (other.side * one.cross.axes[1]) > 0
                and curve.covered + other.covered >= 2 * MIN_COVERED
                for one in others
                for other in one.curves
            )
        )
        if curves:
            kept.append(replace(slip, curves=curves))
    return kept


def _candidates(network: LineNetwork) -> np.ndarray:
    """Return places that may be in the middle of a slip, (n, 2), a metre apart.

    They are between two junctions, or at one, or where two lines come closest to each other without meeting: where
    flangeways cut the rails that cross, each line runs on into a slip curve.
    """
    if not network.lines:
        return np.empty((0, 2))
    nodes = network.nodes[network.degrees() > 2]
    pairs = cKDTree(nodes).query_pairs(2 * NODE_M, output_type="ndarray") if len(nodes) else np.empty((0, 2), dtype=int)
    places = np.concatenate([nodes[pairs].mean(axis=1), nodes, _Parts.of(network).approaches()])
    _, first = np.unique(np.round(places), axis=0, return_index=True)
    return places[np.sort(first)]


@dataclass(frozen=True)
class _Parts:
    """Even points on all lines, with the number of the line of each and a tree of them."""

    points: np.ndarray
    line: np.ndarray
    tree: cKDTree

    @classmethod
    def of(cls, network: LineNetwork) -> _Parts:
        """Place points on the lines of a network."""
        points, line = points_of(network)
        return cls(points, line, cKDTree(points))

    def approaches(self) -> np.ndarray:
        """Return the places at which two lines that come closer than `APPROACH_M` are closest, (n, 2)."""
        pairs = self.tree.query_pairs(APPROACH_M, output_type="ndarray")
        lines = np.sort(self.line[pairs], axis=1)
        pairs, lines = pairs[lines[:, 0] != lines[:, 1]], lines[lines[:, 0] != lines[:, 1]]
        order = np.argsort(np.hypot(*(self.points[pairs[:, 0]] - self.points[pairs[:, 1]]).T), kind="stable")
        _, nearest = np.unique(lines[order], axis=0, return_index=True)
        return self.points[pairs[order[nearest]]].mean(axis=1)

    def legs(self, place: np.ndarray, clear_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the tips and the outward directions of the lines, (n, 2) each, that leave a circle around a place."""
        reach_m = clear_m + DIRECTION_M
        near = np.sort(np.array(self.tree.query_ball_point(place, reach_m), dtype=int))
        distance = np.hypot(*(self.points[near] - place).T)
        near, distance = near[distance >= clear_m], distance[distance >= clear_m]
        breaks = np.flatnonzero((np.diff(near) > 1) | (np.diff(self.line[near]) != 0)) + 1
        found = []
        for run in np.split(np.arange(len(near)), breaks) if len(near) else []:
            if len(run) * STEP_M >= MIN_LEG_SHARE * DIRECTION_M and distance[run].min() < clear_m + 2 * STEP_M:
                part = self.points[near[run]]
                tip, outward = tip_and_direction(part if distance[run[0]] < distance[run[-1]] else part[::-1])
                found.append((tip, -outward))
        tips, outward = (
            (np.array(values).reshape(-1, 2) for values in zip(*found)) if found else (np.empty((0, 2)),) * 2
        )
        return tips, outward


def _slip(parts: _Parts, place: np.ndarray, seen: cKDTree) -> Slip | None:
    """Find the slip around a node; None if there is none."""
    for clear_m in CLEAR_M:
        rough = _cross_near(parts, place, clear_m)
        cross = rough and _cross_near(parts, rough.place, clear_m)
        if cross is None:
            continue
        cells = seen.data[seen.query_ball_point(cross.place, clear_m)]
        found = (cross.curve_on(side, cells, clear_m / CLEAR_SHARE) for side in (1.0, -1.0))
        curves = tuple(curve for curve in found if curve is not None)
        if curves:
            return Slip(cross, clear_m, curves)
    return None


def _cross_near(parts: _Parts, place: np.ndarray, clear_m: float) -> _Cross | None:
    """Find two straight lines that cross near a place, by their legs outside; of several, the nearest."""
    tips, outward = parts.legs(place, clear_m)
    pairs = [pair for pair in combinations(range(len(tips)), 2) if _continue(tips[list(pair)], outward[list(pair)])]
    crosses = [_Cross.of(tips[[*one, *other]]) for one, other in combinations(pairs, 2) if not set(one) & set(other)]
    near = [cross for cross in crosses if cross is not None and np.hypot(*(cross.place - place)) < NEAR_M]
    return min(near, key=lambda cross: float(np.hypot(*(cross.place - place))), default=None)


def _continue(tips: np.ndarray, outward: np.ndarray) -> bool:
    """Return whether two legs, (2, 2) each, continue each other."""
    bend = np.degrees(np.arccos(np.clip(-outward[0] @ outward[1], -1.0, 1.0)))
    way = outward[0] - outward[1]
    step = tips[0] - tips[1]
    miss = abs(step[0] * way[1] - step[1] * way[0]) / max(np.hypot(*way), 1e-9)
    return bool(bend <= MAX_BEND_DEG and miss <= MAX_MISS_M)


def _as_crossing(network: LineNetwork, slip: Slip) -> LineNetwork:
    """Remove what is inside a slip, and join its four legs as two straight lines that cross."""
    middle = len(network.nodes)
    lines: list[np.ndarray] = []
    ends: list[tuple[int, int]] = []
    nodes = [*network.nodes, slip.cross.place, slip.cross.place]
    for line, own in zip(network.lines, network.ends.tolist()):
        outside = ~slip.holds(line)
        for first, last in runs(outside):
            piece, pair = line[first : last + 1], list(own)
            for side, cut in ((0, first > 0), (1, last < len(line) - 1)):
                if not cut:
                    continue
                tip = piece[-1 if side else 0]
                number = slip.line_of_leg(piece[::-1] if side else piece)
                if number is not None:
                    way = even_points(np.array([slip.cross.place, tip]))[:-1]
                    piece = np.concatenate([piece, way[::-1]] if side else [way, piece])
                    pair[side] = middle + number
                else:
                    pair[side] = len(nodes)
                    nodes.append(tip)
            if len(piece) > 1:
                lines.append(piece)
                ends.append((pair[0], pair[1]))
    return weld_pairs(LineNetwork(tuple(lines), np.array(nodes), np.array(ends)).tidy())


def add_curves(network: LineNetwork, slips: Sequence[Slip]) -> LineNetwork:
    """Add the curves of slips, which begin and end on the lines that they touch, where two lines still cross."""
    for slip in slips:
        near = [np.hypot(*(line - slip.cross.place).T) for line in network.lines]
        through = [n for n, one in enumerate(near) if one.min() < STRAY_M and 0 < one.argmin() < len(one) - 1]
        if len(through) != 2:
            continue
        for curve in slip.curves:
            network = _with_curve(network, slip.cross.line_of(curve), through)
    return network.tidy() if slips else network


def _with_curve(network: LineNetwork, curve: np.ndarray, through: Sequence[int]) -> LineNetwork:
    """Add a curve between two of the lines `through`."""
    count, own = len(network.nodes), len(network.lines)
    nodes, ends = np.concatenate([network.nodes, curve[[0, -1]]]), np.concatenate([network.ends, [[count, count + 1]]])
    network = LineNetwork((*network.lines, curve), nodes, ends, network.passes)
    for end, place in ((2 * own, curve[0]), (2 * own + 1, curve[-1])):
        distances = [np.hypot(*(network.lines[number] - place).T) for number in through]
        nearest = int(np.argmin([one.min() for one in distances]))
        vertex = int(np.clip(distances[nearest].argmin(), 1, len(distances[nearest]) - 2))
        network = network.with_end(end, network.from_end(end)[1:2], 2, at=(through[nearest], vertex))
    return network
