"""Lines and figures from stations: where lines end, radius and gradient, and what a guide states."""

import numpy as np
import pytest
from rail_extract.core.airborne.fitting import HIDDEN, SEEN, TrackStations
from rail_extract.core.airborne.survey import GuideLine, gauge_of, joined_others, lines_of, track_of
from rail_extract.core.frame import LocalFrame

FRAME = LocalFrame(np.array([500_000.0, 5_500_000.0, 0.0]))
GUIDE = GuideLine(7, np.array([[0.0, 0.0], [400.0, 0.0]]), 1.0, "main line", "12")


def stations(seen, radius_m=400.0, grade=0.01):
    t = (np.arange(len(seen)) + 0.5) * 10.0
    turn = t / radius_m
    xy = radius_m * np.column_stack([np.sin(turn), 1 - np.cos(turn)])
    same = np.ones(len(t))
    reason = np.where(seen, SEEN, HIDDEN)
    return TrackStations(t, xy, 100 + grade * t, 0.1 * same, 0.01 * same, 0.004 * same, 9 * same, reason, same < 0)


def track(seen, **shape):
    return track_of(GUIDE, stations(np.array(seen, bool), **shape), 1.507, 0.17, FRAME)


def test_figures_are_those_of_the_curve():
    found = track([1] * 30)
    assert found.radius_m[10] == pytest.approx(400, rel=0.01)
    assert found.grade_pm[10] == pytest.approx(10, rel=0.01)
    assert found.cant_mm[0] == pytest.approx(150.7)
    assert found.xyz[3, 2] - found.bed_m[3] == pytest.approx(0.17)
    assert found.sigmaz_mm[0] == pytest.approx(np.hypot(30, 4))


def test_a_line_ends_where_its_track_is_not_seen_for_more_than_30_m():
    seen = [1] * 8 + [0] * 3 + [1] * 6 + [0] * 4 + [1] * 5 + [0] * 9 + [1] * 2
    (numbered,), lines = lines_of([track(seen)], 1435.0)
    assert [line.seen_m for line in lines] == [140.0, 50.0]
    assert [line.length_m for line in lines] == pytest.approx([170.0, 50.0], abs=0.1)
    assert numbered.track_id.tolist() == [1] * 17 + [0] * 4 + [2] * 5 + [0] * 11
    assert (lines[0].guide_id, lines[0].gauge_mm, lines[0].name, lines[0].ref) == (7, 1000.0, "main line", "12")
    assert lines[0].sigma_mm == pytest.approx(10.0)


def test_vertices_follow_the_curve():
    _, (line,) = lines_of([track([1] * 30)], 1435.0)
    off = np.hypot(line.xyz[:, 0], line.xyz[:, 1] - 400) - 400
    assert np.abs(off).max() < 0.003
    assert np.hypot(*np.diff(line.xyz[:, :2], axis=0).T).max() < 2.1


@pytest.mark.parametrize(
    ("text", "gauge_m"),
    [("1435", 1.435), ("1000;1435", 1.0), (1067, 1.067), ("broad", None), (None, None), ("4", None)],
)
def test_gauges_are_read_as_openstreetmap_states_them(text, gauge_m):
    assert gauge_of(text) == gauge_m


def test_places_beside_a_track_become_tracks():
    found = joined_others(np.array([[25.0, 4.1], [75.0, 4.3], [75.0, -4.0], [125.0, 4.2]]))
    assert [(one.first_m, one.last_m) for one in found] == [(25.0, 125.0), (75.0, 75.0)]
    assert found[0].left_m == pytest.approx(4.2, abs=0.05)
