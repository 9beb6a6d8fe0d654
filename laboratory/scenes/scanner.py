"""A mobile laser scanner: profiles of rays that hit railheads, with noise, hidden sides and lost returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .tracks import Railhead

CROWN_RADIUS_M = 0.300
"""Radius of the running surface of new rails (EN 13674-1: 300 mm on 60E1)."""

CORNER_RADIUS_M = 0.013
"""Radius of the gauge corner: the last of the radii in EN 13674-1; the others are left out."""

FACE_DEPTH_M = 0.035
"""Depth of the side faces below the top, about the height of a head without its fillets."""

FACE_TURN = np.pi / 4
"""Angle between the axis of the head and the normal of the surface from which the surface is a side face."""

SPEED_SWING, SPEED_SWING_M = 0.2, 10.0
"""Relative variation of the distance between profiles, due to the speed of the train, and its length per radian."""

PROFILE_SAMPLES = 24
"""Twice the samples on half the crown, on a corner and on a face: at most 0.1 mm from the true outline."""


@dataclass(frozen=True)
class Profile:
    """Shape of a railhead, by default that of a new rail: radii of the running surface and of both corners."""

    crown_radius_m: float = CROWN_RADIUS_M
    corner_radius_m: float = CORNER_RADIUS_M


NEW = Profile()


@dataclass(frozen=True)
class Scanner:
    """A scanner on a train, by default a good one.

    Attributes
    ----------
    profile_step_m : float
        Mean distance between profiles, 0.03 to 0.10 m depending on the speed of the train.
    ray_step_rad : float
        Angle between neighbouring rays of a profile.
    height_m, left_m : float
        Height above the axis of its track, and offset to the left.
    noise_m : float
        Standard deviation of points in each of x, y and z.
    half_range_m : float
        Distance at which half of the rays return.
    face_share : float
        Share of the points on side faces that are classified as rail.
    top_share : float
        The same for the crown and the upper corners: a polished crown may return nothing.
    """

    profile_step_m: float = 0.05
    ray_step_rad: float = 0.002
    height_m: float = 4.0
    left_m: float = 0.4
    noise_m: float = 0.003
    half_range_m: float = 18.0
    face_share: float = 0.3
    top_share: float = 1.0


def head_outline(head_width_m: float, profile: Profile = NEW) -> tuple[np.ndarray, np.ndarray]:
    """Return the outline of a railhead in its own frame, from the bottom of the left face over the top to the right.

    Places, (m, 2), are metres to the left of the axis and above the top, 0 or negative; the angle between the normal of
    the surface and the axis, (m,), is in radians and positive to the left.
    """
    half, crown_m, corner_m = head_width_m / 2, profile.crown_radius_m, profile.corner_radius_m
    reach = crown_m - corner_m
    drop = np.sqrt(reach**2 - (half - corner_m) ** 2)
    shoulder = np.arctan2(half - corner_m, drop)
    crown = np.linspace(0, shoulder, PROFILE_SAMPLES // 2, endpoint=False)
    corner = np.linspace(shoulder, np.pi / 2, PROFILE_SAMPLES // 2)
    corner_height = drop - crown_m
    face = np.linspace(corner_height, -FACE_DEPTH_M, PROFILE_SAMPLES // 2)[1:]
    u = np.concatenate(
        [
            crown_m * np.sin(crown),
            half - corner_m + corner_m * np.sin(corner),
            np.full(len(face), half),
        ]
    )
    v = np.concatenate(
        [
            crown_m * (np.cos(crown) - 1),
            corner_height + corner_m * np.cos(corner),
            face,
        ]
    )
    turn = np.concatenate([crown, corner, np.full(len(face), np.pi / 2)])
    left_half = np.column_stack([u, v])[::-1]
    right_half = np.column_stack([-u, v])[1:]
    return np.concatenate([left_half, right_half]), np.concatenate([turn[::-1], -turn[1:]])


def scan(
    head: Railhead,
    head_width_m: float,
    path: np.ndarray,
    scanner: Scanner,
    rng: np.random.RandomState,
    missing: tuple[tuple[float, float], ...] = (),
    shape: Profile = NEW,
) -> np.ndarray:
    """Scan one railhead, (n, 3) points, from a train that passes along `path`, (k, 3), the axis of its track.

    The rays of a profile have equal angles between them. Those that hit the visible side of the outline become points,
    so that density falls with distance, surfaces at a grazing angle get few points, and the far face gets none.
    Sections that are `missing` have none either, metres along the head.
    """
    stations = _stations(head, scanner, rng, missing)
    source = _scanner_positions(head.top[stations], path, scanner)
    ray = source - head.top[stations]
    across = np.sum(ray * head.across[stations], axis=1)
    above = np.sum(ray * head.axis[stations], axis=1)
    outline, turn = head_outline(head_width_m, shape)
    profile, position = _hits(outline, across, above, scanner.ray_step_rad, rng)
    samples = np.arange(len(outline))
    kept = rng.random_sample(len(profile)) < _chance(
        np.hypot(across, above)[profile], np.interp(position, samples, turn), scanner
    )
    profile, position = profile[kept], position[kept]
    u, v = np.interp(position, samples, outline[:, 0]), np.interp(position, samples, outline[:, 1])
    at = stations[profile]
    points = head.top[at] + u[:, None] * head.across[at] + v[:, None] * head.axis[at]
    return points + scanner.noise_m * rng.standard_normal(points.shape)


def _stations(
    head: Railhead, scanner: Scanner, rng: np.random.RandomState, missing: tuple[tuple[float, float], ...]
) -> np.ndarray:
    """Return the samples of the head at which profiles cross it."""
    chainage = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(head.top, axis=0), axis=1))])
    count = int(chainage[-1] / scanner.profile_step_m / (1 - SPEED_SWING)) + 1
    phase = rng.random_sample() * 2 * np.pi
    swing = 1 + SPEED_SWING * np.sin(phase + np.arange(count) * scanner.profile_step_m / SPEED_SWING_M)
    wanted = np.cumsum(scanner.profile_step_m * swing)
    wanted = wanted[wanted < chainage[-1]]
    for start, end in missing:
        wanted = wanted[(wanted < start) | (wanted > end)]
    return np.searchsorted(chainage, wanted)


def _scanner_positions(top: np.ndarray, path: np.ndarray, scanner: Scanner) -> np.ndarray:
    """Return the positions of the scanner as it passes each of the (n, 3) points."""
    along = np.gradient(path[:, :2], axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(path))])
    flight = path + scanner.left_m * left + np.array([0, 0, scanner.height_m])
    return flight[cKDTree(path[:, :2]).query(top[:, :2])[1]]


def _hits(
    outline: np.ndarray, across: np.ndarray, above: np.ndarray, ray_step_rad: float, rng: np.random.RandomState
) -> tuple[np.ndarray, np.ndarray]:
    """Find where the rays from scanner positions, (`across`, `above`) in the frame of the head, hit its outline.

    Returns the scanner position of each hit, by number, and the place along `head_outline`, in samples.
    """
    # Seen from outside, the angle along a convex outline increases only where the surface faces the scanner.
    angle = np.arctan2(across[:, None] - outline[:, 0], above[:, None] - outline[:, 1])
    rows = np.arange(len(across))
    first, last = np.argmin(angle, axis=1), np.argmax(angle, axis=1)
    lowest, highest = angle[rows, first], angle[rows, last]
    samples = np.arange(len(outline))
    angle = np.where(samples < first[:, None], lowest[:, None], angle)
    angle = np.where(samples > last[:, None], highest[:, None], angle)
    phase = rng.random_sample(len(across))
    start = np.ceil(lowest / ray_step_rad - phase)
    count = np.maximum(np.floor(highest / ray_step_rad - phase) - start + 1, 0).astype(int)
    profile = np.repeat(rows, count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    rays = (start[profile] + number + phase[profile]) * ray_step_rad
    # One interpolation for all profiles: each is shifted by a full turn from the one before.
    lift = 2 * np.pi * rows
    flat = np.interp(rays + lift[profile], (angle + lift[:, None]).ravel(), np.arange(angle.size))
    return profile, flat - profile * len(outline)


def _chance(distance_m: np.ndarray, turn: np.ndarray, scanner: Scanner) -> np.ndarray:
    """Return the probability that a ray returns and its point is classified as rail."""
    returned = 1 / (1 + (distance_m / scanner.half_range_m) ** 4)
    return returned * np.where(np.abs(turn) > FACE_TURN, scanner.face_share, scanner.top_share)
