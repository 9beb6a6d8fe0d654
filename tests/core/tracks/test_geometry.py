from dataclasses import replace

import numpy as np
import pytest
from built import centerline_of, cloud_of, rails_of, rms
from rail_extract.core import pipeline
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import Centerline, Support
from rail_extract.core.squares import steps
from rail_extract.core.tracks.centerlines import build_centerlines
from rail_extract.core.tracks.geometry import measure_track_geometry
from rail_extract.laboratory.curves import Element, trace, transition_curve
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072
RADIUS = 600.0
CANT_MM = 80.0
BORDERS = np.cumsum([0.0, 20.0, 40.0, 50.0, 40.0, 20.0])
"""Straight, clothoid, arc, clothoid, straight."""


def curved_track(sign=1, heading=0.2):
    curve = trace(transition_curve(20, 40, 50, sign / RADIUS), heading=heading)
    cant = -CANT_MM / 1000 * curve.curvature * RADIUS
    return Track(curve, GAUGE + WIDTH, 0.004 * curve.chainage, cant)


def ramp(chainage, height):
    """A quantity that follows the curvature."""
    return np.interp(chainage, BORDERS[1:5], [0.0, height, height, 0.0])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("turned", [False, True])
def test_exact_rails_give_exact_geometry(sign, turned):
    """One of the rails may be reversed: only the direction of the centerline counts."""
    left, right = curved_track(sign).rails()
    rails = rails_of(left[::-1] if turned else left, right)
    lines = build_centerlines(rails, Parameters(GAUGE, WIDTH))
    (found,) = measure_track_geometry(lines, rails, WIDTH)
    t = found.chainage_m
    assert found.track_id == lines[0].track_id
    np.testing.assert_allclose(np.diff(t[:-1]), 1.0)
    np.testing.assert_allclose(found.gauge_mm, 1435.0, atol=0.1)
    np.testing.assert_allclose(
        found.cant_mm, ramp(t, -sign * CANT_MM), atol=0.7
    )  # smoothing rounds the corners of the ramp
    np.testing.assert_allclose(found.grade_pm, 4.0, atol=0.02)
    arc = (t > BORDERS[2] + 10) & (t < BORDERS[3] - 10)
    np.testing.assert_allclose(found.radius_m[arc], sign * RADIUS, rtol=0.003)
    assert np.isnan(found.radius_m[t < 8]).all()
    clothoid = (t > BORDERS[1] + 10) & (t < BORDERS[2] - 10)
    np.testing.assert_allclose(found.radius_m[clothoid], sign * RADIUS * 40 / (t[clothoid] - 20), rtol=0.01)
    np.testing.assert_allclose(found.twist_mm[clothoid], -sign * CANT_MM * 3 / 40, atol=0.1)
    assert np.isnan(found.twist_mm[[0, 1, -1]]).all()
    assert not found.bridged.any()


@pytest.mark.parametrize(("step", "chainage"), [(100, [0, 100, 199]), (150, [0, 199]), (300, [0, 199])])
def test_stations_cover_the_whole_track(step, chainage):
    left, right = Track(trace([Element(199.0)]), GAUGE + WIDTH).rails()
    line = centerline_of(0.5 * (left + right))
    rails = [replace(rail, gaps=np.array([[0.0, 199.0]]), points=398) for rail in rails_of(left, right)]
    (found,) = measure_track_geometry([line], rails, WIDTH, step)
    np.testing.assert_allclose(found.chainage_m, chainage)
    assert found.points.sum() == 796
    assert found.bridged_m == pytest.approx(199)


def test_gauge_and_cant_are_unknown_where_a_rail_is_missing():
    left, right = Track(trace([Element(40.0)]), GAUGE + WIDTH).rails()
    line = centerline_of(0.5 * (left + right))
    short = right[right[:, 0] < 30]
    (found,) = measure_track_geometry([line], rails_of(left, short), WIDTH)
    gone = found.chainage_m > short[-1, 0] + 1.7
    assert gone.sum() > 7
    for values in (found.gauge_mm, found.cant_mm):
        np.testing.assert_array_equal(np.isnan(values), gone)
    assert found.bridged[found.chainage_m > 30.6].all()


def test_points_are_counted_once_around_a_ring():
    angle = np.linspace(0, 2 * np.pi, 400)
    rings = [np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * angle]) for r in (9.2465, 10.7535, 10.0)]
    for ring, turn in zip(rings, (130, 40, 0)):
        ring[:] = np.roll(ring[:-1], turn, axis=0)[np.r_[0:399, 0]]
    rails = [replace(rail, points=1000) for rail in rails_of(*rings[:2])]
    line = centerline_of(rings[2])
    (found,) = measure_track_geometry([line], rails, WIDTH)
    assert found.points.sum() == pytest.approx(2000, rel=0.03)
    assert found.points.max() < 2 * np.median(found.points)


