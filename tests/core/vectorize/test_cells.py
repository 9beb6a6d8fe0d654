"""Cells of rails say on which side of a line the other rail of its track is."""

import numpy as np
import pytest
from rail_extract.core.vectorize.cells import RailCells
from scipy.spatial import cKDTree

SPACING_M = 1.507


def way(sign, radius_m=np.inf, aside_m=0.0):
    """Points every 0.1 m for 10 m outward from the origin, beside the x axis or an arc to the left of it."""
    turn = sign * np.arange(0.2, 10.0, 0.1) / radius_m
    x = sign * np.arange(0.2, 10.0, 0.1) if np.isinf(radius_m) else (radius_m - aside_m) * np.sin(turn)
    y = aside_m + (0 * x if np.isinf(radius_m) else (radius_m - aside_m) * (1 - np.cos(turn)))
    return np.column_stack([x, y])


def cells(*parts, spacings_m=(SPACING_M,)):
    return RailCells(cKDTree(np.concatenate(parts)), spacings_m)


@pytest.mark.parametrize("radius_m", [np.inf, 300.0, 40.0])
@pytest.mark.parametrize("spacings_m", [(SPACING_M,), (1.07, SPACING_M)])
@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [((1,), (1,), 0.0), ((1,), (-1,), 1.0), ((-1,), (1,), 1.0), ((1,), (), 0.0), ((), (), 0.0), ((1, -1), (-1,), 0.0)],
)
def test_a_partner_that_is_seen_on_both_ways_is_on_one_side_or_changes(before, after, expected, spacings_m, radius_m):
    one, other = way(-1, radius_m), way(1, radius_m)
    partners = [way(-1, radius_m, side * SPACING_M) for side in before]
    partners += [way(1, radius_m, side * SPACING_M) for side in after]
    seen = cells(one, other, *partners, spacings_m=spacings_m)
    assert seen.change_of_sides(one, other) == pytest.approx(expected, abs=0.1)
    assert seen.change_of_sides(other, one) == pytest.approx(expected, abs=0.1)


def test_without_spacings_and_on_short_ways_nothing_changes():
    one, other = way(-1), way(1)
    partners = way(-1, aside_m=SPACING_M), way(1, aside_m=-SPACING_M)
    assert cells(one, other, *partners, spacings_m=()).change_of_sides(one, other) == 0.0
    assert cells(one, other, *partners).change_of_sides(one[:5], other) == 0.0
