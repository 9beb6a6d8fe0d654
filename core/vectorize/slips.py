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
from .cells import RailCells
from .junctions import DIRECTION_M, ends_by_node, outward_ways, points_of, weld_pairs

CLEAR_M = (8.0, 11.0, 14.0, 17.0, 20.0)
"""Distances from the middle of a slip from which its legs are taken for those of the crossing, tried in this order."""

CLEAR_SHARE = 0.7
"""Smallest part of the tangent length at which they are: a slip curve of 190 m at 1:9 touches the legs at 10.5 m and is
26 mm from them at 7.4 m. The frogs are at 13.6 m."""

SAME_M = 0.3
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

FROG_M, FROG_DEG = 5.0, 1.5
"""Length of the lines that leave an acute frog, and their largest deviation from the angle that its distance from the
other one states: the raster parts the rails up to 1.2 m from it, 0.5 degrees at 1:7. Measured: 0.9 degrees."""

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

HALF_HEAD_M = 0.036
"""Distance from its axis within which cells are on a rail."""

BIN_M, COVER_M = 0.01, 0.25
"""Bins of the distance between the curve and the crossing, and of the length along the curve."""

MIN_COVERED, MIN_COVERED_OF_ONE = 0.4, 0.2
"""Least share of the length in the middle of a slip curve on which there are cells: the mean of both of its rails, and
of either rail, for on narrow gauges one of them alone may look like a rail of the curve on the other side. In 242
rasters of worlds with switches, the mean of slips is 0.52 and more, and that of whatever else has four legs less than
0.12."""

MIN_LEGS = 0.9
"""Share of the legs of the other two rails that have cells: where these cross is known from the gauge alone."""


