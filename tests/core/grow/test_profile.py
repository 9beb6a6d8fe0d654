"""Cross-sections: what is a head and what is not."""

import numpy as np
import pytest
from rail_extract.core.grow.profile import Section
from rail_extract.core.grow.settings import DENSE, GrowSettings
from rail_extract.core.parameters import GrowParameters
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, WIDTH_M


def growing(**changes):
    return GrowSettings(GAUGE_M, WIDTH_M, GrowParameters(**changes))


BED = -0.17


def section(*parts, count=6000, seed=1, **changes):
    """Random points of half a metre; `parts` are low side, high side and height."""
    rng = np.random.RandomState(seed)
    across = rng.uniform(-0.6, 0.6, count)
    z = BED + rng.normal(0, 0.012, count)
    for low, high, height in parts:
        on = (across >= low) & (across <= high)
        z[on] = height + rng.normal(0, 0.002, on.sum())
    return Section(across, z, growing(**changes), DENSE)


def bar(middle, width=WIDTH_M, height=0.0):
    return middle - width / 2, middle + width / 2, height


@pytest.mark.parametrize("place", [0.0, 0.031, -0.12])
def test_a_head_is_found_where_it_is(place):
    (head,) = section(bar(place)).heads(0.2)
    assert head.across_m == pytest.approx(place, abs=0.003)
    assert head.top_m == pytest.approx(0.0, abs=0.001)
    assert head.is_free
    assert not head.flush
    assert head.bed_m == pytest.approx(BED, abs=0.02)


def test_heights_count_within_the_tolerance():
    cut = section(bar(0.0, height=0.05))
    assert not cut.heads(0.2)
    (head,) = cut.heads(0.2, 0.045)
    assert head.top_m == pytest.approx(0.05, abs=0.001)


@pytest.mark.parametrize("parts", [[bar(0.0, 0.25)], [(-0.6, 0.6, 0.0)], [(0.0, 0.02, 0.0)]])
def test_a_plank_a_floor_and_a_thin_edge_are_no_free_heads(parts):
    assert not [
        head for head in section(*parts).heads(0.2) if head.is_free and abs(head.across_m) < 0.1 and head.count > 300
    ]


def test_two_rails_side_by_side_are_two_heads():
    found = section(bar(0.0), bar(0.114)).heads(0.2)
    assert sorted(head.across_m for head in found) == pytest.approx([0.0, 0.114], abs=0.004)


def test_where_two_heads_touch_each_has_one_free_side():
    found = sorted(section(bar(0.0, 2 * WIDTH_M)).heads(0.2), key=lambda head: head.across_m)
    assert [head.across_m for head in found] == pytest.approx([-WIDTH_M / 2, WIDTH_M / 2], abs=0.004)
    assert [head.clear for head in found] == [(True, False), (False, True)]


def test_a_head_in_a_pavement_shows_by_its_groove():
    cut = section((-0.6, 0.6, 0.0), (WIDTH_M / 2, WIDTH_M / 2 + 0.045, -0.04))
    head = min(cut.heads(0.03), key=lambda one: abs(one.across_m))
    assert head.across_m == pytest.approx(0.0, abs=0.006)
    assert head.flush
    assert head.clear == (False, True)


def test_a_low_ridge_is_no_head():
    assert not section(bar(0.0, height=BED + 0.03)).heads(0.2, BED + 0.03)
    assert section(bar(0.0, height=BED + 0.08)).heads(0.2, BED + 0.08)
    assert not section(bar(0.0, height=BED + 0.08), min_height_m=0.15).heads(0.2, BED + 0.08)


def test_a_wall_hides_a_head():
    rng = np.random.RandomState(3)
    across = np.concatenate([rng.uniform(-0.6, 0.6, 6000), rng.uniform(-0.036, 0.036, 3000)])
    z = np.concatenate([BED + rng.normal(0, 0.012, 6000), rng.uniform(-0.17, 0.6, 3000)])
    z[:6000][np.abs(across[:6000]) < 0.036] = 0.0
    assert not Section(across, z, growing(), DENSE).heads(0.2)


def test_nothing_is_nothing():
    cut = Section(np.empty(0), np.empty(0), growing(), DENSE)
    assert cut.is_empty()
    assert cut.heads(0.2) == []