def test_support_follows_the_chainage():
    """Gaps in one rail and few points on the other, along a centerline in the opposite direction."""
    left, right = Track(trace([Element(40.0)]), GAUGE + WIDTH).rails()
    stations = np.arange(0.125, 40, 0.25)
    even = Support.of_one_strip(stations, np.full(160, 10), np.full(160, 0.003))
    uneven = Support.of_one_strip(stations, np.where(stations < 20, 10, 2), np.where(stations < 20, 0.004, 0.008))
    first, second = rails_of(left, right)
    first = replace(first, gaps=np.array([[5.1, 8.1]]), support=even)
    second = replace(second, support=uneven)
    line = centerline_of(0.5 * (left + right)[::-1], left_ids=(2,), right_ids=(1,))
    (found,) = measure_track_geometry([line], [first, second], WIDTH, step_m=0.5)
    t = 40 - found.chainage_m
    np.testing.assert_array_equal(found.bridged, (t > 5.1) & (t < 8.1))
    np.testing.assert_allclose(found.points[(t > 1) & (t < 19)], 40)
    np.testing.assert_allclose(found.points[(t > 21) & (t < 39)], 24)
    np.testing.assert_allclose(found.sigma_mm[t < 19], 2.5)
    np.testing.assert_allclose(found.sigma_mm[t > 21], 0.5 * np.hypot(3, 8))


def test_lines_from_other_software_are_measured_without_ids_or_heights():
    left, right = curved_track().rails()
    middle = curved_track().centerline[::50, :2]
    line = Centerline(np.column_stack([middle, np.full(len(middle), np.nan)]), 7, 0, (), (), *[np.nan] * 5)
    rails = rails_of(left * [1, 1, np.nan], right * [1, 1, np.nan])
    (found,) = measure_track_geometry([line], rails, WIDTH)
    assert found.track_id == 7
    np.testing.assert_allclose(found.gauge_mm, 1435.0, atol=2.5)  # in plan: cant accounts for 2 mm
    assert np.isnan(found.cant_mm).all()
    assert np.isnan(found.twist_mm).all()
    assert np.isnan(found.grade_pm).all()


def test_short_and_single_lines_give_what_can_be_measured():
    left, right = Track(trace([Element(2.0)]), GAUGE + WIDTH).rails()
    line = centerline_of(0.5 * (left + right))
    (short,) = measure_track_geometry([line], rails_of(left, right), WIDTH)
    np.testing.assert_allclose(short.chainage_m, [0, 1, 2])
    np.testing.assert_allclose(short.gauge_mm, 1435.0, atol=1e-6)
    assert np.isnan(short.radius_m).all()
    (alone,) = measure_track_geometry([line], rails_of(left), WIDTH)
    assert np.isnan(alone.gauge_mm).all()
    assert alone.bridged.all()
    assert measure_track_geometry([], rails_of(left, right), WIDTH) == ()


class RawRaster:
    """An engine that leaves the raster as it is."""

    description, max_cells = "none", 1 << 22

    def sweep(self, seen, *_):
        return seen


def test_one_run_measures_every_track_of_every_class_on_request(monkeypatch):
    monkeypatch.setattr(steps, "load_arrays", lambda path: {})
    monkeypatch.setattr(steps, "make_engine", lambda *_: RawRaster())
    track = Track(trace([Element(30.0)], heading=0.3), GAUGE + WIDTH, cant_m=0.02)
    random = np.random.RandomState(1)
    heads = [scan(track.railhead(side), WIDTH, track.centerline, Scanner(), random) for side in (1, -1)]
    clouds = [cloud_of(*heads, code=11), cloud_of(*(head + [0.0, 20.0, 0.0] for head in heads))]
    network = pipeline.extract_rails(clouds, pipeline.Parameters(GAUGE, WIDTH, quality_step_m=2.0))
    assert [found.track_id for found in network.geometry] == [line.track_id for line in network.centerlines] == [1, 2]
    for found, line in zip(network.geometry, network.centerlines):
        np.testing.assert_allclose(np.diff(found.chainage_m)[:-1], 2.0)
        assert rms(found.cant_mm - 20.0) < 1.0
        np.testing.assert_allclose(found.xyz[0], line.xyz[0])
    assert network.rails[0].class_code == 11
    assert pipeline.extract_rails(clouds[:1], pipeline.Parameters(GAUGE, WIDTH)).geometry == ()


@pytest.mark.parametrize("step_m", [0.25, 1.0, 3.0])
def test_points_of_stations_add_up_to_those_of_the_rails(step_m):
    left, right = curved_track().rails()
    rails = rails_of(left, right, points=60)
    (found,) = measure_track_geometry(build_centerlines(rails, Parameters(GAUGE, WIDTH)), rails, WIDTH, step_m)
    assert abs(found.points.sum() - 120) <= 1


def test_a_millimetre_does_not_make_a_radius_on_a_short_piece():
    x = np.arange(0, 3.3, 0.1)
    sag = 0.001 * np.sin(np.pi * x / x[-1])  # versine 1 mm: a radius of 1.3 km
    left, right = (np.column_stack([x, sag + side * 0.5 * (GAUGE + WIDTH), 0 * x]) for side in (1, -1))
    rails = rails_of(left, right)
    (found,) = measure_track_geometry(build_centerlines(rails, Parameters(GAUGE, WIDTH)), rails, WIDTH)
    assert np.isnan(found.radius_m).all()
