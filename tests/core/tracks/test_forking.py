import numpy as np
import pytest
from rail_extract.core.lines.thinning import thin
from rail_extract.core.rails import Centerline, RailLine
from rail_extract.core.tracks.centerlines import build_centerlines
from rail_extract.core.tracks.forking import (
    MAX_APART_M,
    _angle,
    _extended,
    _near_ends,
    _seen_from,
    _with_bridged,
    _with_vertex,
)
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.rasters.turnouts import FORMS, branch
from rail_extract.laboratory.ruler.lines import compare_lines
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072
TOE_M = 30.0
STRAIGHT = (Element(120.0),)
FORM = {form.name: form for form in FORMS}


def rails_of(*lines):
    fields = {"class_code": 10, "points": 0, "resid_mm": 0.0, "sigma_mm": 0.0, "bridged_m": 0.0}
    return [RailLine(np.asarray(line), number, **fields) for number, line in enumerate(lines, start=1)]


def turnout(form, hand, heading, shown_m, main=STRAIGHT, noise_m=0.0):
    """Rails of a turnout, the branch's from where they are `shown_m` off the stock rails, and both centerlines."""
    through = trace(main, heading=heading)
    side = branch(through, TOE_M, form, hand, 30.0)
    tracks = [Track(curve, GAUGE + WIDTH, 0.003 * curve.chainage) for curve in (through, side)]
    tracks[1] = Track(side, GAUGE + WIDTH, 0.003 * (TOE_M + side.chainage))
    first = int(np.sqrt(2 * shown_m * form.radius_m) / side.step_m)
    rails = [*tracks[0].rails(), *(tracks[1].railhead(end).top[first::5] for end in (1, -1))]
    random = np.random.default_rng(0)
    waves = [noise_m * np.sin(np.arange(len(rail)) / 20 + random.uniform(0, 6)) for rail in rails]
    rails = [rail + np.column_stack([0 * wave, wave, 0 * wave]) for rail, wave in zip(rails, waves)]
    return rails_of(*rails), through.xy[int(TOE_M / through.step_m)], [track.centerline for track in tracks]


def near_end(line, place):
    """The end of a line that is nearer to a place."""
    ends = line.xyz[[0, -1]]
    return ends[np.argmin(np.hypot(*(ends[:, :2] - place).T))]


def by_rails(lines):
    """Centerlines in the order of their first rails."""
    return sorted(lines, key=lambda line: min(line.left_ids + line.right_ids))


@pytest.mark.parametrize("name", ["190-1:9", "300-1:9", "2500-1:26.5"])
@pytest.mark.parametrize(("hand", "heading"), [(1, 0.3), (-1, 0.3 + np.pi)])
@pytest.mark.parametrize("shown_m", [0.0, 0.075, 0.2])
def test_branches_leave_the_through_track_at_the_toe(name, hand, heading, shown_m):
    rails, toe, truth = turnout(FORM[name], hand, heading, shown_m)
    through, side = by_rails(build_centerlines(rails, GAUGE, WIDTH))
    start = near_end(side, toe)
    assert np.hypot(*(start[:2] - toe)) < 0.05
    assert (through.xyz == start).all(axis=1).sum() == 1
    result = compare_lines([through.xyz, side.xyz], truth)
    assert min(result.completeness, result.correctness) > 0.995
    assert result.lateral_p95_m < 0.002
    assert result.height_rmse_m < 0.001
    assert side.bridged_m == pytest.approx(np.sqrt(2 * shown_m * FORM[name].radius_m), abs=0.3)


@pytest.mark.parametrize("name", ["#6", "#10", "#20"])
@pytest.mark.parametrize("shown_m", [0.02, 0.05])
def test_branches_of_straight_switches_leave_at_an_angle(name, shown_m):
    """If part of the straight is visible; a parabola would extend up to 4 m past the toe."""
    rails, toe, truth = turnout(FORM[name], 1, 0.3, shown_m)
    through, side = by_rails(build_centerlines(rails, GAUGE, WIDTH))
    start = near_end(side, toe)
    assert np.hypot(*(start[:2] - toe)) < 1.0
    assert (through.xyz == start).all(axis=1).sum() == 1
    result = compare_lines([through.xyz, side.xyz], truth)
    assert result.lateral_p95_m < 0.004
    assert result.length_ratio < 1.005


