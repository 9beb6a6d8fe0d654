import numpy as np
import pytest
from rail_extract.core.heads.flank import find_flank
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Railhead

WIDTH = 0.072


def flank_of(t, across, z):
    line, free = np.array([[0.0, 0.0], [60.0, 0.0]]), np.ones((2, 241), dtype=bool)
    return find_flank(HeadPoints(t, across, z, WIDTH, line, free))


def scanned(top_share, noise_m=0.004, angle_deg=20.0, seed=0):
    """Chainage, offset and height of the points of a head along the x axis, with a scanner on its left."""
    x = np.arange(0, 60, 0.01)
    axes = [np.tile(axis, (len(x), 1)) for axis in ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0])]
    head = Railhead(np.column_stack([x, 0 * x, 0.01 * x]), *axes)
    path = np.column_stack([x[::10], np.zeros((len(x[::10]), 2))])
    height_m = 4.5 * np.tan(np.radians(angle_deg))
    scanner = Scanner(
        noise_m=noise_m, face_share=1.0, top_share=top_share, left_m=4.5, height_m=height_m, half_range_m=30.0
    )
    points = scan(head, WIDTH, path, scanner, np.random.RandomState(seed))
    return points[np.argsort(points[:, 0])].T


@pytest.mark.parametrize("noise_m", [0.002, 0.004, 0.005])
@pytest.mark.parametrize("off_m", [0.0, 0.036])
def test_the_axis_follows_from_one_face(noise_m, off_m):
    t, across, z = scanned(0.0, noise_m)
    for side in (1, -1):
        flank = flank_of(t, side * (across - off_m), z)
        assert flank.left_m == pytest.approx(-side * off_m, abs=0.001)
        assert flank.top_m == pytest.approx(0.019, abs=0.004)
        assert flank.sigma_m == 0.0012


def test_a_head_with_its_crown_is_not_a_face():
    assert flank_of(*scanned(1.0)) is None


def test_points_that_are_narrow_in_height_too_are_not_a_face():
    t = np.linspace(0, 60, 6000)
    assert flank_of(t, np.zeros(6000), 0.01 * t) is None


def test_points_that_may_be_on_either_face_are_half_a_head_unsure():
    random = np.random.default_rng(0)
    t = np.sort(random.uniform(0, 60, 3000))
    flank = flank_of(t, random.normal(0.01, 0.004, 3000), random.normal(-0.024, 0.008, 3000))
    assert flank.left_m == pytest.approx(0.01, abs=0.001)
    assert flank.sigma_m == WIDTH / 2


@pytest.mark.parametrize(
    ("width_m", "beyond_m", "is_face"),
    [
        (0.020, 0.011, 0),
        (0.020, 0.013, 1),
        (0.0315, 0.013, 1),
        (0.0325, 0.013, 0),
        (0.004, 0.070, 1),
        (0.004, 0.073, 0),
    ],
)
def test_a_face_is_a_narrow_band_higher_than_wide_and_less_than_twice_its_depth(width_m, beyond_m, is_face):
    random = np.random.default_rng(0)
    t = np.sort(random.uniform(0, 60, 3000))
    across, z = random.uniform(-0.5, 0.5, (2, 3000))
    found = flank_of(t, width_m * across, (width_m + beyond_m / 0.9) * z)  # 0.9 is between the percentiles
    assert (found is not None) == bool(is_face)
