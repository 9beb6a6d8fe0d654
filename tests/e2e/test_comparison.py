"""Compare Tracks through qgis_process: the sample's rails compared with their exact truth."""

import json
import re

import numpy as np
import pytest
from lines import read_features


@pytest.fixture(scope="module")
def compared(extracted, sample, qgis_process, tmp_path_factory):
    """The truth as the reference, and the rails that were extracted."""
    folder = tmp_path_factory.mktemp("Vergleich östlich 1")
    truth = json.loads((sample / "sample_truth.geojson").read_text(encoding="utf-8"))
    truth["features"] = [one for one in truth["features"] if one["properties"]["kind"] == "rail"]
    reference = folder / "Wahrheit.geojson"
    reference.write_text(json.dumps(truth), encoding="utf-8")
    outputs = {"OUTPUT": folder / "Abweichungen.gpkg", "REPORT": folder / "Bericht.html"}
    given = {"REFERENCE": reference, "INPUT": extracted.rails, "REFERENCE_SIGMA": 0, "IGNORE_SHIFT": False}
    run = qgis_process({**given, **outputs}, "--json", algorithm="railextract:comparetracks")
    assert run.returncode == 0, run.stdout + run.stderr
    return json.loads(run.stdout[run.stdout.index("{") :])["results"], outputs


def test_the_sample_lies_where_its_truth_is(compared):
    results, _ = compared
    assert results["COMPARED_LENGTH"] == pytest.approx(960, abs=12)
    assert results["MISSING_LENGTH"] < 5
    assert results["EXTRA_LENGTH"] < 5
    assert results["ACROSS_RMS"] < 2
    assert results["HEIGHT_RMS"] < 1
    assert max(abs(results[name]) for name in ("SHIFT_NORTH", "SHIFT_UP")) < 0.5


def test_differences_and_their_stated_errors(compared):
    results, outputs = compared
    rows = [values for _, values in read_features(outputs["OUTPUT"]) if values["state"] == "both"]
    across, sigma, gauge = (
        np.array([row[name] for row in rows if row[name] is not None], dtype=float)
        for name in ("across_mm", "sigma_mm", "gauge_mm")
    )
    assert len(rows) == pytest.approx(results["COMPARED_LENGTH"], abs=12)
    assert np.sqrt(np.mean(across**2)) == pytest.approx(results["ACROSS_RMS"], abs=0.02)
    assert np.mean(np.abs(across) <= 3 * sigma) > 0.8
    assert len(gauge) > 0.95 * len(rows)
    assert abs(np.median(gauge)) < 1.0
    marked = results["MOVED_LENGTH"] / results["COMPARED_LENGTH"]
    assert marked == pytest.approx(np.mean([row["moved"] for row in rows]), abs=0.02)


def test_the_report_states_the_figures(compared):
    results, outputs = compared
    page = outputs["REPORT"].read_text(encoding="utf-8")
    assert re.search("<strong>.* moved by more than 3 standard errors", page)
    assert f"<b>{results['ACROSS_RMS']:.1f} mm</b>" in page
    assert page.count("Line ") >= 6


def test_a_ring_and_a_track_that_is_missing(qgis_process, tmp_path):
    angle = np.linspace(0, 2 * np.pi, 1001)
    ring = np.column_stack([500_000 + 150 * np.cos(angle), 3_000_000 + 150 * np.sin(angle), 0 * angle + 20])
    straight = np.column_stack([500_200 + 0 * angle, 3_000_000 + 0.1 * np.arange(1001), 0 * angle + 20])
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32643"}}
    for name, lines in (("before", [ring, straight]), ("after", [ring[::-1] + [0, 0.012, 0.004]])):
        features = [
            {
                "type": "Feature",
                "properties": {"track_id": number},
                "geometry": {"type": "LineString", "coordinates": line.tolist()},
            }
            for number, line in enumerate(lines, 1)
        ]
        made = {"type": "FeatureCollection", "crs": crs, "features": features}
        (tmp_path / f"{name}.geojson").write_text(json.dumps(made), encoding="utf-8")
    given = {"REFERENCE": tmp_path / "before.geojson", "INPUT": tmp_path / "after.geojson", "REFERENCE_SIGMA": 1}
    given = {**given, "INPUT_SIGMA": 1, "OUTPUT": tmp_path / "differences.gpkg"}
    run = qgis_process(given, "--json", algorithm="railextract:comparetracks")
    assert run.returncode == 0, run.stdout + run.stderr
    results = json.loads(run.stdout[run.stdout.index("{") :])["results"]
    assert results["COMPARED_LENGTH"] == pytest.approx(300 * np.pi, abs=1)
    assert results["MISSING_LENGTH"] == pytest.approx(100, abs=1)
    assert (results["SHIFT_NORTH"], results["SHIFT_UP"]) == (pytest.approx(12, abs=0.2), pytest.approx(4, abs=0.1))
    assert results["MOVED_LENGTH"] == 0
