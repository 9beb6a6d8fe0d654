"""How deep the surface of an object is inside a profile: a fit to its points, as the deepest one is noise.

Of N points of a plane, the deepest lies two to three standard deviations of the noise too deep. See docs/clearance.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

ALONG_M, UP_M, ACROSS_M = 0.15, 0.35, 0.13
"""Half the size of the part of an object that is fitted: small enough that a mast, a wall or a sign is a plane or a
cylinder there, and large enough for some dozens of points at 400 per square metre."""

DEEPEST = 6
"""The median of this number of points leads to the deepest part: a single one is noise."""

LEAST_POINTS = 8
"""Fewer points make no surface: four unknowns leave too little to judge them by."""

ENVELOPE_ROUNDS, BELOW_WEIGHT, PLAIN_ROUNDS = 12, 0.08, 4
"""Rounds of least squares that find the upper envelope, weight of the points below it in these, which are of what
stands behind, and rounds that find its middle."""

NEAR_SIGMAS, STRAY_SIGMAS = 3.0, 4.0
"""Points within the first number of standard deviations of the noise are of the surface; points further above than the
second deny it."""

STRAY_SHARE, STRAY_LEAST = 0.08, 3
"""Share and number of points above the surface from which the object is a bush and has none."""

DROP_M = 0.014
"""The last fit holds where the surface is at most this far behind its deepest line: there a parabola follows a pole of
11 cm within a millimetre. Places are chosen along the track, not by the noise of the points."""

SURE_SLOPE = 2.0
"""Standard errors from which a slope or a bend counts: an imagined slope would deepen the end of the surface."""


@dataclass(frozen=True)
class Surface:
    """The deepest place of the surface of part of an object: penetration, its standard error by the fit, and place.

    `is_sure` where enough points make a surface or a bush. `lean` is v and w along the surface, 0 where there is none.
    """

    depth_m: float
    sigma_m: float
    s: float
    v: float
    w: float
    is_sure: bool
    lean: tuple[float, float] = (0.0, 0.0)


Depth = Callable[[np.ndarray], np.ndarray]
"""Returns the penetration of places, (n, 3): s, v and w."""


def surface_of(
    place: np.ndarray, depth: np.ndarray, centre: np.ndarray, inward: np.ndarray, noise_m: float, depth_at: Depth
) -> Surface:
    """Fit the deepest part of an object, and measure how deep the fitted surface is.

    The depth of points beside a corner of the profile bends where the surface does not, so that not the depth is
    fitted, but how far inwards the surface is, seen across the nearest edge. Given are s, v and w of the points around,
    (n, 3), also of those outside of the profile, and their penetration; where the deepest ones are, (3,); and the unit
    vector in v and w, (2,), perpendicular to the nearest edge of the profile.
    """
    off = place - centre
    s, t, h = off[:, 0], off[:, 1] * inward[1] - off[:, 2] * inward[0], off[:, 1:] @ inward
    near = (np.abs(s) <= ALONG_M) & (np.abs(t) <= UP_M) & (np.abs(h) <= ACROSS_M)
    place, depth, s, t, h = place[near], depth[near], s[near], t[near], h[near]
    deepest = np.argsort(-depth, kind="stable")
    if len(depth) < LEAST_POINTS:
        few = deepest[:3]
        middle = place[few].mean(axis=0) if len(few) else np.full(3, np.nan)
        return _at(middle, float(depth[few].mean()) if len(few) else -np.inf, noise_m, False)
    design = np.column_stack([np.ones(len(s)), t, s, s**2])
    chosen = _on_surface(design, h, noise_m)
    if chosen is None:
        third = deepest[2]
        return _at(place[third], float(depth[third]), 2 * noise_m, True)
    fitted, sigma, slope = _smoothed(design[chosen], h[chosen], noise_m)
    beside = np.array([inward[1], -inward[0]])
    places = centre + np.column_stack([s[chosen], np.outer(t[chosen], beside) + np.outer(fitted, inward)])
    depths = depth_at(places)
    at = int(np.argmax(depths))
    right, up = (beside + slope * inward).tolist()
    return replace(_at(places[at], float(depths[at]), float(sigma[at]), True), lean=(right, up))


def _at(place: np.ndarray, depth_m: float, sigma_m: float, is_sure: bool) -> Surface:
    s, v, w = place.tolist()
    return Surface(depth_m, sigma_m, s, v, w, is_sure)


def _on_surface(design: np.ndarray, h: np.ndarray, noise_m: float) -> np.ndarray | None:
    """Return which points, (n,) bool, are of the surface; None if too many points lie above one."""
    weights = np.ones(len(h))
    for _ in range(ENVELOPE_ROUNDS):
        c = _bulging(design, h, weights)
        weights = np.where(h > design @ c, 1.0, BELOW_WEIGHT)
    near = np.abs(h - design @ c) <= NEAR_SIGMAS * noise_m
    for _ in range(PLAIN_ROUNDS):
        if near.sum() < LEAST_POINTS:
            return None
        c = _bulging(design[near], h[near])
        bend = design[:, 2:] @ c[2:]
        on_top = bend >= bend[near].max() - DROP_M
        near = on_top & (np.abs(h - design @ c) <= NEAR_SIGMAS * noise_m)
    above = int((on_top & (h - design @ c > STRAY_SIGMAS * noise_m)).sum())
    return None if near.sum() < LEAST_POINTS or above >= max(STRAY_LEAST, STRAY_SHARE * len(h)) else near


def _smoothed(design: np.ndarray, h: np.ndarray, noise_m: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the surface at its points, a plane or cylinder whose slopes and bend are sure, errors, and its slope."""
    kept = [0, 1, 2, 3] if _solved(design, h)[3] < 0 else [0, 1, 2]
    while True:
        own = design[:, kept]
        c = _solved(own, h)
        off = h - own @ c
        scatter = max(float(np.sqrt(off @ off / max(len(off) - len(kept), 1))), 0.5 * noise_m)
        spread = scatter**2 * np.linalg.pinv(own.T @ own)
        sure = np.abs(c) / np.sqrt(np.maximum(np.diag(spread), 1e-18))
        weakest = int(np.argmin(np.where(np.arange(len(kept)) > 0, sure, np.inf)))
        if len(kept) == 1 or sure[weakest] >= SURE_SLOPE:
            errors = np.sqrt(np.einsum("ij,jk,ik->i", own, spread, own))
            return own @ c, errors, float(c[kept.index(1)]) if 1 in kept else 0.0
        del kept[weakest]


def _bulging(design: np.ndarray, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the coefficients, of which the bend is not hollow: a mast is round, and hollow ends would be noise."""
    c = _solved(design, values, weights)
    return c if c[3] <= 0 else np.append(_solved(design[:, :3], values, weights), 0.0)


def _solved(design: np.ndarray, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the coefficients of weighted least squares; the smallest ones where the points do not tell them."""
    weighted = design if weights is None else design * weights[:, None]
    return np.linalg.lstsq(weighted.T @ design, weighted.T @ values, rcond=1e-10)[0]
