"""The distance of rails and the width of heads that points show, and what is said of another gauge than stated."""

import numpy as np
import pytest
from built import source_of
from heard import Heard
from rail_extract.core.checks.spacing import measure_spacings, warn_of_gauge, warn_of_spacing
from rail_extract.core.parameters import Parameters
from rail_extract.core.standards import GAUGE_RANGE_MM, HEAD_WIDTH_RANGE_MM, STANDARDS, closest_standard

WIDTH = 0.072


def track(spacing_m, width_m, length_m=30.0, density=300, noise_m=0.003, heading=0.6, seed=1):
    """Points on the tops of two railheads, uphill by 2 %, with scattered points on their feet."""
    rng = np.random.default_rng(seed)
    count = int(density * length_m)
    along = rng.uniform(0, length_m, 2 * count)
    side = np.repeat([-0.5, 0.5], count) * spacing_m
    foot = rng.random(2 * count) < 0.1
    across = side + rng.uniform(-0.5, 0.5, 2 * count) * np.where(foot, 0.13, width_m)
    height = 0.02 * along - 0.15 * foot
    xyz = np.column_stack([along, across, height]) + rng.normal(0, noise_m, (2 * count, 3))
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    return np.column_stack([xyz[:, :2] @ turn, xyz[:, 2]])


@pytest.mark.parametrize("name", ["EN_60E1_1435", "IN_75R_1000", "JIS_60_1067", "IN_60KG_1676", "RU_R65_1520"])
def test_spacing_and_width_of_a_track(name):
    standard = STANDARDS[name]
    points = track(standard.gauge_m + standard.head_width_m, standard.head_width_m)
    spacing_m, width_m = measure_spacings(points).most_common()
    assert spacing_m == pytest.approx(standard.gauge_m + standard.head_width_m, abs=0.001)
    assert width_m == pytest.approx(standard.head_width_m, abs=0.004)
    assert closest_standard(spacing_m, width_m).gauge_m == standard.gauge_m


def test_sparse_points_are_enough():
    spacing_m, _ = measure_spacings(track(1.507, 0.072, length_m=100.0, density=12)).most_common()
    assert spacing_m == pytest.approx(1.507, abs=0.003)


def test_a_part_of_the_points_is_enough_where_they_are_dense():
    spacing_m, width_m = measure_spacings(track(1.507, 0.072, length_m=3.0, density=10_000)).most_common()
    assert spacing_m == pytest.approx(1.507, abs=0.001)
    assert width_m == pytest.approx(0.072, abs=0.004)


def test_every_gauge_of_a_mixed_line_is_included():
    both = [track(1.507, 0.072), track(1.072, 0.072, seed=2) + [40.0, 40.0, 0.0]]
    spacings = measure_spacings(np.concatenate(both))
    assert [spacings.include(one, 0.05) for one in (1.507, 1.072, 1.3)] == [True, True, False]


def test_one_rail_or_too_few_points_give_none():
    rail = track(1.507, 0.072)
    rail = rail[: len(rail) // 2]
    for points in (
        rail,
        rail[:5],
        rail[:0],
        np.random.default_rng(1).uniform(0, 30, (2000, 3)),
        rail[:1].repeat(900, 0),
    ):
        spacings = measure_spacings(points)
        assert spacings.most_common() is None
        assert not spacings.include(1.507, 0.05)


@pytest.mark.parametrize("end", [0, 1])
def test_rails_are_a_track_from_the_least_to_the_largest_gauge_with_the_widest_heads(end):
    spacing_m = (GAUGE_RANGE_MM[end] + HEAD_WIDTH_RANGE_MM[end]) / 1000
    beyond_m = 0.02 if end else -0.02
    assert measure_spacings(track(spacing_m - beyond_m, 0.07)).include(spacing_m - beyond_m, 0.003)
    assert not len(measure_spacings(track(spacing_m + beyond_m, 0.07)).distance_m)


class Sampled:
    """A request whose files hold these points."""

    def __init__(self, xyz):
        self._xyz = xyz

    def sample(self, count=0):
        return self._xyz, None


@pytest.mark.parametrize(
    ("factor", "stated"),
    [(1 / 0.3048, "said to be metres, are these feet?"), (0.3048, "said to be feet, are these metres?")],
)
def test_coordinates_in_the_wrong_unit_are_recognized(factor, stated):
    heard = Heard()
    warn_of_gauge(Sampled(factor * track(1.435 + WIDTH, WIDTH)), Parameters(1.435, WIDTH), heard)
    (warning,) = heard.warnings
    assert stated in warning
    assert ("3.28 times" in warning) == (factor > 1)


def test_coordinates_in_the_right_unit_are_no_warning():
    heard = Heard()
    warn_of_gauge(Sampled(track(1.435 + WIDTH, WIDTH)), Parameters(1.435, WIDTH), heard)
    assert heard.warnings == []


@pytest.mark.parametrize(("gauge_m", "proposed"), [(1.435, []), (1.52, ["RU_R65_1520"])])
def test_found_points_of_another_gauge_lead_to_their_standard(gauge_m, proposed):
    heard, points = Heard(), source_of(track(gauge_m + 0.075, 0.075))
    assert warn_of_spacing(points, Parameters(1.435, WIDTH), heard) == bool(proposed)
    assert heard.proposed == proposed
    assert [f"Rails are {1000 * gauge_m + 75:.0f} mm apart" in text for text in heard.warnings] == [True] * len(
        proposed
    )
