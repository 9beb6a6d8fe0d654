"""Lines moved to the middles of their heads, and branches to where they touch their stock rails."""

import numpy as np
import pytest
from built import check_meeting, cloud_of, network_of, rms
from rail_extract.core.heads.refinement import refine, slide_branches
from rail_extract.core.lines.network import LineNetwork
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072

TOE, LENGTH = 30.0, 80.0


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


@pytest.mark.parametrize(("density", "noise", "slope"), [(60, 0.005, 0.0), (120, 0.003, 0.1), (250, 0.005, 0.1)])
def test_lines_off_the_head_are_moved_to_its_axis(density, noise, slope):
    line = wavy_line(80, 0.015, 30) + [0.0, 0.003]
    refined = refine(network_of(line), cloud_of(head(80, density, noise, slope=slope)), WIDTH).lines[0]
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
    refined = refine(network_of(wavy_line(60, 0.0, 30) + [0.0, 0.003]), cloud_of(points), WIDTH).lines[0]
    assert abs(refined[:, 1].mean()) < 0.0012


@pytest.mark.parametrize("offset", [-0.05, -0.01, 0.0, 0.03, 0.06])
def test_a_line_moves_onto_points_that_all_have_one_offset(offset):
    exact = np.column_stack([np.linspace(0, 20, 500), np.full(500, offset), np.zeros(500)])
    refined = refine(network_of(wavy_line(20, 0.0, 30)), cloud_of(exact), WIDTH).lines[0]
    np.testing.assert_allclose(refined[:, 1], offset, atol=1e-6)


def test_lines_move_to_their_heads_and_still_meet():
    lines = [wavy_line(20, 0.0, 10) + [0.0, 0.01], wavy_line(20, 0.0, 10) + [20.0, 0.01], wavy_line(20, 0.0, 10)]
    lines[2] = lines[2] @ np.array([[0.9, 0.1], [-0.1, 0.9]]) + [20.0, 0.01]
    nodes = np.array([lines[0][0], lines[0][-1], lines[1][-1], lines[2][-1]])
    network = LineNetwork(tuple(lines), nodes, np.array([[0, 1], [1, 2], [1, 3]]))
    refined = refine(network, cloud_of(head(40, 150)), WIDTH)
    check_meeting(refined)
    assert np.abs(refined.nodes[[0, 2], 1]).max() < 0.004
    assert np.abs(refined.lines[0][:, 1]).max() < 0.008


def along_line(points, line):
    """Move points of a head on the x axis onto another line y(x)."""
    return points + np.column_stack([0 * points[:, 0], np.interp(points[:, 0], *line.T), 0 * points[:, 0]])


def test_lines_that_cross_keep_crossing_in_one_place():
    stock, other = wavy_line(80, 0.0, 30), wavy_line(80, 0.0, 30)
    other[:, 1] = (other[:, 0] - 40) / 9
    crossing = along_line(head(80, 150, seed=1), other)
    lines = stock + [0.0, 0.006], other + [0.0, -0.006]
    nodes = np.array([line[end] for line in lines for end in (0, -1)] + [lines[0][400]])
    network = LineNetwork(lines, nodes, np.array([[0, 1], [2, 3]]), np.array([[4, 0, 400], [4, 1, 400]]))
    refined = refine(network, cloud_of(head(80, 150), crossing), WIDTH)
    for line, true in zip(refined.lines, (stock, other)):
        assert np.abs(line[:, 1] - np.interp(line[:, 0], *true.T)).max() < 0.008
    check_meeting(refined)
    assert np.hypot(*(refined.nodes[4] - [40.0, 0.0])) < 0.05


@pytest.mark.parametrize("radius", [150.0, np.inf])
def test_free_ends_follow_the_rail_although_the_raster_curls(radius):
    true = wavy_line(40, 0.0, 20)
    true[:, 1] = true[:, 0] ** 2 / (2 * radius)
    points = along_line(head(40, 150), true)[:, :3]
    points = points[points[:, 0] < 30]
    line = true[true[:, 0] < 30.05].copy()
    line[:, 1] += 0.02 * np.clip(1 - (30 - line[:, 0]) / 0.4, 0, 1)
    refined = refine(network_of(line), cloud_of(points), WIDTH).lines[0]
    off = refined[:, 1] - np.interp(refined[:, 0], *true.T)
    assert np.abs(off[-8:]).max() < 0.006


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
    refined = refine(network_of(line), cloud_of(blended_head(80, density, seed=seed)), WIDTH).lines[0]
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
    (refined,) = refine(network_of(wavy_line(60, 0.005, 30) + [0.0, 0.034]), cloud_of(outer, corner), WIDTH).lines
    assert rms(refined[:, 1]) < 0.003


