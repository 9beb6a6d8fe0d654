"""A mobile laser scanner: profiles of rays that hit railheads, with noise, blind sides and lost returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .tracks import Railhead

CROWN_RADIUS_M = 0.300
"""Radius of the running surface of new rails (EN 13674-1: 300 mm on 60E1)."""

CORNER_RADIUS_M = 0.013
"""Radius of the gauge corner, the last of the radii that EN 13674-1 chains there; the others are left out."""

FACE_DEPTH_M = 0.035
"""How far below the top the side faces reach, about the height of a head less its fillets."""

FACE_TURN = np.pi / 4
"""Surface that looks this far away from the head's axis, or farther, counts as side face."""

SPEED_SWING, SPEED_SWING_M = 0.2, 10.0
"""How much the train's speed, and with it the distance of profiles, swings, and over which length (per radian)."""

PROFILE_SAMPLES = 24
"""Samples on the crown, and half as many on either corner and face: below 0.1 mm from the true outline."""


@dataclass(frozen=True)
class Scanner:
    """How a scanner on a train sees rails; the defaults suit a good one.

    Attributes
    ----------
    profile_step_m : float
        Mean distance between profiles, 0.03 to 0.10 m by the train's speed.
    ray_step_rad : float
        Angle between neighbouring rays of a profile.
    height_m, left_m : float
        Place of the scanner above and left of the axis of the track it rides on.
    noise_m : float
        Standard deviation of a point in each of x, y and z.
    half_range_m : float
        Distance at which half the rays come back.
    face_share : float
        Share of the points on side faces that the classification kept as rail.
    """

    profile_step_m: float = 0.05
    ray_step_rad: float = 0.002
    height_m: float = 4.0
    left_m: float = 0.4
    noise_m: float = 0.003
    half_range_m: float = 18.0
    face_share: float = 0.3


def head_outline(head_width_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Outline of a railhead in its own frame, from the bottom of the left face over the crown to that of the right.

    Parameters
    ----------
    head_width_m : float

    Returns
    -------
    outline : (m, 2) array
        Metres to the left of the axis and above the top (hence at most 0).
    turn : (m,) array
        Angle between the surface's normal and the axis, radians, positive to the left.
    """
    half = head_width_m / 2
    reach = CROWN_RADIUS_M - CORNER_RADIUS_M
    drop = np.sqrt(reach**2 - (half - CORNER_RADIUS_M) ** 2)
    shoulder = np.arctan2(half - CORNER_RADIUS_M, drop)
    crown = np.linspace(0, shoulder, PROFILE_SAMPLES // 2, endpoint=False)
    corner = np.linspace(shoulder, np.pi / 2, PROFILE_SAMPLES // 2)
    corner_height = drop - CROWN_RADIUS_M
    face = np.linspace(corner_height, -FACE_DEPTH_M, PROFILE_SAMPLES // 2)[1:]
    u = np.concatenate(
        [
            CROWN_RADIUS_M * np.sin(crown),
            half - CORNER_RADIUS_M + CORNER_RADIUS_M * np.sin(corner),
            np.full(len(face), half),
        ]
    )
    v = np.concatenate(
        [
            CROWN_RADIUS_M * (np.cos(crown) - 1),
            corner_height + CORNER_RADIUS_M * np.cos(corner),
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
) -> np.ndarray:
    """Scan one railhead from a train that passes by.

    Rays of one profile leave the scanner at equal angles; those that meet the visible side of the outline give
    points, so that density falls with range, grazing tops get few points and the far face none.

    Parameters
    ----------
    head : Railhead
    head_width_m : float
    path : (k, 3) array
        Way of the track that the scanner rides on, metres.
    scanner : Scanner
    rng : RandomState
    missing : tuple of (start, end)
        Stretches without points, metres along the head.

    Returns
    -------
    (n, 3) array
    """
    stations = _stations(head, scanner, rng, missing)
    source = _scanner_positions(head.top[stations], path, scanner)
    ray = source - head.top[stations]
    across = np.sum(ray * head.across[stations], axis=1)
    above = np.sum(ray * head.axis[stations], axis=1)
    profile, position = _hits(head_width_m, across, above, scanner.ray_step_rad, rng)
    outline, turn = head_outline(head_width_m)
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
    """Choose the samples of the head at which profiles cross it."""
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
    """Place the scanner on its way where it passes each of the (n, 3) points."""
    along = np.gradient(path[:, :2], axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(path))])
    flight = path + scanner.left_m * left + np.array([0, 0, scanner.height_m])
    return flight[cKDTree(path[:, :2]).query(top[:, :2])[1]]


def _hits(
    head_width_m: float, across: np.ndarray, above: np.ndarray, ray_step_rad: float, rng: np.random.RandomState
) -> tuple[np.ndarray, np.ndarray]:
    """Send rays from scanners at (`across`, `above`) of the head's frame and find where they meet the outline.

    Returns
    -------
    profile : (n,) int array
        Number of the scanner position.
    position : (n,) array
        Fractional sample number along `head_outline`.
    """
    outline, _ = head_outline(head_width_m)
    # Seen from outside, the angle along a convex outline rises just where the surface faces the scanner.
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
    # One interpolation for all profiles: each is lifted by a full turn above the one before.
    lift = 2 * np.pi * rows
    flat = np.interp(rays + lift[profile], (angle + lift[:, None]).ravel(), np.arange(angle.size))
    return profile, flat - profile * len(outline)


def _chance(distance_m: np.ndarray, turn: np.ndarray, scanner: Scanner) -> np.ndarray:
    """Chance that a ray comes back and its point is classified as rail."""
    returned = 1 / (1 + (distance_m / scanner.half_range_m) ** 4)
    return returned * np.where(np.abs(turn) > FACE_TURN, scanner.face_share, 1.0)
