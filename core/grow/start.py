"""From a seed to the rail under it: its direction and height, the course where it leads, and the side of its partner.

The course is the smooth curve through the last windows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .heads import DENSE, Beam, GrowSettings, OnHeads, SeenHead, heads_in

LEAST_RADIUS_M = 20.0
"""Least radius of a railway: trams; a course can't leave the expected one faster."""

TYPICAL_RADIUS_M = 50.0
"""Radius at which one standard deviation of curvature is expected before any is measured."""

GRADE_LENGTH_M = 3.0
"""Length behind the end that gives the gradient."""

ANGLES = 90
"""Directions that are tried, over half a turn: at 1 m, a head is 17 mm off at most."""

REACH_M = {True: 1.0, False: 2.0}
"""Length to either side of a seed that shows the direction, by whether the cloud is dense."""

CLICK_M = 0.15
"""Accuracy of a click: of two rails, the nearer one is meant."""

SLICES, MIN_COVER = 10, 0.6
"""Parts of the line of a rail, and the least share of them that must hold points."""

MIN_WINDOWS = 3
"""Windows of five along the line that must show the head."""

BEST = 8
"""Directions that are looked at more closely."""

CANT_M = 0.20
"""Largest difference in height between the rails of a track: cant of 180 mm, and a deviation from it."""

GAUGE_OFF_M = (-0.02, 0.045)
"""Smallest and largest deviation from the gauge: gauge widening of 35 mm, wear, and the accuracy of a window."""

TARGET_POINTS, LONGEST_WINDOW_M = 12, 2.0
"""Points of a head that a window should have, and the longest window: a thin cloud needs more length."""


