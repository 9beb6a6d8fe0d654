"""Compare Tracks through qgis_process: the sample's rails compared with their exact truth."""

import json

import numpy as np
import pytest
from lines import read_features


@pytest.fixture(scope="module")
def compared(extracted, sample, succeed, tmp_path_factory):
    """The truth as the reference, and the rails that were extracted."""
    folder = tmp_path_factory.mktemp("Vergleich östlich 1")
    truth = json.loads((sample / "sample_truth.geojson").read_text(encoding="utf-8"))
    truth["features"] = [one for one in truth["features"] if one["properties"]["kind"] == "rail"]
    reference = folder / "Wahrheit.geojson"
    reference.write_text(json.dumps(truth), encoding="utf-8")
    outputs = {"OUTPUT": folder / "Abweichungen.gpkg", "REPORT": folder / "Bericht.html"}
    given = {"REFERENCE": reference, "INPUT": extracted.rails, "REFERENCE_SIGMA": 0, "IGNORE_SHIFT": False}
    return succeed("comparetracks", {**given, **outputs}), outputs


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