@pytest.mark.parametrize("early_m", [0.5, 2.0])
def test_branches_that_begin_on_the_through_track_lose_the_shared_part(early_m):
    rails, toe, truth = turnout(FORM["300-1:9"], 1, 0.3, 0.0)
    lines = [rail.xyz for rail in rails]
    for through, side in ((0, 2), (1, 3)):
        away = np.hypot(*(lines[through][:, :2] - lines[side][0, :2]).T)
        shared = (away < early_m) & (
            lines[through] @ [np.cos(0.3), np.sin(0.3), 0] < lines[side][0] @ [np.cos(0.3), np.sin(0.3), 0]
        )
        lines[side] = np.concatenate([lines[through][shared], lines[side]])
    through, side = by_rails(build_centerlines(rails_of(*lines), GAUGE, WIDTH))
    start = near_end(side, toe)
    assert np.hypot(*(start[:2] - toe)) < 0.5
    assert (through.xyz == start).all(axis=1).any()
    assert compare_lines([through.xyz, side.xyz], truth).length_ratio < 1.004


def test_a_turnout_in_a_curve_forks_although_rails_are_not_exact():
    rails, toe, truth = turnout(FORM["500-1:12"], 1, 1.0, 0.1, (Element(120.0, 1 / 900, 1 / 900),), noise_m=0.001)
    through, side = by_rails(build_centerlines(rails, GAUGE, WIDTH))
    start = near_end(side, toe)
    assert np.hypot(*(start[:2] - toe)) < 2.0
    assert (through.xyz == start).all(axis=1).any()
    assert compare_lines([through.xyz, side.xyz], truth).lateral_p95_m < 0.005


def test_forks_stay_connected_when_lines_are_thinned():
    rails, toe, _ = turnout(FORM["300-1:9"], 1, 0.3, 0.1)
    through, side = thin(by_rails(build_centerlines(rails, GAUGE, WIDTH)), 0.002, 0.002)
    assert len(through.xyz) < 20
    assert (through.xyz == near_end(side, toe)).all(axis=1).any()


def test_a_crossover_forks_at_both_ends():
    form = FORM["190-1:9"]
    lower = trace([Element(100.0)])
    half = [Element(form.arc_m, 1 / form.radius_m, 1 / form.radius_m)]
    back = [Element(form.arc_m, -1 / form.radius_m, -1 / form.radius_m)]
    link = trace([*half, Element(20.0), *back], tuple(lower.xy[1000]), 0.0)
    upper = trace([Element(100.0)], (0.0, link.xy[-1, 1]), 0.0)
    tracks = [Track(curve, GAUGE + WIDTH) for curve in (lower, upper, link)]
    shown = slice(300, -300)  # without 6 m at either end, where the branch is up to 95 mm from the track
    rails = [*tracks[0].rails(), *tracks[1].rails(), *(tracks[2].railhead(side).top[shown] for side in (1, -1))]
    first, second, crossover = by_rails(build_centerlines(rails_of(*rails), GAUGE, WIDTH))
    for track, place in ((first, link.xy[0]), (second, link.xy[-1])):
        end = near_end(crossover, place)
        assert np.hypot(*(end[:2] - place)) < 0.05
        assert (track.xyz == end).all(axis=1).any()
    assert compare_lines([crossover.xyz], [tracks[2].centerline]).lateral_p95_m < 0.002


def test_tracks_that_only_run_or_end_next_to_others_do_not_fork():
    long, short = trace([Element(60.0)]), trace([Element(20.0)], (20.0, 0.0))
    for left_m in (0.25, 4.0):  # dual gauge at one side, and a double track
        lines = [track.rails() for track in (Track(long, GAUGE + WIDTH), Track(short, GAUGE + WIDTH, left_m=left_m))]
        found = build_centerlines(rails_of(*lines[0], *lines[1]), GAUGE, WIDTH)
        assert sorted(round(line.length_m) for line in found) == [20, 60]


def test_a_track_that_continues_another_at_a_distance_does_not_fork():
    first, second = trace([Element(30.0)]), trace([Element(30.0)], (30.0, 0.15))
    rails = [rail for curve in (first, second) for rail in Track(curve, GAUGE + WIDTH).rails()]
    found = build_centerlines(rails_of(*rails), GAUGE, WIDTH)
    assert sum(line.length_m for line in found) == pytest.approx(60.0, abs=0.5)


