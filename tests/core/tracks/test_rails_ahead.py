"""Rails beyond the ends of sections, in either direction of the rail."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.pairing import RailPair
from rail_extract.core.tracks.rails_ahead import rails_ahead, runs_on

LENGTH_M = 30.0


def rails():
    """A rail to the east with y 0, and one to the west with y 1.5."""
    lines = [[[0.0, 0.0, 0.0], [LENGTH_M, 0.0, 0.0]], [[LENGTH_M, 1.5, 0.0], [0.0, 1.5, 0.0]]]
    return [RailLine(np.array(line), number, 10, 0, 1.0, 1.0, 0.0) for number, line in enumerate(lines)]


PAIR = RailPair(left=1, right=0, left_span=(20.0, 8.0), right_span=(10.0, 22.0))
"""A section to the east, from x 10 to 22."""


@pytest.mark.parametrize(("end", "beyond_m", "x", "left_y"), [(0, 10.0, 7.0, -0.5), (1, 8.0, 25.0, 0.5)])
def test_both_rails_go_on_outwards(end, beyond_m, x, left_y):
    left, right = rails_ahead(rails(), PAIR, end)
    assert [left.beyond_m, right.beyond_m] == pytest.approx([beyond_m, beyond_m])
    ahead_m = np.array([0.0, 3.0])
    assert right.at(ahead_m)[1] == pytest.approx([x, 0.0])
    assert left.at(ahead_m)[1] == pytest.approx([x, 1.5])
    assert right.at(ahead_m, 0.5)[1] == pytest.approx([x, left_y])


@pytest.mark.parametrize(
    ("span", "following", "does"),
    [
        ((0, 5), (7, 9), True),
        ((0, 5), (4, 9), True),
        ((0, 5), (9, 7), False),
        ((5, 9), (0, 4), False),
        ((9, 5), (4, 0), True),
        ((9, 5), (9, 5), False),
        ((0, 5), (5, 9), True),
        ((0, 5), (1, 5), False),
    ],
)
def test_a_rail_runs_on_only_forwards(span, following, does):
    assert runs_on(span, following) == does
