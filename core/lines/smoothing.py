"""Smooth lines and height profiles by PAEK; what it keeps and loses: docs/method.md sections 5.3 and 5.4."""

from __future__ import annotations

import numpy as np

from ..polyline import length_along
from .paek import filled, local_fit, reflected, repeated

STATIONS_PER_SIGMA = 4
"""A smoothed line has no detail shorter than sigma; stations a quarter of it apart show its shape."""

GAP_SIGMAS = 3.0
"""A profile is not smoothed across a gap between its points that is longer than this many sigma."""

SAME_STATION_M = 1e-6
"""Points of a profile closer together along the line than this are averaged."""


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
        Distances along the given polyline at which to evaluate. Default: its vertices, and stations between them so
        that no two are more than a quarter of sigma apart.
    ends : {"fixed", "free"}
        Fixed ends stay in place and have no curvature; free ends are fitted from the inside.
    closed : bool
        Whether the line is smoothed across its seam; `ends` is ignored then.

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

    The ends are free. Where points are more than `GAP_SIGMAS` sigma apart, each side is smoothed on its own and the
    profile is straight in between. Beyond its ends it keeps the last height.

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


def _averaged(t: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort points by t and average those at the same place."""
    order = np.argsort(t, kind="stable")
    t, z = t[order], z[order]
    group = np.cumsum(np.concatenate([[0], np.diff(t) > SAME_STATION_M]))
    count = np.bincount(group)
    return np.bincount(group, t) / count, np.bincount(group, z) / count
