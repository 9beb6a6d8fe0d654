"""Lines that meet in nodes, edited: they still meet, and at the same places."""

import numpy as np
import pytest
from built import check_meeting
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.ends import cut_back
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import length_along


def comb(counts, met):
    """Lines along x, a metre between vertices; at the vertices `met` of line i others end that come from above."""
    rows = [np.column_stack([np.arange(float(count)), np.full(count, 100.0 * i)]) for i, count in enumerate(counts)]
    places = [(line, vertex) for line, own in enumerate(met) for vertex in own]
    teeth = [rows[line][vertex] + np.array([[0.0, 0.0], [0.0, 3.0], [0.0, 9.0]]) for line, vertex in places]
    lines = (*rows, *teeth)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    passes = [(2 * (len(rows) + number), *place) for number, place in enumerate(places)]
    ends = np.arange(2 * len(lines)).reshape(-1, 2)
    return LineNetwork(lines, nodes, ends, np.array(passes, dtype=np.int64).reshape(-1, 3))


@st.composite
def combs(draw):
    counts = draw(st.lists(st.integers(6, 14), min_size=1, max_size=3))
    return comb(counts, [sorted(draw(st.sets(st.integers(1, count - 2), max_size=4))) for count in counts])


def passed_places(network):
    """Places where lines pass nodes, by line."""
    return {(line, *network.nodes[node].tolist()) for node, line, _ in network.passes.tolist()}


def new_vertices(count):
    return np.random.default_rng(count).uniform(-1, 1, (count, 2))


@given(combs(), st.data())
@settings(max_examples=100, deadline=None)
def test_a_new_end_is_a_node_and_passes_that_stay_keep_their_places(network, data):
    end = data.draw(st.integers(0, 2 * len(network.lines) - 1))
    line = network.from_end(end)
    replaced = data.draw(st.integers(0, len(line) - 2))
    vertices = new_vertices(data.draw(st.integers(1, 5)))
    edited = network.with_end(end, vertices, replaced)
    check_meeting(edited)
    np.testing.assert_array_equal(edited.from_end(end), np.concatenate([vertices, line[replaced:]]))
    np.testing.assert_array_equal(edited.nodes[edited.ends.flat[end]], vertices[0])
    lost = {(end // 2, *place) for place in line[:replaced].tolist()}
    assert passed_places(edited) == passed_places(network) - lost
    for number, (one, other) in enumerate(zip(network.lines, edited.lines)):
        if number != end // 2:
            np.testing.assert_array_equal(one, other)


@given(combs(), st.data())
@settings(max_examples=100, deadline=None)
def test_ends_that_are_cut_back_are_free_and_shorter_by_just_that(network, data):
    ends = data.draw(st.sets(st.integers(0, 2 * len(network.lines) - 1), max_size=4))
    cuts_m = {end: data.draw(st.floats(0.0, 2.4)) for end in ends}
    cut = network.cut_back(cuts_m)
    check_meeting(cut)
    for number, line in enumerate(network.lines):
        expected = line
        for end in ends & {2 * number, 2 * number + 1}:
            from_end = cut_back(expected[::-1] if end % 2 else expected, cuts_m[end])
            expected = from_end[::-1] if end % 2 else from_end
            assert cuts_m[end] == 0 or cut.degrees()[cut.ends.flat[end]] == 1
        np.testing.assert_array_equal(cut.lines[number], expected)
        length = length_along(line)[-1] - sum(cuts_m.get(end, 0.0) for end in (2 * number, 2 * number + 1))
        assert cut.lengths()[number] == pytest.approx(length)


def parted(network):
    lines, ends, partner = [], [], {}
    for number, (line, own) in enumerate(zip(network.lines, network.ends.tolist())):
        passes = network.passes[network.passes[:, 1] == number]
        passes = passes[np.argsort(passes[:, 2], kind="stable")]
        vertices, nodes = [0, *passes[:, 2].tolist(), len(line) - 1], [own[0], *passes[:, 0].tolist(), own[1]]
        for piece in range(len(nodes) - 1):
            if piece:
                partner[2 * len(lines)], partner[2 * len(lines) - 1] = 2 * len(lines) - 1, 2 * len(lines)
            lines.append(line[vertices[piece] : vertices[piece + 1] + 1])
            ends.append(nodes[piece : piece + 2])
    return LineNetwork(tuple(lines), network.nodes, np.array(ends, dtype=np.int64).reshape(-1, 2)), partner


@given(combs())
@settings(max_examples=40, deadline=None)
def test_lines_parted_at_all_nodes_that_they_pass_weld_to_what_they_were(network):
    pieces, partner = parted(network)
    check_meeting(pieces)
    assert len(pieces.lines) == len(network.lines) + len(network.passes)
    again = pieces.weld(partner)
    check_meeting(again)
    assert passed_places(again) == passed_places(network)
    for one, other in zip(network.lines, again.lines):
        np.testing.assert_array_equal(one, other)
