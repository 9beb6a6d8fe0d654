import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.heads.refinement import refine
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.lines.smoothing import smooth_network
from rail_extract.core.polyline import project
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072


def network_of(*lines):
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.array([line[end] for line in lines for end in (0, -1)])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def wavy_line(length, amplitude, period, step=0.1):
    x = np.arange(0, length + step / 2, step)
    return np.column_stack([x, amplitude * np.sin(2 * np.pi * x / period)])


def head(length, density, noise=0.004, lopsided=0.0, low_share=0.1, slope=0.0, seed=0, width=WIDTH):
    """Points of a head along the x axis; `lopsided` moves that share of the density from the right half to the left."""
    random = np.random.default_rng(seed)
    count = int(length * density)
    x, across = random.uniform(0, length, count), random.uniform(-width / 2, width / 2, count)
    across *= np.where(random.random(count) < lopsided, np.sign(across), 1)
    down = across**2 / 0.6
    low = random.random(count) < low_share
    across[low], down[low] = width / 2, random.uniform(0, 0.035, low.sum())
    return np.column_stack([x, across, slope * across - down]) + random.normal(0, noise, (count, 3))


def cloud(*parts):
    return RailPoints(np.concatenate(parts), LocalFrame(np.zeros(3)), 10)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize("density", [60, 120, 250])
@pytest.mark.parametrize("noise", [0.003, 0.005])
@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_lines_off_the_head_are_moved_to_its_axis(density, noise, slope):
    line = wavy_line(80, 0.015, 30) + [0.0, 0.003]
    refined = refine(network_of(line), cloud(head(80, density, noise, slope=slope)), WIDTH).lines[0]
    assert rms(line[:, 1]) > 0.01
    assert rms(refined[:, 1]) < 0.0025
    assert abs(refined[:, 1].mean()) < 0.002


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.001, 0.002, 0.004])
def test_heads_without_corners_have_their_axis_between_their_edges(noise, seed):
    """With the outline of a rail their axis is 2 to 4 mm off where the noise is small."""
    random = np.random.default_rng(seed)
    exact = [random.uniform(0, 60, 18_000), random.uniform(-WIDTH / 2, WIDTH / 2, 18_000), np.zeros(18_000)]
    points = np.column_stack(exact) + random.normal(0, noise, (18_000, 3))
    refined = refine(network_of(wavy_line(60, 0.0, 30) + [0.0, 0.003]), cloud(points), WIDTH).lines[0]
    assert abs(refined[:, 1].mean()) < 0.0012


@pytest.mark.parametrize("offset", [-0.05, -0.01, 0.0, 0.03, 0.06])
def test_a_line_moves_onto_points_that_all_have_one_offset(offset):
    exact = np.column_stack([np.linspace(0, 20, 500), np.full(500, offset), np.zeros(500)])
    refined = refine(network_of(wavy_line(20, 0.0, 30)), cloud(exact), WIDTH).lines[0]
    np.testing.assert_allclose(refined[:, 1], offset, atol=1e-6)


@pytest.mark.parametrize("elements", [[Element(80.0)], [Element(80.0, 1 / 600, 1 / 600)]])
@pytest.mark.parametrize("left_m", [0.0, 4.0, 8.0])
def test_lines_find_scanned_heads_from_whichever_side_they_are_seen(elements, left_m):
    """Parallel to the grid, where the raster is least exact, with the scanner above the track or off to its side."""
    own = trace(elements)
    track = Track(own, GAUGE + WIDTH, left_m=left_m)
    path = Track(own, GAUGE + WIDTH).centerline
    random = np.random.RandomState(7)
    points = cloud(*(scan(track.railhead(side), WIDTH, path, Scanner(), random) for side in (1, -1)))
    raw = smooth_network(vectorize(rasterize(points.xyz, cell_size(GAUGE, WIDTH)), WIDTH), 0.8)
    refined = refine(raw, points, WIDTH)
    truth = [rail[:, :2] for rail in track.rails()]
    before, after = (rms(project(truth, np.concatenate(network.lines), 0.1).across) for network in (raw, refined))
    assert after < 0.003
    assert after < before + 0.0003


def test_gaps_and_shadows_on_the_head_do_not_mislead_the_line():
    xyz = head(80, 150)
    xyz = xyz[(xyz[:, 0] < 20) | (xyz[:, 0] > 24)]
    shadow = (xyz[:, 0] > 40) & (xyz[:, 0] < 60) & (xyz[:, 1] > 0.0)
    line = wavy_line(80, 0.0, 30) + [0.0, 0.004]
    refined = refine(network_of(line), cloud(xyz[~shadow]), WIDTH).lines[0]
    assert np.abs(refined[:, 1]).max() < 0.015


