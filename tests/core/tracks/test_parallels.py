"""Stations abreast of each other on parallel rails, and the most common spacing."""

import numpy as np
import pytest
from rail_extract.core.progress import Progress, Recording
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.parallels import find_parallels, most_common_spacing
from rail_extract.laboratory.curves import Element, trace, transition_curve

SPACING = 1.507
STRAIGHT = trace([Element(60.0)], heading=0.7)
CURVED = trace(transition_curve(30, 40, 60, 1 / 300), heading=2.0)


def rails_of(*lines):
    return [
        RailLine(np.column_stack([line, np.zeros(len(line))]), number, 10, 0, 0.0, 0.0, 0.0)
        for number, line in enumerate(lines, start=1)
    ]


def beside(curve, *offsets):
    return [curve.offset(offset)[::10] for offset in offsets]


def tracks(curve, *axes, spacing=SPACING):
    return beside(curve, *(axis + side * spacing / 2 for axis in axes for side in (1, -1)))


def test_parallels_have_side_direction_and_place():
    left, right = tracks(STRAIGHT, 0.0)
    parallels = find_parallels(rails_of(left, right[::-1]))
    assert set(parallels.a) == {0}
    assert set(parallels.b) == {1}
    np.testing.assert_allclose(parallels.left_m, -SPACING, atol=1e-9)
    assert not parallels.same.any()
    np.testing.assert_allclose(parallels.t_a + parallels.t_b, 60.0, atol=0.3)


@pytest.mark.parametrize("spacing", [1.0619, 1.507, 1.592, 1.743])
def test_most_common_spacing_is_measured_to_the_millimetre(spacing):
    rails = rails_of(*tracks(CURVED, 0.0, 4.2, spacing=spacing))
    assert most_common_spacing(rails, 3.0) == pytest.approx(spacing, abs=1e-3)


def test_rails_far_apart_or_crossing_have_no_spacing():
    assert most_common_spacing(rails_of(*beside(STRAIGHT, 0.0, 4.0)), 3.0) is None
    assert most_common_spacing(rails_of(STRAIGHT.xy, trace([Element(40.0)], heading=2.0).xy), 3.0) is None
    assert most_common_spacing(rails_of(STRAIGHT.xy), 3.0) is None


def test_a_crowd_of_lines_is_left_out_with_a_warning():
    heard, track = Recording(Progress()), tracks(STRAIGHT, 0.0)
    copies = [trace([Element(20.0)]).xy + [200.0, 0.0]] * 40
    parallels = find_parallels(rails_of(*track, *copies), progress=heard)
    assert set(zip(parallels.a, parallels.b)) == {(0, 1)}
    assert heard.warnings == (
        "More than 25 lines lie within 1 m of each other on 820 m of their length, which is not paired: remove copies "
        "of lines.",
    )
    assert not len(find_parallels(rails_of(*copies)).a)
