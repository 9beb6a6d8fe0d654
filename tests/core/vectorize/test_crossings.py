"""Rails that cross, at flat frogs and where a flangeway cuts one leg off."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.crossings import resolve_crossings


def stairs(line):
    """Vertices of a line, rounded to half a cell of 40 mm."""
    return np.round(line / 0.02) * 0.02


@pytest.mark.parametrize("number", [9, 18.5, 26.5])
@pytest.mark.parametrize("heading", [0.0, 0.37, 0.9, -0.6])
def test_two_rails_cross_at_a_flat_frog_and_do_not_exchange(number, heading):
    shared_m, half = 0.09 * number / 2, np.arctan(1 / number) / 2
    turned = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    t = np.arange(shared_m, 40, 0.1)
    # Wing rails keep the strip wide: for the same length again, the middles of its halves are too close together.
    aside = t * np.tan(half) * np.clip(t / shared_m - 1, 0, 1)
    forks = np.array([[-shared_m, 0.0], [shared_m, 0.0]])
    legs = [np.column_stack([side * t, up * aside]) for side in (-1, 1) for up in (-1, 1)]
    lines = (*(stairs(leg @ turned) for leg in legs), forks @ turned)
    lines = tuple(np.concatenate([lines[4][[number // 2]], line]) for number, line in enumerate(lines[:4])) + lines[4:]
    nodes = np.concatenate([lines[4], *(line[-1:] for line in lines[:4])])
    network = resolve_crossings(LineNetwork(lines, nodes, np.array([[0, 2], [0, 3], [1, 4], [1, 5], [0, 1]])))
    assert len(network.lines) == 2
    for line in network.lines:
        x, y = turned @ line.T
        assert np.abs(np.abs(y) - np.abs(x) * np.tan(half)).max() < 0.06
        assert y[np.argmin(x)] * y[np.argmax(x)] < 0


@pytest.mark.parametrize("missing_m", [1.0, 3.0])
def test_rails_cross_at_a_frog_whose_flangeway_cuts_one_leg_off(missing_m):
    slope = np.arctan(1 / 9)
    way, other = np.array([1.0, 0.0]), np.array([np.cos(slope), np.sin(slope)])
    near, t = np.arange(0, 25, 0.1)[:, None], np.arange(missing_m, 25, 0.1)[:, None]
    fork = np.zeros((1, 2))
    shared = np.concatenate([fork, (missing_m / 2 + 0.1) * (way + other)[None] / 2, (t[1:] + 0.3) * other])
    lines = (np.concatenate([fork, -near[5:] * way]), np.concatenate([fork, -near[5:] * other]), shared, t * way)
    nodes = np.concatenate([fork, *(line[-1:] for line in lines), lines[3][:1]])
    network = resolve_crossings(LineNetwork(lines, nodes, np.array([[0, 1], [0, 2], [0, 3], [5, 4]])))
    assert len(network.lines) == 2
    for line in network.lines:
        off = [np.abs(line @ [-along[1], along[0]]).max() for along in (way, other)]
        assert min(off) < 0.02


def test_a_leg_belongs_to_one_crossing_only():
    """A rail that a flangeway cuts off and a gap interrupts has two free ends that could be the fourth leg."""
    slope = np.arctan(1 / 9)
    way, other = np.array([1.0, 0.0]), np.array([np.cos(slope), np.sin(slope)])
    fork = np.zeros((1, 2))
    arms = [np.concatenate([fork, -np.arange(0.5, 25, 0.1)[:, None] * along]) for along in (way, other)]
    shared = np.concatenate([fork, 0.6 * (way + other)[None] / 2, np.arange(1.4, 25, 0.1)[:, None] * other])
    near, far = (np.arange(start, end, 0.1)[:, None] * way for start, end in ((1.0, 8.0), (9.0, 25.0)))
    lines = (*arms, shared, near, far)
    nodes = np.concatenate([fork, *(line[-1:] for line in lines[:3]), near[[0, -1]], far[[0, -1]]])
    ends = np.array([[0, 1], [0, 2], [0, 3], [4, 5], [6, 7]])
    network = resolve_crossings(LineNetwork(lines, nodes, ends))
    spans = sorted(
        (round(line[:, 0].min(), 1), round(line[:, 0].max(), 1)) for line in network.lines if line[-1, 1] == 0
    )
    assert len(network.lines) == 3
    assert spans == [(-24.9, 7.9), (9.0, 24.9)]
