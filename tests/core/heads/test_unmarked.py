"""Strips that points do not state: told apart by the levels of heads, the same along all lines."""

from dataclasses import replace

import numpy as np
import pytest
from built import cloud_of, network_of
from rail_extract.core.heads.elevation import elevate, measure_again
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.heads.refinement import refine
from rail_extract.core.heads.strips import UNKNOWN, measure_strips
from rail_extract.core.heads.unmarked import told_apart
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Railhead

HEAD_M, LENGTH_M = 0.072, 50.0
RAILS_M = (0.0, 1.507)


def scanned(passes, rails_m=RAILS_M, noise_m=0.002):
    """Points of passes on straight heads, given (across, up, height of the scanner, share of the points)."""
    x = np.arange(0.0, LENGTH_M, 0.01)
    rng, parts, lines = np.random.RandomState(3), [], []
    for rail_m in rails_m:
        line = np.column_stack([x, np.full(len(x), rail_m), 0 * x])
        head = Railhead(line, np.tile([0.0, 0.0, 1.0], (len(x), 1)), np.tile([0.0, 1.0, 0.0], (len(x), 1)))
        lines.append(line[::20, :2])
        for across_m, up_m, height_m, share in passes:
            seen = Scanner(noise_m=noise_m, face_share=1.0, left_m=-4.0, height_m=height_m, half_range_m=30.0)
            points = scan(head, HEAD_M, line[::10], seen, rng)
            kept = rng.random_sample(len(points)) < share * 6000 / len(points)
            parts.append(points[kept] + [0.0, across_m, up_m])
    return cloud_of(*parts), lines


TWO = [(0.010, -0.008, 3.0, 1.0), (-0.010, 0.008, 3.5, 0.8)]


def test_passes_are_told_apart_by_levels_that_all_heads_share():
    points, lines = scanned(TWO)
    told = told_apart(points, lines, HEAD_M)
    np.testing.assert_allclose(told.apart, [[0, 0.010, -0.008, 1], [0, -0.010, 0.008, 1]], atol=0.001)
    assert told.blunt is False and (told.strips != UNKNOWN).mean() > 0.95
    shuffled = points.kept(np.random.RandomState(0).permutation(len(points.xyz)))
    np.testing.assert_allclose(told_apart(shuffled, lines, HEAD_M).apart, told.apart, atol=0.0002)


@pytest.mark.parametrize(
    "passes",
    [
        TWO,
        # Two of three passes are on one level, and count twice.
        [(-0.003, -0.008, 3.0, 1.0), (0.006, 0.015, 3.2, 0.9), (-0.003, -0.007, 3.3, 0.9)],
        [(0.002, 0.001, 3.0, 1.0), (0.004, 0.013, 3.2, 0.9), (-0.006, -0.014, 3.3, 0.9)],
    ],
)
def test_lines_are_on_the_mean_of_passes_and_state_that_they_differ(passes):
    points, lines = scanned(passes)
    network = refine(network_of(*lines), points, HEAD_M)
    told = told_apart(points, network.lines, HEAD_M)
    network = refine(network, told, HEAD_M)
    near = near_lines(network.lines, told, HEAD_M)
    rails = elevate(network, near, 10, strips=[measure_strips(one) for one in near])
    rails = sorted(rails, key=lambda rail: rail.xyz[0, 1])
    again = measure_again(rails, points, HEAD_M)
    of_mean_mm = 1000 * np.std(np.array(passes)[:, :2], axis=0) / np.sqrt(len(passes) - 1)
    for own, repeated, rail_m in zip(rails, again, RAILS_M):
        inner = own.xyz[(own.xyz[:, 0] > 3) & (own.xyz[:, 0] < LENGTH_M - 3)]
        assert np.abs(inner[:, 1:].mean(axis=0) - [rail_m, 0.0]).max() < 0.0012
        assert (np.array([own.sigma_mm, own.sigmaz_mm]) > 0.85 * of_mean_mm).all()
        assert abs(np.mean(repeated.xyz[10:-10, 2])) < 0.0012


def test_faces_do_not_count_for_the_number_of_passes():
    """A low scanner sees as much of the crowns as a high one, and more of the faces (world 15036)."""
    points, lines = scanned([(0.006, -0.012, 3.0, 0.5), (-0.006, 0.012, 1.0, 1.0)])
    apart = told_apart(points, lines, HEAD_M).apart
    np.testing.assert_allclose(apart, [[0, 0.006, -0.012, 1], [0, -0.006, 0.012, 1]], atol=0.001)


def test_one_pass_stays_as_it_is():
    points, lines = scanned([(0.0, 0.0, 3.0, 1.0)])
    assert told_apart(points, lines, HEAD_M) is points


def test_levels_within_the_noise_and_a_lone_rail_tell_nothing():
    points, lines = scanned(TWO, noise_m=0.007)
    assert told_apart(points, lines, HEAD_M) is points
    points, lines = scanned(TWO, rails_m=RAILS_M[:1])
    assert told_apart(points, lines, HEAD_M) is points


def test_levels_that_rails_do_not_share_are_no_passes():
    first, lines = scanned([(0.0, 0.0, 3.0, 1.0), (0.0, 0.030, 3.0, 1.0)])
    second, _ = scanned([(0.0, 0.0, 3.0, 1.0), (0.0, 0.016, 3.0, 1.0)])
    left = np.where(first.xyz[:, 1] > 0.7)[0], np.where(second.xyz[:, 1] < 0.7)[0]
    points = cloud_of(first.xyz[left[0]], second.xyz[left[1]])
    assert told_apart(points, lines, HEAD_M) is points


def test_a_section_that_one_pass_shows_is_of_no_known_pass():
    points, lines = scanned(TWO)
    upper = told_apart(points, lines, HEAD_M).strips == 2
    points = points.kept(~upper | (points.xyz[:, 0] < 23.0))
    told = told_apart(points, lines, HEAD_M)
    assert (told.strips[points.xyz[:, 0] > 26.0] == UNKNOWN).all()
    np.testing.assert_allclose(told.apart[:, 1:3], [[0.010, -0.008], [-0.010, 0.008]], atol=0.001)


def test_stated_strips_stay():
    points, lines = scanned(TWO)
    marked = replace(points, strips=np.arange(len(points.xyz)) % 2)
    assert told_apart(marked, lines, HEAD_M) is marked
