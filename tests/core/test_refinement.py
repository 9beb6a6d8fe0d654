import numpy as np
import pytest
from rail_extract.core.points import LocalFrame, RailPoints
from rail_extract.core.polyline import project
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.refinement import refine
from rail_extract.core.smoothing import smooth_network
from rail_extract.core.synthetic.curves import Element, trace
from rail_extract.core.synthetic.scanner import Scanner, scan
from rail_extract.core.synthetic.tracks import Track
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.network import LineNetwork

GAUGE, WIDTH = 1.435, 0.072


def network_of(*lines):
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.array([line[end] for line in lines for end in (0, -1)])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def wavy_line(length, amplitude, period, step=0.1):
    x = np.arange(0, length + step / 2, step)
    return np.column_stack([x, amplitude * np.sin(2 * np.pi * x / period)])


def head(length, density, noise=0.004, lopsided=0.0, low_share=0.1, slope=0.0, seed=0, width=WIDTH):
    """Points of a head whose axis is the x axis; `lopsided` moves density from its right to its left half."""
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
def test_lines_beside_the_head_are_led_to_its_axis(density, noise, slope):
    line = wavy_line(80, 0.015, 30) + [0.0, 0.003]
    refined = refine(network_of(line), cloud(head(80, density, noise, slope=slope)), WIDTH).lines[0]
    assert rms(line[:, 1]) > 0.01
    assert rms(refined[:, 1]) < 0.0025
    assert abs(refined[:, 1].mean()) < 0.002


@pytest.mark.parametrize("seed", range(4))
def test_a_line_on_the_axis_stays_there(seed):
    line = wavy_line(80, 0.0, 30)
    refined = refine(network_of(line), cloud(head(80, 120, seed=seed)), WIDTH).lines[0]
    assert rms(refined[:, 1]) < 0.002
    assert np.abs(refined[:, 1]).max() < 0.006


@pytest.mark.parametrize("lopsided", [0.1, 0.3, 0.6])
def test_a_fuller_side_does_not_pull(lopsided):
    refined = refine(network_of(wavy_line(80, 0.0, 30)), cloud(head(80, 120, lopsided=lopsided)), WIDTH).lines[0]
    assert rms(refined[:, 1]) < 0.003


@pytest.mark.parametrize("elements", [[Element(80.0)], [Element(80.0, 1 / 600, 1 / 600)]])
@pytest.mark.parametrize("left_m", [0.0, 4.0, 8.0])
def test_scanned_heads_are_met_from_whichever_side_they_are_seen(elements, left_m):
    """Along the grid, where the raster errs most; a scanner abreast, or beside and above of the track."""
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


def test_gaps_and_shadows_on_the_head_do_not_lead_astray():
    xyz = head(80, 150)
    xyz = xyz[(xyz[:, 0] < 20) | (xyz[:, 0] > 24)]
    shadow = (xyz[:, 0] > 40) & (xyz[:, 0] < 60) & (xyz[:, 1] > 0.0)
    line = wavy_line(80, 0.0, 30) + [0.0, 0.004]
    refined = refine(network_of(line), cloud(xyz[~shadow]), WIDTH).lines[0]
    assert np.abs(refined[:, 1]).max() < 0.008


def test_weeds_beside_the_head_do_not_pull():
    random = np.random.default_rng(3)
    weeds = np.column_stack(
        [random.uniform(0, 80, 600), random.uniform(0.03, 0.09, 600), random.uniform(-0.1, 0.1, 600)]
    )
    refined = refine(network_of(wavy_line(80, 0.0, 30)), cloud(head(80, 120), weeds), WIDTH).lines[0]
    assert rms(refined[:, 1]) < 0.002


@pytest.mark.parametrize("count", [0, 30])
def test_lines_with_hardly_a_point_stay_as_they_are(count):
    line = wavy_line(40, 0.01, 20)
    refined = refine(network_of(line), cloud(head(40, 100)[:count]), WIDTH).lines[0]
    np.testing.assert_array_equal(refined, line)


def test_lines_stay_where_several_meet_and_nodes_move_with_free_ends():
    lines = [wavy_line(20, 0.0, 10) + [0.0, 0.01], wavy_line(20, 0.0, 10) + [20.0, 0.01], wavy_line(20, 0.0, 10)]
    lines[2] = lines[2] @ np.array([[0.9, 0.1], [-0.1, 0.9]]) + [20.0, 0.01]
    nodes = np.array([lines[0][0], lines[0][-1], lines[1][-1], lines[2][-1]])
    network = LineNetwork(tuple(lines), nodes, np.array([[0, 1], [1, 2], [1, 3]]))
    refined = refine(network, cloud(head(40, 150)), WIDTH)
    np.testing.assert_array_equal(refined.nodes[1], nodes[1])
    for number, (start, end) in enumerate(network.ends):
        np.testing.assert_array_equal(refined.lines[number][0], refined.nodes[start])
        np.testing.assert_array_equal(refined.lines[number][-1], refined.nodes[end])
    assert abs(refined.nodes[0][1]) < 0.004
    assert abs(refined.nodes[2][1]) < 0.004
