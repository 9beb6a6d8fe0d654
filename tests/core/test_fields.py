"""Values written to the fields of result layers."""

import math

import numpy as np
import pytest
from rail_extract.core.fields import LENGTH, Field


@pytest.mark.parametrize(
    ("known", "written"),
    [(19.87150001, 19.872), (np.float64(1 / 3), 0.333), (-0.0004, 0.0), (1e6 + 2 / 3, 1000000.667), (math.nan, None)],
)
def test_numbers_are_rounded_to_the_decimals_of_the_field(known, written):
    assert LENGTH.value(known) == written


def test_negative_zero_becomes_zero():
    assert math.copysign(1, LENGTH.value(-0.0004)) == 1


def test_ids_and_counts():
    assert Field("rail_id", int, "").value(np.int64(7)) == 7
    assert Field("bridged", int, "").value(np.True_) == 1
    assert Field("left_ids", str, "").value((1, 12)) == "1,12"
