import numpy as np
from rail_extract.core.rails import RailLine
from rail_extract.core.thinning import thin


def rail(xyz):
    return RailLine(np.asarray(xyz), 1, 10, points=0, resid_mm=0.0, sigma_mm=0.0, bridged_m=0.0)


def arc(radius, length, step=0.05):
    angle = np.arange(0, length / radius, step / radius)
    return radius * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])


def test_lines_keep_the_vertices_in_which_others_end():
    main = arc(300.0, 60.0)
    branch = main[517] + np.column_stack([np.arange(20.0), 0.02 * np.arange(20.0) ** 2, np.zeros(20)])
    alone = thin([rail(main)], 0.002, 0.002)[0].xyz
    thinned, other = (line.xyz for line in thin([rail(main), rail(branch)], 0.002, 0.002))
    assert not (alone == main[517]).all(axis=1).any()
    assert (thinned == other[0]).all(axis=1).any()
    assert len(thinned) <= len(alone) + 2


def test_thinned_lines_are_short_and_near():
    (line,) = thin([rail(arc(300.0, 60.0))], 0.002, 0.002)
    assert len(line.xyz) < 40
    middle = 0.5 * (line.xyz[1:] + line.xyz[:-1])
    assert np.abs(np.hypot(middle[:, 0], middle[:, 1] - 300.0) - 300.0).max() <= 0.002
    np.testing.assert_array_equal(line.xyz[[0, -1]], arc(300.0, 60.0)[[0, -1]])
