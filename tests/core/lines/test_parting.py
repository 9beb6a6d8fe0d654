"""The law by which two rails part, against closed formulas."""

import numpy as np
import pytest
from rail_extract.core.lines.parting import ARC, STRAIGHT, PartingLaw, left_of


@pytest.mark.parametrize("radius", [190, 500, 2500])
@pytest.mark.parametrize("touch_m", [-20.0, 0.0, 3.0])
def test_an_arc_is_found_from_a_part_of_it(radius, touch_m):
    way = touch_m + np.arange(4.0, 12.0, 0.1)
    law = PartingLaw.fitted(way, (way - touch_m) ** 2 / (2 * radius), ARC)
    assert law.touch == pytest.approx(touch_m)
    assert law.way_at(0.01) == pytest.approx(touch_m + np.sqrt(2 * radius * 0.01))
    np.testing.assert_allclose(law(np.array([touch_m - 5, touch_m, touch_m + 30])), [0, 0, 450 / radius], atol=1e-9)


def test_a_straight_blade_is_found_from_a_part_of_it():
    way = np.arange(4.0, 12.0, 0.1)
    law = PartingLaw.fitted(way, (way - 1.5) / 30, STRAIGHT)
    assert law.touch == pytest.approx(1.5)
    assert law.way_at(0.1) == pytest.approx(4.5)
    np.testing.assert_allclose(law(np.array([0.0, 1.5, 31.5])), [0, 0, 1], atol=1e-9)


@pytest.mark.parametrize("power", [ARC, STRAIGHT])
def test_rails_that_do_not_part_touch_nowhere(power):
    way = np.arange(0.0, 8.0, 0.1)
    assert PartingLaw.fitted(way, way[::-1], power).touch == -np.inf


def test_weights_decide_which_places_count():
    way = np.arange(0.0, 8.0, 0.5)
    apart = np.where(way < 4, (way + 1) ** 2 / 600, (way + 3) ** 2 / 600)
    law = PartingLaw.fitted(way, apart, ARC, np.where(way < 4, 1.0, 1e-9))
    assert law.touch == pytest.approx(-1.0)


def test_places_left_of_a_line_are_on_its_left():
    line = np.array([[0.0, 0.0], [0.0, 10.0]])
    places = left_of(line, np.array([2.0, 5.0]), np.array([0.5, -0.25]))
    np.testing.assert_allclose(places, [[-0.5, 2.0], [0.25, 5.0]])
