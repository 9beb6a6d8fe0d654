"""Points that are too thin for rails are seen before any raster is made."""

import numpy as np
import pytest
from built import rail_of, source_of
from heard import Heard
from rail_extract.core.checks.points import (
    plausible,
    warn_of_airborne,
    warn_of_unexplained,
)
from rail_extract.core.errors import CloudError
from rail_extract.core.tiles.grid import MIN_IN_WINDOW, WINDOW_M, lay_out, occupied_squares

RNG = np.random.default_rng(4)


def rail(start_m=0.0, length_m=100.0, per_metre=20, y_m=7.0):
    """The sparsest rail: points anywhere on its head."""
    count = int(length_m * per_metre)
    return np.column_stack(
        [start_m + RNG.uniform(0, length_m, count), y_m + RNG.uniform(-0.036, 0.036, count), np.zeros(count)]
    )


def strays(count, side_m=1e6):
    return np.column_stack([RNG.uniform(-side_m / 2, side_m / 2, (count, 2)), np.zeros(count)])


def test_the_sparsest_rail_among_strays_is_plausible():
    one = source_of(rail(length_m=20.0), strays(5_000))
    assert plausible([one]) == [one]


@pytest.mark.parametrize("factor", [100, 1000])
@pytest.mark.parametrize("per_metre", [20, 600])
def test_points_in_a_smaller_unit_are_refused(factor, per_metre):
    with pytest.raises(CloudError, match=r"class 10 are \S+ m apart over \d+ m, .*centimetres or millimetres"):
        plausible([source_of(rail(per_metre=per_metre) * factor)])


def test_the_spacing_is_that_of_the_points():
    line = np.column_stack([np.arange(0, 1000, 2.8), np.zeros(358), np.zeros(358)])
    with pytest.raises(CloudError, match=r"are 2\.8 m apart over 1000 m"):
        plausible([source_of(line)])


def test_a_thin_class_beside_a_plausible_one_is_left_out_with_a_warning():
    heard, good, thin = Heard(), source_of(rail()), source_of(rail() * 100, code=11)
    assert plausible([thin, good], heard) == [good]
    (said,) = heard.warnings
    assert said.startswith("The points of class 11 are ")


def test_points_in_a_larger_unit_give_a_warning():
    heard, one = Heard(), source_of(rail(per_metre=600) / 1000)
    assert plausible([one], heard) == [one]
    (said,) = heard.warnings
    assert said.startswith("All points of class 10 are within 0.1 m of each other: if the coordinates")


def test_few_points_are_not_judged():
    one = source_of(strays(50))
    assert plausible([one]) == [one]


def test_squares_of_strays_are_left_out_and_squares_of_rails_are_kept():
    one = source_of(rail(length_m=1200.0), strays(5_000))
    kept = {square.key for square in occupied_squares([one], one)}
    assert kept == {(0, 0), (1, 0), (2, 0)}
    assert len(lay_out([one], one)) > 4_000


def test_a_square_into_which_a_rail_reaches_is_kept():
    end = rail(start_m=400.0, length_m=100.2)
    assert 0 < np.count_nonzero(end[:, 0] >= 500.0) < MIN_IN_WINDOW
    one = source_of(end, rail(start_m=-600.0, length_m=10.0))
    assert (1, 0) in {square.key for square in occupied_squares([one], one)}


def test_points_with_company_across_a_corner_are_no_strays():
    corner = np.array([500.0, 500.0, 0.0])
    shifts = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    heap = np.column_stack([np.repeat(shifts, 3, axis=0), np.zeros(12)]) * (WINDOW_M / 2)
    one = source_of(corner + heap, np.array([[5_000.0, 0.0, 0.0]]))
    assert {square.key for square in occupied_squares([one], one)} == {(0, 0), (0, 1), (1, 0), (1, 1)}
    less = source_of(corner + heap[: MIN_IN_WINDOW - 1], np.array([[5_000.0, 0.0, 0.0]]))
    assert not occupied_squares([less], less)


def test_a_cloud_within_one_square_is_never_divided():
    one = source_of(strays(20, side_m=100.0))
    (whole,) = occupied_squares([one], one)
    assert whole.is_whole_plane


@pytest.mark.parametrize("length_m", [100.0, 700.0])
@pytest.mark.parametrize(("others", "said"), [(0, None), (1, None), (2, "33 %"), (4, "20 %")])
def test_points_far_from_all_rails_give_a_warning(others, said, length_m):
    one = source_of(*(rail(y_m=7.0 + 0.5 * number, length_m=length_m) for number in range(others + 1)))
    heard = Heard()
    warn_of_unexplained(one, [rail_of([[0.0, 7.1], [length_m, 7.1]])], heard)
    assert [text[5:9] for text in heard.warnings] == [said] * bool(said)


@pytest.mark.parametrize(("per_metre", "said"), [(3, "have 3.0 points per metre"), (9, "have 9.0 points"), (20, "")])
def test_rails_of_an_airborne_cloud_give_a_warning(per_metre, said):
    heard = Heard()
    warn_of_airborne(source_of(rail(per_metre=per_metre)), [rail_of([[0.0, 7.0], [100.0, 7.0]])], heard)
    assert len(heard.warnings) == bool(said)
    assert all(said in text and "use Track Centerlines from Airborne Lidar" in text for text in heard.warnings)
