"""Stations abreast of each other on parallel rails, and the most common spacing."""

import pytest
from built import rails_of, tracks
from rail_extract.core.progress import Progress, Recording
from rail_extract.core.tracks.parallels import find_parallels, most_common_spacing, widths_by_gauge
from rail_extract.laboratory.curves import Element, trace, transition_curve

GAUGES = ((1.435, 0.072), (1.0, 0.066))
WIDE, NARROW = (sum(one) for one in GAUGES)

STRAIGHT = trace([Element(60.0)], heading=0.7)
CURVED = trace(transition_curve(30, 40, 60, 1 / 300), heading=2.0)


@pytest.mark.parametrize("spacing", [1.0619, 1.507, 1.592, 1.743])
def test_most_common_spacing_is_measured_to_the_millimetre(spacing):
    rails = rails_of(*tracks(CURVED, 0.0, 4.2, spacing=spacing))
    assert most_common_spacing(rails, 3.0) == pytest.approx(spacing, abs=1e-3)


def test_a_crowd_of_lines_is_left_out_with_a_warning():
    heard, track = Recording(Progress()), tracks(STRAIGHT, 0.0)
    copies = [trace([Element(20.0)]).xy + [200.0, 0.0]] * 40
    parallels = find_parallels(rails_of(*track, *copies), progress=heard)
    assert set(zip(parallels.a, parallels.b)) == {(0, 1)}
    assert heard.warnings == (
        "More than 25 lines are within 1 m of each other on 820 m of their length, which is not paired: remove copies "
        "of lines.",
    )
    assert not len(find_parallels(rails_of(*copies)).a)


@pytest.mark.parametrize(
    ("lefts", "widths"),
    [
        ([0.0, WIDE, 8.0, 8.0 + NARROW], [0.072, 0.072, 0.066, 0.066]),
        ([0.0, NARROW, WIDE], [0.072, 0.066, 0.072]),  # the first one is common to both tracks
        ([0.0, 5.0], [0.072, 0.072]),
        ([0.0, NARROW + 0.02, 5.0], [0.066, 0.066, 0.072]),
        ([], []),
    ],
)
def test_each_rail_has_the_width_of_its_track(lefts, widths):
    assert widths_by_gauge(rails_of(*([[0.0, left], [20.0, left]] for left in lefts)), GAUGES, 0.05).tolist() == widths
