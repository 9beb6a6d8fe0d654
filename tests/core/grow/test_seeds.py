"""Rails grown from many seeds: each once, and as far as the farthest seed on it reaches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from rail_extract.core.grow.growth import APART, Growths, Reason, apart_first
from rail_extract.core.grow.heads import GrowSettings
from rail_extract.core.parameters import GrowParameters
from rail_extract.laboratory.ruler.whole_clouds import GrowingCloud
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, SPACING_M, WIDTH_M, strip

TRACK = strip(40.0)
CLOUD = GrowingCloud(TRACK.xyz, GrowSettings(GAUGE_M, WIDTH_M, GrowParameters()))


def grown(places, track=TRACK, heads=CLOUD.heads, **changes):
    """Grow from places along and to the left of the middle, each a seed of its own; returns also which are on rails."""
    made = Growths(heads, GrowSettings(GAUGE_M, WIDTH_M, GrowParameters(**changes)))
    is_on = [made.add(track.at(along, left)) for along, left in places]
    made.reach_on()
    return made, is_on


def reached(made):
    """Return the first and the last place along at which rails were followed."""
    ends = [stop.xyz[0] for growth in made.grown for stop in growth.stops]
    return min(ends), max(ends)


def test_equal_seeds_and_seeds_along_a_rail_grow_it_once():
    equal, is_on = grown([(12.0, SPACING_M / 2)] * 400)
    assert len(equal.grown) == 1
    assert all(is_on)
    along, is_on = grown([(at, SPACING_M / 2 + 0.1) for at in np.arange(1.0, 39.0, 0.5)])
    assert len(along.grown) == 1
    assert all(is_on)


def test_a_seed_on_the_other_rail_grows_nothing_more():
    made, is_on = grown([(12.0, SPACING_M / 2), (20.0, -SPACING_M / 2), (25.0, 0.0)])
    assert len(made.grown) == 1
    assert is_on == [True, True, False]


@settings(max_examples=12, deadline=None, derandomize=True)
@given(places=some.lists(some.floats(4.0, 36.0), min_size=1, max_size=6))
def test_rails_are_followed_as_far_as_from_each_seed_alone(places):
    seeds = [(at, SPACING_M / 2) for at in places]
    made, _ = grown(seeds, max_length_m=9.0)
    alone = [reached(grown([seed], max_length_m=9.0)[0]) for seed in seeds]
    for end, other in zip(reached(made), (min(low for low, _ in alone), max(high for _, high in alone))):
        assert end == pytest.approx(other, abs=1.1)


def test_the_end_of_a_run_beyond_which_another_goes_on_is_no_stop():
    made, _ = grown([(at, SPACING_M / 2) for at in np.arange(5.0, 36.0, 0.5)], max_length_m=8.0)
    assert {stop.reason for stop in made.stops()} == {Reason.CLOUD}
    assert len(made.grown) <= 7


def test_a_rail_beside_one_that_has_grown_grows_as_well():
    beside_m = 0.2
    two = strip(20.0, rails=[lambda along, left=left: np.full_like(along, left) for left in (0.5, 0.5 - beside_m)])
    cloud = GrowingCloud(two.xyz, GrowSettings(GAUGE_M, WIDTH_M, GrowParameters()))
    made, is_on = grown([(10.0, 0.5), (10.0, 0.5 - beside_m)], two, cloud.heads, both=False)
    assert is_on == [True, True]
    assert [round(float(np.median(growth.rails[0].xyz[:, 1])), 2) for growth in made.grown] == [0.5, 0.3]


def test_a_long_line_of_seeds_grows_almost_nothing_twice():
    places = np.array([TRACK.at(at, SPACING_M / 2) for at in np.arange(2.0, 39.0, 0.4)])
    made = Growths(CLOUD.heads, GrowSettings(GAUGE_M, WIDTH_M, GrowParameters(max_length_m=5.0)))
    is_on = [made.add(places[at]) for at in apart_first(places, APART * 5.0)]
    made.reach_on()
    low, high = reached(made)
    assert all(is_on)
    assert sum(growth.rails[0].length_m for growth in made.grown) < 1.4 * (high - low)


@given(
    some.lists(some.tuples(some.integers(0, 99), some.integers(0, 9)), min_size=1, max_size=40), some.floats(0.5, 60.0)
)
def test_places_far_apart_come_first_and_all_come_once(places, apart_m):
    xy = np.array(places, dtype=float)
    order = apart_first(xy, apart_m)
    assert sorted(order) == list(range(len(xy)))
    first = [xy[order[0]]]
    for at in order[1:]:
        if min(np.hypot(*(xy[at] - one)) for one in first) <= apart_m:
            break
        first.append(xy[at])
    assert all(min(np.hypot(*(one - other)) for other in first) <= apart_m for one in xy)
