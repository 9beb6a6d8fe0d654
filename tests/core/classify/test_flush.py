from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings, Way
from rail_extract.core.classify.square import classify_square
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, flat, turned

GAUGE, WIDTH, GROOVE, DEPTH = 1.435, 0.072, 0.042, 0.045
SETTINGS = Settings((GAUGE,), WIDTH)


def street(noise, angle=0.3, seed=1):
    """Pave around two rails with a groove inside each: points, those on heads, and distances inside the gauge faces."""
    rng = np.random.RandomState(seed)
    xyz = flat(8.0, 0.01)
    xyz[:, :2] += 0.003 * rng.standard_normal((len(xyz), 2))
    across = turned(xyz, angle)[1]
    inside = GAUGE / 2 - np.abs(across)
    xyz[(inside > 0) & (inside < GROOVE), 2] -= DEPTH
    xyz[:, 2] += noise * rng.standard_normal(len(xyz))
    return xyz, (inside <= 0) & (inside >= -WIDTH), inside


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.4])
def test_heads_beside_grooves_are_labelled(angle):
    xyz, on, inside = street(0.003, angle)
    found = classify_square(xyz, SETTINGS)
    here = np.abs(turned(xyz, angle)[0]) < 3
    assert (found.rail & on & here).sum() / (on & here).sum() > 0.93
    assert (found.rail & on).sum() / found.rail.sum() > 0.93
    # The middle of each strip lies where the axis of the head does.
    assert np.mean(inside[found.rail & here]) == pytest.approx(-WIDTH / 2, abs=0.005)
    assert found.figures.paved == 1


def test_a_building_of_many_floors_is_searched():
    """Its coarse cells, counted over all floors, are more than 16 bits hold."""
    floor = flat(60.0, rng=np.random.RandomState(1), per_m2=10)
    floors = np.concatenate([floor + [0.0, 0.0, up] for up in (0.0, 4.0, 8.0, 12.0)])
    assert not classify_square(floors, SETTINGS).rail.any()


def test_noise_hides_the_grooves():
    xyz, _, _ = street(0.012)
    found = classify_square(xyz, SETTINGS)
    assert not found.rail.any()
    assert found.figures.paved == 0


def test_grooves_are_found_in_a_pavement_as_rough_as_the_noise_of_a_train_scanner():
    """At 7 mm, one point in twenty of the pavement is as low as a groove that a good scanner sees begins."""
    xyz, on, _ = street(0.007)
    found = classify_square(xyz, SETTINGS)
    here = np.abs(turned(xyz, 0.3)[0]) < 3
    assert (found.rail & on & here).sum() / (on & here).sum() > 0.85
    assert (found.rail & on).sum() / found.rail.sum() > 0.9


def test_a_street_is_not_searched_for_heads_just_above_ballast():
    """Two strips at gauge across the street stand out by 9 mm, as profiles of a pass that is registered higher."""
    xyz, on, _ = street(0.001)
    across = turned(xyz, 0.3 + np.pi / 2)[1]
    strips = np.abs(np.abs(across) - (GAUGE + WIDTH) / 2) < WIDTH / 2
    xyz[strips, 2] += 0.009
    found = classify_square(xyz, replace(SETTINGS, way=Way.FILLED))
    assert (found.rail & on).sum() > 1000
    assert found.figures.filled_m == 0
    assert (found.rail & ~on).sum() < 0.01 * found.rail.sum()


def test_grooves_at_another_distance_are_not_rails():
    xyz, _, _ = street(0.003)
    assert not classify_square(xyz, Settings((1.0,), WIDTH)).rail.any()


@pytest.mark.parametrize("seen_m", [(0.0, 0.012), (0.030, GROOVE)])
def test_a_groove_whose_one_wall_is_hidden_gives_the_same_axes(seen_m):
    xyz, on, inside = street(0.002)
    hidden = (inside > 0) & (inside < GROOVE) & ((inside < seen_m[0]) | (inside > seen_m[1]))
    xyz, on, inside = xyz[~hidden], on[~hidden], inside[~hidden]
    found = classify_square(xyz, SETTINGS).rail
    here = np.abs(turned(xyz, 0.3)[0]) < 3
    assert (found & on & here).sum() / (on & here).sum() > 0.9
    assert np.mean(inside[found & here & on]) == pytest.approx(-WIDTH / 2, abs=0.003)
    assert (found & on).sum() / found.sum() > 0.93


