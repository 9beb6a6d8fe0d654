"""Lines from the points of different scanners: dense and sparse, near and far, noisy, in one scan and in two."""

from __future__ import annotations

import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.heads.elevation import elevate
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.heads.refinement import refine
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import left_normals, resample
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.ruler.lines import compare_lines, match
from rail_extract.laboratory.scenes.plain import canted, rolling
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072
GOOD = {"noise_m": 0.004}
FAR = {"noise_m": 0.005, "half_range_m": 20.0}
SPARSE = {"profile_step_m": 0.10, "ray_step_rad": 0.01, "noise_m": 0.004}


def scanned(scanner, cant_m=0.0, left_m=0.0, radius_m=900.0, length_m=80.0, passes=((0.0, 0.0, 0.0),), seed=3):
    """Rails from lines with errors of 12 mm, like those of a raster, and the truth."""
    curve = trace([Element(length_m, 1 / radius_m, 1 / radius_m)], heading=0.1)
    track = Track(curve, GAUGE + WIDTH, rolling(curve), canted(curve, cant_m), left_m=left_m)
    path = Track(curve, GAUGE + WIDTH, rolling(curve)).centerline
    random = np.random.RandomState(seed)
    clouds = [scan(track.railhead(side), WIDTH, path, scanner, random) + shift for shift in passes for side in (1, -1)]
    points = RailPoints(np.concatenate(clouds), LocalFrame(np.zeros(3)), 10)
    truth, lines = track.rails(), []
    for rail in truth:
        line, t = resample(rail[:, :2], 0.1)
        lines.append(line + (0.012 * np.sin(t / 4 + 1))[:, None] * left_normals(line))
    nodes = np.array([line[end] for line in lines for end in (0, -1)])
    network = LineNetwork(tuple(lines), nodes, np.arange(4).reshape(2, 2))
    network = refine(network, points, WIDTH)
    return elevate(network, near_lines(network.lines, points.xyz, WIDTH), 10), truth


@pytest.mark.parametrize(
    ("scanner", "cant_m", "left_m", "across_m", "height_m"),
    [
        (GOOD, 0.15, 0.0, 0.0025, 0.0015),
        (GOOD, -0.15, 0.0, 0.0025, 0.0015),
        ({"noise_m": 0.002, "face_share": 1.0}, 0.0, 0.0, 0.0025, 0.0015),
        ({"noise_m": 0.010, "face_share": 1.0}, 0.15, 0.0, 0.004, 0.0025),
        ({"noise_m": 0.008, "profile_step_m": 0.10}, 0.05, 0.0, 0.004, 0.0025),
        ({"noise_m": 0.003, "profile_step_m": 0.03, "ray_step_rad": 0.0005}, 0.05, 0.0, 0.0015, 0.0015),
        (SPARSE, 0.05, 0.0, 0.004, 0.0025),
        (GOOD, 0.05, 4.5, 0.004, 0.0015),
        (FAR, 0.1, -10.0, 0.004, 0.0025),
        ({"noise_m": 0.004, "height_m": 1.5, "left_m": 6.0, "half_range_m": 25.0}, 0.0, 0.0, 0.004, 0.0025),
    ],
)
def test_errors_with_other_scanners_are_millimetres(scanner, cant_m, left_m, across_m, height_m):
    rails, truth = scanned(Scanner(**scanner), cant_m, left_m)
    found = compare_lines([rail.xyz for rail in rails], truth)
    assert found.completeness > 0.99
    assert found.lateral_rmse_m < across_m
    assert found.height_rmse_m < height_m
    assert abs(found.height_bias_m) < 0.0015


def test_two_scans_that_disagree_give_the_line_midway():
    """The second scan is registered 6 mm to the side and 5 mm up; the points do not show which scan is right."""
    rails, truth = scanned(Scanner(**GOOD), passes=((0.0, 0.0, 0.0), (0.0, 0.006, 0.005)))
    found = compare_lines([rail.xyz for rail in rails], truth)
    assert found.lateral_bias_m == pytest.approx(0.003, abs=0.0015)
    assert found.height_bias_m == pytest.approx(0.0025, abs=0.0015)


def test_a_tram_curve_neither_shrinks_nor_widens():
    rails, truth = scanned(Scanner(**GOOD), radius_m=25.0, length_m=38.0)
    for rail, true in zip(rails, truth):
        assert abs(compare_lines([rail.xyz], [true]).lateral_bias_m) < 0.001


def test_two_thirds_lie_within_one_standard_error_and_nearly_all_within_two():
    shares = []
    for seed, scanner in enumerate((GOOD, FAR, SPARSE, {"noise_m": 0.008})):
        rails, truth = scanned(Scanner(**scanner), seed=seed)
        found = match([rail.xyz for rail in rails], truth)
        sigma = np.empty(len(found.line))
        for number, rail in enumerate(rails):
            mine = found.line == number
            sigma[mine] = np.interp(found.t[mine], rail.support.t, rail.support.sigma_m)
        shares.append([found.share_within(times * sigma) for times in (1, 2)])
    once, twice = np.mean(shares, axis=0)
    assert 0.58 < once < 0.82
    assert 0.89 < twice < 0.99
