"""A square labelled by a network: grooves in pavements, what continues a rail, and what is too short."""

import numpy as np
import pytest
from rail_extract.core.classify.settings import MARGIN_M, Settings, Way
from rail_extract.core.classify.square import classify_square
from rail_extract.core.learned.model import label_square, rails_of
from rail_extract.laboratory.scenes.raw_catalogue import RAW_SCENES
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, turned, with_track

GAUGE, WIDTH = 1.435, 0.072
SETTINGS = Settings((GAUGE,), WIDTH)


class Answer:
    """Gives every point in the zone of railheads the same probability."""

    def __init__(self, value):
        self._value = value

    def probabilities(self, thinned, blocks, progress):
        return np.where(thinned.railhigh, self._value, np.nan)


def test_rails_in_a_pavement_are_found_whatever_the_network_says():
    rng = np.random.RandomState(1)
    xyz = flat(8.0, 0.01)
    inside = GAUGE / 2 - np.abs(turned(xyz, 0.3)[1])
    xyz[(inside > 0) & (inside < 0.042), 2] -= 0.045
    xyz[:, 2] += 0.003 * rng.standard_normal(len(xyz))
    found = label_square(xyz, SETTINGS, Answer(0.0))
    expected = classify_square(xyz, SETTINGS)
    assert found.figures.points == found.rail.sum() > 10_000
    assert np.array_equal(found.rail, expected.rail)
    assert found.figures == expected.figures


@pytest.mark.parametrize(("value", "share"), [(0.9, 1.0), (0.3, 0.0)])
def test_points_from_half_on_are_labelled(value, share):
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(9.0, rng=rng, per_m2=600), GAUGE, WIDTH, 0.3)
    found = label_square(rough(xyz, rng), SETTINGS, Answer(value))
    assert found.rail[on].mean() == pytest.approx(share, abs=0.02)
    assert not found.rail[~on].any()
    assert found.figures.paired_m == pytest.approx(share * 18, abs=2)


def test_blunted_rails_are_found_whatever_the_network_says():
    scene = RAW_SCENES["photo curve blunt"](2)
    settings = Settings((scene.standard.gauge_m,), scene.standard.head_width_m, way=Way.BLUNT)
    corner = scene.rails[0][len(scene.rails[0]) // 2] - [20.0, 20.0, 0.0]
    xyz = scene.xyz - corner
    xyz = xyz[((xyz[:, :2] > -MARGIN_M) & (xyz[:, :2] < settings.side_m + MARGIN_M)).all(axis=1)]
    found, expected = label_square(xyz, settings, Answer(0.0)), classify_square(xyz, settings)
    assert expected.rail.sum() > 3000
    assert found.rail[expected.rail].mean() > 0.95
    assert not found.rail[~expected.rail].any()
    assert found.figures.blunt_m == expected.figures.blunt_m > 100


def test_no_points_give_no_rails():
    assert not label_square(np.empty((0, 3)), SETTINGS, Answer(1.0)).rail.any()


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
