"""Lines that show where to search."""

import numpy as np
import pytest
from rail_extract.core.classify.guide import CONTEXT_M, Guide
from rail_extract.core.classify.lines import Marks, find_lines
from rail_extract.core.classify.pieces import links

SPACING, APART = 1.507, 4.2
BOX = (-20.0, -20.0, 20.0, 20.0)
MIDDLE = np.array([[-100.0, 0.0], [100.0, 0.0]])


def rails(*lefts, angle=0.0, length=30.0):
    """Lines of cells on straight rails through the origin, and the rail of each cell."""
    x = np.arange(-length / 2, length / 2, 0.08)
    xy = np.concatenate([np.column_stack([x, np.full(len(x), left)]) for left in lefts])
    cosine, sine = np.cos(angle), np.sin(angle)
    xy = xy @ np.array([[cosine, sine], [-sine, cosine]])
    return find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05), np.repeat(np.arange(len(lefts)), len(x))


def two_tracks():
    return rails(-SPACING / 2, SPACING / 2, APART - SPACING / 2, APART + SPACING / 2)


def kept(guide, lines, of):
    flag = guide.keeps(lines, links(lines), [SPACING], 0.05)
    return [float(flag[of == rail].mean()) for rail in np.unique(of)]


def test_places_are_near_the_box_only():
    guide = Guide.through([np.array([[-9000.0, 0.0], [9000.0, 0.0]]), MIDDLE + [0, 500]], 4.0, False, BOX)
    reach = 20.0 + 4.0 + CONTEXT_M
    assert guide.xy[:, 0].min() == pytest.approx(-reach, abs=0.25)
    assert guide.xy[:, 0].max() == pytest.approx(reach, abs=0.25)
    assert (guide.xy[:, 1] == 0).all()
    np.testing.assert_allclose(guide.along, np.tile([1.0, 0.0], (len(guide.xy), 1)), atol=1e-12)


def test_a_bend_of_the_guide_outside_of_the_box_is_cut_off():
    bent = np.array([[-10.0, 0.0], [10.0, 0.0], [10.0, 400.0], [200.0, 400.0], [200.0, 0.0], [25.0, 0.0]])
    guide = Guide.through([bent], 4.0, False, BOX)
    assert np.abs(guide.xy).max() <= 27.0


def test_points_are_searched_within_the_distance_and_their_context():
    guide = Guide.through([MIDDLE], 4.0, False, BOX)
    y = np.array([0.0, 3.9, -6.9, 7.1, -40.0])
    np.testing.assert_array_equal(guide.holds(np.column_stack([np.zeros(5), y])), [True, True, True, False, False])


def test_tracks_are_kept_as_a_whole():
    """The near rail of the second track is 3.4 m from the guide, but the middle of this track 4.2 m."""
    assert kept(Guide.through([MIDDLE], 4.0, False, BOX), *two_tracks()) == [1, 1, 0, 0]
    assert kept(Guide.through([MIDDLE], 4.4, False, BOX), *two_tracks()) == [1, 1, 1, 1]


def test_only_the_track_along_the_guide_is_kept():
    assert kept(Guide.through([MIDDLE + [0, 0.4]], 9.0, True, BOX), *two_tracks()) == [1, 1, 0, 0]
    assert kept(Guide.through([MIDDLE + [0, 0.6]], 9.0, True, BOX), *two_tracks()) == [0, 0, 0, 0]


def test_a_single_rail_counts_by_its_own_place():
    lines, of = rails(3.5, 8.0)
    assert kept(Guide.through([MIDDLE], 4.0, False, BOX), lines, of) == [1, 0]
    assert kept(Guide.through([MIDDLE + [0, 3.5]], 4.0, True, BOX), lines, of) == [0, 0]


@pytest.mark.parametrize(("angle", "crosses"), [(0.0, False), (0.2, False), (-0.2, False), (1.0, True), (-1.2, True)])
def test_rails_across_the_guide_are_noticed(angle, crosses):
    lines, _ = rails(-SPACING / 2, SPACING / 2, angle=angle, length=8.0)
    along, across = Guide.through([MIDDLE], 4.0, False, BOX).crosses(lines)
    assert along.all() == (not crosses) or not crosses
    assert across.any() == crosses
    assert not (along & across).any()


def test_nothing_is_kept_where_there_is_no_guide():
    guide = Guide.through([MIDDLE], 4.0, False, BOX).around(np.array([0.0, 1000.0]), 40.0)
    lines, of = two_tracks()
    assert kept(guide, lines, of) == [0, 0, 0, 0]
    assert not guide.holds(lines.axis).any()
    assert not np.any(guide.crosses(lines))


def test_a_square_sees_the_guide_from_its_own_corner():
    guide = Guide.through([MIDDLE], 4.0, False, BOX).around(np.array([-10.0, -5.0]), 40.0)
    assert (guide.xy[:, 1] == 5.0).all()
