"""Tracks with rails cut as in an extraction: one centerline per track, whatever the order of the rails."""

from dataclasses import dataclass

import numpy as np
import pytest
from built import rails_of
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.parameters import Parameters
from rail_extract.core.polyline import length_along
from rail_extract.core.tracks.centerlines import build_centerlines
from rail_extract.laboratory.curves import Curve, Element, trace
from rail_extract.laboratory.rasters.turnouts import FORMS, branch
from rail_extract.laboratory.ruler.lines import compare_lines
from rail_extract.laboratory.scenes.tracks import Track

STANDARD = Parameters(1.435, 0.072)
SPACING = 1.435 + 0.072
CURVED = trace([Element(120.0, 1 / 400, 1 / 400)], heading=0.4)
TRAM = trace([Element(40.0, 1 / 30, 1 / 30)], heading=1.0)
LONGEST_GAP_M = 5.0

slow = settings(max_examples=8, deadline=None, derandomize=True)


def between(line, start_m, end_m):
    """Return the part of a line between two plan chainages."""
    along = length_along(line[:, :2])
    inner = along[(along > start_m) & (along < end_m)]
    t = np.concatenate([[start_m], inner, [min(end_m, along[-1])]])
    return np.column_stack([np.interp(t, along, column) for column in line.T])


def without(line, *gaps):
    """Cut gaps, (start, end) in order, out of a line."""
    starts = [0.0, *(end for _, end in gaps)]
    ends = [*(start for start, _ in gaps), length_along(line[:, :2])[-1]]
    return [between(line, start, end) for start, end in zip(starts, ends) if end - start > 0.5]


def build(*lines, progress=None):
    return build_centerlines(rails_of(*lines), STANDARD, **({"progress": progress} if progress else {}))


def checked(lines, truth, count=None):
    """Assert that the lines are the true tracks, each once."""
    assert len(lines) == (len(truth) if count is None else count)
    result = compare_lines([line.xyz for line in lines], truth)
    assert result.completeness > 0.98
    assert result.correctness > 0.995
    assert result.length_ratio < 1.01
    assert result.lateral_p95_m < 0.005
    return result


@dataclass(frozen=True)
class Switch:
    """True lines of a turnout: rails of the through track and of the branch, (left, right) each, and centerlines."""

    through: tuple
    side: tuple
    middles: tuple
    toe_m: float
    hand: int

    @classmethod
    def lay(cls, name, hand, main):
        form = next(form for form in FORMS if form.name == name)
        toe_m = 30.0
        tracks = [Track(curve, SPACING) for curve in (main, branch(main, toe_m, form, hand, 25.0))]
        rails = [tuple(track.railhead(side).top[::2] for side in (1, -1)) for track in tracks]
        return cls(*rails, tuple(track.centerline for track in tracks), toe_m, hand)

    def shown(self, rail, off_m):
        """The part of a branch's rail at least `off_m` from its stock rail, and the chainage where it starts."""
        stock = between(self.through[rail], self.toe_m - 1.0, np.inf)
        away = np.min(np.hypot(*(self.side[rail][::5, None, :2] - stock[None, ::5, :2]).transpose(2, 0, 1)), axis=1)
        first = 5 * int(np.argmax(away > off_m))
        return self.side[rail][first:], float(length_along(self.side[rail][:, :2])[first])

    def fork(self):
        return self.middles[1][0, :2]


SWITCHES = [
    Switch.lay(name, hand, trace([Element(110.0, bend, bend)], heading=heading))
    for name, hand, bend, heading in (("190-1:9", 1, 0.0, 0.3), ("500-1:12", -1, 1 / 1200, 2.5), ("#8", 1, 0.0, -1.2))
]


@pytest.mark.parametrize("curve", [CURVED, TRAM])
@pytest.mark.parametrize("hidden", [1, -1])
def test_one_rail_continues_a_track_where_the_other_is_hidden(curve, hidden):
    laid = Track(curve, SPACING)
    gap = (8.0, 33.0)
    lines = {side: without(rail, gap) if side == hidden else [rail] for side, rail in zip((1, -1), laid.rails())}
    (line,) = found = build(*lines[1], *lines[-1])
    result = checked(found, [laid.centerline])
    assert result.lateral_p95_m < 0.002
    assert line.bridged_m == pytest.approx(gap[1] - gap[0], rel=0.06)
    assert line.gaugesd_mm < 0.5


@pytest.mark.parametrize("gap_m", [2.0, 5.0])
@pytest.mark.parametrize("kept_m", [-1.0, 0.0, 2.5, 4.0])
def test_rails_with_alternating_gaps_give_one_centerline(gap_m, kept_m):
    """Where both rails exist over less than a section of track, or never, one rail at a time continues the track."""
    laid = Track(CURVED, SPACING)
    left, right = laid.rails()
    found = build(*without(left, (50, 50 + gap_m)), *without(right, (50 + gap_m + kept_m, 50 + 2 * gap_m + kept_m)))
    (line,) = found
    checked(found, [laid.centerline])
    assert line.bridged_m == pytest.approx(2 * gap_m + min(kept_m, 0.0), abs=0.6)


