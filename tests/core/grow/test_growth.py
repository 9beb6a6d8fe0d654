"""Growth: how far rails are followed, why they stop, and which points are on them."""

import numpy as np
import pytest
from heard import Heard
from hypothesis import given, settings
from hypothesis import strategies as some
from rail_extract.core.errors import Cancelled
from rail_extract.core.grow.growth import Reason, grow
from rail_extract.core.grow.heads import GrowSettings
from rail_extract.core.parameters import GrowParameters
from rail_extract.laboratory.ruler.whole_clouds import GrowingCloud
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, SPACING_M, WIDTH_M, strip


def growing(**changes):
    return GrowSettings(GAUGE_M, WIDTH_M, GrowParameters(**changes))


def grown(track, along, left=SPACING_M / 2, **changes):
    own = growing(**changes)
    cloud = GrowingCloud(track.xyz, own)
    found = grow(cloud.heads, track.at(along, left), own)
    return found, cloud.on(found.rails)


def scores(on, head):
    return (on & head).sum() / head.sum(), (on & head).sum() / max(on.sum(), 1)


@pytest.mark.parametrize("curvature", [0.0, 1 / 300, -1 / 25])
def test_both_rails_are_followed_to_the_ends_of_the_cloud(curvature):
    track = strip(20.0, curvature)
    found, on = grown(track, 7.0)
    assert [stop.reason for stop in found.stops] == [Reason.CLOUD, Reason.CLOUD]
    assert len(found.rails) == 2
    for rail in found.rails:
        assert rail.length_m == pytest.approx(19.5, abs=1.2)
        assert rail.seen.all()
    recall, precision = scores(on, track.head)
    assert recall > 0.96
    assert precision > 0.97


def test_only_the_rail_of_the_seed_is_followed_on_request():
    track = strip(14.0)
    found, on = grown(track, 7.0, both=False)
    assert len(found.rails) == 1
    assert not on[track.xyz[:, 1] < 0].any()
    assert scores(on, track.head & (track.xyz[:, 1] > 0))[0] > 0.95


def test_the_longest_run_counts_from_the_seed():
    found, _ = grown(strip(24.0), 12.0, max_length_m=4.0)
    assert [stop.reason for stop in found.stops] == [Reason.LENGTH, Reason.LENGTH]
    assert abs(found.stops[0].xyz[0] - found.stops[1].xyz[0]) == pytest.approx(8.0, abs=2.0)


@pytest.mark.parametrize(("gap", "crossed"), [(2.0, True), (4.0, False)])
def test_a_gap_of_a_few_windows_is_crossed(gap, crossed):
    track = strip(24.0, hidden=lambda along, left: (along > 14.0) & (along < 14.0 + gap))
    found, on = grown(track, 8.0)
    end = max(stop.xyz[0] for stop in found.stops)
    reasons = {stop.reason for stop in found.stops}
    assert (end > 23.0) == crossed
    assert (Reason.HEAD in reasons) == (not crossed)
    if not crossed:
        assert end == pytest.approx(14.0, abs=0.6)
    assert scores(on, track.head)[1] > 0.97


def test_fewer_outliers_stop_at_a_shorter_gap():
    track = strip(24.0, hidden=lambda along, left: (along > 14.0) & (along < 16.0))
    found, _ = grown(track, 8.0, max_outliers=1)
    assert max(stop.xyz[0] for stop in found.stops) == pytest.approx(14.0, abs=0.6)


def test_one_rail_leads_past_a_longer_gap_of_the_other():
    track = strip(24.0, hidden=lambda along, left: (along > 12.0) & (along < 18.0) & (left > 0))
    found, on = grown(track, 6.0)
    assert max(stop.xyz[0] for stop in found.stops) > 23.0
    assert not on[(track.xyz[:, 0] > 12.5) & (track.xyz[:, 0] < 17.5) & (track.xyz[:, 1] > 0)].any()
    assert scores(on, track.head)[0] > 0.96


