"""Drawing and corrupting rasters."""

import numpy as np
import pytest
from rail_extract.core.synthetic.curves import Element, trace
from rail_extract.core.synthetic.distortion import LABEL_WAVELENGTH_M, draw_pair
from rail_extract.core.synthetic.drawing import Window, draw_label, scan_coverage, scan_profiles
from rail_extract.core.synthetic.layouts import Layout, RailPath
from rail_extract.core.synthetic.pairs import BASE_RATIO, random_pair
from rail_extract.core.training.scores import Scores, score
from scipy import ndimage

WINDOW = Window(256, 0.04, 0.0, 10.24)
WIDTH = 0.0762


def straight(heading=0.3, track=0, left_m=0.0):
    line = trace([Element(30.0)], (-8.0, 2.0), heading)
    return RailPath(line.offset(left_m), line.left_normal, track)


def track_layout():
    return Layout((straight(left_m=0.7556), straight(left_m=-0.7556)), (), np.zeros((1, 2)))


def test_a_label_is_the_cells_whose_centre_lies_within_half_a_railhead():
    rail = straight()
    label = np.zeros((256, 256), dtype=bool)
    draw_label(label, WINDOW, rail.xy, rail.normal, WIDTH)
    centres = (np.arange(256) + 0.5) * 0.04
    x, y = np.meshgrid(centres, 10.24 - centres)
    across = -(x + 8.0) * np.sin(0.3) + (y - 2.0) * np.cos(0.3)
    assert np.array_equal(label, np.abs(across) <= WIDTH / 2)


def test_complete_coverage_reaches_both_edges_of_the_head():
    rail = straight()
    points = scan_coverage(rail.xy, rail.normal, np.full(len(rail.xy), -0.03), np.full(len(rail.xy), 0.04))
    across = (points + [8.0, -2.0]) @ [-np.sin(0.3), np.cos(0.3)]
    assert (across.min(), across.max()) == (pytest.approx(-0.03), pytest.approx(0.04))
    assert np.diff(np.unique(across.round(6))).max() <= 0.01 + 1e-9


def test_profiles_have_the_wanted_density_and_skip_what_is_unseen():
    rail = straight()
    seen = np.arange(len(rail.xy)) < len(rail.xy) // 2
    edge = np.full(len(rail.xy), WIDTH / 2)
    points = scan_profiles(np.random.default_rng(0), rail.xy, rail.normal, -edge, edge, seen, 100.0, 0.05)
    along = (points + [8.0, -2.0]) @ [np.cos(0.3), np.sin(0.3)]
    assert len(points) == pytest.approx(1500, rel=0.1)
    assert along.max() < 15.05


def test_severity_zero_loses_nothing_but_width():
    pair = draw_pair(np.random.default_rng(2), track_layout(), WINDOW, WIDTH, 0.0)
    reached = ndimage.binary_dilation(pair.label, np.ones((3, 3)))
    assert (pair.observed & ~reached).sum() == 0
    assert ndimage.binary_dilation(pair.observed, np.ones((3, 3)))[pair.label].mean() > 0.99


def test_the_worse_the_severity_the_worse_the_raster():
    f1 = []
    for severity in (0.0, 0.3, 0.6, 0.9):
        total = Scores()
        for seed in range(12):
            pair = random_pair(np.random.default_rng([9, seed]), 256, severity, BASE_RATIO)
            total += score(pair.observed, pair.label)
        f1.append(total.f1)
    assert f1 == sorted(f1, reverse=True)
    assert f1[0] > 0.7
    assert f1[-1] < 0.5


def test_a_pair_is_a_function_of_its_seed():
    first, second = (random_pair(np.random.default_rng([4, 2]), 128) for _ in range(2))
    assert np.array_equal(first.observed, second.observed)
    assert np.array_equal(first.label, second.label)


def test_the_label_follows_the_long_waves_of_a_rail_alone():
    """The label's centre strays from the ideal line, but smoothly: no power below the label's wavelength."""
    rail = straight(heading=0.0)
    pair = draw_pair(np.random.default_rng(5), Layout((rail,), (), np.zeros((1, 2))), WINDOW, WIDTH, 1.0)
    rows = np.arange(256)[:, None]
    centre = (pair.label * rows).sum(axis=0) / pair.label.sum(axis=0)
    assert np.ptp(centre) > 0
    spectrum = np.abs(np.fft.rfft((centre - centre.mean()) * np.hanning(len(centre))))
    wavelength = 256 * 0.04 / np.maximum(np.arange(len(spectrum)), 1)
    assert spectrum[wavelength < 0.5 * LABEL_WAVELENGTH_M].max() < spectrum.max()


def test_scores_count_by_cell():
    found, label = np.array([[1, 1, 0, 0]], bool), np.array([[1, 0, 1, 0]], bool)
    assert score(found, label) + Scores(1, 1, 1) == Scores(2, 2, 2)
    assert (Scores(1, 3, 3).precision, Scores(1, 3, 3).recall, Scores(1, 3, 3).f1) == (0.5, 0.75, 0.6)
