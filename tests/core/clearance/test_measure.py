"""Objects at known depths, and what does not count, through the whole sweep."""

import numpy as np
import pytest
from rail_extract.core.clearance.along import nominal_mm
from rail_extract.core.clearance.measure import measure
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import LEAVE_OUT, Settings
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import Cancelled
from rail_extract.core.jobs.clearance_inputs import custom
from rail_extract.core.progress import Progress
from rail_extract.core.run.tasks import Runner
from rail_extract.core.tiles.store import counts_of
from rail_extract.laboratory.curves import Element
from rail_extract.laboratory.scenes import clearance as scenes
from rail_extract.laboratory.scenes.clearance import SHORT, courses_of, write_points

HALF_M = 1.645
"""Half width of EBO_G1 above 1.17 m."""

STRAIGHT = (Element(60.0),)


def scene_of(elements=SHORT, cant_m=0.12, apart_m=0.0, per_m2=500.0, grade=0.012):
    return scenes.double_track(3, per_m2, elements, cant_m, grade, apart_m=apart_m)


def depths(found):
    """Return the depths of the objects in the order of their places, millimetres."""
    return [one.pen_mm for one in sorted(found.intrusions, key=lambda one: one.chainage_m)]


@pytest.fixture
def plates():
    """Plates at depths of 5 to 150 mm inside and outside, and a pole and a mast, on straight, clothoid and arc."""
    scene = scene_of()
    for number, depth in enumerate((0.030, -0.005, 0.008, -0.015, 0.150, -0.150, 0.015, -0.030, 0.080)):
        scenes.plate(scene, 5.0 + 9.0 * number, (1, -1)[number % 2], HALF_M - depth, (1.5, 2.5))
    scenes.pole(scene, 84.0, -1, HALF_M - 0.020, (0.2, 3.0))
    return scene


def test_objects_are_found_at_their_depths_and_nothing_outside(swept, plates):
    found = swept(plates)
    assert depths(found) == pytest.approx([30, 8, 150, 15, 80, 20], abs=5)
    assert all(one.sure for one in found.intrusions)
    assert [one.side for one in sorted(found.intrusions, key=lambda one: one.chainage_m)] == [*["left"] * 5, "right"]
    assert [one.intrusion for one in found.intrusions] == [1, 2, 3, 4, 5, 6]
    assert found.least_margin_m == pytest.approx(-0.150, abs=0.005)
    for one in found.intrusions:
        assert (
            abs(one.pen_mm - min((30, 8, 150, 15, 80, 20), key=lambda true: abs(true - one.pen_mm)))
            < 3.5 * one.sigma_mm
        )


def test_a_margin_deepens_every_object(swept, plates):
    plain, grown = swept(plates), swept(plates, margin_m=0.1)
    by_place = {round(one.chainage_m): one.pen_mm for one in grown.intrusions}
    for one in plain.intrusions:
        nearest = min(by_place, key=lambda place: abs(place - one.chainage_m))
        assert by_place[nearest] == pytest.approx(one.pen_mm + 100, abs=3)
    assert len(grown.intrusions) == 9  # all but the one that stands 150 mm outside


def test_widening_deepens_objects_in_the_curve_by_its_amount(swept):
    scene = scene_of((Element(60.0, 1 / 300, 1 / 300),))
    scenes.plate(scene, 30.0, 1, HALF_M - 0.050, (1.5, 2.5))
    plain, wide = swept(scene), swept(scene, widening="EBO")
    assert wide.intrusions[0].pen_mm - plain.intrusions[0].pen_mm == pytest.approx(17.5, abs=0.5)
    assert wide.stations[0].wide_m[30] == pytest.approx([0.0175, 0.0175], abs=2e-4)


