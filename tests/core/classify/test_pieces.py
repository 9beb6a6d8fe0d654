"""Which pieces of line are long enough to be kept."""

import numpy as np
import pytest
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.pieces import links, long_enough


def line(*parts):
    """Cells, 8 cm apart, of the parts of a straight line from one place to another, metres."""
    along = np.concatenate([np.arange(first, last, 0.08) for first, last in parts])
    ones = np.ones(len(along))
    return Lines(np.column_stack([along, 0.0 * ones]), 0.15 * ones, 0.0 * ones, ones, ones, 1.0)


@pytest.mark.parametrize(("hidden_m", "kept"), [(1.2, True), (1.6, False)])
def test_wheels_do_not_divide_a_rail_without_a_partner(hidden_m, kept):
    """A train hides the other rail, and its wheels parts of this one."""
    lines = line((0.0, 2.0), (2.0 + hidden_m, 4.0 + hidden_m))
    nothing = np.zeros(len(lines.axis), dtype=bool)
    assert (long_enough(lines, links(lines), nothing, nothing, keep_single=True) == kept).all()
    assert not long_enough(lines, links(lines), nothing, nothing, keep_single=False).any()
