"""Track geometry of line layers: values, signs, units, and inconsistent inputs."""

import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import QgsVectorLayer
from rail_extract.core.jobs import track_inputs

SPACING_MM = 1507.0
RADIUS_M = 300.0
CANT_MM = 60.0
PLACE = np.array([500_000.0, 3_000_000.0, 100.0])

LAST_DIGIT = 0.11
"""Numbers that differ by less than the last decimal may be rounded differently."""


def curve(offset_m, rise_m, radius_m=RADIUS_M, length_m=60.0, unit_m=1.0):
    """Create a line parallel to a left-hand curve, offset to the left and raised; 4 per mille uphill."""
    angle = np.linspace(0, length_m / radius_m, 121)
    r = radius_m - offset_m
    xyz = np.column_stack([r * np.sin(angle), radius_m - r * np.cos(angle), 0.004 * radius_m * angle + rise_m])
    return xyz / unit_m + PLACE


def curved_track(**kind):
    """Centerline, left rail and right rail of a left-hand curve, in which the left rail is the lower one."""
    half = 0.5 * np.sqrt((SPACING_MM / 1000) ** 2 - (CANT_MM / 1000) ** 2)
    rise = CANT_MM / 2000
    return curve(0, 0, **kind), curve(half, -rise, **kind), curve(-half, rise, **kind)


@pytest.fixture
def measure(run_table):
    """Measure tracks, and return the outcome and the values of the points by field."""

    def run(centerlines, rails, feedback=None, **parameters):
        given = {"INPUT": centerlines, "RAILS": rails, **parameters}
        results, layer, values, _ = run_table("measuretrackgeometry", feedback, **given)
        return results, layer, {name: np.array(column, dtype=float) for name, column in values.items()}

    return run


def test_without_a_cloud_support_comes_from_the_fields_of_the_rails(measure):
    middle, left, right = curved_track()
    fields = "&field=rail_id:integer&field=class_code:integer&field=points:integer&field=sigma_mm:double"
    rails = layer_of(left, right, fields=fields, values=[(4, 10, 600, 3.0), (9, 10, 1200, 4.0)])
    fields = "&field=track_id:integer&field=left_ids:string(20)&field=right_ids:string(20)&field=gauge_mm:double"
    lines = layer_of(middle, fields=fields, values=[(12, "4", "9", 1435.0)])
    results, _, values = measure(lines, rails)
    assert set(values["track_id"]) == {12}
    np.testing.assert_allclose(values["sigma_mm"], 2.5, rtol=1e-6)
    assert results["SIGMA"] == pytest.approx(2.5)
    np.testing.assert_allclose(values["points"][1:-1], 30, atol=1)


def test_a_cloud_is_measured_square_by_square(run, measure, write_cloud, track, tmp_path, monkeypatch):
    """Squares of four metres give the same values as a single square; sections of a head begin elsewhere in them."""
    cloud, sigma_off_mm = write_cloud(track()), 0.8
    paths = {name: tmp_path / f"{name}.gpkg" for name in ("RAILS", "CENTERLINES")}
    assert run({"INPUT": cloud, "ITERATIONS": 1, **paths}).ok
    given = str(paths["CENTERLINES"]), str(paths["RAILS"])
    _, _, whole = measure(*given, POINTS=str(cloud))
    monkeypatch.setattr(track_inputs, "SQUARE_M", 4.0)
    _, _, parts = measure(*given, POINTS=str(cloud))
    for name, values in whole.items():
        off = 1 if name == "points" else LAST_DIGIT  # a point between two stations may be rounded to either
        off = sigma_off_mm if name == "sigma_mm" else off
        np.testing.assert_allclose(parts[name], values, rtol=1e-4, atol=off, err_msg=name)


def test_a_different_head_width_gives_a_warning(measure, new_feedback):
    middle, left, right = curved_track()
    lines = layer_of(middle, fields="&field=gauge_mm:double", values=[(1435.0,)])
    feedback = new_feedback()
    measure(lines, layer_of(left, right), feedback, HEAD_WIDTH=66)
    assert "differs by +6.0 mm" in feedback.warnings[0]
    assert "check HEAD_WIDTH" in feedback.warnings[0]


