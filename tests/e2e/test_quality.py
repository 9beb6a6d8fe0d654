"""Track geometry, report and cleaned raster of the sample, compared with the truth, through qgis_process."""

import re

import numpy as np
import pytest
from osgeo import ogr

STANDARD = "IN_75R_1000"

DENSE, ALL = 2.0, 4.0
"""Greatest RMSE of gauge and cant, in millimetres, on the track with most points and on any track."""


def read_points(path):
    """Read the positions, (n, 3), and the values by field, (n,), of a point layer."""
    source = ogr.Open(str(path))
    features = [(feature.geometry().GetPoint(), feature.items()) for feature in source.GetLayer()]
    values = {
        name: np.array([np.nan if items[name] is None else items[name] for _, items in features], dtype=float)
        for name in features[0][1]
    }
    return np.array([place for place, _ in features]), values


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def test_measuring_from_files_gives_the_same_values(extracted, succeed, tmp_path):
    output = tmp_path / "quality.gpkg"
    parameters = {"INPUT": extracted.centerlines, "RAILS": extracted.rails, "POINTS": extracted.cloud}
    results = succeed("measuretrackgeometry", {**parameters, "STANDARD": STANDARD, "OUTPUT": output})
    whole, again = read_points(extracted.quality), read_points(output)
    np.testing.assert_allclose(again[0], whole[0], atol=1e-6)
    for name, values in whole[1].items():
        np.testing.assert_allclose(again[1][name], values, rtol=1e-3, atol=0.11, err_msg=name)
    for figure in ("STATION_COUNT", "SIGMA", "BRIDGED_LENGTH"):
        assert results[figure] == pytest.approx(extracted.results[figure], abs=0.011)
    assert results["STATION_COUNT"] == len(again[0])


def test_results_contain_the_figures(extracted):
    _, values = read_points(extracted.quality)
    assert extracted.results["STATION_COUNT"] == len(values["track_id"])
    assert extracted.results["SIGMA"] == pytest.approx(rms(values["sigma_mm"]), abs=0.011)
    assert extracted.results["BRIDGED_LENGTH"] == pytest.approx(values["bridged"].sum(), abs=2)
    for name in ("QUALITY", "CLEANED", "REPORT"):
        assert extracted.results[name] == str(getattr(extracted, name.lower()))


def test_report_states_the_figures(extracted):
    html = extracted.report.read_text(encoding="utf-8")
    assert re.search("<strong>(Good|Usable)", html)
    assert f"<b>{extracted.results['CENTERLINE_COUNT']}</b>" in html
    assert html.count("<svg") == 1 + extracted.results["CENTERLINE_COUNT"]
    for words in ("Schienen 1.laz", "1000 mm", "61.91 mm", "EPSG:32643", extracted.results["ENGINE_USED"]):
        assert words in html


def test_help_on_the_command_line_is_text(qgis_process_help):
    text = qgis_process_help("railextract:measuretrackgeometry")
    assert "chainage_m" in text
    assert "<img" not in text