@dataclass(frozen=True)
class Ahead:
    """Where a rail is expected, `xy` (2,), and in which direction, a unit vector."""

    xy: np.ndarray
    z: float
    heading: np.ndarray
    curvature: float
    grade: float

    @property
    def left(self) -> np.ndarray:
        """Unit vector to the left."""
        return np.array([-self.heading[1], self.heading[0]])

    def coordinates(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places of points along, across to the left of, and above the expected course."""
        step = xyz[:, :2] - self.xy
        along, across = step @ self.heading, step @ self.left
        return along, across - self.curvature * along**2 / 2, xyz[:, 2] - self.z - self.grade * along

    def beside(self, left_m: float, up_m: float) -> Ahead:
        """Return the expected course of something beside."""
        curvature = self.curvature / (1 - self.curvature * left_m)
        return Ahead(self.xy + left_m * self.left, self.z + up_m, self.heading, curvature, self.grade)


def lead(xyz: np.ndarray, step_m: float, heading: np.ndarray, beam: Beam) -> Ahead:
    """Continue a course by `step_m`, given places on the axis in order, (n, 3), and a unit vector roughly along it."""
    end = xyz[-1]
    step = xyz[:, :2] - end[:2]
    along = step @ heading
    near = along >= -beam.fit_m
    along, across = along[near], (step @ np.array([-heading[1], heading[0]]))[near]
    prior = beam.sigma_m * 2 * TYPICAL_RADIUS_M
    design = np.column_stack([np.ones_like(along), along, along**2])
    design, wanted = np.vstack([design, [0.0, 0.0, prior]]), np.append(across, 0.0)
    offset, slope, bend = np.linalg.lstsq(design, wanted, rcond=None)[0]
    tangent = slope + 2 * bend * step_m
    root = np.hypot(1.0, tangent)
    left = np.array([-heading[1], heading[0]])
    place = end[:2] + step_m * heading + (offset + slope * step_m + bend * step_m**2) * left
    grade, z = _grade(xyz[near, 2], along)
    return Ahead(place, z + grade * step_m, (heading + tangent * left) / root, 2 * bend / root**3, grade)


def _grade(z: np.ndarray, along: np.ndarray) -> tuple[float, float]:
    """Return the gradient at the end of a course and its height there."""
    near = along >= -GRADE_LENGTH_M
    along, z = along[near], z[near]
    if len(along) < 3:
        return 0.0, float(z[-1])
    grade, end = np.polyfit(along, z, 1)
    return float(grade), float(end)


def smoothed(xyz: np.ndarray, along_m: np.ndarray, reach_m: float, seen: np.ndarray) -> np.ndarray:
    """Fit a parabola through the places within `reach_m` of each one that were seen, (n, 3); the others as they are."""
    result = xyz.copy()
    firsts = np.searchsorted(along_m, along_m - reach_m)
    lasts = np.searchsorted(along_m, along_m + reach_m, side="right")
    for number, place_m in enumerate(along_m):
        near = firsts[number] + np.flatnonzero(seen[firsts[number] : lasts[number]])
        if len(near) > 3 and seen[number]:
            result[number] = np.polyfit(along_m[near] - place_m, xyz[near] - xyz[number], 2)[-1] + xyz[number]
    return result


@dataclass(frozen=True)
class Start:
    """A rail found at a seed: places on its axis, (k, 3), in order, a unit vector along it, and points per metre.

    `side` is 1 if the other rail of the track is to the left, -1 to the right, 0 if none was found; `level_m` is the
    height of the other rail above this one.
    """

    xyz: np.ndarray
    heading: np.ndarray
    beam: Beam
    per_m: float
    side: int
    level_m: float

    @property
    def middle(self) -> np.ndarray:
        """Place on its axis at the seed, (2,)."""
        return self.xyz[:, :2].mean(axis=0)


def window_m(per_m: float, settings: GrowSettings) -> float:
    """Return the length of a window on a rail with this number of points per metre."""
    return float(np.clip(TARGET_POINTS / max(per_m, 1e-9), settings.parameters.window_m, LONGEST_WINDOW_M))


def find_start(points: OnHeads, seed: np.ndarray, settings: GrowSettings) -> Start | None:
    """Find the rail at a seed, (2,); None if there is none within the search distance."""
    search_m = settings.parameters.search_m
    beam = points.beam(seed)
    reach_m = REACH_M[beam is DENSE]
    near = points.around(seed, reach_m + search_m)
    angles = np.arange(ANGLES) * np.pi / ANGLES
    found = sorted((_best(near, seed, angle, reach_m, settings) for angle in angles), key=lambda one: -one[0])
    for score, ahead in found[:BEST]:
        start = _start(points, near, ahead, reach_m, beam, settings) if score > 0 else None
        if start is not None:
            return start
    return None


def _best(
    near: np.ndarray, seed: np.ndarray, angle: float, reach_m: float, settings: GrowSettings
) -> tuple[float, Ahead]:
    """Return the score of the best head in a direction, and where it is."""
    ahead = Ahead(seed, 0.0, np.array([np.cos(angle), np.sin(angle)]), 0.0, 0.0)
    along, across, z = ahead.coordinates(near)
    own = (np.abs(along) <= reach_m) & (np.abs(across) <= settings.parameters.search_m)
    if not own.any():
        return 0.0, ahead
    along, across, z = along[own], across[own], z[own]
    places, half_m = np.sort(across), settings.head_width_m / 2
    inside = np.searchsorted(places, places + half_m, "right") - np.searchsorted(places, places - half_m)
    score = inside * np.exp(-((places / CLICK_M) ** 2))
    head = np.abs(across - places[np.argmax(score)]) <= half_m
    cover = len(np.unique((along[head] + reach_m) // (2 * reach_m / SLICES))) / SLICES
    if cover < MIN_COVER:
        return 0.0, ahead
    xy, top = seed + float(across[head].mean()) * ahead.left, float(np.median(z[head]))
    return float(score.max()) * cover, Ahead(xy, top, ahead.heading, 0.0, 0.0)


def _start(
    points: OnHeads, near: np.ndarray, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings
) -> Start | None:
    """Look closely at a place where a head seems to be; None if there is no rail."""
    for _ in range(2):
        stations, heads = _windows(near, ahead, reach_m, beam, settings)
        if len(heads) < MIN_WINDOWS:
            return None
        ahead = _aligned(ahead, stations, heads)
    stations, heads = _windows(near, ahead, reach_m, beam, settings)
    if len(heads) < MIN_WINDOWS:
        return None
    across = np.array([head.across_m for head in heads])
    z = ahead.z + ahead.grade * stations + np.array([head.top_m for head in heads])
    xy = ahead.xy + stations[:, None] * ahead.heading + across[:, None] * ahead.left
    side, level_m = _other_rail(points, ahead, reach_m, beam, settings)
    return Start(np.column_stack([xy, z]), ahead.heading, beam, _per_m(near, ahead, reach_m, settings), side, level_m)


def _per_m(near: np.ndarray, ahead: Ahead, reach_m: float, settings: GrowSettings) -> float:
    """Return the points per metre on a head."""
    along, across, _ = ahead.coordinates(near)
    on = (np.abs(along) <= reach_m) & (np.abs(across) <= settings.head_width_m / 2)
    return float(np.count_nonzero(on)) / (2 * reach_m)


def _windows(
    near: np.ndarray, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings
) -> tuple[np.ndarray, list[SeenHead]]:
    """Measure the head in five windows along a line; returns the places along and the heads of those that show it."""
    along, across, height = ahead.coordinates(near)
    stations, heads = [], []
    half_m = max(window_m(_per_m(near, ahead, reach_m, settings), settings), 0.4 * reach_m) / 2
    for place_m in np.linspace(-0.8, 0.8, 5) * reach_m:
        own = (np.abs(along - place_m) <= half_m) & (np.abs(height) <= CANT_M)
        found = heads_in(across[own], height[own], settings, beam)
        best = min(found, key=lambda head: abs(head.across_m), default=None)
        if best is not None and abs(best.across_m) <= settings.head_width_m:
            stations.append(place_m)
            heads.append(best)
    return np.array(stations), heads


def _aligned(ahead: Ahead, stations: np.ndarray, heads: list[SeenHead]) -> Ahead:
    """Lay a line through heads."""
    slope, offset = np.polyfit(stations, [head.across_m for head in heads], 1)
    grade, top = np.polyfit(stations, [head.top_m for head in heads], 1)
    heading = ahead.heading + slope * ahead.left
    xy = ahead.xy + offset * ahead.left
    return Ahead(xy, ahead.z + top, heading / np.hypot(*heading), 0.0, ahead.grade + grade)


def _other_rail(points: OnHeads, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings) -> tuple[int, float]:
    """Find the other rail of the track; returns its side and how much higher it is, 0 and 0 without any."""
    most, best = MIN_WINDOWS - 1, (0, 0.0)
    for side in (1, -1):
        beside = ahead.beside(side * settings.spacing_m, 0.0)
        _, heads = _windows(points.around(beside.xy, reach_m + CANT_M), beside, reach_m, beam, settings)
        heads = [head for head in heads if GAUGE_OFF_M[0] <= side * head.across_m <= GAUGE_OFF_M[1]]
        if len(heads) > most:
            most, best = len(heads), (side, float(np.median([head.top_m for head in heads])))
    return best