def test_weeds_next_to_the_head_do_not_bias_the_line():
    random = np.random.default_rng(3)
    weeds = np.column_stack(
        [random.uniform(0, 80, 600), random.uniform(0.03, 0.09, 600), random.uniform(-0.1, 0.1, 600)]
    )
    refined = refine(network_of(wavy_line(80, 0.0, 30)), cloud(head(80, 120), weeds), WIDTH).lines[0]
    assert rms(refined[:, 1]) < 0.002


def test_lines_move_to_their_heads_and_still_meet():
    lines = [wavy_line(20, 0.0, 10) + [0.0, 0.01], wavy_line(20, 0.0, 10) + [20.0, 0.01], wavy_line(20, 0.0, 10)]
    lines[2] = lines[2] @ np.array([[0.9, 0.1], [-0.1, 0.9]]) + [20.0, 0.01]
    nodes = np.array([lines[0][0], lines[0][-1], lines[1][-1], lines[2][-1]])
    network = LineNetwork(tuple(lines), nodes, np.array([[0, 1], [1, 2], [1, 3]]))
    refined = refine(network, cloud(head(40, 150)), WIDTH)
    for number, (start, end) in enumerate(network.ends):
        np.testing.assert_array_equal(refined.lines[number][0], refined.nodes[start])
        np.testing.assert_array_equal(refined.lines[number][-1], refined.nodes[end])
    assert np.abs(refined.nodes[[0, 2], 1]).max() < 0.004
    assert np.abs(refined.lines[0][:, 1]).max() < 0.008


def arc(radius, length, step=0.1):
    x = np.arange(0, length + step / 2, step)
    return np.column_stack([x, x**2 / (2 * radius)])


def along_line(points, line):
    """Move points of a head on the x axis onto another line y(x)."""
    return points + np.column_stack([0 * points[:, 0], np.interp(points[:, 0], *line.T), 0 * points[:, 0]])


def turnout(radius=300.0, toe=30.0, length=80.0, seed=0):
    """Points of a straight head and of one that leaves it at `toe`; where the two overlap, only one has points."""
    branch = arc(radius, length - toe)
    leaving = head(length - toe, 150, seed=seed + 1)
    across = np.interp(leaving[:, 0], *branch.T) + leaving[:, 1]
    leaving = along_line(leaving, branch)[across > WIDTH / 2] + [toe, 0.0, 0.0]
    return cloud(head(length, 150, seed=seed), leaving), branch + [toe, 0.0]


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("turned", [False, True])
def test_a_branch_moves_to_its_head_and_starts_where_it_touches_its_stock_rail(seed, turned):
    """As in the raster: both lines are midway between the rails until the heads are a cell apart."""
    points, branch = turnout(seed=seed)
    stock = wavy_line(80, 0.0, 30)
    apart = branch[:, 1]
    seen = branch[apart > 0.03].copy()
    pull = np.clip(1 - (seen[:, 1] - 0.03) / 0.09, 0, 1)
    seen[:, 1] *= 1 - 0.5 * pull
    beside = np.interp(stock[:, 0], seen[:, 0], pull * seen[:, 1], left=0.0)
    stock[:, 1] += np.where(stock[:, 0] < seen[0, 0], 0.0, beside)
    vertex = int(np.argmin(np.abs(stock[:, 0] - seen[0, 0])))
    seen[0] = stock[vertex]
    ends = np.array([[0, 1], [3, 2] if turned else [2, 3]])
    nodes = np.array([stock[0], stock[-1], seen[0], seen[-1]])
    network = LineNetwork((stock, seen[::-1] if turned else seen), nodes, ends, np.array([[2, 0, vertex]]))
    refined = refine(network, points, WIDTH)
    through, leaving = refined.lines
    assert np.abs(through[:, 1]).max() < 0.012
    assert rms(through[:, 1]) < 0.002
    off = leaving[:, 1] - np.interp(leaving[:, 0], branch[:, 0], branch[:, 1], left=0.0)
    assert np.abs(off).max() < 0.012
    assert rms(off) < 0.0025
    toe = leaving[-1 if turned else 0]
    (node, line, at), *_ = refined.passes.tolist()
    np.testing.assert_array_equal(toe, refined.nodes[node])
    np.testing.assert_array_equal(toe, refined.lines[line][at])
    assert abs(toe[0] - 30.0) < 3.0


def test_lines_that_cross_keep_crossing_in_one_place():
    stock, other = wavy_line(80, 0.0, 30), wavy_line(80, 0.0, 30)
    other[:, 1] = (other[:, 0] - 40) / 9
    crossing = along_line(head(80, 150, seed=1), other)
    lines = stock + [0.0, 0.006], other + [0.0, -0.006]
    nodes = np.array([line[end] for line in lines for end in (0, -1)] + [lines[0][400]])
    network = LineNetwork(lines, nodes, np.array([[0, 1], [2, 3]]), np.array([[4, 0, 400], [4, 1, 400]]))
    refined = refine(network, cloud(head(80, 150), crossing), WIDTH)
    for line, true in zip(refined.lines, (stock, other)):
        assert np.abs(line[:, 1] - np.interp(line[:, 0], *true.T)).max() < 0.008
    for node, line, vertex in refined.passes.tolist():
        np.testing.assert_array_equal(refined.lines[line][vertex], refined.nodes[node])
    assert np.hypot(*(refined.nodes[4] - [40.0, 0.0])) < 0.05


