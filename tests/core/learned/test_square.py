"""A square labelled by a network: rails in pavements are found by their grooves."""

import numpy as np
import pytest
from rail_extract.core.classify.settings import MARGIN_M, Settings, Way
from rail_extract.core.classify.square import classify_square
from rail_extract.core.learned.square import label_square
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
