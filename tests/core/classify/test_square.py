"""A square as a whole: what is labelled, and that order, place and cutting do not matter."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.classify.settings import Settings
from rail_extract.core.classify.square import classify_square
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, TOP_M, flat, rough, turned, with_bar, with_track

GAUGE, WIDTH = 1.435, 0.072
SPACING = GAUGE + WIDTH
SETTINGS = Settings((GAUGE,), WIDTH)


def inner(xyz, size=6.0):
    return (np.abs(xyz[:, :2] - MIDDLE) < size / 2 - 0.3).all(axis=1)


def ballasted(rng, angle=0.3, size=8.0, per_m2=2500):
    xyz, on = with_track(flat(size, rng=rng, per_m2=per_m2), GAUGE, WIDTH, angle)
    return rough(xyz, rng), on


def at_grazing_angle(rng, ground):
    """A track of which one face of each rail is seen, and a share of the ground; the points, and which are on rails."""
    xyz, on = ballasted(rng, size=12.0, per_m2=12_000)
    left = turned(xyz, 0.3)[1]
    face = on & (left - np.sign(left) * SPACING / 2 < -0.015)
    seen = face | (rng.random_sample(len(xyz)) < ground)
    return xyz[seen], on[seen]


def side_of_head(rng, count, half_m, top_m, left_m, behind_m, angle=0.0):
    """The face of a head, 4 cm high, and what is below it and `behind_m` to the left, `half_m` from the middle."""
    along, below = rng.uniform(-half_m, half_m, count), rng.uniform(0.0, top_m, count)
    left = left_m + np.where(below < 0.04, 0.0, behind_m)
    x, y = along * np.cos(angle) - left * np.sin(angle), along * np.sin(angle) + left * np.cos(angle)
    return np.column_stack([np.column_stack([x, y]) + MIDDLE, top_m - below])


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, 2.0])
def test_two_rails_are_labelled(angle):
    xyz, on = ballasted(np.random.RandomState(1), angle)
    found = classify_square(xyz, SETTINGS).rail
    assert (found & on)[inner(xyz, 8)].sum() / on[inner(xyz, 8)].sum() > 0.99
    assert (found & on).sum() / found.sum() > 0.99


@pytest.mark.parametrize("slope", [0.1, 0.4, 1.2])
def test_a_vault_covers_no_rail(slope):
    """In worlds 11024 and 11031, stones of the vault, as far above a plane as heads are, hid the rails below."""
    rng = np.random.RandomState(4)
    xyz, on = ballasted(rng)
    vault = xyz[rng.random_sample(len(xyz)) < 0.5]
    beside_m = turned(vault, 0.3)[1]
    vault[:, 2] = 9.0 - slope * np.abs(beside_m) - 0.2 * slope * beside_m**2 + rng.normal(0, 0.03, len(vault))
    found = classify_square(np.concatenate([xyz, vault]), SETTINGS).rail
    assert found[: len(xyz)][on & inner(xyz, 8)].mean() > 0.95
    assert found[len(xyz) :].mean() < 0.005


@pytest.mark.parametrize("slope", [0.7, 0.75, 0.8, 0.85])
def test_a_vault_that_planes_only_just_cease_to_follow_covers_no_rail(slope):
    """In world 14900, a tenth of each of its cells was higher than any rail."""
    rng = np.random.RandomState(4)
    xyz, on = ballasted(rng)
    vault = xyz[rng.random_sample(len(xyz)) < 0.5]
    vault[:, 2] = 9.0 + slope * vault[:, 1] + rng.normal(0, 0.005, len(vault))
    found = classify_square(np.concatenate([xyz, vault]), SETTINGS).rail
    assert found[: len(xyz)][on & inner(xyz, 8)].mean() > 0.95


def test_rails_are_labelled_where_next_to_nothing_of_the_ground_is_seen():
    """At grazing angles a scanner sees one face of each rail, and shadow behind it."""
    xyz, on = at_grazing_angle(np.random.RandomState(3), 0.004)
    found = classify_square(xyz, SETTINGS).rail
    assert (found & on)[inner(xyz, 10)].sum() / on[inner(xyz, 10)].sum() > 0.9
    assert (found & on).sum() / found.sum() > 0.95


def test_rails_are_labelled_where_little_of_a_viaduct_and_some_ground_below_is_seen():
    rng = np.random.RandomState(3)
    xyz, on = at_grazing_angle(rng, 0.02)
    ground, _ = ballasted(rng, size=12.0, per_m2=240)
    found = classify_square(np.concatenate([xyz, ground - [0.0, 0.0, 8.0]]), SETTINGS).rail[: len(on)]
    assert (found & on)[inner(xyz, 10)].sum() / on[inner(xyz, 10)].sum() > 0.9


def test_rails_are_labelled_where_beams_that_meet_their_edges_leave_points_in_their_shadows():
    """As high as the heads, and in a twentieth of the cells; world 12543 lost the blades of a slip by them."""
    rng = np.random.RandomState(5)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=6000), GAUGE, WIDTH)
    xyz, left = rough(xyz, rng), turned(xyz, 0.0)[1]
    beyond = np.array([side * SPACING / 2 - WIDTH / 2 - left for side in (1, -1)])
    shadow = ((beyond > 0) & (beyond < 0.4)).any(axis=0)
    mixed = shadow & (rng.random_sample(len(xyz)) < 0.01)
    xyz[mixed, 2] = TOP_M - rng.uniform(0.0, 0.06, mixed.sum())
    seen = ~shadow | mixed
    found = classify_square(xyz[seen], SETTINGS).rail
    assert found[on[seen] & inner(xyz[seen], 10)].mean() > 0.99
    assert (found & on[seen]).sum() / found.sum() > 0.99


def test_the_edge_of_a_trough_of_whose_top_little_is_seen_is_no_rail():
    """A far scanner sees its face, and on its top a point here and there: each cell sees none or one of them."""
    rng = np.random.RandomState(22)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=12_000), GAUGE, WIDTH)
    xyz = rough(xyz, rng)
    beyond = turned(xyz, 0.0)[1] - 1.5 * SPACING
    trough, face = (beyond > 0) & (beyond < 0.4), (beyond > 0) & (beyond < 0.008)
    xyz[trough, 2] += 0.12
    xyz[face, 2] -= rng.uniform(0.0, 0.12, face.sum())
    seen = on | face | (rng.random_sample(len(xyz)) < 0.006)
    found = classify_square(xyz[seen], SETTINGS).rail
    assert found[on[seen]].mean() > 0.95
    assert not found[trough[seen]].any()


@pytest.mark.parametrize(
    "left", [SPACING / 2 - WIDTH - 0.045, SPACING / 2 + 0.4, 1.5 * SPACING + 0.018, -1.5 * SPACING + 0.035]
)
def test_guard_and_third_rails_and_what_is_at_gauge_from_a_track_go_and_rails_stay(left):
    rng = np.random.RandomState(5)
    xyz, on = ballasted(rng)
    xyz, bar = with_bar(xyz, WIDTH, 0.3, left, 0.18)
    bar &= ~on
    found = classify_square(xyz, SETTINGS).rail
    assert (found & bar & inner(xyz, 8)).sum() < 0.03 * bar.sum()
    assert (found & on)[inner(xyz, 8)].sum() / on[inner(xyz, 8)].sum() > 0.98


def test_a_higher_rail_of_the_next_track_is_not_a_third_rail():
    """It is 1.8 m from the rail of a track that has its partner on the other side, and hides its own (world 13988)."""
    rng = np.random.RandomState(5)
    xyz, _ = ballasted(rng)
    left = SPACING / 2 + 1.8
    xyz, bar = with_bar(xyz, WIDTH, 0.3, left, TOP_M + 0.06)
    shown = turned(xyz, 0.3)[1] < left + WIDTH
    found = classify_square(xyz[shown], SETTINGS).rail
    assert found[(bar & inner(xyz, 8))[shown]].mean() > 0.9


def test_a_rail_behind_a_wheel_at_the_end_of_the_cloud_is_labelled():
    rng = np.random.RandomState(12)
    xyz, on = ballasted(rng, 0.0)
    along, across = turned(xyz, 0.0)
    wheel = (np.abs(along - 3.05) < 0.55) & (np.abs(np.abs(across) - SPACING / 2) < 0.09)
    found = classify_square(xyz[~wheel], SETTINGS).rail
    behind = on & (along > 3.62)
    assert behind.sum() > 100
    assert found[behind[~wheel]].mean() > 0.95


@pytest.mark.parametrize(("slope", "kept"), [(0.1, True), (0.9, False)])
def test_the_crest_of_a_slope_whose_far_side_is_hidden_is_not_a_lone_rail(slope, kept):
    rng = np.random.RandomState(14)
    xyz, on = with_bar(flat(8.0, rng=rng, per_m2=2000), WIDTH, 0.2, height_m=0.2)
    _, across = turned(xyz, 0.2)
    xyz[:, 2] += slope * across
    found = classify_square(xyz[across < 0.05], SETTINGS)
    assert found.rail.any() == kept


@pytest.mark.parametrize("angle", [0.0, 0.03, 0.2])
def test_the_crest_of_a_steep_slope_is_not_a_lone_rail_in_any_direction(angle):
    """Along the cells of the bed, each of them seems to be a level of its own."""
    rng = np.random.RandomState(5)
    xyz = flat(16.0, rng=rng, per_m2=600)
    left = turned(xyz, angle)[1]
    xyz[:, 2] = 0.94 * left + rng.normal(0, 0.003, len(xyz))
    assert not classify_square(xyz[(left < 0) & (left > -3)], SETTINGS).rail.any()


def test_the_crest_of_a_bank_that_is_hardly_higher_than_its_ground_is_not_a_lone_rail():
    """It is 50 mm high; the bed, whose plane bends there, makes it as high as a rail."""
    rng = np.random.RandomState(1)
    xyz, _ = with_bar(flat(8.0, rng=rng, per_m2=3000), WIDTH, 0.3, height_m=0.05)
    left = turned(xyz, 0.3)[1]
    xyz[:, 2] += 0.003 * rng.standard_normal(len(xyz)) - 0.5 * np.maximum(left - WIDTH / 2, 0.0)
    seen = (left < 0.06) | ((left < 1.0) & (rng.random_sample(len(xyz)) < 0.1))
    assert not classify_square(xyz[seen], SETTINGS).rail.any()


def test_a_rail_beside_a_shoulder_has_its_partner():
    """The bed under the outer rail is 60 mm lower than under the inner one."""
    rng = np.random.RandomState(15)
    xyz, on = ballasted(rng)
    outside = ~on & (turned(xyz, 0.3)[1] > SPACING / 2 - 0.35)
    xyz[outside, 2] -= 0.06
    figures = classify_square(xyz, SETTINGS).figures
    assert figures.paired_m > 0.9 * (figures.paired_m + figures.single_m) > 9


def test_a_rail_of_a_canted_track_that_hides_all_of_its_bed_has_its_partner():
    """Of one rail a low tripod shows the head alone, and of the ground next to nothing from there on."""
    rng = np.random.RandomState(24)
    xyz, on = with_track(flat(14.0, rng=rng, per_m2=6000), GAUGE, WIDTH, 0.3)
    left = turned(xyz, 0.3)[1]
    hidden = left < 0.5 - SPACING / 2
    far = on & hidden
    xyz[far, 2] -= rng.uniform(0.0, 0.08, far.sum())
    xyz[:, 2] += 0.115 * left + rng.normal(0, 0.003, len(xyz))
    xyz = xyz[~hidden | far]
    figures = classify_square(xyz, SETTINGS).figures
    assert figures.paired_m > 0.95 * (figures.paired_m + figures.single_m) > 20


@pytest.mark.parametrize(("per_m2", "found_m"), [(200, 16.5), (5000, 0.0)])
def test_a_face_that_goes_straight_down_is_no_kerb_in_a_thin_cloud(per_m2, found_m):
    """In world 11646, wide beams of a drone blended the head with its web, and a train hid the other rail."""
    rng = np.random.RandomState(25)
    xyz, on = with_bar(rough(flat(16.0, rng=rng, per_m2=per_m2), rng), WIDTH, 0.3)
    face = np.repeat(xyz[on], 2, axis=0)
    face[:, :2] += np.outer(WIDTH / 2 + 0.01 - turned(face, 0.3)[1], [-np.sin(0.3), np.cos(0.3)])
    face[:, 2] -= rng.uniform(0.0, 0.12, len(face))
    xyz = np.concatenate([xyz, face])
    left = turned(xyz, 0.3)[1]
    shown = np.abs(left + SPACING) > 0.45
    assert classify_square(xyz[shown], SETTINGS).figures.single_m == pytest.approx(found_m, abs=1.0)


def test_rails_of_a_canted_track_in_ballast_up_to_the_heads_are_labelled():
    """On the higher side of each rail the bed rises to its top."""
    rng = np.random.RandomState(18)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=4000), GAUGE, WIDTH, 0.3)
    xyz[:, 2] = np.where(on, 0.06, rng.normal(0, 0.005, len(xyz))) + 0.115 * turned(xyz, 0.3)[1]
    found = classify_square(xyz, SETTINGS).rail
    assert (found & on)[inner(xyz, 10)].sum() / on[inner(xyz, 10)].sum() > 0.95
    assert (found & on).sum() / found.sum() > 0.95


def test_ballast_up_to_the_heads_does_not_widen_them():
    rng = np.random.RandomState(16)
    xyz, on = ballasted(rng, per_m2=4000)
    stone = (xyz[:, :2] / 0.05).astype(int) % 400
    xyz[:, 2] = np.where(on, 0.05 + rng.normal(0, 0.002, len(xyz)), rng.normal(0, 0.013, (400, 400))[tuple(stone.T)])
    found = classify_square(xyz, SETTINGS).rail
    assert (found & on)[inner(xyz, 8)].sum() / on[inner(xyz, 8)].sum() > 0.9
    assert (found & on).sum() / found.sum() > 0.9


@pytest.mark.parametrize(("height_m", "kept"), [(0.09, True), (0.145, True), (0.11, False)])
def test_a_lone_rail_stands_as_high_as_the_other_rails(height_m, kept):
    rng = np.random.RandomState(17)
    track, on = with_track(flat(16.0, rng=rng, per_m2=1200), GAUGE, WIDTH, 0.0)
    track[on, 2] = 0.07
    xyz, bar = with_bar(track, WIDTH, 0.0, 5.0, height_m)
    shown = turned(xyz, 0.0)[1] < 5.2
    xyz, bar = xyz[shown], bar[shown]
    found = classify_square(rough(xyz, rng, 0.005), SETTINGS).rail
    assert (found & bar).any() == kept
    assert (found & ~bar).any()


@pytest.mark.parametrize(("height_m", "kept"), [(0.23, True), (0.30, False)])
def test_a_bar_that_is_higher_than_rails_on_their_bed_stands_as_high_as_the_other_rails(height_m, kept):
    rng = np.random.RandomState(17)
    xyz, _ = with_track(flat(16.0, rng=rng, per_m2=1200), GAUGE, WIDTH, 0.0)
    xyz, bar = with_bar(xyz, WIDTH, 0.0, 5.0, height_m)
    assert classify_square(rough(xyz, rng, 0.005), SETTINGS).rail[bar].any() == kept


@pytest.mark.parametrize(("wide_m", "kept"), [(WIDTH, True), (0.14, False)])
def test_a_bar_is_a_rail_only_with_a_partner_that_is_one(wide_m, kept):
    """Both are lower than a rail without a partner may be, as the ends of sleepers and what lies between tracks are."""
    rng = np.random.RandomState(24)
    xyz, bar = with_bar(flat(10.0, rng=rng, per_m2=2500), WIDTH, 0.3, -SPACING / 2, 0.10)
    xyz, _ = with_bar(xyz, wide_m, 0.3, SPACING / 2, 0.10)
    found = classify_square(rough(xyz, rng, 0.005), SETTINGS).rail
    assert found[bar & inner(xyz, 8)].any() == kept


@pytest.mark.parametrize(("wide_m", "kept"), [(0.0, False), (0.04, False), (0.20, True)])
def test_a_lone_bar_is_a_rail_where_something_may_hide_the_other_one(wide_m, kept):
    """Nothing is seen in a strip at gauge, which is as wide as a head, or narrower."""
    rng = np.random.RandomState(21)
    xyz, _ = with_bar(flat(10.0, rng=rng, per_m2=2000), WIDTH, 0.3, -1.0)
    hidden = np.abs(turned(xyz, 0.3)[1] + 1.0 - SPACING) < wide_m / 2
    assert classify_square(rough(xyz, rng)[~hidden], SETTINGS).rail.any() == kept


def test_the_vault_of_a_tunnel_over_hidden_ground_is_not_lower_ground():
    """In world 14138, the wall of a train hid the other rail, and only the vault was seen over its place."""
    rng = np.random.RandomState(21)
    xyz, bar = with_bar(flat(16.0, rng=rng, per_m2=1200), WIDTH, 0.3, -1.0)
    hidden = turned(xyz, 0.3)[1] > -1.0 + SPACING - 0.5
    vault = flat(16.0, rng=rng, per_m2=400)
    vault[:, 2] = 6.0 + rng.normal(0, 0.004, len(vault))
    found = classify_square(np.concatenate([rough(xyz, rng)[~hidden], vault]), SETTINGS).rail
    assert found[: np.count_nonzero(~hidden)][bar[~hidden] & inner(xyz[~hidden], 16)].mean() > 0.9


def test_of_two_lone_bars_within_a_gauge_the_shorter_one_is_a_guard_rail():
    """A guard rail hides the rail that it guards from a scanner beside the track, so that neither bar has a partner."""
    rng = np.random.RandomState(21)
    xyz, rail = with_bar(flat(12.0, rng=rng, per_m2=2500), WIDTH, 0.0, -SPACING / 2)
    place_m = SPACING / 2 - WIDTH - 0.045
    xyz, guard = with_bar(xyz, WIDTH, 0.0, place_m, TOP_M + 0.01, length_m=9.0)
    shown = turned(xyz, 0.0)[1] < place_m + WIDTH / 2
    xyz, rail, guard = rough(xyz, rng)[shown], rail[shown], guard[shown]
    found = classify_square(xyz, SETTINGS).rail
    assert found[rail & inner(xyz, 10)].mean() > 0.95
    assert not found[guard].any()


@pytest.mark.parametrize(("height_m", "kept"), [(0.17, False), (0.25, True)])
def test_ground_below_the_place_of_the_other_rail_shows_no_rail_only_where_its_foot_would_hide_it(height_m, kept):
    rng = np.random.RandomState(21)
    xyz, _ = with_bar(flat(10.0, rng=rng, per_m2=2000), WIDTH, 0.3, -1.0, height_m)
    assert classify_square(rough(xyz, rng), SETTINGS).rail.any() == kept


@pytest.mark.parametrize(("behind_m", "kept"), [(0.0, False), (0.028, True)])
def test_a_lone_bar_overhangs_if_it_is_a_rail(behind_m, kept):
    """A scanner sees the face of its head, and what is below: a web, 28 mm behind the face, or more of the face."""
    rng = np.random.RandomState(22)
    xyz, _ = with_bar(flat(10.0, rng=rng, per_m2=2000), WIDTH, 0.3)
    xyz = xyz[turned(xyz, 0.3)[1] < WIDTH / 2]
    face = side_of_head(rng, 6000, 4.5, TOP_M, -WIDTH / 2, behind_m, 0.3)
    assert classify_square(np.concatenate([rough(xyz, rng), face]), SETTINGS).rail.any() == kept


@pytest.mark.parametrize(("behind_m", "kept"), [(0.0, False), (0.028, True)])
def test_a_lone_bar_as_low_as_rails_in_ballast_overhangs_if_it_is_a_rail(behind_m, kept):
    """In world 15630, a kerb was 12.3 cm high."""
    rng = np.random.RandomState(22)
    track, on = with_track(flat(16.0, rng=rng, per_m2=1200), GAUGE, WIDTH, 0.0)
    track[on, 2] = 0.125
    xyz, bar = with_bar(track, WIDTH, 0.0, 5.0, 0.125)
    shown = turned(xyz, 0.0)[1] < 5.2
    xyz, bar = rough(xyz[shown], rng, 0.005), bar[shown]
    face = side_of_head(rng, 9000, 7.5, 0.125, 5.0 - WIDTH / 2, behind_m)
    assert classify_square(np.concatenate([xyz, face]), SETTINGS).rail[: len(xyz)][bar].any() == kept


@pytest.mark.parametrize(("higher_m", "kept"), [(0.07, False), (0.0, True)])
def test_what_hides_a_rail_and_is_higher_just_outside_its_track_is_a_third_rail(higher_m, kept):
    """Neither bar has a partner; bars that are as high may be rails of two tracks."""
    rng = np.random.RandomState(21)
    xyz, rail = with_bar(flat(12.0, rng=rng, per_m2=2500), WIDTH, 0.0, -SPACING / 2)
    place_m = SPACING / 2 + 0.36
    xyz, third = with_bar(xyz, WIDTH, 0.0, place_m, TOP_M + higher_m, length_m=8.0)
    left = turned(xyz, 0.0)[1]
    seen = (left < place_m - 0.75) | (np.abs(left - place_m) < 0.3)
    found = classify_square(rough(xyz, rng)[seen], SETTINGS).rail
    assert found[rail[seen]].mean() > 0.9
    assert found[third[seen]].any() == kept


def test_heads_in_two_passes_that_are_3_cm_apart_are_labelled():
    """Kerbs of 150 mm are far wider than both together."""
    passes = []
    for shift_m in (-0.015, 0.015):
        xyz, on = ballasted(np.random.RandomState(5), 0.0)
        passes.append((xyz + [0.0, shift_m, 0.0], on))
    xyz, on = (np.concatenate(both) for both in zip(*passes))
    found = classify_square(xyz, SETTINGS)
    assert found.rail[on & inner(xyz, 8)].mean() > 0.9
    assert found.figures.paired_m > 10


def test_feet_and_webs_are_not_labelled():
    rng = np.random.RandomState(6)
    ground = flat(6.0, rng=rng, per_m2=3000)
    for side in (1, -1):
        ground, _ = with_bar(ground, 0.15, 0.3, side * SPACING / 2, 0.03)
    xyz, on = with_track(ground, GAUGE, WIDTH, 0.3)
    xyz[on, 2] -= 0.03
    low = on & (rng.random_sample(len(xyz)) < 0.3)
    xyz[low, 2] -= rng.uniform(0.05, 0.12, low.sum())
    found = classify_square(xyz, SETTINGS).rail
    assert found.any()
    assert xyz[found, 2].min() > TOP_M - 0.045


@pytest.mark.parametrize(("width_m", "expected"), [(0.002, False), (0.030, True), (WIDTH, True)])
def test_a_lone_profile_of_the_scanner_is_no_rail(width_m, expected):
    rng = np.random.RandomState(9)
    bed = rough(flat(8.0, rng=rng, per_m2=1500), rng)
    along, across = rng.uniform(-4, 4, 3000), rng.uniform(-width_m / 2, width_m / 2, 3000)
    bar = np.column_stack([along + MIDDLE[0], across + MIDDLE[1], rng.normal(TOP_M, 0.002, len(along))])
    left = bed[:, 1] - MIDDLE[1]
    bed = bed[(np.abs(left) > WIDTH) & (np.abs(left - SPACING) > 0.1)]
    assert classify_square(np.concatenate([bed, bar]), SETTINGS).rail.any() == expected


@pytest.fixture(scope="module")
def wide():
    """A track across several squares."""
    rng = np.random.RandomState(7)
    x = rng.uniform(0, 100, 260_000)
    y = rng.uniform(-3, 3, len(x))
    on = np.abs(np.abs(y) - SPACING / 2) < WIDTH / 2
    z = np.where(on, TOP_M, 0) + np.where(on, 0.002, 0.012) * rng.standard_normal(len(x))
    return np.column_stack([x + 20.3, y + 40.1 + 0.05 * x, z + 311.0]), on


def test_the_order_of_points_does_not_matter(wide):
    xyz, on = wide
    found = classify_cloud(xyz, SETTINGS)
    assert found.rail[on].mean() > 0.99
    order = np.random.RandomState(1).permutation(len(xyz))
    again = classify_cloud(xyz[order], SETTINGS)
    np.testing.assert_array_equal(again.rail, found.rail[order])
    assert again.figures == found.figures


@settings(max_examples=4, deadline=None)
@given(right=st.integers(-90000, 90000), up=st.integers(-90000, 90000))
def test_a_shift_by_squares_changes_nothing(wide, right, up):
    xyz, _ = wide
    near = xyz[:, 0] < 60
    found = classify_cloud(xyz[near], SETTINGS)
    moved = xyz[near] + np.array([right, up, 0]) * SETTINGS.side_m
    np.testing.assert_array_equal(classify_cloud(moved, SETTINGS).rail, found.rail)


def test_far_away_points_of_other_files_change_nothing(wide):
    xyz, _ = wide
    far = xyz[:, 0] > 20.3 + 50
    found = classify_cloud(xyz, SETTINGS).rail
    corner = np.floor(xyz[:, 0] / SETTINGS.side_m)
    first = corner == corner.min()
    part = xyz[:, 0] < (corner.min() + 1) * SETTINGS.side_m + 3.0
    assert (far & ~part).any()
    np.testing.assert_array_equal(classify_cloud(xyz[part], SETTINGS).rail[first[part]], found[first])


def test_figures_count_what_was_found(wide):
    xyz, _ = wide
    found = classify_cloud(xyz, SETTINGS)
    assert found.figures.points == found.rail.sum()
    assert found.figures.paired_m == pytest.approx(200, rel=0.05)
    assert found.figures.single_m < 2
    assert found.figures.squares >= 3
    assert found.figures.cells_per_m > 20


@pytest.mark.parametrize(
    "xyz",
    [np.empty((0, 3)), np.zeros((1, 3)), np.ones((500, 3)), np.full((500, 3), 0.001) * np.arange(500)[:, None]],
    ids=["empty", "one", "equal", "line"],
)
def test_nothing_comes_of_nothing(xyz):
    found = classify_cloud(xyz, SETTINGS)
    assert not found.rail.any()
    assert found.rail.shape == (len(xyz),)
