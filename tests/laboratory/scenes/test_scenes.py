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
from rail_extract.laboratory.scenes.frogs import FLANGEWAY_M, frog_guards, laid_together
from rail_extract.laboratory.scenes.scanner import CROWN_RADIUS_M, FACE_DEPTH_M, Scanner, head_outline, scan
from rail_extract.laboratory.scenes.scene import GROUND, RAIL, UNCLASSIFIED
from rail_extract.laboratory.scenes.tracks import Track
from rail_extract.laboratory.scenes.write import read_truth
from scipy.spatial import cKDTree

SAMPLE = Path(__file__).parents[3] / "resources" / "sample"
SPACING_M = 1.507
WIDTH_M = 0.072


PLAIN = ("straight", "curved", "main_line", "paper_like", "tram", "noisy", "sparse", "feet")


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


def test_parallel_tracks_keep_their_distance():
    curve = trace([Element(50, 1 / 300, 1 / 300)])
    first, second = Track(curve, SPACING_M), Track(curve, SPACING_M, left_m=4.0)
    distance = np.linalg.norm(first.centerline - second.centerline, axis=1)
    np.testing.assert_allclose(distance, 4.0, atol=1e-12)


def test_truth_lines_stay_on_the_curve():
    track = Track(trace([Element(40, 1 / 30, 1 / 30)]), SPACING_M)
    for line, radius_m in zip(
        (*track.rails(), track.thinned(track.centerline)), (30 - SPACING_M / 2, 30 + SPACING_M / 2, 30)
    ):
        middles = 0.5 * (line[1:] + line[:-1])
        off = radius_m - np.linalg.norm(middles[:, :2] - [0, 30], axis=1)
        assert 0 <= off.min() <= off.max() < 5e-5


def test_the_head_has_a_crown_two_faces_and_its_width():
    outline, turn = head_outline(WIDTH_M)
    assert outline[:, 0].min() == pytest.approx(-WIDTH_M / 2)
    assert outline[:, 0].max() == pytest.approx(WIDTH_M / 2)
    assert outline[:, 1].max() == 0
    assert outline[:, 1].min() == pytest.approx(-FACE_DEPTH_M)
    crown = np.abs(outline[:, 0]) < 0.02
    from_centre = np.hypot(outline[crown, 0], outline[crown, 1] + CROWN_RADIUS_M)
    np.testing.assert_allclose(from_centre, CROWN_RADIUS_M, atol=1e-12)
    np.testing.assert_allclose(outline, outline[::-1] * [-1, 1], atol=1e-12)
    # The normal, turned from the axis by `turn`, is perpendicular to the chords of the surface.
    chords = np.diff(outline, axis=0)
    middle_turn = 0.5 * (turn[1:] + turn[:-1])
    normal = np.column_stack([np.sin(middle_turn), np.cos(middle_turn)])
    slip = np.sum(chords * normal, axis=1) / np.linalg.norm(chords, axis=1)
    assert np.abs(slip).max() < 0.02


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


def test_density_falls_with_range():
    curve = trace([Element(60)])
    path = Track(curve, SPACING_M).centerline
    heads = [Track(curve, SPACING_M, left_m=left).railhead(1) for left in (0.0, 4.0, 8.0, 12.0)]
    counts = [len(scan(head, WIDTH_M, path, Scanner(), np.random.RandomState(1))) for head in heads]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 4 * counts[2]


def test_points_come_in_profiles():
    curve = trace([Element(60)])
    track = Track(curve, SPACING_M)
    points = scan(track.railhead(1), WIDTH_M, track.centerline, Scanner(noise_m=0.0), np.random.RandomState(1))
    stations = np.unique(np.round(points[:, 0], 3))
    assert 60 / 0.06 < len(stations) < 60 / 0.04
    assert 0.03 < np.diff(stations).min() < np.diff(stations).max() < 0.1


def test_gaps_have_no_points():
    curve = trace([Element(60)])
    track = Track(curve, SPACING_M)
    arguments = track.railhead(1), WIDTH_M, track.centerline, Scanner(noise_m=0.0), np.random.RandomState(1)
    points = scan(*arguments, missing=((10, 13), (40, 40.5)))
    x = points[:, 0]
    assert not ((x > 10.05) & (x < 12.95)).any()
    assert not ((x > 40.05) & (x < 40.45)).any()
    assert ((x > 13.05) & (x < 39.95)).any()