@pytest.mark.parametrize("height_m", [1.4, 2.6])
def test_lines_that_refine_moved_are_settled(height_m):
    """A head seen from the side: another run moves its line by a fraction of its standard error."""
    curve = trace([Element(60.0)])
    track = Track(curve, GAUGE + WIDTH)
    scanner = Scanner(noise_m=0.005, face_share=1.0, left_m=4.5, height_m=height_m, half_range_m=25.0)
    points = scan(track.railhead(-1), WIDTH, track.centerline, scanner, np.random.RandomState(2))
    line = wavy_line(60, 0.0, 30) + [0.0, 0.02 - track.spacing_m / 2]
    refined = refine(network_of(line), cloud_of(points), WIDTH)
    assert abs(np.mean(refined.lines[0][:, 1]) + track.spacing_m / 2) < 0.0003
    again = refine(refined, cloud_of(points), WIDTH)
    assert abs(np.mean(again.lines[0][:, 1] - np.interp(again.lines[0][:, 0], *refined.lines[0].T))) < 0.0003


def network(offset, node_at, hand=1, turned=False, stock_turned=False):
    """Stock rail along the x axis and a branch `offset(x - TOE)` from it, connected at `node_at` by force."""
    x = np.arange(0, LENGTH + 0.05, 0.1)
    stock = np.column_stack([x, np.zeros_like(x)])
    vertex = int(round(node_at / 0.1))
    beyond = x[vertex:]
    branch = np.column_stack([beyond, hand * offset(beyond - TOE)])
    branch[0] = stock[vertex]
    nodes = np.array([stock[0], stock[-1], branch[0], branch[-1]])
    ends = np.array([[1, 0] if stock_turned else [0, 1], [3, 2] if turned else [2, 3]])
    passes = np.array([[2, 0, len(stock) - 1 - vertex if stock_turned else vertex]])
    lines = stock[::-1] if stock_turned else stock, branch[::-1] if turned else branch
    return LineNetwork(lines, nodes, ends, passes)


def heads(offset, hand=1, density=100):
    """Points on the heads of a stock rail along the x axis and of a branch next to it, with 3 mm of noise."""
    rng = np.random.default_rng(5)
    x = rng.uniform(0, LENGTH, (2, int(density * LENGTH)))
    across = np.array([np.zeros_like(x[0]), np.where(x[1] > TOE, hand * offset(x[1] - TOE), 0.0)])
    y = across + rng.uniform(-0.5, 0.5, x.shape) * WIDTH
    y, z = y + rng.normal(0, 0.003, x.shape), rng.normal(0, 0.003, x.shape)
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    return points[np.argsort(points[:, 0])]


NO_POINTS = np.empty((0, 3))


@pytest.mark.parametrize("radius", [190.0, 1200.0])
@pytest.mark.parametrize(("hand", "turned", "stock_turned"), [(1, False, False), (-1, True, False), (1, True, True)])
def test_a_branch_on_an_arc_begins_where_the_arc_touches(radius, hand, turned, stock_turned):
    late = TOE + np.sqrt(2 * radius * 0.04)

    def offset(x):
        return x**2 / (2 * radius)

    before = network(offset, late, hand, turned, stock_turned)
    slid = slide_branches(before, heads(offset, hand), WIDTH)
    branch = slid.lines[1][::-1] if turned else slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.06)
    true = hand * np.clip(branch[:, 0] - TOE, 0, None) ** 2 / (2 * radius)
    assert np.abs(branch[:, 1] - true).max() < 0.0005
    check_meeting(slid)
    assert slid.degrees().tolist().count(3) == 1


def test_a_branch_in_a_blunt_cloud_is_led_back_from_where_its_ridge_is_alone():
    """Nearer to its stock rail, the line is drawn aside: in world 10652, 5 m of it were 5 cm off, where no rail was."""

    def drawn(x):
        apart = x**2 / 600
        return np.maximum(apart, 0.05 + 0.54 * apart)

    slid = slide_branches(network(drawn, TOE + 1.0), NO_POINTS, WIDTH, blunt=True)
    branch = slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.3)
    assert np.abs(branch[:, 1] - np.clip(branch[:, 0] - TOE, 0, None) ** 2 / 600).max() < 0.006


def test_other_lines_still_meet_the_branch_that_was_given_a_new_start():
    before = network(lambda x: x**2 / 600, TOE + np.sqrt(600 * 0.04))
    third = before.lines[1][200] + np.array([[0.0, 0.0], [0.0, 5.0]])
    nodes = np.concatenate([before.nodes, third])
    ends, passes = np.array([*before.ends, [4, 5]]), np.array([*before.passes, [4, 1, 200]])
    after = slide_branches(LineNetwork((*before.lines, third), nodes, ends, passes), NO_POINTS, WIDTH)
    assert len(after.lines[1]) > len(before.lines[1])
    check_meeting(after)
    np.testing.assert_array_equal(after.nodes[after.ends[2, 0]], third[0])
