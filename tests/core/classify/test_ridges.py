import numpy as np
import pytest
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.ridges import Ridges, cells_beside, on_crests
from rail_extract.core.classify.tops import Grid

HEAD_M, LENGTH_M = 0.072, 12.0


def axes(offset_m=0.0):
    """Cells of a line to the east, 0.1 m apart, with their axes to the side of the true one."""
    x = np.arange(0.05, LENGTH_M, 0.1)
    ones = np.ones(len(x))
    return Lines(np.column_stack([x, offset_m * ones]), 0.15 * ones, 0 * ones, ones, ones, 1.0)


def surface(width_m, blur_m, slope=0.0, per_m2=2000, noise_m=0.005, seed=0):
    """Points of a bar that is 0.15 m high on a plane bed, blurred by a Gaussian."""
    from scipy.special import erf

    rng = np.random.default_rng(seed)
    xy = rng.uniform([0, -0.5], [LENGTH_M, 0.5], (int(per_m2 * LENGTH_M), 2))
    edges = [erf((width_m / 2 + side * xy[:, 1]) / (np.sqrt(2) * blur_m)) for side in (1, -1)]
    return xy, 0.075 * (edges[0] + edges[1]) + slope * xy[:, 1] + rng.normal(0, noise_m, len(xy))


def measured(width_m, blur_m, **more):
    lines = axes()
    return Ridges.measure(*surface(width_m, blur_m, **more), lines, np.zeros(len(lines.axis), dtype=int))


@pytest.mark.parametrize("blur_m", [0.045, 0.06])
def test_width_and_blur_of_a_blurred_head_are_measured(blur_m):
    ridges = measured(HEAD_M, blur_m)
    spread_m = np.hypot(HEAD_M / np.sqrt(12), blur_m)
    assert ridges.width_m[0] == pytest.approx(2.355 * spread_m, rel=0.06)
    assert ridges.spread_m[0] == pytest.approx(spread_m, rel=0.12)
    assert ridges.length_m[0] == pytest.approx(LENGTH_M, abs=0.2)


@pytest.mark.parametrize(
    ("width_m", "blur_m", "is_blunt", "may_be_head"),
    [(0.072, 0.045, True, True), (0.072, 0.060, True, True), (0.072, 0.004, False, True), (0.150, 0.004, False, False)],
)
def test_heads_are_told_from_kerbs_where_the_cloud_is_sharp(width_m, blur_m, is_blunt, may_be_head):
    ridges = measured(width_m, blur_m, per_m2=20_000)
    assert ridges.are_blunt(HEAD_M) == is_blunt
    assert ridges.may_be_heads(HEAD_M)[0] == may_be_head


def test_a_mound_that_is_wider_than_the_other_ridges_is_no_head():
    lines = axes()
    piece = np.arange(len(lines.axis)) // 90  # 9 m of a rail, then 3 m of a mound
    xy, height = surface(HEAD_M, 0.05)
    _, mound = surface(0.25, 0.05)
    ridges = Ridges.measure(xy, np.where(xy[:, 0] < 9.0, height, mound), lines, piece)
    assert ridges.may_be_heads(HEAD_M).tolist() == [True, False]


def test_what_is_hidden_on_one_side_is_not_measured():
    xy, height = surface(HEAD_M, 0.05)
    lines = axes()
    seen = xy[:, 1] < 0.03
    ridges = Ridges.measure(xy[seen], height[seen], lines, np.zeros(len(lines.axis), dtype=int))
    assert np.isnan(ridges.width_m[0])
    assert not ridges.may_be_heads(HEAD_M)[0] and not ridges.are_blunt(HEAD_M)


@pytest.mark.parametrize("slope", [0.0, 0.09])
def test_axes_move_onto_the_crest_whatever_the_slope_of_the_bed(slope):
    lines = on_crests(*surface(HEAD_M, 0.05, slope, per_m2=400, noise_m=0.01), axes(0.018), 0.055)
    assert np.sqrt(np.mean(lines.axis[:, 1] ** 2)) < 0.004


def test_cells_are_taken_on_both_sides_alike():
    lines = axes(0.002)
    grid, _ = Grid.around(np.array([0.0, LENGTH_M]), np.array([-1.0, 1.0]), 0.04)
    middles = grid.middles(cells_beside(grid, lines, 0.056))
    assert [middles[:, 1].min(), middles[:, 1].max()] == pytest.approx([-0.06, 0.06], abs=0.021)
