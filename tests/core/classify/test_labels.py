"""Widths of tops, from how far points lie across from the axes of cells."""

import numpy as np
import pytest
from rail_extract.core.classify.labels import Near

ROUNDS = 5


def near(across):
    count = np.arange(len(across))
    return Near(len(across), count, np.zeros(len(across), dtype=int), across)


def width(across):
    return float(near(across).widths(np.zeros(1, dtype=int), ROUNDS)[0])


def test_the_width_of_a_head_is_measured():
    assert width(np.linspace(-0.036, 0.036, 2000)) == pytest.approx(0.072, abs=0.001)


@pytest.mark.parametrize("share", [0.1, 0.25])
def test_a_guard_rail_beside_does_not_widen_a_head(share):
    per_m = 2000 / 0.072
    guard = np.linspace(0.045, 0.075, round(share * per_m * 0.03))
    stray = np.linspace(-0.075, 0.075, round(share * per_m * 0.15))
    assert width(np.concatenate([np.linspace(-0.036, 0.036, 2000), guard, stray])) < 0.072 + 0.012


def test_a_kerb_stays_wide():
    assert width(np.linspace(-0.09, 0.06, 2000)) > 0.072 + 0.035
