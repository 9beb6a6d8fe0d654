"""Which pieces of line are long enough to be kept."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.classify.lines import Lines, joined
from rail_extract.core.classify.pieces import links, long_enough, lower_than_beside, to_one_side


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


def along_course(course):
    """Cells, 8 cm apart, on a course to the left of 20 m of straight line, with its directions."""
    along = np.arange(0.0, 20.0, 0.08)
    ones, left = np.ones(len(along)), course(along)
    theta = np.arctan(np.gradient(left, along)) % np.pi
    return Lines(np.column_stack([along, left]), 0.15 * ones, theta, ones, ones, 1.0)


@pytest.mark.parametrize(("apart_m", "lower"), [(0.11, True), (0.16, True), (0.24, False)])
def test_what_is_lower_beside_a_rail_is_no_head(apart_m, lower):
    """In world 13104, the ends of sleepers 0.15 m beside a rail were at gauge from a kerb."""
    rail, beside = along_course(lambda t: 0.0 * t), along_course(lambda t: apart_m + 0.0 * t)
    both = joined(rail, replace(beside, height=beside.height - 0.09))
    found = lower_than_beside(both, 0.045)
    assert not found[: len(rail.axis)].any()
    assert found[len(rail.axis) :].all() == lower


@pytest.mark.parametrize("turned", [0.4, 2.8])
def test_vectors_across_an_arc_point_to_one_side_of_it(turned):
    """In world 14170, grooves of an arc of 27 m had their heads on the wrong side after it had turned by 90 degrees."""
    angle = np.random.RandomState(5).permutation(np.arange(0.0, turned, 0.08 / 25.0))
    away, ones = np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(len(angle))
    lines = Lines(25.0 * away, 0.15 * ones, (angle + np.pi / 2) % np.pi, ones, ones, 1.0)
    outwards = np.einsum("ij,ij->i", to_one_side(lines, np.zeros(len(angle), dtype=int)), away)
    assert np.abs(outwards).min() > 0.99
    assert (outwards > 0).all() or (outwards < 0).all()
