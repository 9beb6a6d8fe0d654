"""How wide the ridges of a blunt cloud are, and which of them may be heads."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.pieces import SHOWN_SHARE
from rail_extract.core.classify.ridges import Ridges, above_sides, on_crests, steadied
from rail_extract.core.classify.settings import Settings, Way
from rail_extract.core.classify.square import classify_square
from scipy.special import ndtr

GAUGE_M, WIDTH_M, SIDE_M = 1.435, 0.072, 16.0
FIELDS = "height", "theta", "cover", "pure"
MATCHED_M = 0.092
"""Width of a head with what matching adds."""


def bars(width_m, height_m, blur_m, spacing_m=GAUGE_M + WIDTH_M, noise_m=0.004):
    """Two bars in level ground, as images show them: (n, 3) points."""
    places = np.arange(0.0, SIDE_M, 0.04)
    xy = np.array(np.meshgrid(places, places)).reshape(2, -1).T
    rng = np.random.RandomState(8)
    xy = xy + rng.uniform(-0.02, 0.02, xy.shape)
    off_m = xy[:, :1] - (7.0 + spacing_m * np.array([-0.5, 0.5]))
    rise = ndtr((off_m + width_m / 2) / blur_m) - ndtr((off_m - width_m / 2) / blur_m)
    return np.column_stack([xy, height_m * rise.sum(axis=1) + noise_m * rng.standard_normal(len(xy))])


def found_m(xyz, way=Way.BLUNT):
    return classify_square(xyz, Settings((GAUGE_M,), WIDTH_M, way=way)).figures


@pytest.mark.parametrize("blur_m", [0.022, 0.042, 0.065])
def test_heads_are_as_narrow_under_any_blur(blur_m):
    assert found_m(bars(MATCHED_M, 0.17, blur_m)).paired_m == pytest.approx(2 * SIDE_M, rel=0.05)


@pytest.mark.parametrize(("wider_m", "found"), [(-0.02, True), (0.015, True), (0.043, False)])
def test_bars_further_apart_than_any_track_are_no_rails(wider_m, found):
    """As kerbs on either side of a strip of lawn may be; their single cells seem to be nearer."""
    xyz = bars(0.15, 0.08, 0.042, GAUGE_M + WIDTH_M + wider_m, noise_m=0.008)
    assert found_m(xyz).paired_m == pytest.approx(2 * SIDE_M * found, rel=0.1)


@pytest.mark.parametrize(("width_m", "blur_m"), [(0.25, 0.045), (0.3, 0.085)])
def test_walls_at_the_distance_of_rails_are_too_wide(width_m, blur_m):
    figures = found_m(bars(width_m, 0.15, blur_m))
    assert figures.paired_m + figures.single_m == 0


@pytest.mark.parametrize(("lower_m", "found"), [(0.02, True), (0.064, False)])
def test_the_ridges_of_a_track_are_as_high_as_each_other(lower_m, found):
    """As a rail and a low wall at gauge are not; their single cells seem to be."""
    high, low = bars(MATCHED_M, 0.17, 0.042, noise_m=0.008), bars(MATCHED_M, 0.17 - lower_m, 0.042, noise_m=0.008)
    xyz = np.where(high[:, :1] > 7.0, high, low)
    assert (found_m(xyz).paired_m > SIDE_M) == found


@pytest.mark.parametrize(("gaps_m", "found"), [(0.0, True), (0.35, False)])
def test_a_rail_has_no_gaps_in_images_and_a_row_of_sleepers_has(gaps_m, found):
    """Ends of sleepers are as narrow as a head where ballast lies on both sides, and another row may be at gauge."""
    shape, plain = bars(MATCHED_M, 0.10, 0.042), bars(MATCHED_M, 0.0, 0.042)
    ends = shape[:, 1] % 0.6 >= gaps_m
    assert (found_m(np.where(ends[:, None], shape, plain)).paired_m > SIDE_M) == found


def with_check_rails(xyz, blur_m, sides, first_m=6.0, last_m=10.0):
    """Points of `bars` whose check rails, a flangeway of 45 mm from each, are on these sides, 1 for the left."""
    across = np.clip(np.abs(xyz[:, 1] - (first_m + last_m) / 2) - (last_m - first_m) / 2, 0.0, None)
    shown = np.exp(-0.5 * (across / blur_m) ** 2)
    xyz = xyz.copy()
    for rail_m, side in zip(7.0 + (GAUGE_M + WIDTH_M) * np.array([-0.5, 0.5]), sides):
        off_m = xyz[:, 0] - (rail_m - side * (WIDTH_M + 0.045))
        rise = ndtr((off_m + MATCHED_M / 2) / blur_m) - ndtr((off_m - MATCHED_M / 2) / blur_m)
        xyz[:, 2] += 0.17 * abs(side) * shown * rise
    return xyz


@pytest.mark.parametrize("sides", [(-1, 1), (-1, 0)], ids=["both", "one"])
def test_a_rail_is_at_gauge_beside_the_check_rail_with_which_it_is_one_ridge(sides):
    """Of a ridge of two heads, the crest is between both."""
    xyz = with_check_rails(bars(MATCHED_M, 0.17, 0.05), 0.05, sides)
    rail = classify_square(xyz, Settings((GAUGE_M,), WIDTH_M, way=Way.BLUNT)).rail
    x, y, _ = xyz[rail].T
    for rail_m in 7.0 + (GAUGE_M + WIDTH_M) * np.array([-0.5, 0.5]):
        near = np.abs(x - rail_m) < 0.2
        beside = near & (np.abs(y - 8.0) < 1.5)
        assert np.count_nonzero(beside) > 0.1 * np.count_nonzero(near)
        assert abs(np.mean(x[beside]) - rail_m) < 0.015


@pytest.mark.parametrize("blur_m", [0.04, 0.05])
def test_a_rail_is_at_gauge_beside_a_guard_rail_as_long_as_it(blur_m):
    """The ridge of both is too wide for one head, and half of all ridges are (worlds 14757 and 14851)."""
    xyz = with_check_rails(bars(MATCHED_M, 0.17, blur_m), blur_m, (-1, 0), first_m=0.0, last_m=SIDE_M)
    rail = classify_square(xyz, Settings((GAUGE_M,), WIDTH_M, way=Way.BLUNT)).rail
    x = xyz[rail, 0]
    for rail_m in 7.0 + (GAUGE_M + WIDTH_M) * np.array([-0.5, 0.5]):
        near = np.abs(x - rail_m) < 0.2
        assert np.count_nonzero(near) > 0.4 * len(x)
        assert abs(np.mean(x[near]) - rail_m) < 0.015


def lines_beside(across_m):
    """Cells of a line along x, 4 cm apart, with their axes aside."""
    along_m = 0.04 * np.arange(len(across_m))
    same = np.zeros(len(along_m))
    return Lines(np.column_stack([along_m, across_m]), same + 0.15, same, same + 1.0, same + 1.0, 1.0)


def test_crests_are_found_where_lines_point_either_way():
    """Lines have no direction: along the x axis, half of them seem to point back."""
    rng = np.random.RandomState(6)
    lines = lines_beside(np.zeros(100))
    lines = replace(lines, theta=np.where(np.arange(100) % 2, 0.002, np.pi - 0.002))
    xy = np.column_stack([rng.uniform(0.0, 4.0, 20_000), rng.uniform(-0.3, 0.3, 20_000)])
    height = 0.15 * np.exp(-0.5 * ((xy[:, 1] - 0.02) / 0.042) ** 2)
    assert on_crests(xy, height, lines, 0.042).axis[:, 1] == pytest.approx(0.02, abs=0.002)


def section(height_at, seen_at=lambda left_m: np.ones(len(left_m))):
    """Points beside a line along x, of heights and shares that are seen by their distances to the left; the line."""
    rng = np.random.RandomState(6)
    xy = np.column_stack([rng.uniform(0.0, 4.0, 20_000), rng.uniform(-0.3, 0.3, 20_000)])
    xy = xy[rng.uniform(size=len(xy)) < seen_at(xy[:, 1])]
    return xy, height_at(xy[:, 1]), lines_beside(np.zeros(100)), np.zeros(100, dtype=np.int64)


@pytest.mark.parametrize(("mixed", "known"), [(0.05, False), (0.15, False), (0.3, True)])
def test_a_head_is_no_wider_for_what_is_seen_in_its_shadow(mixed, known):
    """Beams that meet its edge and the bed behind it are between both in height (worlds 13587 and 14909)."""
    shadow = (0.036, 0.15)

    def height_at(left_m):
        return np.where(np.abs(left_m) < 0.036, 0.05, np.where((left_m > 0) & (left_m < shadow[1]), 0.04, 0.0))

    def seen_at(left_m):
        return np.where((left_m > shadow[0]) & (left_m < shadow[1]), mixed, 1.0)

    width_m = Ridges.measure(*section(height_at, seen_at), SHOWN_SHARE).width_m[0]
    assert width_m == pytest.approx(0.036 + shadow[1], abs=0.01) if known else np.isnan(width_m)


@pytest.mark.parametrize(
    ("height_at", "above_m"),
    [
        (lambda left_m: np.where(np.abs(left_m) < 0.036, 0.05, 0.0), 0.05),
        (lambda left_m: np.where(np.abs(left_m) < 0.036, 0.05, 0.0) + 0.1 * left_m, 0.05),
        (lambda left_m: np.where(np.abs(left_m - 0.03) < 0.036, 0.05, 0.0) + 0.1 * left_m, 0.05),
        (lambda left_m: np.where(left_m > 0, -0.3 * left_m, 0.0), -0.0015),
        (lambda left_m: -0.2 * np.abs(left_m), -0.002),
    ],
    ids=["head", "head on a slope", "head aside", "edge of a slab", "crest of a bank"],
)
def test_the_ground_leads_up_to_an_edge_and_passes_below_a_head(height_at, above_m):
    assert above_sides(*section(height_at))[0] == pytest.approx(above_m, abs=0.002)


def test_a_side_that_is_not_seen_does_not_tell_an_edge_from_a_head():
    xy, height, lines, piece = section(
        lambda left_m: np.where(np.abs(left_m) < 0.036, 0.05, 0.0), lambda left_m: np.where(left_m > 0.05, 0.0, 1.0)
    )
    assert above_sides(xy, height, lines, piece)[0] == pytest.approx(0.05, abs=0.002)


def test_a_train_above_the_ground_is_not_the_ground():
    """Few beams reach the ground in the shadow of a head, and others of the same bins the train beside it (14958)."""
    xy, height, lines, piece = section(
        lambda left_m: np.where(np.abs(left_m) < 0.036, 0.2, 0.0), lambda left_m: np.where(left_m > 0.036, 0.05, 1.0)
    )
    train = section(lambda left_m: np.full(left_m.shape, 3.5), lambda left_m: np.where(left_m > 0.036, 0.05, 0.0))
    both = np.concatenate([xy, train[0]]), np.concatenate([height, train[1]])
    assert above_sides(*both, lines, piece)[0] == pytest.approx(0.2, abs=0.002)


def test_the_wall_of_a_tunnel_has_no_ridge():
    """It is 3.6 times as steep as earth lies, and bends towards the vault (world 15415)."""
    wall = section(lambda left_m: -3.6 * left_m - 3.5 * left_m**2)
    assert above_sides(*wall)[0] == 0.0


def test_axes_that_scatter_are_steadied():
    scattered = np.random.RandomState(5).uniform(-0.035, 0.035, 200)
    across_m = steadied(lines_beside(scattered)).axis[:, 1]
    assert across_m.std() < scattered.std() / 3


def test_axes_stay_where_another_rail_begins():
    """Two rails side by side, a guard rail's distance apart, keep their axes."""
    both = [lines_beside(np.full(50, across_m)) for across_m in (0.0, 0.11)]
    axis = np.concatenate([one.axis for one in both])
    lines = Lines(axis, *(np.concatenate([getattr(one, name) for one in both]) for name in FIELDS), 1.0)
    np.testing.assert_allclose(steadied(lines).axis, axis, rtol=0, atol=1e-12)


def test_bars_too_wide_for_either_way_do_not_say_in_which_way_to_search():
    """Ridges that images blur a little are steep, and too wide for heads of a sharp cloud."""
    steep = found_m(bars(0.125, 0.15, 0.01), Way.SHARP)
    assert steep.paired_m == steep.unsure_m == 0
    narrow = found_m(bars(0.095, 0.15, 0.004, noise_m=0.001), Way.SHARP)
    assert narrow.paired_m > 30.0
    assert narrow.unsure_m == pytest.approx(narrow.paired_m)
