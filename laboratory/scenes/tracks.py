"""Tracks in space: a plan curve with heights and cant, and the two railheads on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..curves import Curve

UP = np.array([0.0, 0.0, 1.0])

TRUTH_SAGITTA_M = 2e-5
"""Greatest distance between a true line and the curve: negligible compared with a millimetre."""

MAX_CHORD_M, ROUGH_CHORD_M = 0.5, 0.1
"""Distance between the vertices of true lines on straight track, and where rails are not as smooth as designed."""


@dataclass(frozen=True)
class Railhead:
    """A railhead in space, sampled along the track; (n, 3) arrays.

    The top is on the axis of the head, metres; `axis` has unit vectors up along this axis, and `across` those to the
    left, perpendicular to it.
    """

    top: np.ndarray
    axis: np.ndarray
    across: np.ndarray


@dataclass(frozen=True)
class Track:
    """A track: its plan, heights and cant.

    Attributes
    ----------
    curve : Curve
        Axis of the track in plan, or a line parallel to it.
    spacing_m : float
        Distance between the tops of the two heads: gauge and one head width.
    height_m, cant_m : float or (n,) array
        Height of the midpoint between the tops, and height of the left top above the right one, at the samples.
    left_m : float
        Offset of the track's axis to the left of the curve.
    inclination : float
        Inward inclination of the heads: 1/20 in most countries, 1/40 in some.
    sides : tuple of int
        Rails of the track, +1 left and -1 right; a third rail is a track with one.
    wear : mapping of int to (n, 2) array
        How far the top of a rail, by its side, is to the left of its design and above it, at the samples.
    """

    curve: Curve
    spacing_m: float
    height_m: float | np.ndarray = 0.0
    cant_m: float | np.ndarray = 0.0
    left_m: float = 0.0
    inclination: float = 1 / 20
    sides: tuple[int, ...] = (1, -1)
    wear: Mapping[int, np.ndarray] = field(default_factory=dict)

    @property
    def centerline(self) -> np.ndarray:
        """Midpoints between the tops, (n, 3)."""
        height = np.broadcast_to(self.height_m, len(self.curve.xy))
        return np.column_stack([self.curve.offset(self.left_m), height])

    def railhead(self, side: int) -> Railhead:
        """Return one of the two railheads: `side` is +1 for the left and -1 for the right one."""
        left = np.column_stack([self.curve.left_normal, np.zeros(len(self.curve.xy))])
        tilt = np.broadcast_to(np.arcsin(np.asarray(self.cant_m) / self.spacing_m), len(left))
        top = self.centerline + side * 0.5 * self.spacing_m * _turned(left, tilt)
        if side in self.wear:
            top = top + self.wear[side][:, :1] * left + self.wear[side][:, 1:] * UP
        lean = tilt + side * np.arctan(self.inclination)
        across = _turned(left, lean)
        axis = _turned(left, lean + np.pi / 2)
        return Railhead(top, axis, across)

    def rails(self) -> tuple[np.ndarray, ...]:
        """Return the tops of the rails, each (k, 3), with as few vertices as the curvature allows."""
        return tuple(self.thinned(self.railhead(side).top) for side in self.sides)

    def thinned(self, line: np.ndarray) -> np.ndarray:
        """Return as many vertices of a line as the curvature requires; its (n, 3) vertices are at the samples."""
        sharpest = max(float(np.abs(self.curve.curvature).max()), 1e-9)
        chord_m = min(np.sqrt(8 * TRUTH_SAGITTA_M / sharpest), ROUGH_CHORD_M if self.wear else MAX_CHORD_M)
        stride = max(int(chord_m / self.curve.step_m), 1)
        last = len(self.curve.xy) - 1
        return line[np.unique(np.append(np.arange(0, last, stride), last))]

    def piece(self, start_m: float, end_m: float) -> Track:
        """Return the part between two chainages of the curve, to the nearest samples."""
        height, cant = (np.broadcast_to(value, len(self.curve.xy)) for value in (self.height_m, self.cant_m))
        first = max(int(round(start_m / self.curve.step_m)), 0)
        curve = self.curve.piece(start_m, end_m)
        part = slice(first, first + len(curve.xy))
        wear = {side: own[part] for side, own in self.wear.items()}
        return replace(self, curve=curve, height_m=height[part], cant_m=cant[part], wear=wear)


def _turned(left: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotate horizontal unit vectors upwards by an angle, radians, about the direction of the track."""
    return np.cos(angle)[:, None] * left + np.sin(angle)[:, None] * UP
