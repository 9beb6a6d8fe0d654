import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.centerlines import build_centerlines
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


def test_a_turnout_in_a_curve_forks_although_rails_are_not_exact():
    rails, toe, truth = turnout(FORM["500-1:12"], 1, 1.0, 0.1, (Element(120.0, 1 / 900, 1 / 900),), noise_m=0.001)
    through, side = by_rails(build_centerlines(rails, GAUGE, WIDTH))
    start = near_end(side, toe)
    assert np.hypot(*(start[:2] - toe)) < 2.0
    assert (through.xyz == start).all(axis=1).any()
    assert compare_lines([through.xyz, side.xyz], truth).lateral_p95_m < 0.005


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
