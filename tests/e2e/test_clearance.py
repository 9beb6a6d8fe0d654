"""Measure Clearance through qgis_process: objects at known depths, a platform, a wire, and the report."""

import numpy as np
import pytest
from lines import read_features
from rail_extract.core.disk import Destination
from rail_extract.core.fields import CENTERLINES, RAILS
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.files.writing import write_layers
from rail_extract.core.frame import LocalFrame
from rail_extract.laboratory.scenes import clearance as scenes

DEPTHS_MM = (150.0, 80.0, 30.0, 15.0)


@pytest.fixture(scope="module")
def measured(succeed, tmp_path_factory):
    """A curve with plates inside and outside of the profile, a platform and a wire."""
    folder = tmp_path_factory.mktemp("Lichtraum größer 1")
    scene = scenes.double_track(1, 500.0, scenes.SHORT, apart_m=4.0)
    scenes.bed(scene)
    for number, depth_mm in enumerate(DEPTHS_MM):
        scenes.plate(scene, 20.0 + 12.0 * number, 1, 1.645 - depth_mm / 1000, (1.5, 2.5))
        scenes.plate(scene, 26.0 + 12.0 * number, 1, 1.645 + depth_mm / 1000, (1.5, 2.5))
    scenes.platform(scene, (10.0, 80.0), -1, 1.70, 0.55)
    scenes.catenary(scene)
    scenes.write_points(folder / "Wolke.laz", scene.points, scene.codes)
    tracks, rails = scenes.lines_of(scene)
    network = folder / "Netz.gpkg"
    layers = [lines_layer(RAILS, rails), lines_layer(CENTERLINES, tracks)]
    write_layers(layers, Destination.at(network), LocalFrame(np.zeros(3)))
    outputs = {name: folder / f"{name}.gpkg" for name in ("INTRUSIONS", "OUTPUT", "PLATFORMS", "WIRES")}
    outputs["REPORT"] = folder / "Bericht.html"
    given = {
        "INPUT": f"{network}|layername=centerlines",
        "RAILS": f"{network}|layername=rails",
        "POINTS": folder / "Wolke.laz",
    }
    return succeed("measureclearance", {**given, **outputs}), outputs


def test_objects_are_found_at_their_depths(measured):
    results, outputs = measured
    rows = [values for _, values in read_features(outputs["INTRUSIONS"])]
    assert results["INTRUSION_COUNT"] == len(rows) == len(DEPTHS_MM)
    assert [row["pen_mm"] for row in rows] == pytest.approx(DEPTHS_MM, abs=4)
    assert {(row["track_id"], row["side"], row["sure"]) for row in rows} == {(1, "left", 1)}
    assert results["LEAST_MARGIN"] == pytest.approx(-150, abs=4)


def test_stations_state_margins_and_the_neighbour_track(measured):
    _, outputs = measured
    rows = [values for _, values in read_features(outputs["OUTPUT"]) if values["track_id"] == 1]
    assert len(rows) == 90
    assert [row["ldist_m"] for row in rows[2:-2]] == pytest.approx([4.0] * 86, abs=0.001)
    assert {row["ltrack"] for row in rows[2:-2]} == {2}
    assert rows[20]["lmar_mm"] == pytest.approx(-160, abs=12)
    assert rows[40]["roff_mm"] == pytest.approx(1700, abs=5)
    assert rows[40]["wire_mm"] == pytest.approx(5510, abs=20)
    assert rows[85]["cant_mm"] == pytest.approx(-120, abs=0.5)


def test_platform_and_wire(measured):
    results, outputs = measured
    ((_, platform),) = read_features(outputs["PLATFORMS"])
    assert (platform["offset_mm"], platform["height_mm"]) == pytest.approx((1700, 550), abs=2)
    assert platform["nominal_mm"] == 550
    ((_, wire),) = read_features(outputs["WIRES"])
    assert wire["length_m"] == pytest.approx(60, abs=2)
    assert results["WIRE_LENGTH"] == pytest.approx(wire["length_m"], abs=0.1)


def test_the_report_says_it_in_words(measured):
    _, outputs = measured
    page = outputs["REPORT"].read_text(encoding="utf-8")
    assert "4 places inside the profile, the worst 1" in page
    assert page.count("<svg") >= 2 + len(DEPTHS_MM)
