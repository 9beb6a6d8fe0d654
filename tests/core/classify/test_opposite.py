"""Heads opposite rails without a partner, in the shadow of a guard rail."""

import numpy as np
import pytest
from rail_extract.core.classify.bed import Bed
from rail_extract.core.classify.cells import Kept, Shown
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.opposite import opposite_heads
from rail_extract.core.classify.pieces import links
from rail_extract.core.classify.settings import Settings
from rail_extract.core.classify.tops import Grid, tops_of

GAUGE_M, WIDTH_M, LENGTH_M, HEIGHT_M = 1.435, 0.072, 12.0, 0.17
RAIL_M, OTHER_M = 5.0, 5.0 + GAUGE_M + WIDTH_M
SETTINGS = Settings((GAUGE_M,), WIDTH_M)


def strip(rng, middle_m, half_m, up_m, per_m, noise_m=0.002):
    """Points of a strip along x, about its middle across and in this height, (k, 3)."""
    count = int(per_m * LENGTH_M)
    x, y = rng.uniform(0, LENGTH_M, count), middle_m + half_m * rng.uniform(-1, 1, count)
    return np.column_stack([x, y, up_m + rng.normal(0, noise_m, count)])


def found(other, cant=0.0, rail_m=LENGTH_M):
    """Which points of another strip, (k,) bool, are on a head opposite a rail; a guard rail hides the ground there."""
    rng = np.random.RandomState(3)
    other = other(rng)
    ground = strip(rng, 4.0, 3.0, 0.0, 2000, 0.006)
    ground = ground[np.abs(ground[:, 1] - OTHER_M) > 0.4]
    guard = strip(rng, OTHER_M - 0.12, 0.036, HEIGHT_M + 0.015, 150)
    xyz = np.concatenate([other, ground, guard, strip(rng, RAIL_M, 0.036, HEIGHT_M, 150)])
    xyz[:, 2] += 5.0 + cant * xyz[:, 1]
    bed, height, _, z = Bed.under(xyz)
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], SETTINGS.cell_m)
    shown = Shown(xyz[:, :2], cell, z, height, bed, tops_of(grid, cell, height, z))
    x = np.arange(0.0, rail_m, 0.08)
    axis, one = np.column_stack([x, 0 * x + RAIL_M]), np.ones(len(x))
    lines = Lines(axis, HEIGHT_M * one, 0 * one, one, one, 1.0)
    rail = Kept(lines, grid.cells(axis)[0], one > 1, links(lines))
    numbers = opposite_heads(rail, shown, SETTINGS)
    assert (numbers < len(other)).all()
    return np.isin(np.arange(len(other)), numbers)


@pytest.mark.parametrize("cant", [0.0, 0.1, -0.1])
def test_a_head_behind_a_guard_rail_is_found_at_gauge_from_its_partner(cant):
    """World 15177: the half of the crown that is nearer to the guard rail is all that is seen."""
    assert found(lambda rng: strip(rng, OTHER_M - 0.018, 0.018, HEIGHT_M, 45), cant).mean() > 0.95


@pytest.mark.parametrize(
    "other",
    [
        lambda rng: strip(rng, OTHER_M, 0.3, HEIGHT_M, 300),
        lambda rng: strip(rng, OTHER_M - 0.018, 0.018, HEIGHT_M - 0.1, 45),
        lambda rng: strip(rng, OTHER_M - 0.018, 0.018, HEIGHT_M, 5),
        lambda rng: strip(rng, OTHER_M, 0.036, HEIGHT_M, 45, 0.05),
        lambda rng: strip(rng, OTHER_M + 0.1, 0.036, HEIGHT_M, 45),
    ],
    ids=["pavement", "lower", "few points", "weeds", "off gauge"],
)
def test_what_is_not_a_head_as_high_as_the_rail_is_not_its_partner(other):
    assert not found(other).any()


def test_some_metres_and_most_of_the_rail_have_to_show_a_partner():
    def half_crown(rng):
        return strip(rng, OTHER_M - 0.018, 0.018, HEIGHT_M, 45)

    assert not found(half_crown, rail_m=2.5).any()
    assert found(half_crown, rail_m=4.0).any()
    assert not found(lambda rng: half_crown(rng) * [0.4, 1, 1]).any()