def test_a_pavement_with_grooves_is_crossed():
    track = strip(26.0, paved=lambda along: (along > 10.0) & (along < 18.0), per_m2=2500)
    found, on = grown(track, 5.0)
    assert max(stop.xyz[0] for stop in found.stops) > 25.0
    recall, precision = scores(on, track.head)
    assert recall > 0.9
    assert precision > 0.95


def diverging(radius):
    """Left rail and right rail of a straight track, and those of one that leaves to the left at 8 m."""

    def branch(side):
        return lambda s: np.where(s > 8.0, side * SPACING_M / 2 + (s - 8.0) ** 2 / (2 * radius), np.nan)

    return [lambda s: SPACING_M / 2 + 0 * s, lambda s: -SPACING_M / 2 + 0 * s, branch(1), branch(-1)]


@pytest.mark.parametrize(("seed", "curved"), [(24.0, True), (24.0, False)])
def test_a_switch_is_passed_on_the_side_of_the_seed(seed, curved):
    track = strip(28.0, rails=diverging(150.0), half_width_m=2.6)
    bend = (seed - 8.0) ** 2 / 300.0
    found, _ = grown(track, seed, SPACING_M / 2 + bend if curved else -SPACING_M / 2)
    for rail, side in zip(found.rails, (1, -1) if curved else (-1, 1)):
        s, left = rail.xyz[:, 0], rail.xyz[:, 1]
        true = side * SPACING_M / 2 + (np.maximum(s - 8.0, 0) ** 2 / 300.0 if curved else 0)
        assert s.min() < 1.0
        assert s.max() > 27.0
        assert np.abs(left - true).max() < 0.03


def test_plants_on_the_rail_are_named():
    track = strip(22.0)
    rng = np.random.RandomState(4)
    there = (track.xyz[:, 0] > 14.0) & track.head
    track.xyz[there, 2] += rng.uniform(0.06, 0.4, there.sum())
    found, _ = grown(track, 6.0)
    assert Reason.COVERED in {stop.reason for stop in found.stops}
    assert max(stop.xyz[0] for stop in found.stops) == pytest.approx(14.0, abs=0.6)


@given(turn=some.floats(0, 6.28))
@settings(max_examples=4, deadline=None)
def test_a_turned_cloud_gives_the_same_points(turn):
    track = strip(12.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = track.xyz.copy()
    moved[:, :2] = moved[:, :2] @ rotation.T + [3e5, 5e6]
    _, straight = grown(track, 6.0)
    cloud = GrowingCloud(moved, growing())
    found = grow(cloud.heads, rotation @ track.at(6.0, SPACING_M / 2) + [3e5, 5e6], growing())
    assert np.mean(cloud.on(found.rails)[track.head] == straight[track.head]) > 0.95


def test_it_can_be_cancelled():
    track = strip(10.0)
    with pytest.raises(Cancelled):
        grow(GrowingCloud(track.xyz, growing()).heads, track.at(5.0, SPACING_M / 2), growing(), Heard(cancel_after=0))


@pytest.mark.parametrize(("length", "found"), [(4.0, False), (7.0, True)])
def test_a_short_lone_bar_is_no_rail(length, found):
    bar = strip(16.0, rails=[lambda s: np.where(np.abs(s - 8.0) < length / 2, 0.3, np.nan)])
    assert (grow(GrowingCloud(bar.xyz, growing()).heads, bar.at(8.0, 0.3), growing()) is not None) == found


@pytest.mark.parametrize("side", [1, -1])
def test_towards_a_switch_the_track_that_keeps_its_curvature_is_followed(side):
    track = strip(28.0, rails=diverging(150.0), half_width_m=2.6)
    found, _ = grown(track, 4.0, side * SPACING_M / 2)
    for rail, own in zip(found.rails, (side, -side)):
        assert rail.xyz[:, 0].max() > 27.0
        assert np.abs(rail.xyz[:, 1] - own * SPACING_M / 2).max() < 0.03
