"""Points compared with the stated rail standard: units, gauge and width of the heads."""

from dataclasses import replace

import numpy as np
import pytest
from built import rails_of, source_of, tracks
from heard import Heard
from rail_extract.core.checks.spacing import SEEN_SHARE
from rail_extract.core.checks.standard import head_widths, warn_of_raw
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import SearchFigures
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
