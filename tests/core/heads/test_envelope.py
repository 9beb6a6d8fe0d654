import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.heads.envelope import extremal_boundary

HEIGHT = st.floats(-3, 3, allow_nan=False).map(lambda value: round(value, 2))
POSITION = st.floats(0, 12, allow_nan=False).map(lambda value: round(value, 2))
POINTS = st.lists(st.tuples(POSITION, HEIGHT), min_size=1, max_size=40).map(lambda pairs: np.array(pairs, dtype=float))


def upper_by_brute_force(points, radius, x):
    beside = radius**2 - (x[:, None] - points[None, :, 0]) ** 2
    discs = np.where(beside >= 0, points[None, :, 1] + np.sqrt(np.maximum(beside, 0)), -np.inf)
    return discs.max(axis=1)


def closing_by_brute_force(points, radius, x):
    # Sampled finely near the points: between two samples the disc falls by much less than the test's tolerance.
    centres = np.linspace(-12, 24, 36001)
    heights = upper_by_brute_force(points, radius, centres)
    beside = radius**2 - (x[:, None] - centres[None, :]) ** 2
    with np.errstate(invalid="ignore"):
        lower = np.where(beside >= 0, heights[None, :] - np.sqrt(np.maximum(beside, 0)), np.inf)
    return lower.min(axis=1)


@given(POINTS, st.sampled_from([0.5, 1.0, 2.5, 20.0]))
def test_upper_boundary_equals_brute_force(points, radius):
    boundary = extremal_boundary(points[:, 0], points[:, 1], radius)
    x = np.linspace(-radius, 12 + radius, 997) + 1e-5
    expected = upper_by_brute_force(points, radius, x)
    reached = np.isfinite(expected)
    np.testing.assert_allclose(boundary.upper(x)[reached], expected[reached], atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_closing_surface_equals_brute_force_on_rail_profiles(seed):
    random = np.random.default_rng(seed)
    points = np.column_stack([random.uniform(0, 12, 60), random.normal(0, 0.02, 60)])
    boundary = extremal_boundary(points[:, 0], points[:, 1], 20.0)
    x = np.linspace(1, 11, 40)
    expected = closing_by_brute_force(points, 20.0, x)
    np.testing.assert_allclose(boundary.closing(x), expected, atol=5e-5)
    assert np.all(boundary.closing(points[:, 0]) >= points[:, 1] - 1e-12)
