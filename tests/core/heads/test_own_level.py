import numpy as np
import pytest
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.core.heads.own_level import (
    _chain,
    _gradient,
    _Levels,
    _levels,
    _pieces,
    _sagitta,
    _step,
    on_own_level,
)

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


@pytest.mark.parametrize("noise", [0.002, 0.005, 0.008])
@pytest.mark.parametrize("density", [12, 150])
def test_all_points_of_a_head_are_on_its_level(noise, density):
    (found,) = own(band(0, 100, density, noise=noise, profile=hilly))
    assert found.mean() > (0.998 if density > 12 else 0.95)  # six points in a bin, of which three show its level


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


def test_a_step_without_return_is_that_of_another_pass():
    """As where strips of a scanner meet."""
    one, other = own(band(0, 40), band(40, 80, up=0.02, seed=1))
    assert one.mean() > 0.99
    assert other.mean() > 0.99


def test_weeds_are_not_on_the_level():
    random = np.random.default_rng(5)
    weeds = np.column_stack([random.uniform(0, 60, 40), random.uniform(-0.03, 0.03, 40), random.uniform(0.05, 0.1, 40)])
    heads, above = own(band(0, 60), weeds)
    assert heads.all()
    assert not above.any()


def test_few_points_are_left_alone():
    (found,) = own(band(0, 5, 10))
    assert found.all()


@pytest.mark.parametrize(("step_m", "first"), [(0.003, 0.0), (0.03, 40.0)])
def test_a_piece_that_a_bin_off_by_chance_begins_continues_its_level(step_m, first):
    """The last bins of the piece before it and its first ones are next to each other."""
    one = np.column_stack([np.arange(0.0, 46.0), np.zeros(46)])
    other = np.column_stack([np.arange(40.0, 240.0), np.full(200, step_m)])
    chain = _chain([one, other], 0.015)
    assert chain[0, 0] == first and chain[-1, 0] == 239.0
    assert (np.diff(chain[:, 0]) >= 0).all()


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


def test_a_level_steps_by_more_than_chance_explains():
    for off_m, expected_m in ((0.0005, 0.008), (0.002, 4 * 1.4826 * 0.002), (0.02, 0.015)):
        bins, heights = np.repeat(np.arange(81), 2), np.zeros(162)
        heights[::2] = np.cumsum(off_m * np.resize([0, 1, -1, -1, 1, 0, -1, 1], 81))
        heights[1::2] = 5.0  # what stands on the head
        assert _step(_Levels(bins, heights)) == pytest.approx(expected_m, rel=0.01)


def test_a_rail_leaves_the_straight_line_between_known_bins_by_its_sagitta():
    found = _sagitta(np.array([5, 10, 14, 20, 30]), np.array([10, 20]))
    np.testing.assert_allclose(found, [0, 0, 5e-5 * 2 * 3, 0, 0])


@pytest.mark.parametrize(("skipped", "step_m", "lengths"), [(3, 0.0, [22]), (4, 0.0, [12, 10]), (1, 0.01, [12, 10])])
def test_a_level_runs_across_three_bins_without_and_over_small_steps(skipped, step_m, lengths):
    bins = np.append(np.arange(12), np.arange(10) + 11 + skipped)
    levels = _Levels(bins, np.where(np.arange(22) < 12, 0.0, step_m))
    assert [len(piece) for piece in _pieces(levels, 0.008)] == lengths
    short = _Levels(np.append(bins, [100, 101, 102]), np.append(levels.height, np.zeros(3)))
    assert [len(piece) for piece in _pieces(short, 0.008)] == lengths


def test_two_levels_in_the_same_bins_are_two_pieces_and_one_odd_bin_does_not_turn_them():
    bins = np.repeat(np.arange(30), 2)
    heights = np.tile([0.0, 0.012], 30)
    heights[30] = 0.004
    one, other = _pieces(_Levels(bins, heights), 0.008)
    assert len(one) == len(other) == 30
    assert np.delete(one[:, 1], 15).max() == 0.0 and other[:, 1].min() == 0.012


def level(start, end, up):
    return np.column_stack([np.arange(start, end), np.full(end - start, up)]).astype(float)


@pytest.mark.parametrize(
    ("other", "kept"),
    [
        (level(60, 100, 0.0), [0, 1]),  # a gap of 10 m
        (level(60, 100, 0.009 + 0.04), [0, 1]),
        (level(60, 100, 0.06 + 0.04), [0]),  # further off than its gradient explains
        (level(300, 340, 0.107), [0, 1]),
        (level(300, 340, 0.12), [0]),  # longer gaps are not seen through
        (level(40, 80, 0.049), [0, 1]),  # another pass
        (level(40, 80, 0.051), [0]),  # passes do not step by more
        (level(40, 62, 0.049), [0]),  # too short for another pass
        (level(42, 102, 0.08), [0]),  # a vehicle, though longer
        (level(42, 102, 0.068), [1]),  # too low for one
        (level(48, 108, 0.08), [1]),  # too far away
        (level(42, 222, 0.08), [1]),  # more than four times as long
    ],
)
def test_a_rail_has_the_pieces_that_its_gradient_passes_and_vehicles_explain(other, kept):
    pieces = [level(0, 40, 0.0), other]
    np.testing.assert_array_equal(_chain([*pieces], 0.01), np.concatenate([pieces[number] for number in kept]))
    assert len(_chain([], 0.01)) == 0
