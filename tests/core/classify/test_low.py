"""Lines that stand out of a rough bed."""

import numpy as np
import pytest
from rail_extract.core.classify.low import find_low
from rail_extract.core.classify.settings import Settings
from rail_extract.core.classify.square import classify_square
from rail_extract.core.classify.tops import Grid
from rail_extract.core.classify.ways import Way
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, turned, with_bar

CELL_M, SIDE = 0.04, 120
SCATTER_M = 0.01
ROW, COLUMN = np.indices((SIDE, SIDE))


def bed(seen: float = 0.6, seed: int = 3) -> np.ndarray:
    """Make rough ballast of which a share of the cells is seen."""
    rng = np.random.RandomState(seed)
    level = SCATTER_M * rng.standard_normal((SIDE, SIDE))
    return np.where(rng.uniform(size=level.shape) < seen, level, np.nan)


def off_m(degrees: float) -> np.ndarray:
    """Distance of each cell to the left of a line through the middle."""
    x, y = (COLUMN - SIDE / 2) * CELL_M, (SIDE / 2 - ROW) * CELL_M
    angle = np.radians(degrees)
    return y * np.cos(angle) - x * np.sin(angle)


def found(level: np.ndarray):
    return find_low(Grid(CELL_M, 0, 0, level.shape), level)


@pytest.mark.parametrize("degrees", [0.0, 20.0, 57.0, 90.0, 139.0])
def test_a_head_of_any_direction_is_a_crest(degrees):
    on = np.abs(off_m(degrees)) < 0.036
    level = np.where(np.isnan(bed()), np.nan, np.where(on, 0.02, bed()))
    low = found(level)
    inner = (np.hypot(ROW - SIDE / 2, COLUMN - SIDE / 2) < 0.4 * SIDE) & low.crest
    assert (np.abs(off_m(degrees))[inner] < 0.06).mean() > 0.95
    assert inner.sum() > 0.4 * 0.8 * SIDE
    assert np.median(low.rise[inner]) == pytest.approx(0.017, abs=0.004)
    assert np.median(low.base[inner]) == pytest.approx(0.0, abs=0.006)


def test_rough_ballast_has_hardly_a_crest():
    assert found(bed()).crest.mean() < 0.001


def test_a_slope_hides_no_head():
    on = np.abs(off_m(30.0)) < 0.036
    level = np.where(on, 0.025, bed()) + 0.12 * off_m(30.0)
    low = found(np.where(np.isnan(bed()), np.nan, level))
    assert (np.abs(off_m(30.0))[low.crest] < 0.06).mean() > 0.9
    assert low.crest.sum() > 0.4 * SIDE


def test_a_head_is_seen_beside_its_own_shadow():
    left = off_m(20.0)
    level = np.where(np.abs(left) < 0.036, 0.04, bed())
    low = found(np.where(np.isnan(bed()) | ((left > 0.036) & (left < 0.6)), np.nan, level))
    assert (np.abs(left[low.crest]) < 0.06).mean() > 0.95
    assert low.crest.sum() > 0.4 * SIDE


def test_a_head_of_little_more_than_the_scatter_is_seen_along_several_metres():
    """Of 1.3 m of it, hardly a line is certain (worlds 13634 and 13736)."""
    rng = np.random.RandomState(8)
    level = SCATTER_M * rng.standard_normal((SIDE, SIDE))
    level = np.where(np.abs(off_m(20.0)) < 0.036, level + 0.016, level)
    crest = found(np.where(rng.uniform(size=level.shape) < 0.3, level, np.nan)).crest
    inner = (np.hypot(ROW - SIDE / 2, COLUMN - SIDE / 2) < 0.4 * SIDE) & crest
    assert (np.abs(off_m(20.0))[inner] < 0.08).mean() > 0.9
    assert inner.sum() > 15


def test_what_is_not_seen_has_no_crest():
    low = found(np.full((SIDE, SIDE), np.nan))
    assert not low.crest.any()
    assert np.isnan(low.rise).all()


def slabs_beside_a_ditch() -> np.ndarray:
    """Two slabs whose edges are at gauge, as of two tracks of 1000 mm in world 13504: (n, 3) points."""
    xyz = flat(16.0, rng=np.random.RandomState(4), per_m2=2000)
    inside_m = np.maximum(0.5 * (1.435 + 0.072) - np.abs(turned(xyz, 0.0)[1]), 0.0)
    return rough(np.column_stack([xyz[:, :2], -0.3 * inside_m]), np.random.RandomState(5), 0.004)


def test_edges_to_which_the_ground_leads_up_are_no_heads():
    assert not classify_square(slabs_beside_a_ditch(), Settings((1.435,), 0.072, way=Way.FILLED)).rail.any()


@pytest.mark.parametrize(("slope", "is_track"), [(0.0, True), (0.12, True), (0.4, False)])
def test_no_track_is_steeper_across_than_its_cant(slope, is_track):
    """The edges of a bank and of its berm may be at gauge from each other (world 14682)."""
    xyz, half_m = flat(16.0, rng=np.random.RandomState(4), per_m2=2000), 0.5 * (1.435 + 0.072)
    ground = rough(xyz + np.outer(slope * turned(xyz, 0.0)[1], [0.0, 0.0, 1.0]), np.random.RandomState(5), 0.004)
    for left_m in (half_m, -half_m):
        ground = with_bar(ground, 0.072, left_m=left_m, height_m=0.025)[0]
    rail = classify_square(ground, Settings((1.435,), 0.072, way=Way.FILLED)).rail
    assert rail.any() == is_track


def test_what_is_higher_beside_rails_that_hardly_stand_out_is_a_third_rail():
    """Another search finds the rails themselves (worlds 15382 and 15510)."""
    xyz, rails = flat(16.0, rng=np.random.RandomState(4), per_m2=2000), np.zeros(512_000, dtype=bool)
    ground = rough(xyz, np.random.RandomState(5), 0.004)
    for left_m in (0.754, -0.754):
        ground, on = with_bar(ground, 0.072, left_m=left_m, height_m=0.025)
        rails |= on
    ground, third = with_bar(ground, 0.072, left_m=1.15, height_m=0.2)
    rail = classify_square(ground, Settings((1.435,), 0.072, way=Way.FILLED)).rail
    assert rail[rails].mean() > 0.9
    assert not rail[third].any()
