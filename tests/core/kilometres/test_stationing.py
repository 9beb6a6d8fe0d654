"""Kilometres along an axis: jumps, posts, and that place, kilometre and place again are the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.errors import RailExtractError
from rail_extract.core.kilometres.stationing import Jump, stationing_of
from rail_extract.core.kilometres.text import GERMAN, HECTOMETRES, KILOMETRES, MILES, NOTATIONS, read_km, write_km


def km_at(stationing, *s):
    return np.round(stationing.at(np.array(s, float))[1], 6).tolist()


def test_numbers_are_missing_in_a_gap_and_twice_in_an_overlap():
    """The gap is km 11.0 = 11.4, the overlap km 12.4 = 11.9."""
    stationing = stationing_of(5000.0, [0.0], [10.0], [Jump(11.0, 11.4), Jump(12.4, 11.9)])
    assert stationing.jumps == [(1000.0, Jump(11.0, 11.4)), (pytest.approx(2000), Jump(12.4, 11.9))]
    assert km_at(stationing, 999, 1000, 1999, 2000, 5000) == [10.999, 11.4, 12.399, 11.9, 14.9]
    assert stationing.at(np.array([999.0, 1000.0, 2000.0]))[0].tolist() == [0, 1, 2]
    assert stationing.places(11.2) == []
    assert [(piece, round(s, 6)) for piece, s in stationing.places(12.0)] == [(1, 1600.0), (2, 2100.0)]
    assert stationing.counts_from().tolist() == [np.inf, 11.9, np.inf]


def test_jumps_before_the_only_known_place_are_counted_back():
    """As where kilometres decrease along the line: km 12.0 is at its far end."""
    stationing = stationing_of(2000.0, [2000.0], [12.0], [Jump(11.2, 11.5)])
    assert km_at(stationing, 0, 1499, 1500, 2000) == [9.7, 11.199, 11.5, 12.0]


def test_gaps_longer_than_the_axis_before_the_first_post_are_counted_back_one_by_one():
    """The second gap ends 30 m before the post, the first one 50 m before it; their numbers are 230 m apart."""
    stationing = stationing_of(500.0, [100.0, 300.0], [1.48, 1.70], [Jump(1.0, 1.2), Jump(1.25, 1.45), Jump(1.58, 1.6)])
    assert [(round(s, 6), jump) for s, jump in stationing.jumps][:2] == [(20, Jump(1.0, 1.2)), (70, Jump(1.25, 1.45))]
    assert km_at(stationing, 0, 19, 21, 69, 71, 100) == [0.98, 0.999, 1.201, 1.249, 1.451, 1.48]
    assert stationing.notices == ()


def test_posts_share_out_the_length_between_them():
    stationing = stationing_of(2000.0, [100.0, 1101.0, 1900.0], [5.0, 6.0, 6.8])
    assert km_at(stationing, 0, 100, 600.5, 1101, 2000) == [4.9, 5.0, 5.5, 6.0, 6.9]
    assert stationing.notices == ()


def test_a_scale_that_is_off_is_said():
    stationing = stationing_of(2000.0, [0.0, 1000.0, 2000.0], [5.0, 5.995, 6.995])
    assert stationing.notices == (
        "AXIS is 1000.0 m long between km 5.000 and km 5.995, where the numbers differ by 995.0 m: they are spread "
        "evenly.",
    )
    assert stationing.jumps == []


def test_an_unstated_jump_counts_on_up_to_the_next_post_as_in_the_german_notation():
    """Elmshorn-Husum: km 37.6 + 5720 = km 37.7."""
    stationing = stationing_of(10_000.0, [0.0, 100.0, 5820.0, 5920.0], [37.5, 37.6, 37.7, 37.8])
    assert stationing.jumps == [(5820.0, Jump(pytest.approx(43.32), 37.7))]
    assert "AXIS is 5620.0 m longer than the numbers from km 37.600 to km 37.700" in stationing.notices[0]
    piece, km = stationing.at(np.array([5819.0, 5820.0]))
    texts = [
        write_km(*one, counts_from_km=again) for *one, again in zip(km, [GERMAN] * 2, stationing.counts_from()[piece])
    ]
    assert texts == ["37,6 + 5719", "37,7 + 0"]


def test_stated_jumps_lie_between_the_posts_that_they_explain():
    posts_s, posts_km = [0.0, 100.0, 350.0, 450.0], [4.1, 4.2, 4.3, 4.4]
    stationing = stationing_of(450.0, posts_s, posts_km, [Jump(4.4, 4.25)])
    assert stationing.notices == ()
    assert stationing.jumps == [(pytest.approx(300), Jump(4.4, 4.25))]
    assert km_at(stationing, 299, 301, 350) == [4.399, 4.251, 4.3]


def test_a_stated_jump_follows_the_scale_between_its_posts():
    """The axis is 404 m long where the numbers are 400 m: the jump, 300 m behind the first post, is at 303 m."""
    stationing = stationing_of(404.0, [0.0, 404.0], [4.1, 4.4], [Jump(4.4, 4.3)])
    assert stationing.jumps == [(pytest.approx(303), Jump(4.4, 4.3))]
    assert len(stationing.notices) == 1


@pytest.mark.parametrize(
    ("s", "km", "jumps", "says"),
    [
        ([0, 100, 200], [4.1, 4.3, 4.2], [], "out of order: km 4.200 follows km 4.300"),
        ([100.0], [4.0], [Jump(3.5, 3.78), Jump(3.87, 3.98)], "The jump from km 3.500 to km 3.780 is not on AXIS"),
        ([100.0], [4.0], [Jump(3.0, 3.92), Jump(3.7, 3.98)], "The jump from km 3.000 to km 3.920 is not on AXIS"),
        ([0.0], [4.0], [Jump(7.0, 7.5)], "The jump from km 7.000 to km 7.500 is not on AXIS"),
        ([0.0], [4.0], [Jump(5.0, 5.2), Jump(4.5, 4.6)], "The jump from km 4.500 to km 4.600 is not on AXIS"),
    ],
)
def test_contradictions_are_refused(s, km, jumps, says):
    with pytest.raises(RailExtractError, match=says):
        stationing_of(2000.0, s, km, jumps)


@given(
    st.floats(-50, 500),
    st.lists(st.tuples(st.floats(50, 2000), st.floats(-1.5, 1.5)), max_size=5),
    st.lists(st.floats(0, 1), min_size=1, max_size=20),
    st.booleans(),
)
def test_place_to_kilometre_to_place_is_the_identity(start_km, sections, shares, decreasing):
    """With any gaps and overlaps, numbered from the first or from the last place."""
    jumps, km, length_m = [], start_km, 0.0
    for section_m, jump_km in sections:
        jumps.append(Jump(km + section_m / 1000, km + section_m / 1000 + jump_km))
        length_m, km = length_m + section_m, jumps[-1].ahead_km
    length_m += 100.0
    known = ([length_m], [km + 0.1]) if decreasing else ([0.0], [start_km])
    stationing = stationing_of(length_m, *known, jumps)
    s = np.array(shares) * length_m
    piece, found = stationing.at(s)
    assert stationing.km[0] == pytest.approx(start_km, abs=1e-6)
    assert len(stationing.jumps) == len(jumps)
    for one, number, place in zip(found, piece, s):
        again = dict(stationing.places(one))
        assert again[number] == pytest.approx(place, abs=0.002)


@pytest.mark.parametrize(
    ("km", "texts"),
    [
        (12.34567, ["12.3+45.67", "12+345.67", "12,3 + 46", "7 mi 1181.39 yd"]),
        (12.399999, ["12.4+00.00", "12+400.00", "12,4 + 0", "7 mi 1240.80 yd"]),
        (0.0, ["0.0+00.00", "0+000.00", "0,0 + 0", "0 mi 0.00 yd"]),
        (-0.05, ["-0.1+50.00", "-1+950.00", "-0,1 + 50", "-1 mi 1705.32 yd"]),
    ],
)
def test_notations(km, texts):
    assert [write_km(km, notation) for notation in NOTATIONS] == texts
    assert tuple(NOTATIONS) == (HECTOMETRES, KILOMETRES, GERMAN, MILES)


@given(st.integers(0, 10**8), st.sampled_from([HECTOMETRES, KILOMETRES]))
def test_what_is_written_is_read_back(centimetres, notation):
    assert read_km(write_km(centimetres / 1e5, notation)) == pytest.approx(centimetres / 1e5, abs=1e-9)


def test_text_that_is_no_kilometre():
    assert [read_km(text) for text in ("", "12.3+", "km 12", "12+3+4", "nan")] == [None] * 5
