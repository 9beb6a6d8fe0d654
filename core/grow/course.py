"""The course of a rail: the smooth curve through the last windows, and where it leads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .settings import Beam

LEAST_RADIUS_M = 20.0
"""Least radius of a railway: trams; a course can't leave the expected one faster."""

TYPICAL_RADIUS_M = 50.0
"""Radius at which one standard deviation of curvature is expected before any is measured."""

GRADE_LENGTH_M = 3.0
"""Length behind the end that gives the gradient."""


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