def test_both_rails_go_on_where_one_groove_is_a_gap_without_depth():
    xyz, on, inside = street(0.002)
    along, across = turned(xyz, 0.3)
    unseen = (inside > 0) & (inside < GROOVE) & (across < 0) & (along > 0)
    xyz, on, along, across = xyz[~unseen], on[~unseen], along[~unseen], across[~unseen]
    found = classify_square(xyz, SETTINGS).rail
    for side in (across < 0, across > 0):
        there = on & side & (along > 0.3) & (along < 3)
        assert found[there].mean() > 0.9
    assert (found & on).sum() / found.sum() > 0.95


def test_a_groove_that_has_its_partner_nowhere_is_not_a_rail():
    xyz, _, inside = street(0.002)
    across = turned(xyz, 0.3)[1]
    xyz[(inside > 0) & (inside < GROOVE) & (across < 0), 2] += DEPTH
    assert not classify_square(xyz, SETTINGS).rail.any()


def test_grooves_are_found_as_far_from_the_scanner_as_they_hold_a_row_of_points():
    xyz, on, _ = street(0.003)
    few = np.random.RandomState(3).random_sample(len(xyz)) < 0.07
    found = classify_square(xyz[few], SETTINGS).rail
    here = np.abs(turned(xyz[few], 0.3)[0]) < 3
    assert (found & on[few] & here).sum() / (on[few] & here).sum() > 0.9


@pytest.mark.parametrize(("near", "found"), [(0.10, True), (0.035, False)])
def test_a_far_rail_is_found_in_the_thinner_rest_of_a_pavement(near, found):
    """The far half of the street has 350 points per square metre, the near one 1000, or as few."""
    xyz, on, _ = street(0.003)
    share = np.where(turned(xyz, 0.3)[1] < -0.2, near, 0.035)
    few = np.random.RandomState(3).random_sample(len(xyz)) < share
    along, across = turned(xyz[few], 0.3)
    far = on[few] & (np.abs(along) < 3) & (across > 0)
    labelled = classify_square(xyz[few], SETTINGS).rail
    assert (labelled[far].mean() > 0.9) if found else not labelled.any()


def test_hollows_at_the_feet_of_two_walls_are_not_grooves():
    xyz, _, inside = street(0.003)
    rng = np.random.RandomState(6)
    outside = inside < 0
    xyz[outside, 2] += rng.uniform(0.0, 0.75, outside.sum())
    wall = outside & (inside > -0.012) | ~outside
    assert not classify_square(xyz[wall], SETTINGS).rail.any()


def test_a_paved_strip_between_a_slope_and_a_parapet_has_no_grooves():
    """Beside both, the bed bends up, so that the strip, 1.58 m wide, seems to fall towards its sides."""
    rng, angle = np.random.RandomState(5), 0.2
    xyz = flat(8.0, rng=rng, per_m2=600)
    beyond = np.abs(turned(xyz, angle)[1]) - 0.79
    left = turned(xyz, angle)[1] > 0
    xyz[~left, 2] += 0.65 * np.clip(beyond[~left], 0.0, 1.0)
    xyz[:, 2] += 0.004 * rng.standard_normal(len(xyz))
    face = flat(8.0, rng=rng, per_m2=90)
    along, across = turned(face, angle)[0], 0.79 + 0.004 * rng.standard_normal(len(face))
    face = np.column_stack([along, across, rng.uniform(0.0, 1.5, len(face))])
    face[:, :2] = MIDDLE + face[:, :2] @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    assert not classify_square(np.concatenate([xyz[~left | (beyond < 0)], face]), SETTINGS).rail.any()


def test_the_side_of_a_vehicle_at_gauge_from_a_groove_is_no_rail():
    """Its points, from 0.75 m up, have a level of their own, and the lowest lie below it as those of a groove do."""
    xyz, _, inside = street(0.003, angle=0.0)
    across = turned(xyz, 0.0)[1]
    xyz[(inside > 0) & (inside < GROOVE) & (across < 0), 2] += DEPTH
    rng = np.random.RandomState(4)
    side = xyz[rng.choice(len(xyz), 40_000)]
    side[:, 1] = xyz[0, 1] - across[0] - GAUGE / 2 + GROOVE / 2 + 0.002 * rng.standard_normal(len(side))
    side[:, 2] = rng.uniform(0.75, 3.0, len(side))
    assert not classify_square(np.concatenate([xyz, side]), SETTINGS).rail.any()


def test_grooves_of_two_storeys_are_not_those_of_a_track():
    """As the joints of the vault of a tunnel may seem to be, above its floor."""
    xyz, _, _ = street(0.003)
    xyz[turned(xyz, 0.3)[1] > 0.2, 2] += 4.0
    assert not classify_square(xyz, SETTINGS).rail.any()
