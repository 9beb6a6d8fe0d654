"""Edges of gaps in level pavement, from counts of points across a groove."""

import numpy as np
import pytest
from rail_extract.core.classify.gaps import BIN_M, BINS, outer_edges, summed_along, thinned
from rail_extract.core.classify.lines import Lines

WIDTH, GROOVE = 0.072, 0.060
BIN_MM = 1000 * BIN_M


def profile(head_mm: float, road_mm: float, per_bin: float = 40.0) -> np.ndarray:
    """Count level points on both sides of a gap between the edges of a head and of the road, (BINS,)."""
    edges = (np.arange(BINS + 1) - BINS // 2) * BIN_MM
    low, high = edges[:-1], edges[1:]
    before = np.clip(head_mm - low, 0, BIN_MM)
    after = np.clip(high - road_mm, 0, BIN_MM)
    return per_bin * (before + after) / BIN_MM


def wall(at_mm: float, points: float = 80.0) -> np.ndarray:
    """Count the points on a wall of the groove, below what is level, (BINS,)."""
    counts = np.zeros(BINS)
    counts[int(np.floor(at_mm / BIN_MM)) + BINS // 2] = points
    return counts


def rows(count: int, level: np.ndarray, hollow: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Repeat counts of level points, and of these with the hollow ones."""
    return np.tile(level, (count, 1)), np.tile(level + hollow, (count, 1))


def edges_mm(*parts: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    level, every = (np.concatenate(counts) for counts in zip(*parts))
    return 1000 * outer_edges(level, every, WIDTH)


@pytest.mark.parametrize("head_mm", [-31.0, -30.0, -28.5, -27.2])
def test_the_edge_of_a_head_is_found_between_two_bins(head_mm):
    found = edges_mm(rows(3, profile(head_mm, head_mm + 60), wall(head_mm + 1)))
    assert found == pytest.approx(head_mm, abs=1.6)


def test_points_on_the_face_do_not_move_the_edge():
    level = profile(-28.2, 30.0) + wall(-28.2, 200.0)
    found = edges_mm(rows(3, level, wall(-28.0)))
    assert found == pytest.approx(-28.2, abs=1.6)


def test_a_hidden_corner_ends_where_grooves_with_faces_say():
    """The corner of the second groove is hidden over 8 mm; its other edge, and the width of the first one, are seen."""
    facing = rows(60, profile(-30.0, 30.0), wall(-29.0))
    hidden = rows(60, profile(-38.0, 30.0), wall(29.0))
    assert edges_mm(hidden) == pytest.approx(-38.0, abs=1.6)
    assert edges_mm(facing, hidden) == pytest.approx(-30.0, abs=2.5)


def test_a_groove_that_is_no_wider_is_not_moved():
    facing = rows(60, profile(-32.0, 32.0), wall(-31.0))
    hidden = rows(60, profile(-30.0, 20.0), wall(19.0))
    assert edges_mm(facing, hidden)[60:] == pytest.approx(-30.0, abs=1.6)


def test_no_more_than_a_corner_is_hidden():
    """The gap of the first groove is filled by beams that meet its edge."""
    facing = rows(60, profile(-20.0, 20.0), wall(-19.0))
    hidden = rows(60, profile(-38.0, 30.0), wall(29.0))
    assert edges_mm(facing, hidden)[60:] == pytest.approx(-28.0, abs=1.6)


def test_few_points_are_added_up_over_more_of_a_groove():
    """One level point in 25 cm of each bin is enough, although no bin of 1.2 m holds one point in twenty."""
    along = np.arange(0.0, 24.0, 0.02)
    axis = np.column_stack([along, 0.002 * np.sin(along)])
    count = len(axis)
    lines = Lines(axis, np.zeros(count), np.zeros(count), np.ones(count), np.ones(count), 1.0)
    lines = lines.of(thinned(lines))
    assert len(lines.axis) == pytest.approx(24 / 0.05, rel=0.05)
    rng = np.random.RandomState(1)
    xyz = np.column_stack([rng.uniform(0, 24, 24 * 4 * BINS), rng.uniform(-0.112, 0.112, 24 * 4 * BINS)])
    xyz = np.column_stack([xyz, np.zeros(len(xyz))])
    xyz = xyz[np.abs(xyz[:, 1]) > 0.03]
    inward = np.tile([0.0, 1.0], (len(lines.axis), 1))
    level, every = summed_along(lines, inward, xyz, np.ones(len(xyz), dtype=bool))
    assert np.array_equal(level, every)
    middle = np.abs(lines.axis[:, 0] - 12) < 6
    assert np.quantile(level[middle], 0.6, axis=1).min() >= 30
    assert 1000 * outer_edges(level, every, WIDTH)[middle] == pytest.approx(-30.0, abs=4.0)
