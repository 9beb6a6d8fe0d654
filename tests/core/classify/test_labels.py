"""Widths of tops, from how far points lie across from the axes of cells."""

import numpy as np
import pytest
from rail_extract.core.classify.labels import Near


def near(across):
    count = np.arange(len(across))
    return Near(len(across), count, np.zeros(len(across), dtype=int), across)


def width(across):
    return float(near(across).widths(np.zeros(1, dtype=int))[0])


def test_the_width_of_a_head_is_measured():
    assert width(np.linspace(-0.036, 0.036, 2000)) == pytest.approx(0.072, abs=0.001)


def test_a_kerb_stays_wide():
    assert width(np.linspace(-0.09, 0.06, 2000)) > 0.072 + 0.035
