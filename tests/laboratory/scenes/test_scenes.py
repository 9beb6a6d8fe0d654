"""Scenes: the truth has the geometry of tracks, and the points are where a scanner would find them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rail_extract import __main__ as commands
from rail_extract.core.clouds.las import laspy
from rail_extract.core.clouds.points import read_rail_points
from rail_extract.core.polyline import length_along
from rail_extract.laboratory.curves import Element, trace, transition_curve
from rail_extract.laboratory.scenes.catalogue import SCENES
from rail_extract.laboratory.scenes.frogs import FLANGEWAY_M, laid_together
from rail_extract.laboratory.scenes.mixed import IMAGED, SCANNED, mixed
from rail_extract.laboratory.scenes.raw_scanner import SUBRAY_WEIGHTS, SUBRAYS
from rail_extract.laboratory.scenes.scanner import Scanner, head_outline, scan
from rail_extract.laboratory.scenes.scene import RAIL
from rail_extract.laboratory.scenes.tracks import Track
from rail_extract.laboratory.scenes.write import read_truth
from scipy.spatial import cKDTree
from scipy.special import erfc

SAMPLE = Path(__file__).parents[3] / "resources" / "sample"
SPACING_M = 1.507
WIDTH_M = 0.072


class Built(dict):
    """Scenes by name, built on first use."""

    def __missing__(self, name):
        self[name] = SCENES[name]()
        return self[name]


@pytest.fixture(scope="module")
def scenes():
    return Built()


def canted_curve():
    curve = trace(transition_curve(20, 50, 60, 1 / 600), heading=1.1)
    return Track(curve, SPACING_M, 0.004 * curve.chainage, -0.08 * curve.curvature * 600)


def test_heads_are_half_the_spacing_from_the_centerline_and_cant_is_left_minus_right():
    track = canted_curve()
    left, right = track.railhead(1).top, track.railhead(-1).top
    np.testing.assert_allclose(np.linalg.norm(left - right, axis=1), SPACING_M, rtol=0, atol=1e-12)
    np.testing.assert_allclose(0.5 * (left + right), track.centerline, rtol=0, atol=1e-12)
    np.testing.assert_allclose((left - right)[:, 2], track.cant_m, rtol=0, atol=1e-12)
    towards_left = np.sum((left - right)[:, :2] * track.curve.left_normal, axis=1)
    assert (towards_left > 0).all()


def test_heads_lean_inward_by_the_inclination_and_with_the_cant():
    track = canted_curve()
    for side in (1, -1):
        head = track.railhead(side)
        np.testing.assert_allclose(np.linalg.norm(head.axis, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.sum(head.axis * head.across, axis=1), 0, atol=1e-12)
        inward = -side * (track.railhead(1).top - track.railhead(-1).top) / SPACING_M
        lean = np.arcsin(np.sum(head.axis * inward, axis=1))
        np.testing.assert_allclose(lean, np.arctan(1 / 20), atol=1e-12)


@pytest.mark.parametrize("inclination", [1 / 20, 1 / 40])
def test_points_without_noise_are_on_the_head_and_only_where_the_scanner_sees_it(inclination):
    track = Track(trace([Element(60)], heading=0.7), SPACING_M, inclination=inclination)
    ridden = Track(track.curve, SPACING_M, left_m=6.0).centerline
    head = track.railhead(-1)
    scanner = Scanner(noise_m=0.0, face_share=1.0)
    points = scan(head, WIDTH_M, ridden, scanner, np.random.RandomState(1))
    nearest = cKDTree(head.top).query(points)[1]
    offset = points - head.top[nearest]
    across = np.sum(offset * head.across[nearest], axis=1)
    above = np.sum(offset * head.axis[nearest], axis=1)
    outline, _ = head_outline(WIDTH_M)
    fine = np.column_stack(
        [np.interp(np.arange(0, len(outline) - 1, 0.02), np.arange(len(outline)), column) for column in outline.T]
    )
    assert cKDTree(fine).query(np.column_stack([across, above]))[0].max() < 1e-4
    assert above[across < 0].min() > -0.012, "the far face is out of sight"
    assert above[across > 0].min() < -0.03, "the near face is in sight"


def test_gaps_have_no_points():
    curve = trace([Element(60)])
    track = Track(curve, SPACING_M)
    arguments = track.railhead(1), WIDTH_M, track.centerline, Scanner(noise_m=0.0), np.random.RandomState(1)
    points = scan(*arguments, missing=((10, 13), (40, 40.5)))
    x = points[:, 0]
    assert not ((x > 10.05) & (x < 12.95)).any()
    assert not ((x > 40.05) & (x < 40.45)).any()
    assert ((x > 13.05) & (x < 39.95)).any()


def nearest(points, line, step=0.05):
    """Distances in plan of points from a line."""
    t = length_along(line)
    dense = np.column_stack([np.interp(np.arange(0, t[-1], step), t, column) for column in line[:, :2].T])
    return cKDTree(dense).query(points[:, :2])[0]


def test_rails_that_meet_share_their_points_and_frogs_have_flangeways():
    tracks = [Track(trace([Element(40)], (-20 * np.cos(a), -20 * np.sin(a)), a), SPACING_M) for a in (0.0, 0.15)]
    head = tracks[0].railhead(1)
    ridden = tracks[0].centerline
    clouds = [
        scan(track.railhead(side), WIDTH_M, ridden, Scanner(noise_m=0.0), np.random.RandomState(1))
        for track in tracks
        for side in (1, -1)
    ]
    laid = laid_together(tracks, clouds, WIDTH_M)
    left = [points[np.abs(points[:, 0]) < 18, 1] - head.top[0, 1] for points in laid[2:]]
    for offsets in left:
        assert not (np.abs(offsets) < WIDTH_M / 2 - 1e-4).any(), "the first rail's head gives these points"
        assert not ((offsets < -WIDTH_M / 2 - 2e-3) & (offsets > -WIDTH_M / 2 - FLANGEWAY_M + 2e-3)).any()
        assert (np.abs(offsets) < 0.15).any()
    assert len(laid[0]) < len(clouds[0]), "the other track's flangeways cut it too"


def test_the_command_writes_the_sample_that_ships(tmp_path):
    assert commands.main(["scenes", "paper_like", "--into", str(tmp_path), "--name", "sample"]) == 0
    assert (SAMPLE / "sample.laz").stat().st_size < 2_000_000
    shipped, made = laspy.read(SAMPLE / "sample.laz"), laspy.read(tmp_path / "sample.laz")
    assert len(shipped.points) == len(made.points)
    np.testing.assert_allclose(shipped.xyz, made.xyz, rtol=0, atol=0.0015)
    np.testing.assert_array_equal(shipped.classification, made.classification)
    for kind, count in (("rail", 6), ("centerline", 3)):
        lines = read_truth(SAMPLE / "sample_truth.geojson", kind)
        assert len(lines) == count
        for line, again in zip(lines, read_truth(tmp_path / "sample_truth.geojson", kind)):
            np.testing.assert_allclose(line, again, rtol=0, atol=2e-4)


def test_the_sample_reads_back_as_the_scene(scenes):
    scene = scenes["paper_like"]
    (points,) = read_rail_points(SAMPLE / "sample.laz", [RAIL])
    assert "EPSG" in points.frame.crs_wkt
    assert "UTM zone 43N" in points.frame.crs_wkt
    world = scene.frame.to_crs(scene.rail_points().xyz)
    np.testing.assert_allclose(points.frame.to_crs(points.xyz), world, rtol=0, atol=0.0006)
    truth = scene.frame.to_local(read_truth(SAMPLE / "sample_truth.geojson", "rail")[0])
    np.testing.assert_allclose(truth, scene.rails[0], rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [(["nowhere"], "no scene 'nowhere'"), (["straight", "curved", "--name", "x"], "for a single scene")],
)
def test_bad_arguments_end_in_one_sentence(tmp_path, capsys, arguments, sentence):
    assert commands.main(["scenes", *arguments, "--into", str(tmp_path / "out")]) == 1
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_mixed_cloud_has_its_rails_where_each_source_shows_them():
    scene = mixed(3, scanned=0.5, imaged=0.75)
    along = {one: scene.xyz[scene.strips == one] @ [np.cos(0.35), np.sin(0.35), 0] for one in (SCANNED, IMAGED)}
    lengths = {one: np.ptp(np.percentile(own, (0.1, 99.9))) for one, own in along.items()}
    assert lengths[SCANNED] == pytest.approx(30, abs=4) and lengths[IMAGED] == pytest.approx(45, abs=4)
    first, second = scene.rails[:4], scene.rails[4:]
    for sharp, blunt in zip(first, second):
        assert length_along(sharp[:, :2])[-1] == pytest.approx(length_along(blunt[:, :2])[-1], abs=0.7)
        step = blunt[0] - sharp[-1]
        assert 0.01 < np.hypot(*step[:2]) < 0.2 and -0.06 < step[2] < 0.0


def test_a_beam_as_wide_as_a_head_hits_the_bed_with_a_twentieth_of_its_power():
    """Of a Gaussian beam that is 1 wide where its power falls to 1/e², erfc(√2) is further than 0.5 from its middle."""
    beyond = np.abs(SUBRAYS) > 1
    at_edge = np.abs(SUBRAYS) == 1
    weights = np.array(SUBRAY_WEIGHTS)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[beyond].sum() + weights[at_edge].sum() / 2 == pytest.approx(erfc(np.sqrt(2)), abs=0.006)
