import numpy as np
import pytest
from built import cloud_of
from rail_extract.core.heads.head_points import HeadPoints, stations_along
from rail_extract.core.heads.sections import likelier_width, outline_middles
from rail_extract.laboratory.scenes.scanner import NEW, Profile, Scanner, scan
from rail_extract.laboratory.scenes.tracks import Railhead

WIDTH, LENGTH = 0.072, 60.0


def scanned(angle_deg, share=1.0, noise_m=0.005, seed=0, slope=0.0, bend_m=0.0, width_m=WIDTH, shape=NEW):
    """Chainage, offset and height of the points of a head, which may lean and wander about the line."""
    x = np.arange(0, LENGTH, 0.01)
    axis, across = np.array([0.0, -slope, 1.0]), np.array([0.0, 1.0, slope])
    size = np.hypot(1, slope)
    top = np.column_stack([x, bend_m * np.sin(x / 5), 0.005 * x])
    head = Railhead(top, np.tile(axis / size, (len(x), 1)), np.tile(across / size, (len(x), 1)))
    path = np.column_stack([x[::10], np.zeros((len(x[::10]), 2))])
    height_m = 4.5 * np.tan(np.radians(angle_deg))
    scanner = Scanner(noise_m=noise_m, face_share=share, left_m=4.5, height_m=height_m, half_range_m=30.0)
    points = scan(head, width_m, path, scanner, np.random.RandomState(seed), shape=shape)
    return points[np.argsort(points[:, 0])].T


def middles_of(points, seen=None):
    seen = np.ones(len(stations_along(LENGTH)), dtype=bool) if seen is None else seen
    line = np.array([[0.0, 0.0], [LENGTH, 0.0]])
    return outline_middles(HeadPoints(*points, WIDTH, line, np.ones((2, len(seen)), dtype=bool)), seen)


def mean_m(middles, factor=1.0):
    """Offset that all stations together show; `factor` (s,) or 1."""
    weight = np.where(np.isfinite(middles.offset), middles.information, 0.0) * factor
    return np.sum(weight * np.nan_to_num(middles.offset)) / weight.sum()


@pytest.mark.parametrize("angle_deg", [17, 30, 45])
@pytest.mark.parametrize(("share", "slope"), [(0.3, 0.08), (1.0, 0.0), (1.0, 0.08)])
def test_the_middle_does_not_lean_to_the_scanner(angle_deg, share, slope):
    middles = middles_of(scanned(angle_deg, share, slope=slope))
    assert np.isfinite(middles.offset[:-1]).all()
    assert abs(mean_m(middles)) < 0.0015


@pytest.mark.parametrize("angle_deg", [17, 45, 75])
@pytest.mark.parametrize(("noise_m", "shape"), [(0.003, NEW), (0.008, NEW), (0.004, Profile(crown_radius_m=0.8))])
def test_the_top_is_as_high_as_the_axis(angle_deg, noise_m, shape):
    middles = middles_of(scanned(angle_deg, noise_m=noise_m, slope=0.05, shape=shape))
    off = (middles.top - 0.005 * stations_along(LENGTH))[:-1]
    known = middles.top_information[:-1]
    assert abs(np.average(off, weights=known)) < 2 * middles.top_common[0] + 0.0002
    assert np.sqrt(np.mean(off**2 * known)) == pytest.approx(1.0, abs=0.25)


def test_a_head_that_is_flat_to_its_edges_has_no_outline():
    points = scanned(75, noise_m=0.002, shape=Profile(crown_radius_m=20.0, corner_radius_m=0.002))
    middles = middles_of(points)
    assert np.isnan(middles.top).all()
    assert np.isnan(middles.offset).all()


def test_the_axis_stays_where_another_width_is_stated():
    """Without another outline it is 1.7 mm off."""
    points = scanned(60, noise_m=0.004, seed=3, width_m=0.062)
    assert abs(mean_m(middles_of(points))) < 0.001


def test_errors_of_middles_are_as_large_as_stated():
    """Each station has its own points, so that errors are independent, and a scanner spreads points evenly."""
    middles = middles_of(scanned(60, noise_m=0.004, seed=6))
    off = (middles.offset - mean_m(middles))[:-1] * np.sqrt(middles.information[:-1])
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.15
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.2


def test_parts_that_a_tripod_sees_from_one_side_and_from_the_other_have_their_own_outlines():
    """In a section of both, the one of each side would be 4 to 8 mm off towards it."""
    points, other = scanned(17, noise_m=0.004), scanned(17, noise_m=0.004, seed=1)
    before, after = points[0] < 0.5 * LENGTH, other[0] >= 0.5 * LENGTH
    middles = middles_of(np.hstack([points[:, before], (other * [[1], [-1], [1]])[:, after]]))
    stations = stations_along(LENGTH)
    for there in (stations < 0.5 * LENGTH, (stations > 0.5 * LENGTH) & (stations < LENGTH)):
        assert abs(mean_m(middles, there)) < 0.0015


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


@pytest.mark.parametrize("width_m", [0.066, 0.072, 0.078])
def test_the_outline_shows_which_width_heads_have_whatever_the_noise(width_m):
    heads = [scanned(80, noise_m=0.006, seed=seed, width_m=width_m) for seed in (1, 2)]
    heads[1][1] += 1.5
    line = np.column_stack([np.arange(0, LENGTH, 0.5), np.zeros(int(2 * LENGTH))])
    lines, points = [line, line + [0, 1.5]], cloud_of(*(head.T for head in heads))
    assert likelier_width(lines, points, (0.066, 0.072)) == min(width_m, 0.072)
    assert likelier_width(lines, points, (0.072, 0.078)) == max(width_m, 0.072)
    assert likelier_width(lines, cloud_of(points.xyz[:100]), (0.072, 0.078)) == 0.072