@pytest.mark.parametrize("radius", [150.0, np.inf])
def test_free_ends_follow_the_rail_although_the_raster_curls(radius):
    true = wavy_line(40, 0.0, 20)
    true[:, 1] = true[:, 0] ** 2 / (2 * radius)
    points = along_line(head(40, 150), true)[:, :3]
    points = points[points[:, 0] < 30]
    line = true[true[:, 0] < 30.05].copy()
    line[:, 1] += 0.02 * np.clip(1 - (30 - line[:, 0]) / 0.4, 0, 1)
    refined = refine(network_of(line), cloud(points), WIDTH).lines[0]
    off = refined[:, 1] - np.interp(refined[:, 0], *true.T)
    assert np.abs(off[-8:]).max() < 0.006


def test_dirt_next_to_covered_rails_does_not_draw_the_line():
    points = head(80, 150)
    xyz = points[(points[:, 0] < 30) | (points[:, 0] > 45)]
    dirt = head(15, 200, seed=4, width=0.045, low_share=0.0) + [30.0, 0.066, -0.035]
    x = np.arange(0, 80.05, 0.1)
    drawn = np.column_stack([x, np.interp(x, [29, 31, 44, 46], [0, 0.066, 0.066, 0])])
    (refined,) = refine(network_of(drawn), cloud(xyz, dirt), WIDTH).lines
    assert np.abs(refined[:, 1]).max() < 0.015


def blended_head(length, density, footprint=0.05, seed=0):
    """Points of a head in beams as wide as the head: those that reach beyond it also see the ballast, 0.17 m below."""
    random = np.random.default_rng(seed)
    count = int(length * density)
    x, across = random.uniform(0, length, count), random.uniform(-0.06, 0.06, count)
    beyond = np.clip((np.abs(across) + footprint / 2 - WIDTH / 2) / footprint, 0, 1)
    xyz = np.column_stack([x, across, -0.17 * beyond]) + random.normal(0, [0, 0.003, 0.012], (count, 3))
    return xyz[xyz[:, 2] > -0.08]


@pytest.mark.parametrize(("density", "seed"), [(12, 1), (25, 2), (100, 3)])
def test_heads_in_wide_beams_have_their_axis_in_the_middle_of_their_points(density, seed):
    line = wavy_line(80, 0.010, 60) + [0.0, 0.008]
    refined = refine(network_of(line), cloud(blended_head(80, density, seed=seed)), WIDTH).lines[0]
    assert rms(line[:, 1]) > 0.010
    assert rms(refined[:, 1]) < 0.05 / np.sqrt(density)
    assert abs(refined[:, 1].mean()) < 0.003


def test_a_line_on_one_face_moves_onto_the_axis():
    face = head(60, 150, low_share=1.0, noise=0.003)
    outer = face[(face[:, 2] < -0.004)]
    corner = head(60, 60, low_share=0.0, noise=0.003, seed=5)
    turn = np.random.default_rng(6).uniform(np.pi / 4, np.pi / 2, len(corner))
    corner[:, 1] = 0.023 + 0.013 * np.sin(turn) + np.random.default_rng(7).normal(0, 0.003, len(corner))
    corner[:, 2] = 0.013 * np.cos(turn) - 0.014 + np.random.default_rng(8).normal(0, 0.003, len(corner))
    outer = outer[outer[:, 2] < -0.013]
    (refined,) = refine(network_of(wavy_line(60, 0.005, 30) + [0.0, 0.034]), cloud(outer, corner), WIDTH).lines
    assert rms(refined[:, 1]) < 0.003


@pytest.mark.parametrize("height_m", [1.4, 2.6])
def test_lines_that_refine_moved_are_settled(height_m):
    """A head seen from the side: another run moves its line by a fraction of its standard error."""
    curve = trace([Element(60.0)])
    track = Track(curve, GAUGE + WIDTH)
    scanner = Scanner(noise_m=0.005, face_share=1.0, left_m=4.5, height_m=height_m, half_range_m=25.0)
    points = scan(track.railhead(-1), WIDTH, track.centerline, scanner, np.random.RandomState(2))
    line = wavy_line(60, 0.0, 30) + [0.0, 0.02 - track.spacing_m / 2]
    refined = refine(network_of(line), cloud(points), WIDTH)
    assert abs(np.mean(refined.lines[0][:, 1]) + track.spacing_m / 2) < 0.0003
    again = refine(refined, cloud(points), WIDTH)
    assert abs(np.mean(again.lines[0][:, 1] - np.interp(again.lines[0][:, 0], *refined.lines[0].T))) < 0.0003
