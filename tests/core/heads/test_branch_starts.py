import numpy as np
import pytest
from built import check_meeting
from rail_extract.core.heads.branch_starts import slide_branches
from rail_extract.core.lines.network import LineNetwork

WIDTH, TOE, LENGTH = 0.072, 30.0, 80.0


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
    slid = slide_branches(before, heads(offset, hand), WIDTH, 0.5 * WIDTH)
    branch = slid.lines[1][::-1] if turned else slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.06)
    true = hand * np.clip(branch[:, 0] - TOE, 0, None) ** 2 / (2 * radius)
    assert np.abs(branch[:, 1] - true).max() < 0.0005
    check_meeting(slid)
    assert slid.degrees().tolist().count(3) == 1


def test_other_lines_still_meet_the_branch_that_was_given_a_new_start():
    before = network(lambda x: x**2 / 600, TOE + np.sqrt(600 * 0.04))
    third = before.lines[1][200] + np.array([[0.0, 0.0], [0.0, 5.0]])
    nodes = np.concatenate([before.nodes, third])
    ends, passes = np.array([*before.ends, [4, 5]]), np.array([*before.passes, [4, 1, 200]])
    after = slide_branches(LineNetwork((*before.lines, third), nodes, ends, passes), NO_POINTS, WIDTH, 0.5 * WIDTH)
    assert len(after.lines[1]) > len(before.lines[1])
    check_meeting(after)
    np.testing.assert_array_equal(after.nodes[after.ends[2, 0]], third[0])
