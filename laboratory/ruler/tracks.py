"""Gauge and cant between extracted rails, compared with those between the true rails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.comparison import ASTRAY_M, cut, spacing_and_cant
from ...core.polyline import Polyline, project
from ...core.rails import Centerline, RailLine, TrackGeometry

CURVED_M = 1500.0
"""Greatest radius that is compared: above it, the versine of a chord of 20 m is below 35 mm."""

CHORD_M = 20.0
STEADY = 0.02
"""Radii are compared where the true curvature changes by less than the share `STEADY` within `CHORD_M` on either side:
on arcs that contain the whole chord of the measurement."""

STEP_M = 0.5
"""Distance between the places at which gauge and cant are compared."""


@dataclass(frozen=True)
class TrackErrors:
    """Measured minus true values along all centerlines, metres: mean and root mean square."""

    gauge_bias_m: float
    gauge_rmse_m: float
    cant_bias_m: float
    cant_rmse_m: float


def compare_tracks(
    centerlines: Sequence[Centerline], rails: Sequence[RailLine], truth: Sequence[np.ndarray], head_width_m: float
) -> TrackErrors:
    """Compare gauge and cant every `STEP_M` along the centerlines, where lines and truth have both rails.

    True rails, (n, 3), are in the same frame.
    """
    errors = [np.empty((0, 2))]
    for centerline in centerlines:
        own = [rail.xyz for rail in rails if rail.rail_id in (*centerline.left_ids, *centerline.right_ids)]
        middle, left = _places(centerline.xyz)
        half_m = (centerline.gauge_mm / 1000 + head_width_m) / 2
        found, true = (
            spacing_and_cant(middle + half_m * left, middle - half_m * left, cut(lines)) for lines in (own, truth)
        )
        errors.append(found - true)
    error = np.concatenate(errors)
    error = error[np.isfinite(error).all(axis=1)]
    if not len(error):
        return TrackErrors(*[float("nan")] * 4)
    bias, rmse = error.mean(axis=0), np.sqrt(np.mean(error**2, axis=0))
    return TrackErrors(float(bias[0]), float(rmse[0]), float(bias[1]), float(rmse[1]))


@dataclass(frozen=True)
class GeometryErrors:
    """Errors of measured track geometry at its stations, root mean squares; NaN without a true value to compare.

    Errors of the radius are shares of the true one, where that is constant and below `CURVED_M`.
    """

    gauge_m: float
    cant_m: float
    radius: float


def compare_geometry(
    geometry: Sequence[TrackGeometry],
    rails: Sequence[np.ndarray],
    centerlines: Sequence[np.ndarray],
    head_width_m: float,
) -> GeometryErrors:
    """Compare measured gauge, cant and radius with the truth; true lines, (n, 3), are in the same frame."""
    plain, curved = [np.empty((0, 2))], [np.empty(0)]
    for track in geometry:
        half_m = (np.nanmedian(track.gauge_mm) / 1000 + head_width_m) / 2
        middle, to_left = track.xyz[:, :2], half_m * Polyline(track.xyz).normals
        true = spacing_and_cant(middle + to_left, middle - to_left, cut(rails))
        measured = np.column_stack([track.gauge_mm / 1000 + head_width_m, track.cant_mm / 1000])
        plain.append(measured - true)
        radius = _true_radius(track.xyz[:, :2], centerlines)
        curved.append(np.abs(track.radius_m) / radius - 1)
    errors, ratios = np.concatenate(plain), np.concatenate(curved)
    gauge, cant = (_rms(column[np.isfinite(column)]) for column in errors.T)
    return GeometryErrors(gauge, cant, _rms(ratios[np.isfinite(ratios)]))


def _true_radius(places: np.ndarray, centerlines: Sequence[np.ndarray]) -> np.ndarray:
    """Return the radius of the true centerlines at places, (n,); NaN where it varies within a chord, or is large."""
    radius = np.full(len(places), np.nan)
    feet = project([line[:, :2] for line in centerlines], places, ASTRAY_M)
    for number in np.unique(feet.line):
        mine = feet.of(int(number))
        line = Polyline(centerlines[number][:, :2])
        mine = mine[(mine.t >= CHORD_M) & (mine.t <= line.length_m - CHORD_M)]
        t = mine.t[:, None] + CHORD_M * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
        around = line.at(t.ravel()).reshape(-1, 5, 2)
        bends = np.array([_curvature(around[:, [k, k + 1, k + 2]]) for k in range(3)])
        steady = (np.ptp(bends, axis=0) < STEADY * np.abs(bends[1])) & (np.abs(bends[1]) > 1 / CURVED_M)
        radius[mine.point[steady]] = 1 / np.abs(bends[1][steady])
    return radius


def _curvature(places: np.ndarray) -> np.ndarray:
    """Return the curvature of circles through three places each, (n, 3, 2) to (n,), positive to the left."""
    one, two, chord = places[:, 1] - places[:, 0], places[:, 2] - places[:, 1], places[:, 2] - places[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    return 2 * area / np.prod([np.hypot(*side.T) for side in (one, two, chord)], axis=0)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _places(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places every `STEP_M` of a line and unit vectors to the left there, (n, 2) each."""
    own = Polyline(line[:, :2])
    at = np.arange(STEP_M / 2, own.length_m, STEP_M)
    return own.at(at), own.left_at(at)
