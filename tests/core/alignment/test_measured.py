"""Cant from two rails beside a centerline."""

import numpy as np
from rail_extract.core.alignment.measured import cant_of_rails


def test_cant_is_left_minus_right_where_both_rails_are_known():
    x = np.arange(0.0, 101.0)
    line = np.column_stack([x, 0 * x, 0 * x])
    left = np.column_stack([x, 0 * x + 0.75, 0.001 * x])[:80]
    right = np.column_stack([x, 0 * x - 0.75, -0.001 * x])
    other = np.column_stack([x, 0 * x + 3.0, 0 * x + 5.0])
    cant = cant_of_rails(line, [left, right, other])
    known = cant[:, 0] <= 79.0
    np.testing.assert_allclose(cant[known, 1], 0.002 * cant[known, 0], atol=1e-9)
    assert 79 <= cant[-1, 0] <= 81
    assert len(cant_of_rails(line, [left])) == len(cant_of_rails(line, [])) == 0