class Curve(NamedTuple):
    """A slip curve: how far from the crossing of either rail it passes, and on which side, 1 for the left."""

    height: float
    side: float


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

    def beside(self, spacing_m: float) -> _Cross:
        """Return where the other rails of both tracks cross: `spacing_m` to the left, or to the right if negative."""
        return replace(self, place=self.place + spacing_m / np.cos(self.half_angle) * self.axes[1])

    def legs(self, clear_m: float) -> np.ndarray:
        """Return places on both lines, (n, 2), where they are clear of a slip."""
        x = np.arange(clear_m, clear_m + DIRECTION_M, STEP_M)
        x, y = (np.outer(signs, x).ravel() for signs in ((1, 1, -1, -1), (1, -1, 1, -1)))
        return self.place + np.column_stack([x, y * self.half_angle]) @ self.axes

    def heights(self, side: float, cells: np.ndarray, longest_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the places along the crossing and the heights of the slip curves that cells, (n, 2), state, (k,) each.

        A curve of radius R passes e = R h² / 2 above a crossing of half angle h, and touches the lines at R h = 2 e / h
        from the middle, at most `longest_m`. At x it is y = e + x² h² / (4 e) above it, so every cell states an e.
        """
        x, y = self.axes @ (cells - self.place).T
        y = side * y
        inside = y > np.abs(x) * self.half_angle
        x, y = x[inside], y[inside]
        height = 0.5 * (y + np.sqrt(y**2 - (x * self.half_angle) ** 2))
        lowest, highest = 0.5 * MIN_RADIUS_M * self.half_angle**2, self.highest(longest_m)
        # The lower half of a head would show a curve that is too low, so all of the highest one is looked at.
        used = (np.abs(x) <= self.seen_m(height) / 2) & (height >= lowest) & (height <= highest + 2 * HALF_HEAD_M)
        return x[used], height[used]

    def highest(self, longest_m: float) -> float:
        """Return the height of the curve that touches the lines `longest_m` from the middle."""
        return 0.5 * longest_m * self.half_angle

    def seen_m(self, height: np.ndarray | float) -> np.ndarray:
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


def open_slips(network: LineNetwork, cells: RailCells) -> tuple[LineNetwork, list[Slip]]:
    """Draw the crossings inside slips as two straight lines that cross, and find the slip curves.

    The lines have no passes. The slips are what `add_curves` adds once the joins have been chosen: two with the same
    curves, of the left and of the right rails. Both are drawn before the next ones are sought, which they may disturb.
    """
    slips: list[Slip] = []
    parts = None
    for place in _candidates(network, cells.spacings_m):
        parts = parts or _Parts.of(network)
        found = [
            slip
            for slip in _slips_at(parts, place, cells)
            if all(np.hypot(*(slip.cross.place - one.cross.place)) > SAME_M for one in slips)
        ]
        drawn = _as_crossings(network, found) if found else None
        if drawn is not None:
            slips += found
            network, parts = drawn, None
    return network, slips


def _as_crossings(network: LineNetwork, slips: Sequence[Slip]) -> LineNetwork | None:
    """Draw slips as two straight lines that cross each; None if the network does not show all four legs of each."""
    for slip in slips:
        network, legs = _as_crossing(network, slip)
        if legs < 4:
            return None
    return network


def _candidates(network: LineNetwork, spacings_m: Sequence[float]) -> np.ndarray:
    """Return places that may be in the middle of a slip, (n, 2), a metre apart.

    They are between two junctions, or at one, or where two lines come closest to each other without meeting: where
    flangeways cut the rails that cross, each line runs on into a slip curve. Where little is seen of the middle, they
    are halfway between the two acute frogs.
    """
    if not network.lines:
        return np.empty((0, 2))
    junctions = [(node, ends) for node, ends in ends_by_node(network) if len(ends) > 2]
    nodes = network.nodes[[node for node, _ in junctions]].reshape(-1, 2)
    ways = [outward_ways(network, ends, FROG_M) for _, ends in junctions]
    middles = [
        nodes[pairs].mean(axis=1) for pairs in (_pairs(nodes, 2 * NODE_M), _acute_frogs(nodes, ways, spacings_m))
    ]
    places = np.concatenate([*middles, nodes, _Parts.of(network).approaches()])
    _, first = np.unique(np.round(places), axis=0, return_index=True)
    return places[np.sort(first)]


def _pairs(nodes: np.ndarray, most_m: float) -> np.ndarray:
    """Return which nodes, (n, 2), are at most `most_m` apart, (k, 2) numbers."""
    return cKDTree(nodes).query_pairs(most_m, output_type="ndarray") if len(nodes) else np.empty((0, 2), dtype=int)


def _acute_frogs(nodes: np.ndarray, ways: Sequence[np.ndarray], spacings_m: Sequence[float]) -> np.ndarray:
    """Return which nodes, (n, 2), may be the two acute frogs of a crossing, (k, 2) numbers.

    Their distance states the angle of the crossing, and at both of them lines leave, in the `ways` of each, at half of
    it to either side of the way to the other one.
    """
    found = [np.empty((0, 2), dtype=int)]
    for spacing_m in spacings_m:
        pairs = _pairs(nodes, spacing_m / np.sin(np.radians(MIN_ANGLE_DEG / 2)))
        step = nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
        half_deg = np.degrees(np.arcsin(spacing_m / np.maximum(np.hypot(*step.T), spacing_m)))
        fits = [
            all(_leave(ways[node], along, angle_deg) for node in pair)
            for pair, along, angle_deg in zip(pairs, step, half_deg)
        ]
        found.append(pairs[(2 * half_deg < MAX_ANGLE_DEG) & np.array(fits, dtype=bool)])
    return np.concatenate(found)


def _leave(ways: np.ndarray, along: np.ndarray, angle_deg: float) -> bool:
    """Return whether lines, unit vectors (n, 2), are at an angle to either side of a vector."""
    ahead, aside = ways @ along, along[0] * ways[:, 1] - along[1] * ways[:, 0]
    turn_deg = np.degrees(np.arctan2(np.where(ahead < 0, -aside, aside), np.abs(ahead)))
    return all(np.abs(turn_deg - side * angle_deg).min() < FROG_DEG for side in (1, -1))


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


def _slips_at(parts: _Parts, place: np.ndarray, cells: RailCells) -> list[Slip]:
    """Find the slip around a place, as those of its left and of its right rails; empty if there is none."""
    for clear_m in CLEAR_M:
        rough = _cross_near(parts, place, clear_m)
        cross = None if rough is None else _cross_near(parts, rough.place, clear_m)
        if cross is None:
            continue
        for other in (cross.beside(side * spacing_m) for spacing_m in cells.spacings_m for side in (1.0, -1.0)):
            if np.mean(cells.tree.query(other.legs(clear_m))[0] < HALF_HEAD_M) < MIN_LEGS:
                continue
            found = (_curve_on(side, (cross, other), clear_m, cells.tree) for side in (1.0, -1.0))
            curves = tuple(curve for curve in found if curve is not None)
            if curves:
                return [Slip(one, clear_m, curves) for one in (cross, other)]
    return []


def _curve_on(side: float, crosses: Sequence[_Cross], clear_m: float, seen: cKDTree) -> Curve | None:
    """Find the curve that touches the lines of two crossings on one side of each, 1 for the left, -1 for the right.

    None if cells show no such curve, or too little of its rails.
    """
    stated = [
        cross.heights(side, seen.data[seen.query_ball_point(cross.place, clear_m)], clear_m / CLEAR_SHARE)
        for cross in crosses
    ]
    height = np.concatenate([heights for _, heights in stated])
    if not len(height):
        return None
    counts = np.bincount((height / BIN_M).astype(int))
    width = int(round(2 * HALF_HEAD_M / BIN_M))
    mode = (np.argmax(np.convolve(counts, np.ones(width), "same")) + 0.5) * BIN_M
    found = float(np.median(height[np.abs(height - mode) <= HALF_HEAD_M]))
    length = float(crosses[0].seen_m(found))
    if found > crosses[0].highest(clear_m / CLEAR_SHARE) or length < MIN_SEEN_M:
        return None
    parts = [np.unique(np.floor(x[np.abs(own - found) <= HALF_HEAD_M] / COVER_M)) for x, own in stated]
    covered = [min(len(part) * COVER_M / length, 1.0) for part in parts]
    is_seen = np.mean(covered) >= MIN_COVERED and min(covered) >= MIN_COVERED_OF_ONE
    return Curve(found, side) if is_seen else None


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


def _as_crossing(network: LineNetwork, slip: Slip) -> tuple[LineNetwork, int]:
    """Remove what is inside a slip, and join its legs as two straight lines that cross; also count the legs."""
    middle = len(network.nodes)
    lines: list[np.ndarray] = []
    ends: list[tuple[int, int]] = []
    nodes = [*network.nodes, slip.cross.place, slip.cross.place]
    for line, own in zip(network.lines, network.ends.tolist()):
        even = even_points(line)  # vertices are metres apart: the next one may be at the frog
        line = even if slip.holds(even).any() else line
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
    legs = int(np.isin(ends, [middle, middle + 1]).sum())
    return weld_pairs(LineNetwork(tuple(lines), np.array(nodes), np.array(ends)).tidy()), legs


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
