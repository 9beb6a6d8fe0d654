"""Heads in windows, and rails followed in clouds that are thin or blur heads."""

import numpy as np
import pytest
from rail_extract.core.grow import heads as module
from rail_extract.core.grow.growth import Reason, grow
from rail_extract.core.grow.heads import DENSE, THIN, GrowSettings, heads_in
from rail_extract.core.polyline import length_along
from rail_extract.laboratory.ruler.lines import cut
from rail_extract.laboratory.ruler.whole_clouds import GrowingCloud
from rail_extract.laboratory.scenes.raw_catalogue import RAW_SCENES
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, WIDTH_M
from scipy.spatial import cKDTree

SETTINGS = GrowSettings(GAUGE_M, WIDTH_M)


def group(middle, width=WIDTH_M, height=0.0):
    across = np.linspace(middle - width / 2, middle + width / 2, 15)
    return across, height - (across - middle) ** 2 / 0.1


def heads(*groups, beam=DENSE, least=3):
    return heads_in(*np.concatenate(groups, axis=1), SETTINGS, beam, least)


@pytest.fixture(scope="module")
def scene():
    return RAW_SCENES["photo curve blunt"](2)


@pytest.fixture(scope="module")
def near(scene):
    rails = cKDTree(np.concatenate([rail[:, :2] for rail in scene.rails]))
    return scene.xyz[np.isfinite(rails.query(scene.xyz[:, :2], distance_upper_bound=4.0)[0])]


def distances(xyz, rails):
    return np.hypot(*(xyz - cut(rails).nearest(xyz)[0]).T[:2])


@pytest.mark.parametrize(("beam", "width", "apart"), [(DENSE, WIDTH_M, 0.12), (THIN, 0.11, 0.25)])
def test_each_group_of_points_is_a_head(beam, width, apart):
    one, other = heads(group(-0.03, width, 0.1), group(-0.03 + apart, width), beam=beam)
    assert (one.across_m, other.across_m) == pytest.approx((-0.03, apart - 0.03), abs=0.001)
    assert (one.top_m, other.top_m) == pytest.approx((0.1, 0.0), abs=0.01)
    assert one.alone
    assert other.alone


def test_few_points_are_no_head():
    assert not heads(group(0.0), least=100)


@pytest.mark.parametrize("beam", [DENSE, THIN])
def test_two_heads_that_touch_are_at_the_sides_of_their_group(beam):
    width = WIDTH_M + 2 * beam.beside_m
    one, other = heads(group(-width / 2, width), group(width / 2, width), beam=beam)
    assert (one.across_m, other.across_m) == pytest.approx((-width / 2, width / 2), abs=0.03)
    assert not one.alone
    assert not other.alone


def test_a_rail_is_followed_through_the_cloud_and_no_square_is_classified_twice(scene, near, monkeypatch):
    calls, real = [], module.classify_square
    monkeypatch.setattr(module, "classify_square", lambda xyz, own: calls.append(len(xyz)) or real(xyz, own))
    own = GrowSettings(scene.standard.gauge_m, scene.standard.head_width_m)
    cloud = GrowingCloud(near, own)
    for rail in scene.rails[:2]:
        found = grow(cloud.heads, rail[len(rail) // 2, :2] + 0.03, own)
        assert [stop.reason for stop in found.stops] == [Reason.CLOUD, Reason.CLOUD]
        assert len(found.rails) == 2
        for one in found.rails:
            assert one.length_m == pytest.approx(length_along(rail[:, :2])[-1], abs=2.0)
            assert distances(one.xyz[1:-1], scene.rails).max() < 0.05
        on = cloud.on(found.rails)
        assert (distances(near[on], scene.rails) < 0.10).mean() > 0.99
    squares = len(calls)
    grow(cloud.heads, scene.rails[1][len(scene.rails[1]) // 3, :2], own)
    assert len(calls) == squares
