"""Which points belong to which line."""

import numpy as np
from rail_extract.core.heads.head_points import near_lines

WIDTH = 0.072


def test_points_belong_to_the_nearest_line_in_order_along_it():
    lines = [np.array([[0.0, y], [10.0, y]]) for y in (0.0, 0.1)]
    xyz = np.array([[7.0, 0.02, 1.0], [3.0, 0.09, 2.0], [2.0, -0.03, 3.0], [5.0, 1.0, 4.0]])
    one, other = near_lines(lines, xyz, np.array([WIDTH, 0.06]), np.array([4, 5, 6, 7]))
    np.testing.assert_allclose([one.t, one.across, one.z], [[2, 7], [-0.03, 0.02], [3, 1]])
    np.testing.assert_allclose([other.t, other.across, other.z], [[3], [-0.01], [2]])
    assert (one.strips.tolist(), other.strips.tolist()) == ([6, 4], [5])
    assert (one.width_m, other.width_m, one.length_m) == (WIDTH, 0.06, 10.0)
    assert not one.free[1].any() and one.free[0].all() and not other.free[0].any()
    assert one.within(0.3).tolist() == [False, True]
    assert one[one.within(0.3)].strips.tolist() == [4]