def test_results_do_not_depend_on_how_the_cloud_is_cut_or_ordered(swept, plates):
    rng = np.random.RandomState(0)

    def mixed(xyz):
        order = rng.permutation(len(xyz))
        return np.split(order, [len(xyz) // 3])

    one, other = swept(plates), swept(plates, parts=mixed)
    assert [vars(a)["pen_mm"] for a in one.intrusions] == [vars(b)["pen_mm"] for b in other.intrusions]
    assert one.stations[0].margin_m == pytest.approx(other.stations[0].margin_m, nan_ok=True)


def test_straight_track_needs_no_rails(swept):
    scene = scene_of(STRAIGHT, cant_m=0.0)
    scenes.plate(scene, 30.0, 1, HALF_M - 0.050, (1.5, 2.5))
    with_rails, without = swept(scene), swept(scene, with_rails=False)
    assert without.intrusions[0].pen_mm == pytest.approx(with_rails.intrusions[0].pen_mm, abs=1)
    assert without.intrusions[0].sure


def test_canted_track_without_rails_is_not_judged_surely(swept):
    scene = scene_of((Element(60.0, 1 / 300, 1 / 300),))
    scenes.plate(scene, 30.0, 1, HALF_M - 0.150, (2.5, 3.2))
    found = swept(scene, with_rails=False)
    assert not any(one.sure for one in found.intrusions)


def test_a_beam_over_the_track_is_measured_from_above(swept):
    scene = scene_of(per_m2=800.0)
    scenes.beam(scene, 60.0, 4.31 - 0.040, 0.6, 0.5)
    assert depths(swept(scene)) == pytest.approx([40], abs=4)


def test_a_long_wall_is_one_object_and_its_margin_is_constant(swept):
    scene = scene_of((Element(150.0, 1 / 300, 1 / 300),), per_m2=300.0)
    scenes.wall(scene, (10.0, 140.0), -1, HALF_M - 0.020, (1.3, 3.0))
    scenes.wall(scene, (10.0, 140.0), 1, HALF_M + 0.120, (1.3, 3.0))
    found = swept(scene)
    assert len(found.intrusions) == 1
    assert found.intrusions[0].pen_mm == pytest.approx(20, abs=3)
    assert (found.intrusions[0].from_m, found.intrusions[0].to_m) == pytest.approx((10, 140), abs=0.3)
    margin = found.stations[0].least_m[15:135, 0]
    assert 0.100 < margin.min() < margin.max() < 0.121


def test_single_points_do_not_count_and_four_are_in_doubt(swept):
    scene = scene_of()
    scenes.stray(scene, 25)
    assert swept(scene).intrusions == ()
    scene.add(np.full(4, 50.02), np.array([1.50, 1.51, 1.49, 1.5]), np.array([2.0, 2.03, 2.01, 1.98]), 1)
    (one,) = swept(scene).intrusions
    assert (one.points, one.sure) == (4, 0)


def test_bed_and_rails_do_not_count(swept):
    scene = scene_of(per_m2=200.0)
    scenes.bed(scene)
    scene.add(np.linspace(1, 89, 2000), np.full(2000, 0.75), np.zeros(2000), 10)
    found = swept(scene)
    assert found.intrusions == ()
    assert not any(found.unseen(one).any() for one in found.stations)


def test_trains_are_named_and_not_counted(swept):
    scene = scene_of(STRAIGHT, cant_m=0.0, apart_m=3.8)
    scenes.wagon(scene, (15.0, 40.0), way=1, half_m=1.5)
    found = swept(scene, "EBO_MAIN")
    assert {(one.track_id, one.what) for one in found.intrusions} == {
        (1, "vehicle on track 2"),
        (2, "vehicle on track 2"),
    }
    assert found.sure == []
    assert swept(scene, "EBO_MAIN", trains=LEAVE_OUT).intrusions == ()


def test_the_vehicle_of_the_scanner_is_left_out(swept):
    scene = scene_of((Element(130.0),), cant_m=0.0)
    rng = np.random.RandomState(1)
    s = np.repeat(np.arange(0.5, 130, 0.25), 12)
    scene.add(s, rng.uniform(0.62, 0.68, len(s)), rng.uniform(2.92, 2.98, len(s)), 1)
    scenes.plate(scene, 60.0, 1, HALF_M - 0.050, (1.5, 2.5))
    found = swept(scene)
    assert depths(found) == pytest.approx([50], abs=4)
    assert found.vehicle == ((0, 0), (0, 1))


def test_platforms_are_measured_and_named(swept):
    scene = scene_of((Element(30.0), Element(20.0, 0.0, 1 / 600), Element(30.0, 1 / 600, 1 / 600)), 0.05, per_m2=800.0)
    scenes.platform(scene, (10.0, 70.0), 1, 1.60, 0.76)
    found = swept(scene)
    (edge,) = found.platforms
    assert 1000 * np.abs(edge.v).mean() == pytest.approx(1600, abs=1)
    assert 1000 * edge.w.mean() == pytest.approx(760, abs=1)
    assert edge.ends == pytest.approx((10, 70), abs=0.6)
    assert nominal_mm(edge) == 760
    assert {one.what for one in found.intrusions} == {"platform"}


def test_a_platform_that_is_seen_from_above_only_has_a_larger_error(swept):
    scene = scene_of(STRAIGHT, 0.0, per_m2=800.0)
    scenes.platform(scene, (10.0, 50.0), -1, 1.70, 0.55, face=False)
    (edge,) = swept(scene).platforms
    assert 1000 * np.abs(edge.v).mean() == pytest.approx(1700, abs=4)
    assert edge.sigma_m.mean() > 0.004


def test_the_floor_of_a_wagon_is_not_a_platform(swept):
    scene = scene_of(STRAIGHT, 0.0, apart_m=4.0)
    at, v = scene.patch((10.0, 50.0), (2.55, 3.0))
    scene.add(at, v, np.full(len(at), 0.9), 1)
    at, w = scene.patch((10.0, 50.0), (0.9, 3.5))
    scene.add(at, np.full(len(at), 2.6), w, 1)
    assert swept(scene, "EBO_MAIN").platforms == ()


def test_the_contact_wire_is_followed_below_droppers_and_arms(swept):
    scene = scene_of((Element(90.0),), 0.0)
    scenes.catenary(scene, 5.3, 30.0)
    found = swept(scene)
    (wire,) = found.wires
    assert wire.length_m > 55
    assert 1000 * np.median(wire.w) == pytest.approx(5300, abs=2)
    stagger = np.interp(wire.s, [5.0, 35.0, 65.0], [-0.2, 0.2, -0.2])
    away_from_supports = np.abs((wire.s - 5.0 + 15.0) % 30.0 - 15.0) > 1.0
    assert np.sqrt(np.mean((wire.v - stagger)[away_from_supports] ** 2)) < 2e-3


def test_a_wire_inside_a_profile_is_named(swept):
    scene = scene_of((Element(70.0),), 0.0)
    scenes.catenary(scene, 5.1, 30.0)
    found = swept(scene, "EBO_MAIN_15KV")
    assert {one.what for one in found.intrusions} == {"contact wire"}
    assert found.sure == []


def test_the_roof_of_a_tunnel_is_not_a_wire(swept):
    scene = scene_of((Element(60.0),), 0.0, per_m2=300.0)
    scenes.tunnel(scene, (5.0, 55.0))
    assert swept(scene).wires == ()


def test_parallel_tracks_are_as_far_apart_as_they_are(swept):
    scene = scene_of(apart_m=4.0)
    scenes.bed(scene, 2.0)
    found = swept(scene)
    first, second = found.stations
    assert np.abs(first.left.distance_m[1:-1] - 4.0).max() < 3e-4
    assert np.isnan(first.right.distance_m).all()
    assert np.nanmax(np.abs(second.right.distance_m - 4.0)) < 3e-4
    assert not first.left.short.any()
    near = swept(scene, distance_m=4.1).stations[0].left
    assert near.short[1:-1].all()


def test_a_lopsided_profile_is_entered_on_one_side_only(swept):
    outline = custom([(1.9, 0.3), (1.9, 3.0), (0.0, 4.2), (-1.5, 3.0), (-1.5, 0.3)], "own.csv")
    scene = scene_of(STRAIGHT, 0.0)
    for side in (1, -1):
        scenes.plate(scene, 30.0, side, 1.7, (1.0, 2.0))
    (one,) = swept(scene, outline).intrusions
    assert (one.side, one.pen_mm) == ("left", pytest.approx(200, abs=4))


def test_classes_that_are_left_out_count_nowhere(swept):
    scene = scene_of(STRAIGHT, 0.0)
    scenes.plate(scene, 30.0, 1, 1.5, (1.0, 2.0))
    assert len(swept(scene).intrusions) == 1
    assert swept(scene, left_out=(scenes.OBJECT,)).intrusions == ()


def test_a_reversed_track_has_the_same_depths_on_the_other_side(swept, plates):
    found = swept(plates)
    way = plates.ways[0].reversed()
    other = swept(plates, courses=courses_of(scenes.Scene([way], 1.0, 0.0, np.random.RandomState(0))))
    assert depths(other)[::-1] == pytest.approx(depths(found), abs=2)
    assert {one.side for one in other.intrusions} == {"left", "right"}


def test_points_out_of_reach_are_read_and_not_kept(swept):
    scene = scene_of(STRAIGHT, 0.0)
    scenes.plate(scene, 30.0, 1, HALF_M - 0.050, (1.5, 2.5))
    near = swept(scene)
    rng = np.random.RandomState(0)
    far = rng.uniform((0.0, 12.0, 0.0), (60.0, 40.0, 6.0), (200_000, 3))
    scene.add(*far.T, 1)
    found = swept(scene)
    assert counts_of(found.swept.files) == counts_of(near.swept.files)
    assert found.point_count == near.point_count
    assert found.swept.census.sum() < 250_000


def test_a_section_of_many_points_keeps_their_number_and_the_depth(swept, plates, monkeypatch):
    plain = swept(plates)
    monkeypatch.setattr("rail_extract.core.clearance.measure.MOST_POINTS", 1000)
    thinned = swept(plates)
    counts = ([one.points for one in found.intrusions] for found in (thinned, plain))
    assert next(counts) == pytest.approx(next(counts), abs=2)
    assert depths(thinned) == pytest.approx(depths(plain), abs=3)


def test_a_cancelled_run_ends(tmp_path, plates):
    class Impatient(Progress):
        def is_cancelled(self):
            return True

    write_points(tmp_path / "cloud.laz", plates.points, plates.codes)
    settings = Settings(named()["EBO_G1"])
    with pytest.raises(Cancelled):
        measure(ask(tmp_path / "cloud.laz", range(256)), courses_of(plates), settings, tmp_path, Runner(), Impatient())
