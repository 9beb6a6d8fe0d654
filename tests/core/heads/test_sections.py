import numpy as np
import pytest
from rail_extract.core.heads.edges import station_count
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.core.heads.outline import MIN_NOISE_M, Section
from rail_extract.core.heads.sections import (
    VIEW_STATIONS,
    Middles,
    _blur,
    _half_apart,
    _pull,
    likelier_width,
    outline_middles,
    with_outline,
)
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Railhead

WIDTH, LENGTH = 0.072, 60.0


def scanned(angle_deg, share=1.0, noise_m=0.005, seed=0, slope=0.0, bend_m=0.0, width_m=WIDTH):
    """Chainage, offset and height of the points of a head, which may lean and wander about the line."""
    x = np.arange(0, LENGTH, 0.01)
    axis, across = np.array([0.0, -slope, 1.0]), np.array([0.0, 1.0, slope])
    size = np.hypot(1, slope)
    top = np.column_stack([x, bend_m * np.sin(x / 5), 0.005 * x])
    head = Railhead(top, np.tile(axis / size, (len(x), 1)), np.tile(across / size, (len(x), 1)))
    path = np.column_stack([x[::10], np.zeros((len(x[::10]), 2))])
    height_m = 4.5 * np.tan(np.radians(angle_deg))
    scanner = Scanner(noise_m=noise_m, face_share=share, left_m=4.5, height_m=height_m, half_range_m=30.0)
    points = scan(head, width_m, path, scanner, np.random.RandomState(seed))
    return points[np.argsort(points[:, 0])].T


def middles_of(points, seen=None):
    seen = np.ones(station_count(LENGTH), dtype=bool) if seen is None else seen
    line = np.array([[0.0, 0.0], [LENGTH, 0.0]])
    return outline_middles(HeadPoints(*points, WIDTH, line, np.ones((2, len(seen)), dtype=bool)), seen)


def mean_m(middles, factor=1.0):
    """Offset that all stations together show; `factor` (s,) or 1."""
    weight = np.where(np.isfinite(middles.offset), middles.information, 0.0) * factor
    return np.sum(weight * np.nan_to_num(middles.offset)) / weight.sum()


@pytest.mark.parametrize("angle_deg", [17, 30, 45])
@pytest.mark.parametrize("share", [0.3, 1.0])
@pytest.mark.parametrize("slope", [0.0, 0.08])
def test_the_middle_does_not_lean_to_the_scanner(angle_deg, share, slope):
    middles = middles_of(scanned(angle_deg, share, slope=slope))
    assert np.isfinite(middles.offset[:-1]).all()
    assert abs(mean_m(middles)) < 0.0015


def test_the_axis_stays_where_another_width_is_stated():
    """Without another outline it is 1.7 mm off."""
    points = scanned(60, noise_m=0.004, seed=3, width_m=0.062)
    assert abs(mean_m(middles_of(points))) < 0.001


def flat(noise_m, apart_m=0.0, count=30_000):
    """Chainage, offset and height of points on heads without corners, half of them by a pass that lies apart."""
    random = np.random.RandomState(0)
    across = random.uniform(-WIDTH / 2, WIDTH / 2, count) + random.choice([-apart_m / 2, apart_m / 2], count)
    noise = noise_m * random.normal(size=(2, count))
    return np.array([np.sort(random.uniform(0, LENGTH, count)), across + noise[0], noise[1]])


@pytest.mark.parametrize("noise_m", [0.0, 0.001, 0.002])
def test_the_outline_does_not_show_the_middle_of_sharp_heads_without_corners(noise_m):
    """They look 10 mm wider than an outline with round corners; fitted as such, their axis is up to 5 mm off."""
    assert np.isnan(middles_of(flat(noise_m)).offset).all()
    assert np.isfinite(middles_of(scanned(60, noise_m=max(noise_m, 0.001))).offset[:-1]).all()


