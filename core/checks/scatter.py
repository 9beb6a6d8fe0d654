"""What the gauge of a track tells of the errors of its rails: it is built to a millimetre or two, and scatters by more.

See docs/method.md section 6.11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..rails import Centerline, RailLine


def gauge_scatter(rails: Sequence[RailLine], centerlines: Sequence[Centerline]) -> dict[int, float]:
    """Return by how much rails err beyond their standard errors, by `rail_id`, metres.

    Both rails of a track err independently, and by as much as each other: half of the variance of the gauge is each
    one's. The stiff curve along a single rail follows errors that are as long as itself, and shows nothing of them.

    Parameters
    ----------
    rails : sequence of RailLine
    centerlines : sequence of Centerline
        All tracks of these rails.
    """
    own = {rail.rail_id: (rail.sigma_mm / 1000) ** 2 for rail in rails}
    beyond: dict[int, float] = {}
    for line in centerlines:
        sides = [np.mean([own[one] for one in ids]) for ids in (line.left_ids, line.right_ids)]
        more = max((line.gaugesd_mm / 1000) ** 2 - sum(sides), 0.0) / 2
        for one in (*line.left_ids, *line.right_ids):
            beyond[one] = max(beyond.get(one, 0.0), float(np.sqrt(more)))
    return beyond


def doubting_scatter(rails: Sequence[RailLine], beyond_m: Mapping[int, float]) -> list[RailLine]:
    """Add what `gauge_scatter` found to the standard errors of rails."""
    return [_doubting(rail, beyond_m.get(rail.rail_id, 0.0)) for rail in rails]


def _doubting(rail: RailLine, beyond_m: float) -> RailLine:
    """Add an error to the standard errors of a rail."""
    if rail.support is None or not beyond_m:
        return rail
    support = replace(rail.support, sigma_m=np.hypot(rail.support.sigma_m, beyond_m))
    return replace(rail, sigma_mm=1000 * support.rms_m, support=support)
