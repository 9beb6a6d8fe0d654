"""Smoothed networks: lines that met still meet."""

import numpy as np
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.lines.network_smoothing import bend_through, smooth_network

SIGMA = 0.8


def circle(radius, count):
    angle = np.linspace(0, 2 * np.pi, count + 1)
    line = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    line[-1] = line[0]
    return line


def wavy(x, y, seed):
    return np.column_stack([x, y + 0.01 * np.random.default_rng(seed).normal(size=len(x))])


def turnout():
    """A through line whose vertex 200 is the node in which a 1:9 branch begins."""
    x = np.arange(0, 40, 0.1)
    through = wavy(x, 0 * x, 1)
    branch = wavy(x[200:], (x[200:] - x[200]) / 9, 2)
    branch[0] = through[200]
    nodes = np.array([through[0], through[-1], branch[0], branch[-1]])
    return LineNetwork((through, branch), nodes, np.array([[0, 1], [2, 3]]), np.array([[2, 0, 200]]))


def test_lines_of_a_network_still_meet_and_free_ends_stay():
    network = turnout()
    smoothed = smooth_network(network, SIGMA)
    for line, (start, end) in zip(smoothed.lines, smoothed.ends):
        np.testing.assert_array_equal(line[[0, -1]], smoothed.nodes[[start, end]])
    for node, line, vertex in smoothed.passes:
        np.testing.assert_array_equal(smoothed.lines[line][vertex], smoothed.nodes[node])
    np.testing.assert_array_equal(smoothed.nodes[[0, 1, 3]], network.nodes[[0, 1, 3]])
    np.testing.assert_array_equal(smoothed.ends, network.ends)


def test_a_loop_in_a_network_is_smoothed_across_its_seam():
    loop = circle(25, 4000)
    smoothed = smooth_network(LineNetwork((loop,), loop[:1], np.array([[0, 0]])), SIGMA)
    np.testing.assert_allclose(np.hypot(*smoothed.lines[0].T), 25, atol=1e-4)
    np.testing.assert_array_equal(smoothed.lines[0][0], smoothed.lines[0][-1])


def test_a_diamond_keeps_its_crossing_in_both_lines():
    x = np.arange(-20, 20.05, 0.1)
    lines = (wavy(x, x / 9, 5), wavy(x, -x / 9, 6))
    for line in lines:
        line[200] = 0
    nodes = np.array([line[i] for line in lines for i in (0, -1)] + [[0.0, 0.0]])
    network = LineNetwork(lines, nodes, np.array([[0, 1], [2, 3]]), np.array([[4, 0, 200], [4, 1, 200]]))
    smoothed = smooth_network(network, SIGMA)
    for node, line, vertex in smoothed.passes:
        np.testing.assert_array_equal(smoothed.lines[line][vertex], smoothed.nodes[node])
    assert np.hypot(*smoothed.nodes[4]) < 0.005


def test_bending_a_line_equals_one_dense_system():
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.05, 0.2, 4000))
    places = np.sort(rng.choice(len(t), 40, replace=False))
    line, targets = rng.normal(size=(len(t), 2)), rng.normal(size=(40, 2))

    def fading(d):
        return (1 + np.abs(d)) * np.exp(-np.abs(d))

    weights = np.linalg.solve(fading(t[places][:, None] - t[places]), targets - line[places])
    expected = line + fading(t[:, None] - t[places]) @ weights
    bend_through(line, t, places, targets)
    np.testing.assert_allclose(line, expected, atol=1e-9)