@pytest.mark.parametrize("noise_m", [0.004, 0.008])
def test_the_outline_shows_the_middle_of_heads_without_corners_in_noise(noise_m):
    middles = middles_of(flat(noise_m))
    assert np.isfinite(middles.offset[:-1]).all()
    assert abs(mean_m(middles)) < 0.0015


def test_passes_side_by_side_are_no_head_without_corners():
    one, other = scanned(60, noise_m=0.004), scanned(60, noise_m=0.004, seed=1) + [[0], [0.015], [0]]
    both = np.column_stack([one, other])
    middles = middles_of(both[:, np.argsort(both[0])])
    assert np.isfinite(middles.offset[:-1]).all()
    assert mean_m(middles) == pytest.approx(0.0075, abs=0.002)


@pytest.mark.parametrize(
    ("last", "density", "pull_m"), [(0.5, 30, 0.0), (0.7, 30, 0.0028), (0.51, 1, 0.0), (1.0, 30, 0.0)]
)
def test_a_view_that_changes_pulls_the_ends_of_a_section(last, density, pull_m):
    """The share of points on the left half of the head changes along 40 m, if there are enough points to say so."""
    random, count = np.random.RandomState(0), VIEW_STATIONS
    station = np.repeat(np.arange(count), density)
    is_left = random.random_sample(len(station)) < 0.5 + (last - 0.5) * station / count
    is_left |= (station > 20) & (station < 28)
    pull = _pull(station, is_left, count)
    assert pull[-1] == pytest.approx(pull_m, abs=0.0009)
    assert pull[0] == -pull[-1] and pull[count // 2] == 0.0


def test_middles_follow_the_head_along_the_line():
    middles = middles_of(scanned(30, bend_m=0.004))
    wave = np.sin((np.arange(len(middles.offset)) + 0.5) * 0.25 / 5)
    assert mean_m(middles, np.abs(wave) > 0.9) == pytest.approx(0.0, abs=0.0015)
    upper, lower = (mean_m(middles, side * wave > 0.9) for side in (1, -1))
    assert upper == pytest.approx(0.004, abs=0.0015)
    assert lower == pytest.approx(-0.004, abs=0.0015)


def test_errors_of_middles_are_as_large_as_stated():
    """Each station has its own points, so that errors are independent, and a scanner spreads points evenly."""
    middles = middles_of(scanned(60, noise_m=0.004, seed=6))
    off = (middles.offset - mean_m(middles))[:-1] * np.sqrt(middles.information[:-1])
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.15
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.2


def test_stations_that_do_not_show_the_head_alone_have_no_middle_and_do_not_count():
    points = scanned(30)
    t, across, z = points
    seen = np.arange(station_count(LENGTH)) >= 60
    disturbed = np.array([t, across + np.where(t < 10, 0.02, 0.0), z])
    middles = middles_of(disturbed, seen)
    assert np.isnan(middles.offset[:60]).all()
    known = slice(62, -1)
    off = (middles.offset - middles_of(points, seen).offset)[known] * np.sqrt(middles.information[known])
    assert np.abs(off).max() < 0.5


def test_few_points_show_no_middle():
    few = scanned(30)[:, ::60]
    assert np.isnan(middles_of(few).offset).all()


def test_what_is_no_head_shows_no_middle():
    random = np.random.default_rng(0)
    t = np.sort(random.uniform(0, LENGTH, 12000))
    middles = middles_of(np.array([t, random.uniform(-0.09, 0.09, len(t)), random.uniform(-0.08, 0.03, len(t))]))
    assert np.isnan(middles.offset).all()


def test_edges_are_corrected_by_what_the_outline_shows_elsewhere():
    by_edges = np.array([0.005, 0.006, np.nan, 0.004, 0.009])
    nothing = np.zeros(5)
    by_outline = Middles(np.array([0.001, 0.002, 0.0, np.nan, np.nan]), nothing, nothing, nothing, nothing)
    np.testing.assert_allclose(with_outline(by_edges, by_outline), [0.001, 0.002, 0.0, 0.0, 0.005], atol=1e-12)
    unknown = Middles(np.full(5, np.nan), nothing, nothing, nothing, nothing)
    np.testing.assert_array_equal(with_outline(by_edges, unknown), by_edges)


@pytest.mark.parametrize(("across_mm", "up_mm"), [(0, 0), (4, 0), (10, 0), (20, 0), (30, 0), (0, 4), (0, 12), (0, 16)])
def test_two_passes_blur_the_head_by_half_of_their_distance(across_mm, up_mm):
    passes = [scanned(80, noise_m=0.004, seed=seed) for seed in (1, 2)]
    for sign, one in zip((0.5, -0.5), passes):
        one[1] += sign * across_mm / 1000
        one[2] += sign * up_mm / 1000
    both = np.concatenate(passes, axis=1)
    middles = middles_of(both[:, np.argsort(both[0])])
    expected = [half if half > 3 else 0 for half in (across_mm / 2, up_mm / 2)]
    found = [1000 * np.median(one) for one in (middles.blur, middles.blur_up)]
    assert found == pytest.approx(expected, rel=0.12)


def test_noise_with_weeds_or_rounded_to_half_of_it_is_no_second_level():
    random = np.random.RandomState(0)
    noise = 0.004 * random.standard_normal(4000)
    weeds = np.append(noise, random.uniform(0, 0.06, 200))
    assert [_half_apart(one) for one in (noise, weeds, np.round(noise, 3) // 0.002 * 0.002, noise[:100])] == 4 * [0.0]
    assert _half_apart(np.concatenate([noise - 0.005, noise + 0.005])) == pytest.approx(0.005, rel=0.05)
    assert _half_apart(np.zeros(0)) == 0.0 and _half_apart(np.zeros(4000)) == 0.0


@pytest.mark.parametrize("width_m", [0.066, 0.072, 0.078])
def test_the_outline_shows_which_width_heads_have_whatever_the_noise(width_m):
    heads = [scanned(80, noise_m=0.006, seed=seed, width_m=width_m) for seed in (1, 2)]
    heads[1][1] += 1.5
    line = np.column_stack([np.arange(0, LENGTH, 0.5), np.zeros(int(2 * LENGTH))])
    lines, xyz = [line, line + [0, 1.5]], np.concatenate(heads, axis=1).T
    assert likelier_width(lines, xyz, (0.066, 0.072)) == min(width_m, 0.072)
    assert likelier_width(lines, xyz, (0.072, 0.078)) == max(width_m, 0.072)
    assert likelier_width(lines, xyz[:100], (0.072, 0.078)) == 0.072


@pytest.mark.parametrize(
    ("across_mm", "up_mm", "apart_up_mm", "wander_mm", "blur_mm"),
    [(6.5, 5, 4, 0, 5.766), (6.5, 3, 0, 2.5, 5.196), (6.5, 4, 4, 0, None), (4.5, 3, 0, 0, 0), (9, 3, 0, 6, 0)],
)
def test_edges_are_blurred_by_what_neither_noise_nor_passes_in_height_nor_wandering_lines_explain(
    across_mm, up_mm, apart_up_mm, wander_mm, blur_mm
):
    section = Section(np.array([0, 0, 0, 0, np.log(across_mm / 1000), np.log(up_mm / 1000)]), np.zeros(1))
    offset = wander_mm / 1000 * np.array([1, -1, np.nan])
    blur_mm = np.sqrt(across_mm**2 - (1000 * MIN_NOISE_M) ** 2) if blur_mm is None else blur_mm
    blur = _blur(section, 0.0, offset, apart_up_mm / 1000, is_crowned=True)
    assert 1000 * blur == pytest.approx(blur_mm, abs=0.001)


@pytest.mark.parametrize(("count", "apart_m"), [(249, 0.0), (250, 0.005)])
def test_two_levels_are_told_by_250_points(count, apart_m):
    levels = 0.005 * np.resize([1, -1], count) + 0.0005 * np.random.RandomState(0).standard_normal(count)
    assert _half_apart(levels) == pytest.approx(apart_m, rel=0.05)
