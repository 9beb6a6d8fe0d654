"""Drawing and corrupting rasters."""

import numpy as np
import pytest
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.rasters import pairs
from rail_extract.laboratory.rasters.distortion import LABEL_WAVELENGTH_M, draw_pair
from rail_extract.laboratory.rasters.drawing import Window, draw_label, scan_coverage, scan_profiles
from rail_extract.laboratory.rasters.layouts import FAMILIES, RARE_FAMILIES
from rail_extract.laboratory.rasters.noise import flip, shadows
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, random_pair
from rail_extract.laboratory.rasters.paths import Layout, RailPath
from rail_extract.laboratory.training.scores import Scores, score
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


def test_complete_coverage_reaches_both_edges_of_the_head():
    rail = straight()
    points = scan_coverage(rail.xy, rail.normal, np.full(len(rail.xy), -0.03), np.full(len(rail.xy), 0.04))
    across = (points + [8.0, -2.0]) @ [-np.sin(0.3), np.cos(0.3)]
    assert (across.min(), across.max()) == (pytest.approx(-0.03), pytest.approx(0.04))
    assert np.diff(np.unique(across.round(6))).max() <= 0.01 + 1e-9


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


def test_the_higher_the_severity_the_worse_the_raster():
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


def test_a_pair_depends_on_its_seed_alone():
    first, second = (random_pair(np.random.default_rng([4, 2]), 128) for _ in range(2))
    assert np.array_equal(first.observed, second.observed)
    assert np.array_equal(first.label, second.label)


def test_the_label_follows_the_long_waves_of_a_rail_only():
    """In fine cells the middle of the label follows the rail's shift, without power below the label's wavelength."""
    window = Window(1024, 0.01, 0.0, 10.24)
    layout, rows = Layout((straight(heading=0.0),)), np.arange(1024)[:, None]
    labels = [draw_pair(np.random.default_rng(seed), layout, window, WIDTH, 1.0).label for seed in range(5)]
    centres = [(label * rows).sum(axis=0) / label.sum(axis=0) * window.cell_m for label in labels]
    assert np.ptp(centres) > 0.02
    spectrum = sum(np.abs(np.fft.rfft((centre - centre.mean()) * np.hanning(1024))) ** 2 for centre in centres)
    wavelength = window.extent_m / np.maximum(np.arange(len(spectrum)), 1)
    assert spectrum[wavelength < 0.5 * LABEL_WAVELENGTH_M].sum() < 0.05 * spectrum.sum()


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


def test_distractors_are_seen_and_not_in_the_label():
    guard = straight(left_m=0.6)
    pair = draw_pair(np.random.default_rng(0), Layout((straight(left_m=0.75),), (guard,)), WINDOW, WIDTH, 0.0)
    ideal = np.zeros_like(pair.label)
    draw_label(ideal, WINDOW, guard.xy, guard.normal, WIDTH)
    assert not pair.label[ideal].any()
    assert pair.distractor[ideal].mean() > 0.8


def test_rails_have_openings_at_frogs_in_the_observed_raster_only():
    rail = straight()
    layout = Layout((rail,), openings=((rail.xy[600], 0.3),))
    pair = draw_pair(np.random.default_rng(3), layout, WINDOW, WIDTH, 0.0)
    place = WINDOW.cells_of(rail.xy[[600]])
    assert not pair.observed[place].any()
    assert pair.label[place].all()
    assert pair.gap_lengths_m == ()


def test_nothing_is_seen_in_a_shadow():
    window = Window(256, 0.04, 0.0, 10.24)
    areas = [shadows(np.random.default_rng(seed), window, 1.0).mean() for seed in range(40)]
    assert 0.0 < np.mean(areas) < 0.2
    assert not shadows(np.random.default_rng(0), window, 0.0).any()


def test_ballast_is_next_to_the_rails():
    label = np.zeros((256, 256), dtype=bool)
    label[:, 128:130] = True
    strays = np.mean(
        [flip(np.random.default_rng(seed), label, label, 1.0, 0.04) & ~label for seed in range(30)], axis=0
    )
    assert strays[:, 120:138].mean() > 2 * strays[:, :60].mean()


def test_thin_rails_have_a_few_cells_per_metre():
    pair = draw_pair(np.random.default_rng(2), track_layout(), WINDOW, WIDTH, 0.1, thin=True)
    length_m = 0.04 * pair.label.sum() / (WIDTH / 0.04)
    near = ndimage.binary_dilation(pair.label, np.ones((3, 3)))
    assert 2 < (pair.observed & near).sum() / length_m < 24


def test_training_draws_thin_rails_and_rare_layouts(monkeypatch):
    drawn = []
    monkeypatch.setattr(pairs, "random_pair", lambda *arguments: drawn.append(arguments[3:]))
    for seed in range(1000):
        pairs.training_pair(np.random.default_rng(seed), 64)
    families = [family for _, family, _ in drawn]
    assert 0.8 < families.count(None) / 1000 < 0.9
    assert {family for family in families if family} == set(RARE_FAMILIES)
    assert 0.1 < sum(thin for _, _, thin in drawn) / 1000 < 0.2
