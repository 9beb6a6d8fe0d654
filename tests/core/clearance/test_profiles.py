"""Profiles: those that ship, the user's, and what refuses them."""

import pytest
from rail_extract.core.clearance.profiles import REFERENCE, mirrored, named
from rail_extract.core.errors import ParameterError
from rail_extract.core.jobs.clearance_inputs import custom

HALF = [(1.0, 0.4), (1.2, 1.0), (1.0, 3.0), (0.0, 4.0)]


def test_every_profile_names_its_source():
    assert len(named()) == 10
    assert all(one.source for one in named().values())


def test_numbers_of_g1_are_those_of_the_regulation():
    points = named()["EBO_G1"].points
    assert points[:8] == (
        *((1.620, 0.400), (1.620, 1.170), (1.645, 1.170), (1.645, 3.250)),
        *((1.425, 3.700), (1.120, 4.010), (0.525, 4.310), (0.0, 4.310)),
    )


@pytest.mark.parametrize(
    ("radius_m", "deficiency", "limit"),
    [
        (250.0, (1.684, 1.736, 1.863, 1.706, 1.070), "EBO_LIMIT_LARGE"),
        (1e9, (1.656, 1.690, 1.754, 1.589, 0.930), "EBO_LIMIT_SMALL"),
    ],
)
def test_limits_agree_with_what_the_tables_of_the_regulation_add_up_to(radius_m, deficiency, limit):
    # EBO_G2 plus annex 2: the printed drawings round each part, so that sums and drawings agree within 2 mm.
    points = named()[limit].points
    drawn = [points[number][0] for number in ((2, 4, 5, 6, 7) if limit == "EBO_LIMIT_LARGE" else (2, 4, 5, 6, 7))]
    assert drawn == pytest.approx(deficiency, abs=0.0021)


def test_half_is_mirrored():
    assert mirrored([(1.0, 0.0), (0.0, 2.0)]) == ((1.0, 0.0), (0.0, 2.0), (-1.0, 0.0))


def test_a_half_and_the_whole_outline_are_the_same():
    whole = [*HALF, *[(-v, w) for v, w in reversed(HALF[:-1])]]
    assert custom(whole, "whole.csv").points == custom(HALF, "half.csv").points
    assert custom(HALF, "half.csv").rule == REFERENCE


def test_an_open_half_is_closed_at_its_top():
    made = custom([(1.0, 0.4), (1.0, 3.0), (0.5, 4.0)], "half.csv")
    assert made.points[3] == (0.0, 4.0)
    assert made.said == "The half outline of half.csv does not end at v = 0: it was closed at its top, 4 m high."


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([(1.0, 0.4), (0.0, 4.0)], "has 2 points"),
        ([(1620, 400), (1620, 3000), (0, 4310)], "are these millimetres?"),
        ([(1, 0), (-1, 2), (1, 2), (-1, 0)], "crosses itself"),
    ],
)
def test_outlines_that_are_none_are_refused(points, words):
    with pytest.raises(ParameterError, match=words.replace("?", r"\?")):
        custom(points, "file.csv")
