"""The warning about smoothing that displaces lines too far from their heads."""

import numpy as np
import pytest
from rail_extract.core.heads.smoothing_check import displacement, warn_if_out_of_reach
from rail_extract.core.progress import Progress
from rail_extract.core.rails import RailLine

HEAD_M = 0.072


def arc(radius_m, length_m=40.0):
    angle = np.linspace(0, length_m / radius_m, 400)
    return radius_m * np.column_stack([np.sin(angle), 1 - np.cos(angle)])


def rail(line):
    return RailLine(np.column_stack([line, np.zeros(len(line))]), 1, 10, 100, 20.0, 1.0, 0.0)


class Warned(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


def warned(line, smoothing_m):
    listener = Warned()
    warn_if_out_of_reach([rail(line)], HEAD_M, smoothing_m, listener)
    return listener.warnings


@pytest.mark.parametrize(("radius_m", "sigma_m"), [(25, 1.0), (60, 2.0), (300, 3.0)])
def test_a_line_that_ends_in_an_arc_is_displaced_in_proportion_to_sigma_squared(radius_m, sigma_m):
    assert displacement(arc(radius_m), sigma_m) == pytest.approx(0.26 * sigma_m**2 / radius_m, rel=0.03)


def test_a_ring_has_no_end():
    assert displacement(arc(25.0, 2 * np.pi * 25.0), 2.0) == pytest.approx(1.8 * 2.0**4 / 25.0**3, abs=5e-4)


def test_a_straight_line_stays():
    assert displacement(np.array([[0.0, 0.0], [30.0, 10.0]]), 3.0) == pytest.approx(0, abs=1e-9)


def test_three_metres_are_too_much_in_a_tram_curve():
    assert warned(arc(25.0), 3.0) == [
        "SMOOTHING_XY of 3 m displaces lines in curves by up to 98 mm, more than points can correct: "
        "set it to 1.8 m or less."
    ]
    assert warned(arc(25.0), 1.8) == []


def test_three_metres_do_no_harm_on_a_main_line():
    assert warned(arc(300.0, 200.0), 3.0) == []


def test_a_corner_that_no_rail_has_does_not_cause_a_warning_about_the_default():
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert displacement(corner, 0.8) > 0.1
    assert warned(corner, 0.8) == []
