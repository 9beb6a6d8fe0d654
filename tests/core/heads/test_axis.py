import numpy as np
import pytest
from built import cloud_of
from rail_extract.core.heads.axis import UNSHOWN_M, Axis
from rail_extract.core.heads.elevation import elevate
from rail_extract.core.heads.head_points import HeadPoints, near_lines, stations_along
from rail_extract.core.heads.refinement import refine
from rail_extract.core.lines.smoothing import smooth_network
from rail_extract.core.polyline import interpolate, length_along, project
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.scanner import Scanner, head_outline, scan
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072
UNSEEN = 0.0115


def head(length, density, noise=0.003, seed=0):
    """Points on the crown and the corners of a head along the x axis: chainage, offset and height."""
    random = np.random.default_rng(seed)
    count = int(length * density)
    t = np.sort(random.uniform(0, length, count))
    across = random.uniform(-WIDTH / 2, WIDTH / 2, count)
    outline, _ = head_outline(WIDTH)
    height = np.interp(across, *outline[::-1].T)
    return t, across + random.normal(0, noise, count), height + random.normal(0, noise, count)


def axis(t, across, z, length=60.0, free=None):
    line = np.column_stack([np.linspace(0, length, int(10 * length) + 1), np.zeros(int(10 * length) + 1)])
    free = np.ones((2, len(stations_along(length))), dtype=bool) if free is None else free
    return Axis.of(HeadPoints(t, across, z, WIDTH, line, free), UNSEEN)


def support(t, across, z, length=60.0, free=None):
    return axis(t, across, z, length, free).support(marked=False)


@pytest.mark.parametrize(("left_m", "noise_m"), [(0.0, 0.003), (0.0, 0.008), (4.0, 0.005), (8.0, 0.005)])
def test_errors_of_lines_are_as_large_as_stated(left_m, noise_m):
    """Scanned from above the track and from the side, with little and much noise, and with gaps in one rail.

    Wear moves the axis of a head for all of its points: by 0.6 mm to the left of one rail, to the right of the other.
    """
    own = trace([Element(120.0, 1 / 900, 1 / 900)], heading=0.1)
    track, path = Track(own, GAUGE + WIDTH, left_m=left_m), Track(own, GAUGE + WIDTH).centerline
    random = np.random.RandomState(3)
    scanner = Scanner(noise_m=noise_m)
    gaps = ((30.0, 31.5), (60.0, 62.0), (90.0, 93.0))
    rails = [scan(track.railhead(side), WIDTH, path, scanner, random, gaps[: 3 * (side > 0)]) for side in (1, -1)]
    points = cloud_of(*rails)
    network = smooth_network(vectorize(rasterize(points.xyz, cell_size(GAUGE, WIDTH)), WIDTH), 0.8)
    network = refine(network, points, WIDTH)
    lines = elevate(network, near_lines(network.lines, points, WIDTH), 10)
    errors, local, whole = [], [], []
    for line, worn_m in zip(lines, (0.0006, -0.0006)):
        stations = interpolate(line.xyz[:, :2], length_along(line.xyz[:, :2]), line.support.t)
        feet = project([rail[:, :2] for rail in track.rails()], stations, 0.1)
        errors.append(feet.across + worn_m)
        local.append(line.support.sigma_m[feet.point])
        whole.append(np.full(len(feet.point), line.sigma_mm / 1000))
    errors, local, whole = (np.abs(np.concatenate(values)) for values in (errors, local, whole))
    assert 0.3 < np.sqrt(np.mean((errors / local) ** 2)) < 1.7
    assert 0.3 < np.sqrt(np.mean((errors / whole) ** 2)) < 1.7


def test_a_band_wider_than_a_head_tells_that_the_head_may_be_at_either_end():
    """As where road next to a grooved rail is as high as its head."""
    t, across, z = head(60, 500)
    wide = support(t, across * (1 + 0.05 / WIDTH), 0.0 * z)
    assert wide.sigma_m[10:-10] == pytest.approx(np.hypot(UNSEEN, 0.025), abs=0.004)


def test_a_line_off_its_rail_has_a_large_sigma():
    t, across, z = head(60, 150)
    assert support(t, across + 0.01, z).rms_m == pytest.approx(0.01, rel=0.15)


@pytest.mark.parametrize("apart_m", [0.010, 0.015, 0.025])
def test_two_passes_without_a_mark_blur_the_head_and_are_in_sigma(apart_m):
    t, across, z = head(60.0, 120)
    across[::2] += 0.5 * apart_m
    across[1::2] -= 0.5 * apart_m
    found = support(t, across, z)
    count, spread_m, shared_m = found.strips.T
    assert (count == 1).all()
    assert np.allclose(spread_m, apart_m, atol=0.002)
    assert np.allclose(shared_m, 0.5 * spread_m)
    assert (found.sigma_m >= shared_m).all()


@pytest.mark.parametrize("noise_m", [0.001, 0.003, 0.008])
@pytest.mark.parametrize("density", [10, 120])
def test_one_pass_does_not_blur_the_head(noise_m, density):
    assert not support(*head(60.0, density, noise_m, seed=4)).strips[:, 2].any()


def test_a_line_without_points_stays_and_is_in_doubt():
    found = axis(*np.empty((3, 0)))
    np.testing.assert_allclose(found.course.at(np.arange(60.0)), 0.0, atol=1e-12)
    assert not found.shown.points.any()
    assert found.support(marked=False).rms_m > 0.3 * UNSHOWN_M / np.sqrt(60)
