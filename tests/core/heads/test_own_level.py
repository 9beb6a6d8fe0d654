import numpy as np
import pytest
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.core.heads.own_level import on_own_level

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


@pytest.mark.parametrize("foot_density", [100, 200])
def test_a_head_is_no_vehicle_on_its_foot(foot_density):
    """In world 10161, a line between the head of a whole rail and the side of its foot followed the foot."""
    head = band(0, 100, across=-0.032, profile=hilly)
    foot = band(0, 100, foot_density, -0.165, across=0.02, half=0.03, seed=1, profile=hilly)
    on_head, on_foot = own(head, foot)
    assert on_head.mean() > 0.98
    assert on_foot.mean() < 0.01


def test_a_head_is_no_vehicle_beside_the_part_of_its_foot_whose_head_a_train_hides():
    """In world 12595 (classified), 56 m of a rail beside 20 m of its foot were left out."""
    heads = band(0, 30, profile=hilly), band(50, 100, seed=1, profile=hilly)
    foot = band(30, 50, 100, -0.135, across=0.02, half=0.03, seed=2, profile=hilly)
    *on_heads, on_foot = own(*heads, foot)
    assert np.concatenate(on_heads).mean() > 0.98
    assert on_foot.mean() < 0.01


@pytest.mark.parametrize("wave_m", [0.04, 0.06])
def test_a_rail_whose_level_drifts_is_not_a_vehicle_where_noise_breaks_it_into_pieces(wave_m):
    (rail,) = own(band(0, 100, 70, noise=0.015, profile=lambda t: wave_m * np.sin(2 * np.pi * t / 140)))
    assert rail.mean() > 0.9


@pytest.mark.parametrize("lower_m", [0.022, 0.03])
def test_a_level_may_follow_another_one_although_both_are_seen_where_they_meet(lower_m):
    """A tripod shows the crown of a head, and the next one its face (world 12423: 20 mm lower)."""
    parts = own(band(0, 51, profile=hilly), band(50, 90, up=-lower_m, seed=1, profile=hilly))
    assert min(part.mean() for part in parts) > 0.98


def test_few_points_on_a_face_have_no_level():
    """A far scanner sees some points of a crown, and most of a face that is 38 mm high."""
    random = np.random.default_rng(1)
    head = band(0, 100, 18, across=-0.03, half=0.004, noise=0.003, seed=1, profile=hilly)
    head[:, 2] -= (random.random(len(head)) < 0.9) * random.uniform(0, 0.038, len(head))
    assert own(head)[0].all()


def test_a_rail_seen_from_the_air_keeps_its_points_where_noise_alone_makes_steps():
    (rail,) = own(band(0, 100, 12, noise=0.016, profile=lambda t: 0.05 * np.sin(2 * np.pi * t / 70)))
    assert rail.mean() > 0.9


def test_weeds_are_not_on_the_level():
    random = np.random.default_rng(5)
    weeds = np.column_stack([random.uniform(0, 60, 40), random.uniform(-0.03, 0.03, 40), random.uniform(0.05, 0.1, 40)])
    heads, above = own(band(0, 60), weeds)
    assert heads.all()
    assert not above.any()
