"""The least errors that a fit can have."""

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, chained
from rail_extract.core.alignment.layouts import given_of, noted
from rail_extract.core.alignment.plane_fit import MeasuredLine, fit_plan
from rail_extract.core.frame import LocalFrame
from rail_extract.laboratory.designs import surveyed
from rail_extract.laboratory.ruler.alignments import bound_of, quantiles

SHAPES = [(80.0, 0, 0), (60.0, 0, 1 / 400), (90.0, 1 / 400, 1 / 400), (50.0, 1 / 400, 0), (80.0, 0, 0)]
WHITE_M = 0.002


def test_errors_of_fits_with_the_true_types_are_as_large_as_the_bound():
    plan = tuple(map(noted, chained((100.0, 200.0), 0.3, SHAPES)))
    design = Alignment(1, LocalFrame(np.zeros(3)), plan)
    true = surveyed(design, np.random.default_rng(0), 0.0)
    bound = bound_of(design, true, WHITE_M)
    s = np.arange(len(true), dtype=float)
    given, starts, radii = given_of(design, 0.0, float(s[-1])), [], []
    for seed in range(40):
        line = surveyed(design, np.random.default_rng(seed), WHITE_M)
        points = MeasuredLine(line[:, :2], s, np.full(len(s), WHITE_M**-2))
        found = fit_plan(given.chain, points, given.held, poses=given.poses).elements
        starts.append([one.s_from for one in found[1:]])
        radii.append(1 / found[2].k_from)
    assert np.std(radii) == pytest.approx(400 * bound.radius[0], rel=0.25)
    np.testing.assert_allclose(np.std(starts, axis=0), bound.ends_m[2::2], rtol=0.3)
    np.testing.assert_allclose(bound_of(design, true, 2 * WHITE_M).ends_m, 2 * bound.ends_m, rtol=1e-6)


def test_quantiles_of_normal_errors():
    np.testing.assert_allclose(quantiles(np.full(7, 3.0), (0.5, 0.6827)), [0.6745 * 3, 3.0], rtol=1e-3)
    assert quantiles(np.array([0.0, 0.0, 0.0, 1.0]), (0.5,))[0] < 1e-3
