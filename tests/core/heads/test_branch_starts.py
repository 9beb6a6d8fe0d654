import numpy as np
import pytest
from rail_extract.core.heads.branch_starts import _blade, _Parting, _power, _section, slide_branches
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.lines.parting import ARC, STRAIGHT

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
@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("stock_turned", [False, True])
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
    ((node, line, vertex),) = slid.passes.tolist()
    np.testing.assert_array_equal(slid.lines[line][vertex], branch[0])
    np.testing.assert_array_equal(slid.nodes[node], branch[0])
    assert slid.degrees().tolist().count(3) == 1


def test_a_branch_that_began_too_early_begins_later():
    before = network(lambda x: np.clip(x, 0, None) ** 2 / 600, 22.0)
    slid = slide_branches(before, NO_POINTS, WIDTH, 0.5 * WIDTH)
    assert slid.lines[1][0, 0] == pytest.approx(TOE, abs=0.06)


def straight_switch(angle):
    """An American switch: an angle at the point, the closure curve behind the heel."""
    return lambda x: angle * x + np.clip(x - 0.16 / angle, 0, None) ** 2 / 600


@pytest.mark.parametrize("angle", [1 / 30, 1 / 60])
@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sure", [1.3, 0.5])
def test_a_straight_blade_begins_at_its_point(angle, hand, turned, sure):
    offset = straight_switch(angle)
    slid = slide_branches(network(offset, TOE - 2.8, hand, turned), heads(offset, hand), WIDTH, sure * WIDTH)
    branch = slid.lines[1][::-1] if turned else slid.lines[1]
    assert branch[0, 0] == pytest.approx(TOE, abs=0.06)
    assert np.abs(branch[:, 1] - hand * offset(branch[:, 0] - TOE)).max() < 0.0005


def test_heads_wide_enough_to_hide_the_heel_are_no_obstacle():
    slid = slide_branches(network(straight_switch(1 / 30), TOE - 2.8), NO_POINTS, 0.125, 1.3 * 0.125)
    assert slid.degrees().tolist().count(3) == 1


def test_without_points_a_blade_is_taken_for_an_arc():
    offset = straight_switch(1 / 30)
    slid = slide_branches(network(offset, TOE - 2.8), NO_POINTS, WIDTH, 1.3 * WIDTH)
    assert slid.lines[1][0, 0] < TOE - 2.0


@pytest.mark.parametrize("offset", [lambda x: x / 3, lambda x: 0.5 + 0 * x, lambda x: 0.05 - x / 2000])
def test_lines_that_do_not_part_on_an_arc_stay(offset):
    before = network(offset, TOE)
    after = slide_branches(before, NO_POINTS, WIDTH, 0.5 * WIDTH)
    for one, other in zip(before.lines, after.lines):
        np.testing.assert_array_equal(one, other)


def test_other_lines_still_meet_the_branch_that_was_given_a_new_start():
    before = network(lambda x: x**2 / 600, TOE + np.sqrt(600 * 0.04))
    third = before.lines[1][200] + np.array([[0.0, 0.0], [0.0, 5.0]])
    nodes = np.concatenate([before.nodes, third])
    ends, passes = np.array([*before.ends, [4, 5]]), np.array([*before.passes, [4, 1, 200]])
    after = slide_branches(LineNetwork((*before.lines, third), nodes, ends, passes), NO_POINTS, WIDTH, 0.5 * WIDTH)
    assert len(after.lines[1]) > len(before.lines[1])
    for node, line, vertex in after.passes.tolist():
        np.testing.assert_array_equal(after.lines[line][vertex], after.nodes[node])
    np.testing.assert_array_equal(after.nodes[after.ends[2, 0]], third[0])


@pytest.mark.parametrize(
    ("apart", "section"),
    [
        ([0.02, 0.05, 0.11, 0.15, 0.21, 0.25, 0.15], (2, 5)),
        ([0.12, 0.09, 0.11, 0.15], (2, 4)),
        ([0.12, 0.15, 0.3, 0.02], (0, 2)),
        ([0.3, 0.12], (0, 0)),
    ],
)
def test_lines_part_between_the_last_place_too_near_and_the_first_too_far(apart, section):
    assert _section(np.array(apart), 0.1, 0.22) == section


@pytest.mark.parametrize(
    ("on_arc", "on_head", "power"), [(0, 19, ARC), (0, 20, STRAIGHT), (39, 100, STRAIGHT), (40, 100, ARC)]
)
def test_a_blade_is_straight_where_an_arc_would_have_its_head_and_there_are_few_points(on_arc, on_head, power):
    assert _power(np.array([on_arc, on_head])) == power


@pytest.mark.parametrize(("touch", "first"), [(5.0, 15.0), (15.0, 5.0)])
def test_a_blade_has_a_vertex_every_decimetre_and_leaves_along_its_law(touch, first):
    line = np.array([[0.0, 2.0], [20.0, 2.0]])
    for power in (STRAIGHT, ARC):
        blade = _blade(line, touch, first, -0.2, power)
        share = np.arange(1, 100) / 100
        np.testing.assert_allclose(blade, np.column_stack([touch + share * (first - touch), 2 - 0.2 * share**power]))
    assert len(_blade(line, touch, touch + 0.05, 0.1, ARC)) == 0


def test_a_straight_blade_is_fitted_up_to_its_heel():
    way = np.arange(5.0, 15.0, 0.1)
    apart = np.where(way < 10, 0.03 * (way - 5), 0.15 + 0.06 * (way - 10))
    parting = _Parting(0.0, 0, 1.0, way, apart, 1.0, 0)
    assert parting.law(STRAIGHT).touch == pytest.approx(5.0, abs=0.01)
    behind = _Parting(0.0, 0, 1.0, way[60:], apart[60:], 1.0, 0)
    assert behind.law(STRAIGHT).touch == pytest.approx(7.5, abs=0.01)
