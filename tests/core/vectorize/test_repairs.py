"""Lines past guard rails, weeds and kinks."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.repairs import _turns, cut_kinks, straighten_blots
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


@pytest.mark.parametrize(("turn_deg", "count"), [(22, 1), (29, 2)])
def test_lines_are_cut_where_they_turn_by_25_degrees_and_half_a_metre_on_either_side_is_dropped(turn_deg, count):
    before, ways = along_x(0, 10.05), np.arange(0.1, 10, 0.1)
    turn = np.radians(turn_deg)
    line = np.concatenate([before, before[-1] + ways[:, None] * [np.cos(turn), np.sin(turn)]])
    lengths = cut_kinks(loose(line)).lengths()
    assert len(lengths) == count
    assert lengths.sum() == pytest.approx(19.9 if count == 1 else 18.9, abs=0.25)


def test_the_angle_between_parts_of_a_line_is_that_of_their_chords():
    line = np.concatenate([along_x(0, 5.05), 5.0 + np.arange(0.1, 5, 0.1)[:, None] * [0.8, 0.6] - [0, 5.0]])
    turns = _turns(line, 1.0)
    assert turns[50] == pytest.approx(np.arctan2(0.6, 0.8)) and turns[45] == pytest.approx(np.arctan2(0.3, 0.9))
    assert not turns[:41].any() and not turns[-10:].any() and turns[55] == pytest.approx(turns[45])
    assert not _turns(line[:20], 1.0).any()


@pytest.mark.parametrize(("wide_m", "straightened"), [(3.5, True), (8.5, False)])
@pytest.mark.parametrize("heads", [1.9, 2.1])
def test_strips_of_two_heads_up_to_eight_metres_long_are_redrawn(wide_m, heads, straightened):
    line = along_x(0, 40)
    beside = np.abs(line[:, 0] - 20) < wide_m / 2
    line[beside, 1] = 0.03  # too little to be a swerve
    network = straighten_blots(loose(line), line, np.where(beside, heads * HEAD_M, 0.11), HEAD_M)
    redrawn = np.abs(network.lines[0][:, 1]).max() < 0.01
    assert redrawn == (straightened and heads > 2)
