"""Join consecutive pieces of a rail into one line with the figures of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..polyline import length_along
from ..rails import RailLine, Support

SAME_RAIL_M = 0.03
"""Lines this close together are the same rail: two rails are at least a head apart, two copies of one a few
millimetres."""


def united(parts: Sequence[RailLine]) -> RailLine:
    """Join pieces, each of which begins where the previous one ends, into one line."""
    if len(parts) == 1:
        only = parts[0]
        return only if only.points == int(only.points) else _with_figures(parts, only.xyz)
    xyz = np.concatenate([parts[0].xyz[:1], *(part.xyz[1:] for part in parts)])
    return _with_figures(parts, xyz)


def _with_figures(parts: Sequence[RailLine], xyz: np.ndarray) -> RailLine:
    """Combine the figures of the pieces as if the line, with vertices `xyz`, had been measured as a whole."""
    lengths = [length_along(part.xyz[:, :2])[-1] for part in parts]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    points = np.array([part.points for part in parts], dtype=float)
    squares = np.array([part.resid_mm**2 for part in parts])
    supports = [part.support for part in parts if part.support is not None]
    support, sigma_mm, sigmaz_mm = None, parts[0].sigma_mm, parts[0].sigmaz_mm
    if len(supports) == len(parts):
        several = any(one.strips is not None for one in supports)
        support = Support(
            np.concatenate([one.t + start for one, start in zip(supports, starts)]),
            np.concatenate([one.points for one in supports]),
            np.concatenate([one.sigma_m for one in supports]),
            np.concatenate([one.every_strip for one in supports]) if several else None,
            np.concatenate([one.heights_m for one in supports]),
        )
        if len(support.t):
            sigma_mm, sigmaz_mm = 1000 * support.rms_m, 1000 * support.rmsz_m
    gaps = _merged_gaps(np.concatenate([part.gaps + start for part, start in zip(parts, starts)]))
    return replace(
        parts[0],
        xyz=xyz,
        points=int(round(points.sum())),
        resid_mm=float(np.sqrt((points * squares).sum() / max(points.sum(), 1.0))),
        sigma_mm=sigma_mm,
        sigmaz_mm=sigmaz_mm,
        bridged_m=float(np.sum(gaps[:, 1] - gaps[:, 0])),
        gaps=gaps,
        support=support,
    )


def _merged_gaps(gaps: np.ndarray) -> np.ndarray:
    """Merge touching gaps, (k, 2) in order."""
    if len(gaps) < 2:
        return gaps
    apart = gaps[1:, 0] > gaps[:-1, 1] + SAME_RAIL_M
    return np.column_stack([gaps[np.append(True, apart), 0], gaps[np.append(apart, True), 1]])
