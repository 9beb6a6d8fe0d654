"""Points compared with the stated rail standard: units, distance of rails, and width of the heads."""

from dataclasses import replace

import numpy as np
import pytest
from built import rails_of, source_of, tracks
from heard import Heard
from rail_extract.core.checks.standard import (
    SEEN_SHARE,
    head_widths,
    measure_spacings,
    warn_of_gauge,
    warn_of_raw,
    warn_of_spacing,
)
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import SearchFigures
from rail_extract.core.standards import GAUGE_RANGE_MM, HEAD_WIDTH_RANGE_MM, STANDARDS, closest_standard
from rail_extract.core.tiles.grid import MemorySource
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.adversarial import from_the_side
from rail_extract.laboratory.scenes.raw_strips import strip
from rail_extract.laboratory.scenes.strips import two_passes

WIDTH = 0.072
LINE = trace([Element(40.0)], heading=0.4)


class Sampled:
    """A request whose files hold these points."""

    def __init__(self, xyz):
        self._xyz = xyz

    def sample(self, count=0):
        return self._xyz, None


def heads_of(curve, width_m, gauge_m=1.435, count=40_000):
    """Points spread evenly over the two heads of a track."""
    random = np.random.RandomState(3)
    at = random.randint(len(curve.xy), size=count)
    left_m = random.choice([-0.5, 0.5], count) * (gauge_m + width_m) + width_m * random.uniform(-0.5, 0.5, count)
    xy = curve.xy[at] + left_m[:, None] * curve.left_normal[at]
    return np.column_stack([xy, 0.003 * random.standard_normal(count)])


@pytest.mark.parametrize(("width_m", "count"), [(0.062, 1), (0.068, 0), (0.072, 0), (0.076, 0), (0.084, 1)])
def test_heads_of_another_width_than_stated_are_said(width_m, count):
    points = source_of(heads_of(LINE, SEEN_SHARE * width_m))
    heard = Heard()
    widths = head_widths(points, ((1.435, 0.072),), heard)
    assert widths.seen_m == pytest.approx(width_m, abs=0.002)
    assert widths.differ == (count == 1)
    assert len(heard.warnings) == count
    said = "72 mm are stated: is it " if width_m < 0.08 else "72 mm are stated, and no standard has such heads"
    assert all(said in one for one in heard.warnings)


def test_heads_of_another_standard_are_not_said_where_the_gauge_is_another_one():
    points = source_of(heads_of(LINE, SEEN_SHARE * 0.062, gauge_m=1.0))
    for gauge_m, count in ((1.0, 1), (1.435, 0)):
        heard = Heard()
        assert head_widths(points, ((gauge_m, 0.072),), heard).differ
        assert len(heard.warnings) == count


def test_passes_side_by_side_without_a_mark_are_said():
    scene = two_passes(apart_m=0.016)
    for strips, count in ((None, 1), (scene.rail_points().strips, 0)):
        heard = Heard()
        source = MemorySource(replace(scene.rail_points(), strips=strips), 500.0)
        assert head_widths(source, ((1.435, 0.072),), heard).differ == bool(count)
        assert len(heard.warnings) == count
        assert all("passes of the scanner are not aligned" in text for text in heard.warnings)


def test_noise_and_faces_do_not_widen_heads_and_a_single_face_is_no_head():
    for scene, said in (
        (from_the_side("all", 39, 60.0, noise_m=0.006, length_m=30.0), ""),
        (from_the_side("one", 44, 20.0, noise_m=0.004, length_m=30.0, top_share=0.0), "one side only"),
    ):
        heard = Heard()
        head_widths(MemorySource(scene.rail_points(), 500.0), ((1.435, 0.072),), heard, rails_of(*scene.rails))
        assert len(heard.warnings) == bool(said)
        assert all(said in text for text in heard.warnings)


def test_blunt_heads_are_said_and_their_width_is_not_measured():
    rng = np.random.default_rng(5)
    points = heads_of(LINE, 0.112, gauge_m=1.435 + WIDTH - 0.112)
    left = np.abs((points[:, :2] - LINE.xy[0]) @ LINE.left_normal[0]) - 0.5 * (1.435 + WIDTH)
    points[:, 2] = rng.normal(0, 0.012, len(points)) - 5.0 * left**2
    heard, rails = Heard(), rails_of(*tracks(LINE, 0.0))
    widths = head_widths(source_of(points), ((1.435, WIDTH),), heard, rails)
    assert not widths.differ and np.isnan(widths.seen_m)
    (warning,) = heard.warnings
    assert warning.startswith("Heads are blunt") and "72 mm" in warning


@pytest.mark.parametrize(
    ("gauge_m", "found", "proposed"),
    [
        (1.000, SearchFigures(points=474, paired_m=5.0), ["EN_60E1_1435"]),
        (1.000, SearchFigures(), ["EN_60E1_1435"]),
        (1.000, SearchFigures(points=9000, paired_m=200.0, single_m=20.0), []),
        (1.435, SearchFigures(points=474, paired_m=5.0), []),
    ],
)
def test_a_search_that_finds_next_to_nothing_says_which_gauge_the_cloud_has(gauge_m, found, proposed):
    heard = Heard()
    is_warned = warn_of_raw(Sampled(strip(12.0).xyz), found, Parameters(gauge_m, WIDTH), heard)
    assert (is_warned, heard.proposed) == (bool(proposed), proposed)
    assert all("mm apart are expected: is it EN 60E1" in text for text in heard.warnings)


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
