"""The rails that rays from stations meet, up to the ends of a section."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.midline import Meeting, Side, at_gauge, bridged_steps, midway

LENGTH_M, ASIDE_M = 10.0, 0.75


def side(*ends):
    lines = [
        RailLine(np.array([[start, ASIDE_M, 0.1 * start], [end, ASIDE_M, 0.1 * end]], dtype=float), 1, 10, 9, 1, 1, 0)
        for start, end in ends
    ]
    return Side.of(lines, [(number, (0.0, end - start)) for number, (start, end) in enumerate(ends)], 0.0)


def meet(rails, *x):
    count = len(x)
    directions = np.tile([0.0, 1.0], (count, 1))
    return rails.meet(np.column_stack([x, np.zeros(count)]), directions, ASIDE_M)


def test_a_rail_is_met_all_along_and_a_segment_beyond_its_ends():
    places = [-0.15, -0.09, 0.0, 0.04, 5.03, 9.93, 9.99, 10.0, 10.09, 10.15]
    found = meet(side((0.0, LENGTH_M)), *places)
    known = np.isfinite(found.distance_m)
    assert known.tolist() == [False, *[True] * 8, False]
    assert found.distance_m[known] == pytest.approx(ASIDE_M)
    assert found.t[known] == pytest.approx(np.array(places)[known])
    assert found.height_m[known] == pytest.approx(0.1 * np.array(places)[known])


def test_no_ray_meets_the_gap_between_two_rails():
    found = meet(side((0.0, LENGTH_M), (LENGTH_M + 1, 2 * LENGTH_M)), 9.9, 10.5, 11.2)
    assert found.rail[[0, 2]].tolist() == [0, 1]
    assert np.isnan(found.distance_m[1])


NAN = np.nan


def meeting(distance_m, height_m=0.0, rail=0, t=None, paired=True):
    """Return a meeting of stations a metre apart; a rail that is not met has neither a height nor a chainage."""
    distance_m = np.array(distance_m)
    t = np.arange(len(distance_m), dtype=float) if t is None else np.array(t)
    columns = (np.broadcast_to(one, len(distance_m)) for one in (height_m, rail, paired))
    height_m, rail, paired = (np.array(one) for one in columns)
    unmet = np.isnan(distance_m)
    return Meeting(distance_m, np.where(unmet, NAN, height_m), rail, np.where(unmet, NAN, t), paired)


def test_the_middle_is_half_the_usual_spacing_from_a_rail_without_a_partner():
    x = np.arange(5.0)
    stations, normals = np.column_stack([x, np.full(5, 0.1)]), np.tile([0.0, 1.0], (5, 1))
    left = meeting([0.65, 0.65, NAN, 0.65, NAN], 0.10 + 0.01 * x)
    right = meeting([0.85, 0.85, 0.85, NAN, NAN], 0.04 + 0.01 * x)
    found = midway(stations, normals, left, right)
    expected = np.column_stack([x, np.zeros(5), 0.07 + 0.01 * x])[:4]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_rails_outside_their_sections_must_keep_the_gauge():
    left = meeting([0.74, 0.74, 0.80, 0.70, 0.80], paired=[True, True, True, True, False])
    right = meeting([0.75, 0.75, 0.75, 0.71, 0.75], paired=[True, False, False, False, True])
    kept_left, kept_right = at_gauge(left, right, 1.5, 0.04)
    assert np.isfinite(kept_left.distance_m).tolist() == [True, True, True, True, False]
    assert np.isfinite(kept_right.distance_m).tolist() == [True, True, False, False, True]
    assert (
        np.isnan(kept_right.t).tolist() == np.isnan(kept_right.height_m).tolist() == [False, False, True, True, False]
    )


def test_bridged_lengths_between_stations_are_gaps_and_rails_that_are_not_met():
    line = np.column_stack([np.arange(0, 11.0), np.zeros((11, 2))])
    gapped = RailLine(line, 1, 10, 9, 1, 1, 1.5, gaps=np.array([[2.5, 4.0]]))
    whole = RailLine(line, 2, 10, 9, 1, 1, 0)
    t = np.arange(0.0, 8.0)
    left = meeting(8 * [0.75], rail=0, t=t)
    right = meeting([0.75] * 5 + [NAN, NAN, 0.75], rail=[1] * 5 + [1, 0, 0], t=t)
    bridged = bridged_steps([gapped, whole], left, right, t)
    np.testing.assert_allclose(bridged, [0, 0, 0.5, 1.0, 0.5, 1.0, 0.5])
    np.testing.assert_allclose(bridged_steps([gapped, whole], left, left, 2 * t)[2:4], [0.5, 1.0])
    changing = meeting(3 * [0.75], rail=[1, 0, 0], t=[9.0, 5.0, 3.0])
    np.testing.assert_allclose(bridged_steps([gapped, whole], changing, changing, np.array([0, 1, 1.8])), [0.0, 0.8])


def test_sections_are_cut_with_margins_in_which_rails_are_not_paired():
    line = np.column_stack([np.arange(0, 21.0), np.zeros(21), np.arange(0, 2.1, 0.1)])
    rail = RailLine(line, 1, 10, 9, 1, 1, 0)
    cut = Side.of([rail, rail], [(1, (15.0, 5.0)), (0, (1.0, 4.0))], 2.0)
    assert cut.rail.tolist() == 141 * [1] + 61 * [0] and cut.section.tolist() == 141 * [0] + 61 * [1]
    np.testing.assert_allclose(cut.t, np.concatenate([np.linspace(3, 17, 141), np.linspace(0, 6, 61)]))
    np.testing.assert_allclose(cut.xyz[:, 0], cut.t)
    np.testing.assert_allclose(cut.xyz[:, 2], 0.1 * cut.t)
    inside = ((cut.section == 0) & (cut.t > 4.99) & (cut.t < 15.01)) | (
        (cut.section == 1) & (cut.t > 0.99) & (cut.t < 4.01)
    )
    assert np.count_nonzero(cut.paired != inside) <= 2  # chainages at the very ends are rounded
