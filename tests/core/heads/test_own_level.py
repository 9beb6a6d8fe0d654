import numpy as np
import pytest
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.core.heads.own_level import _gradient, _levels, on_own_level

WIDTH = 0.072


def band(start, end, density=150, up=0.0, across=0.0, half=0.036, noise=0.004, seed=0, profile=None):
    """Points of a level strip: chainage, offset and height."""
    random = np.random.default_rng(seed)
    t = random.uniform(start, end, int((end - start) * density))
    z = up + random.normal(0, noise, len(t)) + (0.0 if profile is None else profile(t))
    return np.column_stack([t, across + random.uniform(-half, half, len(t)), z])


def own(*parts):
    """Whether the points of each part may be on the head."""
    points = np.concatenate(parts)
    order = np.argsort(points[:, 0], kind="stable")
    line, free = np.array([[0.0, 0.0], [100.0, 0.0]]), np.ones((2, 401), dtype=bool)
    found = np.isin(np.arange(len(points)), on_own_level(HeadPoints(*points[order].T, WIDTH, line, free, order)).strips)
    return np.split(found, np.cumsum([len(part) for part in parts])[:-1])


def hilly(t):
    return 0.03 * t + 0.01 * np.sin(2 * np.pi * t / 60)


@pytest.mark.parametrize("depth", [0.02, 0.035, 0.06])
@pytest.mark.parametrize("length", [6.0, 15.0, 22.0])
def test_dirt_between_two_steps_is_not(depth, length):
    before, after = band(0, 30, profile=hilly), band(30 + length, 70, seed=1, profile=hilly)
    dirt = band(30, 30 + length, 200, -depth, noise=0.005, seed=2, profile=hilly)
    heads, more_heads, covered = own(before, after, dirt)
    assert heads.mean() > 0.98
    assert more_heads.mean() > 0.98
    assert covered.mean() < 0.05


def test_a_train_that_stands_on_the_rail_is_not_even_where_it_hides_most_of_it():
    seen = [band(start, start + 0.5, seed=int(start), profile=hilly) for start in range(22, 80, 5)]
    ends = band(0, 20, profile=hilly), band(85, 100, seed=1, profile=hilly)
    frames = band(20, 85, 200, 0.28, noise=0.01, seed=2, profile=hilly)
    *heads, train = own(*ends, *seen, frames)
    assert np.concatenate(heads).mean() > 0.98
    assert train.mean() < 0.01


def test_weeds_are_not_on_the_level():
    random = np.random.default_rng(5)
    weeds = np.column_stack([random.uniform(0, 60, 40), random.uniform(-0.03, 0.03, 40), random.uniform(0.05, 0.1, 40)])
    heads, above = own(band(0, 60), weeds)
    assert heads.all()
    assert not above.any()


def level(start, end, up):
    return np.column_stack([np.arange(start, end), np.full(end - start, up)]).astype(float)


def test_the_gradient_sums_up_without_steps():
    t = np.arange(0.05, 60.0, 0.1)
    z = 0.03 * t + 0.05 * (t > 25)
    at = np.array([0.0, 10.0, 40.0, 59.0])
    found = _gradient(t, z, at)
    np.testing.assert_allclose(found - found[0], 0.03 * at, atol=0.001)
    assert _gradient(t[:4], z[:4], at).tolist() == [0.0] * 4


def test_the_fullest_level_of_a_bin_is_the_first_and_three_points_make_one():
    heights = {0: [0.0] * 5 + [0.3] * 4 + [-0.2] * 3 + [0.6] * 3, 2: [0.1] * 2, 3: [0.50, 0.51, 0.519, 0.54, 0.56]}
    number = np.repeat(list(heights), [len(one) for one in heights.values()])
    found = _levels(number, np.concatenate(list(heights.values())))
    assert found.bin.tolist() == [0, 0, 0, 3]
    assert found.height[[0, 1, 3]].tolist() == [0.0, 0.3, 0.51]
    assert found.height[2] in (-0.2, 0.6)
    assert len(_levels(np.zeros(0, dtype=int), np.zeros(0)).bin) == 0
