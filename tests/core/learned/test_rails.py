"""What continues a rail that the network found is added; what is too short is left out."""

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings
from rail_extract.core.learned.square import rails_of

GAUGE, WIDTH = 1.435, 0.072
SETTINGS = Settings((GAUGE,), WIDTH)


def rail(left, step=0.04, length=12.0, grade=0.0):
    """Points on a head along a line at 0.3 rad, (n, 3): three across."""
    along, across = np.meshgrid(np.arange(0, length, step), left + WIDTH * np.array([-0.3, 0.0, 0.3]))
    x = 12 + along * np.cos(0.3) - across * np.sin(0.3)
    y = 12 + along * np.sin(0.3) + across * np.cos(0.3)
    return np.column_stack([x.ravel(), y.ravel(), 5 + grade * along.ravel()]), along.ravel()


def pair(**shape):
    left, along = rail(0.0, **shape)
    right, _ = rail(-GAUGE - WIDTH, **shape)
    return np.concatenate([left, right]), np.tile(along, 2)


@pytest.mark.parametrize("grade", [0.0, 0.04])
def test_a_gap_is_filled_by_what_may_be_rail_and_lies_on_the_axis(grade):
    xyz, along = pair(grade=grade)
    sure = np.abs(along - 6) > 0.8
    kept, figures = rails_of(xyz, sure, SETTINGS, 1.0)
    assert kept.all()
    assert figures.points == len(xyz)
    assert figures.paired_m == pytest.approx(24, abs=4)


@pytest.mark.parametrize("off", [(0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (0.0, 0.0, -0.09), (0.0, 0.0, 0.08)])
def test_what_lies_beside_below_or_above_the_head_is_not(off):
    xyz, along = pair()
    gap = np.abs(along - 6) <= 0.8
    turn = np.array([[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    moved = xyz + np.where(gap[:, None], np.array(off) @ turn, 0.0)
    kept, _ = rails_of(moved, ~gap, SETTINGS, 1.0)
    assert kept[~gap].all()
    assert not kept[gap].any()


def test_nothing_continues_where_nothing_was_found():
    xyz, along = pair()
    kept, figures = rails_of(xyz, np.zeros(len(xyz), dtype=bool), SETTINGS, 1.0)
    assert not kept.any()
    assert figures.points == 0
    short, _ = rails_of(xyz, along < 1.0, SETTINGS, 1.0)
    assert not short.any()


def test_a_thin_rail_is_seen_with_a_longer_reach():
    xyz, along = pair(step=0.9)
    some = np.random.RandomState(3).random_sample(len(xyz)) < 0.4
    near, far = (rails_of(xyz[some], np.ones(some.sum(), dtype=bool), SETTINGS, reach)[0] for reach in (1.0, 2.0))
    assert near.mean() < 0.7 < 0.8 < far.mean()