def test_a_line_without_rails_gives_a_warning(measure, new_feedback):
    middle, left, right = curved_track()
    feedback = new_feedback()
    _, _, values = measure(layer_of(middle, middle + [0, 50, 0]), layer_of(left, right), feedback)
    assert "Tracks 2 do not have rails on both sides" in feedback.warnings[0]
    away = values["track_id"] == 2
    assert np.isnan(values["gauge_mm"][away]).all()
    assert values["bridged"][away].all()


def test_report_and_findings_judge_lines_from_files(measure, tmp_path):
    """The gauge is compared with that of the standard, with GAUGE and with OTHER_GAUGES."""
    middle, left, right = curved_track()
    lines, rails, report = layer_of(middle), layer_of(left, right), tmp_path / "report.html"
    paths = {"FINDINGS": str(tmp_path / "findings.gpkg"), "REPORT": str(report)}
    measure(lines, rails, **paths)
    assert QgsVectorLayer(paths["FINDINGS"]).featureCount() == 0
    html = report.read_text(encoding="utf-8")
    for words in ("Good throughout", "railextract:measuretrackgeometry", "EN 60E1", "60 m", "lines"):
        assert words in html, words
    for more, count in (({"GAUGE": 1420}, 1), ({"GAUGE": 1000}, 1), ({"GAUGE": 1000, "OTHER_GAUGES": "1435"}, 0)):
        measure(lines, rails, **paths, **more)
        findings = list(QgsVectorLayer(paths["FINDINGS"]).getFeatures())
        assert [finding["reason"] for finding in findings] == count * [
            "gauge off by more than 10 mm and 4 standard errors"
        ], more
    measure(lines, rails, **paths, STANDARD="CUSTOM", HEAD_WIDTH=72)
    assert "72 mm head, 1435 mm as measured" in report.read_text(encoding="utf-8")


def test_an_axis_gives_stations_findings_and_report_their_kilometres(run_step, context, tmp_path):
    """The axis is a straight beside the curve: kilometres come from it and not from the length of the track."""
    middle, left, right = curved_track()
    axis = layer_of(np.array([[0.0, 0], [70, 0]]) + PLACE[:2], kind="LineString")
    given = {"INPUT": layer_of(middle), "RAILS": layer_of(left, right[:61]), "AXIS": axis, "START_KM": 7.35}
    outputs = {"OUTPUT": "memory:", "FINDINGS": "memory:", "REPORT": tmp_path / "report.html"}
    outcome = run_step("measuretrackgeometry", {**given, **outputs})
    assert outcome.ok, outcome.error
    stations, findings = (context.getMapLayer(outcome.results[name]) for name in ("OUTPUT", "FINDINGS"))
    names = ["axis", "piece", "km", "km_text", "offset_m", "side", "ambiguous"]
    assert stations.fields().names()[-8:] == ["sigmaz_mm", *names]
    rows = list(stations.getFeatures())
    east = np.array([feature.geometry().asPoint().x() for feature in rows]) - PLACE[0]
    north = np.array([feature.geometry().asPoint().y() for feature in rows]) - PLACE[1]
    np.testing.assert_allclose([feature["km"] for feature in rows], 7.35 + east / 1000, atol=2e-6)
    np.testing.assert_allclose([feature["offset_m"] for feature in rows], north, atol=0.001)
    assert {feature["side"] for feature in rows[1:]} == {"left"}
    assert rows[30]["km_text"] == "7.3+79.95"
    assert findings.fields().names()[-2:] == ["km", "km_text"]
    worst = next(findings.getFeatures())
    nearest = min(rows, key=lambda feature: abs(feature["chainage_m"] - worst["worst_m"]))
    assert (worst["km"], worst["km_text"]) == (nearest["km"], nearest["km_text"])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"<td>{worst['km_text']}</td>" in page
    assert f"<td>{rows[0]['km_text']} to {rows[-1]['km_text']}</td>" in page
    assert ">7.3+79.95</text>" in page  # below the profiles
