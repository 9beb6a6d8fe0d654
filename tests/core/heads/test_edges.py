"""Stations, windows and search distance that all measurements of heads share."""

import numpy as np
import pytest
from rail_extract.core.heads.edges import (
    BLURRED_BINS,
    ENOUGH_POINTS,
    HALF_RANGE_BINS,
    MAX_SHIFT_BINS,
    RIM_BINS,
    WINDOWS,
    CrossSections,
    histograms,
    middles,
    search_distance,
    stations_along,
)

WIDTH = 0.072


def test_stations_are_the_centres_of_windows_of_a_quarter_metre():
    assert stations_along(0.9) == pytest.approx([0.125, 0.375, 0.625, 0.875])
    assert np.diff(stations_along(100.0)) == pytest.approx(0.25)


def test_points_are_searched_as_far_as_a_shifted_and_blurred_rim_reaches():
    bins = 18 + MAX_SHIFT_BINS + 2 + BLURRED_BINS + RIM_BINS
    assert search_distance(WIDTH) == pytest.approx(bins * WIDTH / 36)
    assert WIDTH < search_distance(WIDTH) < 2 * WIDTH


LENGTH_M = 20.0


def head(per_m, offset_m=0.0, span_m=(0.0, LENGTH_M), share=(-0.5, 0.5)):
    """Chainages and offsets of points evenly spread over a head, one in each bin across before the next in any."""
    t = np.arange(span_m[0], span_m[1], 1 / per_m)
    return t, (share[0] + (share[1] - share[0]) * ((13 * np.arange(len(t)) % 36) + 0.5) / 36) * WIDTH + offset_m


@pytest.mark.parametrize(("per_m", "window"), [(432, 5), (72, 5), (48, 9), (24, 17), (6, 33)])
def test_the_shortest_window_with_eighty_points_is_used(per_m, window):
    stations, counts, wide = histograms(*head(per_m), LENGTH_M, WIDTH)
    middle = slice(WINDOWS[-1] // 2, len(stations) - WINDOWS[-1] // 2 - 1)
    assert counts.shape == wide.shape == (81, 2 * HALF_RANGE_BINS)
    np.testing.assert_allclose(counts[middle].sum(axis=1).mean(), per_m * window / 4, rtol=0.02)
    np.testing.assert_allclose(wide[middle].sum(axis=1).mean(), per_m * 33 / 4, rtol=0.02)
    assert ENOUGH_POINTS == 80


@pytest.mark.parametrize("offset_m", [-0.024, -0.004, 0.0, 0.014])
def test_the_middle_is_between_both_edges(offset_m):
    _, counts, wide = histograms(*head(1000, offset_m), LENGTH_M, WIDTH)
    free = np.ones((2, len(counts)), dtype=bool)
    np.testing.assert_allclose(middles(counts, wide, free), offset_m / 0.002, atol=0.3)
    one_edge = free & [[True], [False]]  # its round corner hides a part of the head
    assert middles(counts, wide, one_edge)[40] == pytest.approx(offset_m / 0.002 - 1.6, abs=0.2)
    assert middles(counts, wide, ~one_edge & free)[40] == pytest.approx(offset_m / 0.002 + 1.6, abs=0.2)


def test_lines_too_far_from_the_head_and_points_without_edges_show_no_middle():
    free = np.ones((2, 81), dtype=bool)
    for points in (head(1000, 0.033), head(1000, share=(-0.9, 0.9)), head(20)[:0]):
        _, counts, wide = histograms(*points, LENGTH_M, WIDTH) if len(points) else (0, *np.zeros((2, 81, 94)))
        assert np.isnan(middles(counts, wide, free)).all()
    _, counts, wide = histograms(*head(1000), LENGTH_M, WIDTH)
    assert np.isnan(middles(counts, wide, ~free)).all()


def test_densities_are_those_of_the_nine_bins_to_either_side_of_a_border():
    counts = np.random.default_rng(0).integers(0, 50, (3, 2 * HALF_RANGE_BINS)).astype(float)
    sections, start = CrossSections.of(counts), np.array([-15, 0, 7])
    left = [row[HALF_RANGE_BINS + at :][:9] for row, at in zip(counts, start)]
    right = [row[: HALF_RANGE_BINS + at][-9:] for row, at in zip(counts, start)]
    np.testing.assert_allclose(sections._density(start, 1), np.mean(left, axis=1))
    np.testing.assert_allclose(sections._density(start, -1), np.mean(right, axis=1))
