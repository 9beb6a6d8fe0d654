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


@given(POINTS, st.sampled_from([0.5, 1.0, 2.5, 20.0]))
def test_starts_increase_and_ends_are_kept(points, radius):
    boundary = extremal_boundary(points[:, 0], points[:, 1], radius)
    assert np.all(np.diff(boundary.start) > 0)
    assert np.all(np.diff(boundary.x) > 0)
    assert boundary.x[0] == points[:, 0].min()
    assert boundary.x[-1] == points[:, 0].max()


@pytest.mark.parametrize("seed", range(5))
def test_closing_surface_equals_brute_force_on_rail_profiles(seed):
    random = np.random.default_rng(seed)
    points = np.column_stack([random.uniform(0, 12, 60), random.normal(0, 0.02, 60)])
    boundary = extremal_boundary(points[:, 0], points[:, 1], 20.0)
    x = np.linspace(1, 11, 40)
    expected = closing_by_brute_force(points, 20.0, x)
    np.testing.assert_allclose(boundary.closing(x), expected, atol=5e-5)
    assert np.all(boundary.closing(points[:, 0]) >= points[:, 1] - 1e-12)


def test_contact_points_are_on_the_closing_surface():
    random = np.random.default_rng(1)
    x, y = random.uniform(0, 50, 500), random.normal(0, 0.01, 500)
    boundary = extremal_boundary(x, y, 20.0)
    np.testing.assert_allclose(boundary.closing(boundary.x), boundary.y, atol=1e-12)
    assert 5 < len(boundary.x) < 100


def test_gap_sags_by_its_square_over_eight_radii():
    boundary = extremal_boundary(np.array([0.0, 1.0]), np.array([2.0, 2.0]), 20.0)
    assert boundary.closing(np.array([0.5]))[0] == pytest.approx(2.0 - 1 / (8 * 20.0), abs=1e-6)


def test_separate_components_hand_over_where_the_right_disc_begins():
    boundary = extremal_boundary(np.array([0.0, 100.0]), np.array([0.0, 5.0]), 20.0)
    np.testing.assert_allclose(boundary.start, [-20.0, 80.0])
    assert boundary.upper(np.array([50.0]))[0] == -np.inf


def test_the_higher_of_two_points_at_one_place_counts():
    boundary = extremal_boundary(np.array([0.0, 0.0, 1.0]), np.array([0.1, 0.4, 0.2]), 20.0)
    np.testing.assert_allclose(boundary.y, [0.4, 0.2])


def test_a_single_point_closes_at_its_own_height():
    assert extremal_boundary(np.array([3.0]), np.array([7.0]), 20.0).closing(np.array([3.0]))[0] == 7.0
