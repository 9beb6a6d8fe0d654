"""Rails in clouds that are thin or blur heads: followed where the classification finds them."""

import numpy as np
import pytest
from rail_extract.core.grow import on_heads as module
from rail_extract.core.grow.follow import Reason
from rail_extract.core.grow.growth import grow, on_rails
from rail_extract.core.grow.on_heads import OfHeads, OnHeads
from rail_extract.core.grow.points import Buckets
from rail_extract.core.grow.settings import BLUNT, GrowSettings
from rail_extract.core.parameters import GrowParameters
from rail_extract.core.polyline import length_along
from rail_extract.laboratory.ruler.lines import cut, nearest
from rail_extract.laboratory.scenes.raw_catalogue import RAW_SCENES
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, WIDTH_M
from scipy.spatial import cKDTree

HALF_M = WIDTH_M / 2 + 0.02


def group(middle, half=HALF_M, height=0.0):
    across = np.linspace(middle - half, middle + half, 15)
    return across, height - (across - middle) ** 2 / 0.1


def window(*groups):
    across, height = np.concatenate(groups, axis=1)
    return OfHeads(across, height, GrowSettings(GAUGE_M, WIDTH_M, GrowParameters()), BLUNT)


@pytest.fixture(scope="module")
def scene():
    return RAW_SCENES["photo curve blunt"](2)


@pytest.fixture(scope="module")
def near(scene):
    rails = cKDTree(np.concatenate([rail[:, :2] for rail in scene.rails]))
    return scene.xyz[np.isfinite(rails.query(scene.xyz[:, :2], distance_upper_bound=4.0)[0])]


def distances(xyz, rails):
    return np.hypot(*(xyz - nearest(xyz, cut(rails))[0]).T[:2])


def test_each_group_of_points_is_a_head():
    one, other = window(group(-0.03, height=0.1), group(0.22)).heads(0.3)
    assert (one.across_m, other.across_m) == pytest.approx((-0.03, 0.22), abs=0.001)
    assert (one.top_m, other.top_m) == pytest.approx((0.1, 0.0), abs=0.01)


def test_only_heads_within_reach_of_the_place_count():
    cut_open = window(group(-0.03), group(0.22))
    assert [round(one.across_m, 2) for one in cut_open.heads(0.1, around_m=0.2)] == [0.22]
    assert not cut_open.heads(0.1, min_points=100)


@pytest.mark.parametrize("place", [-0.05, 0.0, 0.04])
def test_where_two_heads_touch_the_course_decides_between_them(place):
    (head,) = window(group(-0.07), group(0.07)).heads(0.3, around_m=place)
    assert head.across_m == pytest.approx(place, abs=0.02)


def test_a_rail_is_followed_through_the_cloud_and_no_square_is_classified_twice(scene, near, monkeypatch):
    calls, real = [], module.classify_square
    monkeypatch.setattr(module, "classify_square", lambda xyz, own: calls.append(len(xyz)) or real(xyz, own))
    points, own = Buckets(near), GrowSettings(scene.standard.gauge_m, scene.standard.head_width_m)
    heads = OnHeads(points, own)
    for rail in scene.rails[:2]:
        found = grow(points, rail[len(rail) // 2, :2] + 0.03, own, heads=heads)
        assert [stop.reason for stop in found.stops] == [Reason.CLOUD, Reason.CLOUD]
        assert len(found.rails) == 2
        for one in found.rails:
            assert one.length_m == pytest.approx(length_along(rail[:, :2])[-1], abs=2.0)
            assert distances(one.xyz[1:-1], scene.rails).max() < 0.05
        on = on_rails(found.rails, near, own)
        assert (distances(near[on], scene.rails) < 0.10).mean() > 0.99
    squares = len(calls)
    grow(points, scene.rails[1][len(scene.rails[1]) // 3, :2], own, heads=heads)
    assert len(calls) == squares
