import numpy as np
import pytest
from rail_extract.core.heads.branch_starts import slide_branches
from rail_extract.core.vectorize.network import LineNetwork

WIDTH, TOE, LENGTH = 0.072, 30.0, 80.0


def network(offset, node_at, hand=1, turned=False, stock_turned=False):
    """Stock rail along the x axis and a branch `offset(x - TOE)` beside it, joined by force at `node_at`."""
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


@pytest.mark.parametrize("radius", [190.0, 1200.0])
@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("stock_turned", [False, True])
def test_a_branch_on_an_arc_begins_where_the_arc_touches(radius, hand, turned, stock_turned):
    late = TOE + np.sqrt(2 * radius * 0.04)
    slid = slide_branches(network(lambda x: x**2 / (2 * radius), late, hand, turned, stock_turned), WIDTH, 0.5 * WIDTH)
    branch = slid.lines[1][::-1] if turned else slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.06)
    true = hand * np.clip(branch[:, 0] - TOE, 0, None) ** 2 / (2 * radius)
    assert np.abs(branch[:, 1] - true).max() < 0.0005
    ((node, line, vertex),) = slid.passes.tolist()
    np.testing.assert_array_equal(slid.lines[line][vertex], branch[0])
    np.testing.assert_array_equal(slid.nodes[node], branch[0])
    assert slid.degrees().tolist().count(3) == 1


def test_a_branch_that_began_too_early_begins_later():
    slid = slide_branches(network(lambda x: np.clip(x, 0, None) ** 2 / 600, 22.0), WIDTH, 0.5 * WIDTH)
    assert slid.lines[1][0, 0] == pytest.approx(TOE, abs=0.06)


@pytest.mark.parametrize("angle", [1 / 30, 1 / 60])
@pytest.mark.parametrize("turned", [False, True])
def test_a_straight_blade_begins_at_its_point(angle, turned):
    """A straight American switch: an angle at the point, the closure curve behind the heel."""

    def offset(x):
        heel = 0.16 / angle
        return angle * x + np.clip(x - heel, 0, None) ** 2 / 600

    slid = slide_branches(network(offset, TOE - 2.8, 1, turned), WIDTH, 0.5 * WIDTH)
    branch = slid.lines[1][::-1] if turned else slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.3)
    assert np.abs(branch[:, 1] - offset(branch[:, 0] - TOE)).max() < 0.01


@pytest.mark.parametrize("offset", [lambda x: x / 3, lambda x: 0.5 + 0 * x, lambda x: 0.05 - x / 2000])
def test_lines_that_do_not_part_on_an_arc_stay(offset):
    before = network(offset, TOE)
    after = slide_branches(before, WIDTH, 0.5 * WIDTH)
    for one, other in zip(before.lines, after.lines):
        np.testing.assert_array_equal(one, other)


def test_other_lines_still_meet_the_branch_that_was_given_a_new_start():
    before = network(lambda x: x**2 / 600, TOE + np.sqrt(600 * 0.04))
    third = before.lines[1][200] + np.array([[0.0, 0.0], [0.0, 5.0]])
    nodes = np.concatenate([before.nodes, third])
    ends, passes = np.array([*before.ends, [4, 5]]), np.array([*before.passes, [4, 1, 200]])
    after = slide_branches(LineNetwork((*before.lines, third), nodes, ends, passes), WIDTH, 0.5 * WIDTH)
    assert len(after.lines[1]) > len(before.lines[1])
    for node, line, vertex in after.passes.tolist():
        np.testing.assert_array_equal(after.lines[line][vertex], after.nodes[node])
    np.testing.assert_array_equal(after.nodes[after.ends[2, 0]], third[0])
