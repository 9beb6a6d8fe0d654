"""Lines past guard rails, weeds and kinks."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.repairs import cut_kinks, straighten_blots
from rail_extract.laboratory.curves import Element, trace

HEAD_M = 0.072


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


def test_a_rail_is_straight_past_a_guard_rail_that_widens_its_strip():
    line = along_x(0, 30)
    beside = (line[:, 0] > 13) & (line[:, 0] < 17)
    line[beside, 1] = 0.058
    network = straighten_blots(loose(line), line, np.where(beside, 0.22, 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.002
    np.testing.assert_allclose(network.lengths(), 29.9, atol=0.01)


def test_a_swerve_to_a_guard_rail_and_back_is_undone_without_its_width():
    line = along_x(0, 30)
    line[:, 1] = 0.116 * np.clip(1 - (np.abs(line[:, 0] - 15) - 1.5) / 0.7, 0, 1)
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.002


def test_a_gentle_swerve_to_a_guard_rail_is_undone():
    line = along_x(0, 30)
    line[:, 1] = 0.09 * np.exp(-(((line[:, 0] - 15) / 0.9) ** 2))
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.03


@pytest.mark.parametrize(("height_m", "straightened"), [(0.047, False), (0.053, True)])
def test_a_swerve_counts_from_five_centimetres(height_m, straightened):
    line = along_x(0, 30)
    line[:, 1] = height_m * np.cos(np.clip((line[:, 0] - 15) / 1.5, -1, 1) * np.pi / 2) ** 2
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    if straightened:
        assert np.abs(network.lines[0][:, 1]).max() < 0.03
    else:
        np.testing.assert_array_equal(network.lines[0], line)


def test_the_sharpest_tram_curve_is_left_alone():
    line = trace([Element(10), Element(20, 1 / 18, 1 / 18)]).xy[::5]
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert len(cut_kinks(network).lines) == 1
    np.testing.assert_array_equal(network.lines[0], line)


def test_a_line_that_turns_back_is_cut_in_two():
    line = np.concatenate([along_x(0, 10), along_x(0, 10, 0.3)[::-1]])
    network = cut_kinks(loose(line))
    assert len(network.lines) == 2
    assert (network.degrees() == 1).all()
    assert network.lengths() == pytest.approx([9.3, 9.3], abs=0.3)