@pytest.mark.parametrize("switch", SWITCHES)
@pytest.mark.parametrize("swapped", [(1,), (-1,), (1, -1)])
def test_stock_rails_that_continue_into_the_branch_change_no_centerline(switch, swapped):
    """The rail of the through track then starts behind the toe."""
    lines = []
    for rail, side in enumerate((1, -1)):
        own, chainage = switch.shown(rail, 0.08)
        if side in swapped:
            lines.append(np.concatenate([between(switch.through[rail], 0.0, switch.toe_m - 0.1), switch.side[rail]]))
            lines.append(between(switch.through[rail], switch.toe_m + chainage, np.inf))
        else:
            lines += [own, switch.through[rail]]
    found = build(*lines)
    checked(found, switch.middles)
    assert all(line.gaugesd_mm < 8.0 for line in found)


def gapped(line, steps):
    """Cut gaps out of a line, given by their distance from the previous gap and their length."""
    end, gaps = 3.0, []
    for distance, length in steps:
        gaps.append((end + distance, end + distance + length))
        end = gaps[-1][1]
    last = length_along(line[:, :2])[-1] - 12.0
    return without(line, *(gap for gap in gaps if gap[1] < last))


def broken(random, rail):
    """Cut up to four gaps of half a metre to 5 m out of a rail."""
    return gapped(rail, random.uniform((3.0, 0.5), (30.0, LONGEST_GAP_M), (random.integers(5), 2)))


def test_turnouts_of_broken_rails_give_two_centerlines_that_fork():
    """One in forty does not: where gaps hide two rails just behind the toe, the wrong pieces may be joined."""
    right = 0
    for seed in range(24):
        random = np.random.default_rng(seed)
        switch = SWITCHES[seed % len(SWITCHES)]
        rails = [*switch.through, *(switch.shown(rail, random.uniform(0.05, 0.2))[0] for rail in (0, 1))]
        found = build(*(piece for rail in rails for piece in broken(random, rail)))
        result = compare_lines([line.xyz for line in found], switch.middles)
        ends = [line.xyz[end] for line in found for end in (0, -1)]
        fork = min(ends, key=lambda end: np.hypot(*(end[:2] - switch.fork())))
        forks = sum((line.xyz == fork).all(axis=1).any() for line in found)
        right += (len(found), forks, result.completeness > 0.98, result.lateral_p95_m < 0.005) == (2, 2, True, True)
    assert right >= 22


def yard():
    """Rails of a turnout and of the double track next to it, some of them broken."""
    switch = SWITCHES[0]
    curve = trace([Element(110.0)], heading=0.3)
    second = Track(Curve(curve.offset(-4.5), curve.heading, curve.curvature, curve.step_m), SPACING)
    lines = [*switch.through, *(switch.shown(rail, 0.1)[0] for rail in (0, 1)), *second.rails()]
    return rails_of(*without(lines[0], (60.0, 63.0)), *lines[1:5], *without(lines[5], (20.0, 24.0), (70.0, 71.0)))


@slow
@given(st.permutations(range(9)), st.lists(st.booleans(), min_size=9, max_size=9))
def test_order_and_directions_of_rails_change_nothing(order, turned):
    rails = yard()
    expected = build_centerlines(rails, STANDARD)
    found = build_centerlines([rails[n].reversed() if turned[n] else rails[n] for n in order], STANDARD)
    assert [line.left_ids + line.right_ids for line in found] == [line.left_ids + line.right_ids for line in expected]
    for line, other in zip(found, expected):
        np.testing.assert_allclose(line.xyz, other.xyz, atol=1e-9)
        assert line.gauge_mm == pytest.approx(other.gauge_mm, abs=1e-6)
        assert line.bridged_m == pytest.approx(other.bridged_m, abs=1e-6)


def assert_same_lines(found, expected, apart_m):
    assert len(found) == len(expected)
    result = compare_lines(found, expected)
    assert min(result.completeness, result.correctness) > 0.9999
    assert result.lateral_p95_m < apart_m
    assert result.length_ratio == pytest.approx(1.0, abs=1e-3)


@slow
@given(st.lists(st.floats(5.0, 100.0), min_size=1, max_size=3), st.integers(0, 8))
def test_cutting_a_rail_changes_nothing(places, number):
    rails = yard()
    expected = build_centerlines(rails, STANDARD)
    line = rails[number].xyz
    last = length_along(line[:, :2])[-1]
    borders = [0.0, *sorted({place for place in places if place < last - 1}), last]
    pieces = [between(line, start, end) for start, end in zip(borders, borders[1:])]
    found = build(*(rail.xyz for rail in rails[:number] + rails[number + 1 :]), *pieces)
    assert_same_lines([line.xyz for line in found], [line.xyz for line in expected], 5e-4)


@slow
@given(st.floats(-np.pi, np.pi), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_centerlines_rotate_and_move_with_their_rails(angle, east, north):
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    rails = yard()
    expected = [line.xyz @ turn + [east, north, 0] for line in build_centerlines(rails, STANDARD)]
    found = build(*(rail.xyz @ turn + [east, north, 0] for rail in rails))
    assert_same_lines([line.xyz for line in found], expected, 2e-4)