@pytest.mark.parametrize(("first_m", "is_near"), [(MAX_APART_M - 0.005, True), (MAX_APART_M + 0.005, False)])
def test_a_branch_is_only_extended_if_its_very_end_is_near_the_track(first_m, is_near):
    """A branch on an arc of 300 m, whose second vertex is further away than the limit in both cases."""
    x = np.arange(0.0, 60.0, 0.5)
    through = np.column_stack([x - 20, np.zeros((len(x), 2))])
    way = x + np.sqrt(600 * first_m)
    branch = np.column_stack([x, way**2 / 600, np.zeros(len(x))])
    longer = _extended(branch, through)
    assert (longer is not None) == is_near
    if is_near:
        assert longer[0] == pytest.approx([-np.sqrt(600 * first_m), 0, 0], abs=0.05)


@pytest.mark.parametrize(("bend", "touch"), [(0.001, -5.0), (-0.001, -np.inf)])
def test_a_straight_switch_has_a_heel_behind_which_the_branch_bends_outward(bend, touch):
    s = np.arange(0.0, 30.0, 0.5)
    off = 0.02 * (s + 5) + bend * np.maximum(s - 8, 0) ** 2
    law, misfit_m = _angle(s, off, 8.0)
    assert law.touch == pytest.approx(touch)
    assert misfit_m.max() < 1e-9


@pytest.mark.parametrize(("at_m", "is_extended"), [(None, True), (2.0, True), (11.0, False)])
def test_a_branch_that_leaves_its_arc_late_is_not_extended(at_m, is_extended):
    """An arc of 300 m that lies off by 5 cm for 2 m; it is followed as far as 0.8 m from the track."""
    x = np.arange(0.0, 60.0, 0.5)
    through = np.column_stack([x - 20, np.zeros((len(x), 2))])
    branch = np.column_stack([x, (x + 8) ** 2 / 600, np.zeros(len(x))])
    if at_m is not None:
        branch[(x >= at_m) & (x < at_m + 2), 1] += 0.05
    assert (_extended(branch, through) is not None) == is_extended


@pytest.mark.parametrize(("at_m", "first_m", "last_m"), [(0.0, 0, 149), (250.2, 101, 400), (499.0, 350, 500)])
def test_a_line_is_seen_to_150_m_from_a_place(at_m, first_m, last_m):
    line = np.column_stack([np.arange(0, 501.0), np.zeros((501, 2))])
    seen = _seen_from(np.array([at_m, -1.0, 0.0]), line)
    assert line[seen][[0, -1], 0].tolist() == [first_m, last_m]
    returning = np.concatenate([line, line[::-1] + [0, 5.0, 0]])
    assert _seen_from(np.array([0.0, -1.0, 0.0]), returning) == slice(0, 150)
    assert _seen_from(line[3], line[:5]) == slice(0, 5)


@pytest.mark.parametrize(("off_m", "count"), [(0.0018, 5), (0.0022, 6)])
def test_a_vertex_within_two_millimetres_moves_to_the_place_of_the_fork(off_m, count):
    line = np.column_stack([np.arange(5.0), np.zeros(5), np.arange(5.0)])
    place = np.array([2.0 + off_m, 0.0, 7.0])
    forked = _with_vertex(line, place)
    assert len(forked) == count and line[2].tolist() == [2.0, 0.0, 2.0]
    np.testing.assert_array_equal(forked[count - 3], place)
    np.testing.assert_array_equal(
        np.delete(forked, count - 3, axis=0), np.delete(line, 2, axis=0) if count == 5 else line
    )


def centerline(*places):
    return Centerline(np.column_stack([places, np.zeros(len(places))]), 1, 10, (1,), (2,), 1435.0, 1.0, 0.0, 0.0, 0.5)


def test_ends_are_near_the_line_whose_stations_are_nearest():
    through, other = centerline((0.0, 0.0), (50.0, 0.0)), centerline((0.0, -0.5), (50.0, -0.5))
    branch = centerline((20.2, 0.25), (40.0, 5.0))
    assert list(_near_ends([through, branch])) == [(1, 0, 0)]
    turned = centerline((40.0, 5.0), (20.2, 0.25))
    assert (1, -1, 0) in list(_near_ends([through, turned, other]))
    assert list(_near_ends([through, centerline((20.2, 0.82), (40.0, 5.0))])) == []
    assert list(_near_ends([through])) == []


def test_an_extension_is_bridged_and_a_shorter_branch_is_not():
    branch = centerline((10.0, 0.0), (30.0, 0.0))
    assert _with_bridged(branch, np.array([[4.0, 0, 0], [30.0, 0, 0]])).bridged_m == pytest.approx(branch.bridged_m + 6)
    assert _with_bridged(branch, np.array([[14.0, 0, 0], [30.0, 0, 0]])).bridged_m == branch.bridged_m
