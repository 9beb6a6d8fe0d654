"""Two ridges on a bed: found where they are, of their height, and not in what looks like one of them."""

import numpy as np
import pytest
from rail_extract.core.airborne.ridges import HALF_M, Shape, binned, fit

SPACING_M = 1.507
U = np.arange(-25, 26) * 0.05
SHAPE = Shape(SPACING_M, 0.1, 0.08, noise_m=0.03, rough_m=0.02)
MANY = np.full((1, len(U)), 20.0)


def rails(height=0.08):
    return height * (SHAPE.ridge(U, 1) + SHAPE.ridge(U, -1))


def gain(profile):
    return float(fit(MANY, profile[None], U, SHAPE).gain[0])


@pytest.mark.parametrize("tilt", [-0.1, 0.0, 0.1])
def test_rails_on_a_tilted_bed_are_measured(tilt):
    found = fit(MANY, (rails() + tilt * U + 0.3)[None], U, SHAPE)
    assert found.height[0] == pytest.approx(0.08, abs=0.004)
    assert found.tilt[0] == pytest.approx(tilt, abs=0.003)
    assert found.level[0] == pytest.approx(0.3, abs=0.005)
    assert found.gain[0] > 20
    assert found.flaw[0] == 0


@pytest.mark.parametrize(
    "profile",
    [
        np.zeros_like(U),
        0.08 * SHAPE.ridge(U, 1),
        -0.4 * np.maximum(U - 0.7, 0),
        0.2 * np.abs(U),
        -0.25 * np.maximum(np.abs(U) - 0.6, 0),
        0.1 * U * U,
    ],
    ids=["bed", "one rail", "shoulder", "trench", "bank", "bowl"],
)
def test_what_is_not_two_rails_gains_little(profile):
    assert gain(profile) < 0.15 * gain(rails())


def test_one_rail_and_an_edge_are_not_a_track():
    profile = 0.08 * SHAPE.ridge(U, 1) + 0.35 * np.minimum(U + 0.65, 0)
    assert gain(profile) < 0.15 * gain(rails())


def test_a_step_counts_as_a_flaw():
    found = fit(MANY, (rails() + 0.3 * (U > 1.0))[None], U, SHAPE)
    assert found.flaw[0] > 10


def test_bins_hold_counts_and_means():
    count, height = binned(
        np.array([0, 0, 1]), np.array([-0.9, -0.85, 0.6]), np.array([1.0, 3.0, 5.0]), 2, -1.0, 8, 0.25
    )
    assert count.tolist() == [[2, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 1, 0]]
    assert height[0, 0] == 2.0
    assert height[1, 6] == 5.0
    assert HALF_M > SPACING_M / 2
