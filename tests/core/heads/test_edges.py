import numpy as np
import pytest
from rail_extract.core.heads.edges import WIDE_SIGMA_M, Ridge
from rail_extract.core.heads.head_points import STATION_STEP_M, HeadPoints, stations_along

WIDTH, LENGTH_M, BEND = 0.072, 40.0, 8.0


def ridge_of(t, across, z):
    line, free = np.array([[0.0, 0.0], [LENGTH_M, 0.0]]), np.ones((2, len(stations_along(LENGTH_M))), dtype=bool)
    return Ridge.find(HeadPoints(t, across, z, WIDTH, line, free, is_blunt=True))


def ridge_points(offset_m=0.0, noise_m=0.015, slope=0.0, per_m=40, seed=0, bend=BEND):
    """Points of a blurred head, 56 mm to either side of its crest, as the classification gives them."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0, LENGTH_M, int(per_m * LENGTH_M)))
    x = rng.uniform(-0.056, 0.056, len(t))
    z = 100.0 + 0.01 * t - 0.5 * bend * x**2 + slope * x + rng.normal(0, noise_m, len(t))
    return t, x + offset_m, z


@pytest.mark.parametrize("offset_m", [-0.006, 0.0, 0.006])
def test_the_crest_is_found_within_its_standard_error(offset_m):
    t, across, z = ridge_points(offset_m)
    ridge = ridge_of(t, across, z)
    assert abs(np.average(ridge.offset_m, weights=ridge.information) - offset_m) < 0.003
    of_stations = ((ridge.offset_m - offset_m) * np.sqrt(ridge.information))[20:-20]
    assert 0.5 < np.sqrt(np.mean(of_stations**2)) < 1.6


def test_noise_that_hides_the_crest_leaves_it_at_the_mean_of_the_points():
    """Not at the line, about which the points on the top are chosen."""
    t, across, z = ridge_points(0.01, noise_m=0.06, per_m=20)
    ridge = ridge_of(t, across, z)
    assert abs(np.average(ridge.offset_m, weights=ridge.information) - 0.01) < 0.005


@pytest.mark.parametrize("side", [-1, 1])
def test_what_is_as_high_as_the_head_beside_it_does_not_draw_the_crest_aside(side):
    """A road on one side of a tram rail, or echoes of beams that hit only one edge: crests were up to 37 mm off."""
    t, across, z = ridge_points(noise_m=0.01, bend=40.0)
    beside = side * across > 0.5 * WIDTH
    ridge = ridge_of(t, across, np.where(beside, 100.0 + 0.01 * t, z))
    assert abs(np.average(ridge.offset_m, weights=ridge.information)) < 0.004


def test_chance_does_not_choose_the_few_points_on_the_top_of_a_short_line():
    for seed in range(60):
        t, across, z = ridge_points(per_m=20, seed=seed, bend=48.0)
        near = t < 6.0
        ridge = ridge_of(t[near], across[near], z[near])
        assert abs(np.average(ridge.offset_m, weights=ridge.information)) < 0.005


@pytest.mark.parametrize("seed", range(3))
def test_a_line_stays_along_a_ridge_that_is_wider_than_a_head(seed):
    """As that of a head and the check rail beside it: its crest is between both."""
    t, across, z = ridge_points(noise_m=0.002, seed=seed)
    beside = (t > 17.0) & (t < 23.0) & (across > 0)
    z[beside] += 0.5 * BEND * across[beside] ** 2
    ridge = ridge_of(t, across, z)
    beside, elsewhere = np.abs(ridge.t - 20.0) < 1.5, np.abs(ridge.t - 20.0) > 4.0
    assert abs(np.average(ridge.offset_m[beside], weights=ridge.information[beside])) < 0.002
    assert ridge.information[beside].mean() < 0.1 * ridge.information[elsewhere].mean()


def test_chance_makes_no_ridge_wide_of_which_few_points_are_seen():
    """A third of the straight rails of a drone's cloud stayed as the raster had drawn them (world 12724)."""
    ridges = [ridge_of(*ridge_points(per_m=10, seed=seed)) for seed in range(20)]
    assert np.mean([ridge.information == STATION_STEP_M / WIDE_SIGMA_M**2 for ridge in ridges]) < 0.01


@pytest.mark.parametrize("count", [0, 1, 2, 3, 5, 12])
def test_a_few_points_show_a_crest_or_none(count):
    """Two points of the branch of a world drawn at random stopped the whole run."""
    for seed in range(20):
        points = (values[:count] for values in ridge_points(seed=seed))
        ridge = ridge_of(*points)
        assert (ridge is not None) == (count == 12)
