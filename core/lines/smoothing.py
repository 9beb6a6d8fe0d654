"""Smoothing of lines, height profiles and networks by PAEK, and the thinning of their vertices afterwards.

What the smoothing keeps and loses, and how networks are led back to their nodes: ALGORITHMS.md sections 2.4 to 2.9.
"""

from __future__ import annotations

import numpy as np

from ..rails import length_along
from .network_smoothing import smooth_network
from .paek import filled, local_fit, reflected, repeated

__all__ = ["simplify", "smooth_line", "smooth_network", "smooth_profile"]

STATIONS_PER_SIGMA = 4
"""The smoothed line has nothing shorter than sigma left in it; a quarter of it shows the curve."""

GAP_SIGMAS = 3.0
"""A profile is not smoothed across a gap between its points longer than this many sigma."""

SAME_STATION_M = 1e-6
"""Points of a profile that lie closer along the line than this are averaged."""

EXACT_M = 1e-9
"""A vertex nearer than this to the chord says nothing, even at a tolerance of zero."""


def smooth_line(
    vertices: np.ndarray,
    sigma_m: float,
    stations: np.ndarray | None = None,
    ends: str = "fixed",
    closed: bool = False,
) -> np.ndarray:
    """Smooth a polyline along its own length.

    Parameters
    ----------
    vertices : (n, d) array
        Metres; the first vertex of a closed line is repeated as its last.
    sigma_m : float
        Length of the kernel. Waves of 4.9 sigma are halved; a circle of radius R shrinks by 1.8 sigma⁴ / R³.
    stations : (m,) array, optional
        Distances along the given polyline at which to evaluate; by default its vertices and at most a quarter of sigma
        in between.
    ends : {"fixed", "free"}
        Fixed ends stay where they are and are straight; free ones are fitted from the inside.
    closed : bool
        Smooth across the seam of a closed line; `ends` then means nothing.

    Returns
    -------
    (m, d) array
    """
    vertices = np.asarray(vertices, dtype=float)
    t = length_along(vertices)
    if stations is None:
        stations = filled(t, sigma_m / STATIONS_PER_SIGMA)
    if closed:
        t, vertices = repeated(t, vertices, t[-1], sigma_m)
    elif ends == "fixed":
        t, vertices = repeated(*reflected(t, vertices), t[-1], sigma_m)
    return local_fit(t, vertices, stations, sigma_m)


def smooth_profile(t: np.ndarray, z: np.ndarray, sigma_m: float, stations: np.ndarray) -> np.ndarray:
    """Smooth heights over the distance along a line; points weigh by the distance between them, not by their number.

    The ends are free. Where points lie more than `GAP_SIGMAS` sigma apart, each side is smoothed alone and the profile
    runs straight across; beyond its ends it keeps the last height.

    Parameters
    ----------
    t, z : (n,) arrays
        Distance along the line and height of points in any order, at least one.
    sigma_m : float
    stations : (m,) array
        Distances at which the height is wanted.

    Returns
    -------
    (m,) array
    """
    t, z = _averaged(np.asarray(t, dtype=float), np.asarray(z, dtype=float))
    stations = np.asarray(stations, dtype=float)
    breaks = np.flatnonzero(np.diff(t) > GAP_SIGMAS * sigma_m) + 1
    known_t, known_z = [], []
    for piece_t, piece_z in zip(np.split(t, breaks), np.split(z, breaks)):
        inside = stations[(stations > piece_t[0]) & (stations < piece_t[-1])]
        known_t.append(np.unique(np.concatenate([piece_t[[0, -1]], inside])))
        known_z.append(local_fit(piece_t, piece_z[:, None], known_t[-1], sigma_m)[:, 0])
    return np.interp(stations, np.concatenate(known_t), np.concatenate(known_z))


def simplify(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Leave out vertices that lie within tolerance of the line through the others (Douglas and Peucker, 1973).

    Plan and height are judged at once, so that the result keeps both tolerances.

    Parameters
    ----------
    xyz : (n, 3) array
        Heights may be NaN; then the plan alone counts.
    tolerance_xy_m, tolerance_z_m : float
        How far a vertex may lie beside the result in plan, and above or below it.

    Returns
    -------
    (k, 3) array
        Some of the vertices, the first and the last among them.
    """
    return xyz[essential_vertices(xyz, tolerance_xy_m, tolerance_z_m)]


def essential_vertices(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Mark the vertices that `simplify` keeps, (n,) bool."""
    keep = np.zeros(len(xyz), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(xyz) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        beside, above = _deviation(xyz[first : last + 1])
        excess = np.fmax(beside / max(tolerance_xy_m, EXACT_M), above / max(tolerance_z_m, EXACT_M))
        worst = int(excess.argmax())
        if excess[worst] > 1:
            keep[first + 1 + worst] = True
            spans += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return keep


def _averaged(t: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort points by t and average those at the same place."""
    order = np.argsort(t, kind="stable")
    t, z = t[order], z[order]
    group = np.cumsum(np.concatenate([[0], np.diff(t) > SAME_STATION_M]))
    count = np.bincount(group)
    return np.bincount(group, t) / count, np.bincount(group, z) / count


def _deviation(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of the inner vertices from the segment between the outer ones, in plan and in height, (n - 2,) each."""
    chord, inner = xyz[-1] - xyz[0], xyz[1:-1] - xyz[0]
    length_squared = chord[0] ** 2 + chord[1] ** 2
    share = np.clip(inner[:, :2] @ chord[:2] / length_squared, 0, 1) if length_squared > 0 else np.zeros(len(inner))
    off = inner - share[:, None] * chord
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])
