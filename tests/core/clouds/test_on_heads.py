from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.clouds.on_heads import heads_of, on_heads
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame

HEAD, WEB, FOOT, SLEEPER = range(4)


def rail(length_m, per_m=150, seed=0, noise_m=0.002, across_m=0.0, gradient=0.0):
    """Points on a rail along x, (n, 3), and what each is on: shares as a scanner sees them from the side."""
    random = np.random.default_rng(seed)
    n = int(length_m * per_m)
    part = random.choice(4, n, p=[0.45, 0.15, 0.3, 0.1])
    x = random.uniform(0, length_m, n)
    half = np.choose(part, [0.036, 0.008, 0.075, 0.1])
    low, high = (np.choose(part, bounds) for bounds in ([-0.03, -0.13, -0.17, -0.18], [0.0, -0.06, -0.15, -0.175]))
    top = (part == HEAD) & (random.random(n) < 0.6)
    z = np.where(top, 0.0, random.uniform(low, high)) + gradient * x + random.normal(0, noise_m, n)
    y = np.where((part == HEAD) & ~top, random.choice([-0.036, 0.036], n), random.uniform(-half, half))
    return np.column_stack([x, across_m + y + random.normal(0, noise_m, n), z]), part


@pytest.mark.parametrize("gradient", [0.0, 0.04])
@pytest.mark.parametrize("noise_m", [0.001, 0.005])
def test_what_is_below_a_head_is_left_out(gradient, noise_m):
    xyz, part = rail(30.0, noise_m=noise_m, gradient=gradient)
    kept = on_heads(xyz)
    assert kept[part == HEAD].mean() > 0.99
    assert kept[part != HEAD].mean() < 0.015


@given(st.integers(20, 400), st.floats(0.0, 0.006), st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_heads_alone_are_kept(per_m, noise_m, seed):
    """All but the few points that noise puts below them: one in 2,000 at 6 mm, and at times two of a hundred."""
    xyz, part = rail(12.0, per_m, seed, noise_m)
    head = xyz[part == HEAD]
    assert len(head) - on_heads(head).sum() <= 3 + 0.002 * len(head)


def test_a_rail_far_beside_the_scanner_shows_its_web_as_well_as_its_head():
    """Seen at a low angle, a rail has as many points at every height, and the levels of head and web touch."""
    random = np.random.default_rng(3)
    x, z = random.uniform(0, 60, 6000), random.uniform(-0.16, 0.0, 6000)
    across = np.interp(
        z, [-0.16, -0.15, -0.13, -0.045, -0.0375, -0.01, 0.0], [0.075, 0.06, 0.01, 0.01, 0.036, 0.036, 0]
    )
    xyz = np.column_stack([x, across, z + random.normal(0, 0.002, 6000)])
    crown = (z > -0.005) & (random.random(6000) < 0.8)
    xyz[crown, 1] = random.uniform(-0.03, 0.03, crown.sum())
    kept, found = on_heads(xyz), on_heads(xyz, found=True)
    assert kept[z > -0.035].mean() > 0.99
    assert not kept[z < -0.07].any()
    assert found[z > -0.02].mean() > 0.99
    for each in (kept, found):
        assert each[(z < -0.045) & (z > -0.06)].mean() < 0.2


def test_where_a_class_holds_webs_their_upper_ends_are_left_out_and_where_it_does_not_the_lower_ends_of_faces_stay():
    random = np.random.default_rng(5)
    x, z = random.uniform(0, 40, 3000), random.uniform(-0.12, 0.0, 3000)
    across = np.interp(z, [-0.12, -0.05, -0.042, -0.036, -0.008, 0.0], [0.01, 0.01, 0.03, 0.036, 0.036, 0.0])
    crown = random.random(3000) < 0.15
    z[crown], across[crown] = 0.0, random.uniform(-0.02, 0.03, crown.sum())
    xyz = np.column_stack([x, across, z]) + random.normal(0, 0.003, (3000, 3))
    assert on_heads(xyz)[(z < -0.043) & (z > -0.05)].mean() < 0.2
    faces = z > -0.042
    assert on_heads(xyz[faces]).mean() > 0.99


def test_a_web_right_below_the_face_that_a_tripod_sees_is_left_out():
    random = np.random.default_rng(4)
    x, z = random.uniform(0, 40, 3000), random.uniform(-0.06, 0.0, 3000)
    across = np.interp(z, [-0.06, -0.045, -0.0375, -0.008, 0.0], [0.01, 0.012, 0.036, 0.036, 0.0])
    xyz = np.column_stack([x, across, z]) + random.normal(0, 0.0015, (3000, 3))
    kept = on_heads(xyz)
    assert kept[z > -0.035].mean() > 0.99
    assert kept[z < -0.048].mean() < 0.1


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_few_points_of_the_foot_are_left_out_as_well(share):
    xyz, part = rail(30.0)
    there = (part == HEAD) | (np.random.default_rng(1).random(len(xyz)) < share)
    kept = on_heads(xyz[there])
    assert kept[part[there] == HEAD].mean() > 0.99
    assert kept[part[there] > WEB].sum() <= 0.1 * (part[there] > WEB).sum() + 3


def test_a_train_above_a_third_of_a_rail_does_not_hide_it():
    xyz, part = rail(60.0)
    random = np.random.default_rng(2)
    wheels = np.column_stack([random.uniform(20, 40, 1500), random.uniform(-0.06, 0.06, 1500), np.zeros(1500)])
    wheels[:, 2] = random.uniform(0.08, 0.18, 1500)
    kept = on_heads(np.concatenate([xyz, wheels]))[: len(xyz)]
    assert kept[part == HEAD].mean() > 0.98


def test_a_stretch_without_points_on_the_head_does_not_lower_it_beside():
    xyz, part = rail(30.0)
    there = (part != HEAD) | (np.abs(xyz[:, 0] - 15.0) > 0.8)
    kept = on_heads(xyz[there])
    assert kept[part[there] == HEAD].mean() > 0.99
    assert kept[part[there] != HEAD].mean() < 0.015


def test_rails_next_to_each_other_at_two_heights_are_both_kept():
    """A conductor rail is 15 cm higher than the running rail and 35 cm beside it."""
    running, part = rail(30.0)
    conductor, _ = rail(30.0, seed=1, across_m=0.35)
    kept = on_heads(np.concatenate([running, conductor + [0.0, 0.0, 0.15]]))[: len(running)]
    assert kept[part == HEAD].mean() > 0.99


def test_a_rail_without_a_head_is_kept():
    """Where the class holds no head, nothing says that the points are below one."""
    xyz, part = rail(30.0)
    assert on_heads(xyz[part == FOOT]).all()


@pytest.mark.parametrize("found", [False, True])
def test_a_class_and_what_was_found_in_a_sharp_cloud_lose_web_and_foot(found):
    xyz, part = rail(30.0)
    points = RailPoints(xyz, LocalFrame(np.zeros(3)), 10, found=found)
    assert len(heads_of(points).xyz) < 1.01 * (part == HEAD).sum()


def test_ridges_that_were_found_in_a_blunt_cloud_are_kept():
    xyz, _ = rail(30.0)
    assert heads_of(RailPoints(xyz, LocalFrame(np.zeros(3)), 10, found=True, blunt=True)).xyz is xyz


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_few_points_are_kept(count):
    assert on_heads(np.zeros((count, 3))).all()
