"""Drawing and corrupting rasters."""

import numpy as np
import pytest
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.rasters.distortion import draw_pair
from rail_extract.laboratory.rasters.drawing import Window, draw_label, scan_profiles
from rail_extract.laboratory.rasters.layouts import FAMILIES
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, random_pair
from rail_extract.laboratory.rasters.paths import Layout, RailPath
from scipy import ndimage

WINDOW = Window(256, 0.04, 0.0, 10.24)
WIDTH = 0.0762


def straight(heading=0.3, track=0, left_m=0.0):
    line = trace([Element(30.0)], (-8.0, 2.0), heading)
    return RailPath(line.offset(left_m), line.left_normal, track)


def track_layout():
    return Layout((straight(left_m=0.7556), straight(left_m=-0.7556)))


def test_a_label_has_the_cells_whose_centre_is_within_half_a_railhead():
    rail = straight()
    label = np.zeros((256, 256), dtype=bool)
    draw_label(label, WINDOW, rail.xy, rail.normal, WIDTH)
    centres = (np.arange(256) + 0.5) * 0.04
    x, y = np.meshgrid(centres, 10.24 - centres)
    across = -(x + 8.0) * np.sin(0.3) + (y - 2.0) * np.cos(0.3)
    assert np.array_equal(label, np.abs(across) <= WIDTH / 2)


def test_profiles_have_the_stated_density_and_skip_unseen_samples():
    rail = straight()
    seen = np.arange(len(rail.xy)) < len(rail.xy) // 2
    edge = np.full(len(rail.xy), WIDTH / 2)
    points = scan_profiles(np.random.default_rng(0), rail.xy, rail.normal, -edge, edge, seen, 100.0, 0.05)
    along = (points + [8.0, -2.0]) @ [np.cos(0.3), np.sin(0.3)]
    assert len(points) == pytest.approx(1500, rel=0.1)
    assert along.max() < 15.05


def test_severity_zero_changes_only_the_width():
    pair = draw_pair(np.random.default_rng(2), track_layout(), WINDOW, WIDTH, 0.0)
    reached = ndimage.binary_dilation(pair.label, np.ones((3, 3)))
    assert (pair.observed & ~reached).sum() == 0
    assert ndimage.binary_dilation(pair.observed, np.ones((3, 3)))[pair.label].mean() > 0.99


def test_a_pair_depends_on_its_seed_alone():
    first, second = (random_pair(np.random.default_rng([4, 2]), 128) for _ in range(2))
    assert np.array_equal(first.observed, second.observed)
    assert np.array_equal(first.label, second.label)


@pytest.mark.parametrize("family", FAMILIES)
def test_masks_agree_with_the_rasters(family):
    pair = random_pair(np.random.default_rng([6, 1]), 384, 0.6, BASE_RATIO, family)
    assert pair.label.any()
    assert pair.observed.any()
    assert not (pair.distractor & ~pair.observed).any()
    assert not (pair.distractor & pair.label).any()
    assert not ((pair.gap > 0) & ~pair.label).any()
    assert pair.gap.max() <= len(pair.gap_lengths_m)
    assert all(length >= 0.2 for length in pair.gap_lengths_m)


def test_a_gap_has_the_number_of_cells_of_its_length():
    layout = Layout((straight(),))
    cells, expected, unseen = [], [], []
    for seed in range(12):
        pair = draw_pair(np.random.default_rng(seed), layout, WINDOW, WIDTH, 0.5)
        inside = [n + 1 for n in range(len(pair.gap_lengths_m)) if not _at_border(pair.gap == n + 1)]
        cells += [np.count_nonzero(pair.gap == number) for number in inside]
        expected += [pair.gap_lengths_m[number - 1] * WIDTH / 0.04**2 for number in inside]
        unseen += [pair.observed[pair.gap == number].mean() for number in inside]
    assert len(cells) > 5
    assert np.abs(np.array(cells) - expected).max() < 15
    assert np.mean(unseen) < 0.1


def _at_border(mask):
    return mask[[0, -1]].any() or mask[:, [0, -1]].any() or not mask.any()