@pytest.mark.parametrize("name", ["paper_like", "noisy", "turnout_9", "diamond"])
def test_scenes_repeat_exactly(scenes, name):
    again = SCENES[name]()
    # Sums can differ in the last bit, depending on the position of arrays in memory.
    np.testing.assert_allclose(again.xyz, scenes[name].xyz, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(again.classification, scenes[name].classification)


@pytest.mark.parametrize("name", PLAIN)
def test_the_true_gauge_is_that_of_the_standard(scenes, name):
    scene = scenes[name]
    for left, right, middle in zip(scene.rails[::2], scene.rails[1::2], scene.centerlines):
        gauge = np.linalg.norm(left - right, axis=1) - scene.standard.head_width_m
        np.testing.assert_allclose(gauge, scene.standard.gauge_m, rtol=0, atol=1e-9)
        np.testing.assert_allclose(middle, 0.5 * (left + right), rtol=0, atol=1e-9)


def nearest(points, line, step=0.05):
    """Distances in plan of points from a line."""
    t = length_along(line)
    dense = np.column_stack([np.interp(np.arange(0, t[-1], step), t, column) for column in line[:, :2].T])
    return cKDTree(dense).query(points[:, :2])[0]


@pytest.mark.parametrize(
    ("name", "rails", "tracks"),
    [("turnout_7", 4, 2), ("turnout_26", 4, 2), ("crossover", 6, 3), ("diamond", 4, 2), ("dual_gauge", 3, 2)],
)
def test_scenes_with_several_tracks_have_each_rail_once(scenes, name, rails, tracks):
    scene = scenes[name]
    assert (len(scene.rails), len(scene.centerlines)) == (rails, tracks)
    for number, rail in enumerate(scene.rails):
        for other in scene.rails[:number]:
            assert nearest(rail, other).max() > 0.4


@pytest.mark.parametrize("name", ["turnout_7", "turnout_9", "turnout_26"])
def test_branch_rails_leave_their_stock_rails_tangentially(scenes, name):
    *stock, left, right = scenes[name].rails
    for rail, beside in zip((left, right), stock):
        off = nearest(rail, beside)
        along = length_along(rail)
        assert off[along < 3].max() < 0.03
        assert (np.diff(off[along > 12]) > 0).all()


def test_the_throat_leads_to_ten_parallel_tracks(scenes):
    scene = scenes["throat"]
    assert (len(scene.rails), len(scene.centerlines)) == (20, 10)
    ends = np.array([line[-1, :2] for line in scene.centerlines])
    main = scene.centerlines[0][:, :2]
    along = (main[-1] - main[0]) / np.linalg.norm(main[-1] - main[0])
    beside = np.sort((ends - main[0]) @ [-along[1], along[0]])
    np.testing.assert_allclose(np.diff(beside), 4.5, atol=0.02)
    np.testing.assert_allclose((ends - main[0]) @ along, 270, atol=1.5)


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


def test_a_diamond_has_check_and_wing_rails_inside_its_acute_frogs():
    tracks = [Track(trace([Element(60)], (-30 * np.cos(a), -30 * np.sin(a)), a), SPACING_M) for a in (0.0, 0.15)]
    guards = frog_guards(tracks, WIDTH_M)
    assert len(guards) == 8
    apart = SPACING_M / 2 - WIDTH_M - FLANGEWAY_M
    flat = [guard.top[:, :2] for guard in guards]
    beside = [np.abs(xy @ np.array([-np.sin(a), np.cos(a)])) for xy in flat for a in (0.0, 0.15)]
    assert sum(np.allclose(offset, apart, atol=1e-4) for offset in beside) == 8
    far = SPACING_M / 2 / np.sin(0.075)
    middles = np.array([np.linalg.norm(xy.mean(axis=0)) for xy in flat])
    assert (np.abs(middles - far) < 2).all()
    checks = np.array([np.ptp(xy, axis=0).max() > 3 for xy in flat])
    assert checks.sum() == 4
    assert (middles[checks] < far).all(), "two thirds of a check rail lie ahead of the nose"
    assert (middles[~checks] > far).all(), "wing rails lie around it"


def near_rail(scene, rail, reach_m=0.045):
    """Heights of the rail points around a true rail, above it."""
    fine = np.linspace(0, len(rail) - 1, 20 * len(rail))
    dense = np.column_stack([np.interp(fine, np.arange(len(rail)), column) for column in rail.T])
    points = scene.rail_points().xyz
    distance, number = cKDTree(dense[:, :2]).query(points[:, :2], distance_upper_bound=reach_m)
    kept = np.isfinite(distance)
    return points[kept, 2] - dense[number[kept], 2]


def test_the_paper_like_scene_has_the_figures_of_the_paper(scenes):
    scene = scenes["paper_like"]
    count = np.count_nonzero(scene.classification == RAIL)
    assert abs(count - 75_500) < 1000
    assert (scene.standard.gauge_m, scene.standard.head_width_m) == (1.0, 0.06191)
    assert set(np.unique(scene.classification)) == {UNCLASSIFIED, GROUND, RAIL}
    for rail in scene.rails:
        assert length_along(rail)[-1] == pytest.approx(160, abs=1.5)
    heights = [near_rail(scene, rail) for rail in scene.rails]
    density = [len(near) / 160 for near in heights]
    assert min(density[:2]) > 90
    assert min(density[2:4]) > 60
    assert 20 < min(density[4:]) <= max(density[4:]) < 50
    low = [np.mean(near < -0.012) for near in heights]
    assert 0.06 < np.average(low, weights=density) < 0.14, "about a tenth lies on side faces"


def test_gaps_of_the_sparse_track_end_below_three_metres(scenes):
    scene = scenes["paper_like"]
    for rail in scene.rails[4:]:
        points = scene.rail_points().xyz[:, :2]
        along = np.column_stack([np.interp(np.arange(0, 320, 0.2), np.arange(len(rail)), c) for c in rail[:, :2].T])
        empty = cKDTree(points).query(along)[0] > 0.06
        borders = np.flatnonzero(np.diff(np.concatenate([[0], empty.astype(int), [0]])))
        longest = np.max(borders[1::2] - borders[::2]) * length_along(along)[-1] / len(along)
        assert 1.5 < longest < 3.2


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
