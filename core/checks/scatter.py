"""What the gauge of a track tells of the errors of its rails: it is built to a millimetre or two, and scatters by more.

See docs/method.md section 6.11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..rails import Centerline, RailLine

ALIKE_M = 20.0
"""Length over which errors of dense matching are alike, at most."""


def gauge_scatter(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline], gauges_m: Sequence[float]
) -> dict[int, float]:
    """Return by how much rails err beyond their standard errors, by `rail_id`, metres.

    Both rails of a track err independently, and by as much as each other: half of the variance of the gauge is each
    one's. The stiff curve along a single rail follows errors that are as long as itself, and shows nothing of them.

    Parameters
    ----------
    rails : sequence of RailLine
    centerlines : sequence of Centerline
        All tracks of these rails.
    gauges_m : sequence of float
        Gauges that tracks may have.
    """
    own = {rail.rail_id: (rail.sigma_mm / 1000) ** 2 for rail in rails}
    beyond: dict[int, float] = {}
    for line, scatter_mm in zip(centerlines, _scatter_mm(centerlines, gauges_m)):
        sides = [np.mean([own[one] for one in ids]) for ids in (line.left_ids, line.right_ids)]
        more = max((scatter_mm / 1000) ** 2 - sum(sides), 0.0) / 2
        for one in (*line.left_ids, *line.right_ids):
            beyond[one] = max(beyond.get(one, 0.0), float(np.sqrt(more)))
    return beyond


def _scatter_mm(centerlines: Sequence[Centerline], gauges_m: Sequence[float]) -> np.ndarray:
    """Return by how much the gauge of each track scatters.

    A track that is about as long as its errors shows little of them. What it shows counts by its length, and one error
    more as all tracks of its gauge scatter about their mean, if that is more.
    """
    tracks = [(line.gauge_mm, line.gaugesd_mm, line.length_m) for line in centerlines]
    mean_mm, own_mm, length_m = np.reshape(tracks, (-1, 3)).T
    nominal = np.abs(np.subtract.outer(mean_mm, 1000 * np.array(gauges_m))).argmin(axis=1)
    scatter_mm = own_mm.copy()
    for same in (nominal == one for one in np.unique(nominal)):
        off_mm = mean_mm[same] - np.average(mean_mm[same], weights=length_m[same])
        all_mm2 = np.average(own_mm[same] ** 2 + off_mm**2, weights=length_m[same])
        more_mm2 = np.maximum(all_mm2 - own_mm[same] ** 2, 0.0) * ALIKE_M / (length_m[same] + ALIKE_M)
        scatter_mm[same] = np.sqrt(own_mm[same] ** 2 + more_mm2)
    return scatter_mm


def doubting_scatter(rails: Sequence[RailLine], beyond_m: Mapping[int, float]) -> list[RailLine]:
    """Add what `gauge_scatter` found to the standard errors of rails."""
    return [_doubting(rail, beyond_m.get(rail.rail_id, 0.0)) for rail in rails]


def _doubting(rail: RailLine, beyond_m: float) -> RailLine:
    """Add an error to the standard errors of a rail."""
    if rail.support is None or not beyond_m:
        return rail
    support = replace(rail.support, sigma_m=np.hypot(rail.support.sigma_m, beyond_m))
    return replace(rail, sigma_mm=1000 * support.rms_m, support=support)
