import pytest
from lines import read_features, read_lines
from rail_extract.laboratory.ruler.lines import compare_lines

STANDARD = "IN_75R_1000"
TRUE_GAUGE_MM = 1000
MAX_LATERAL_M, MAX_HEIGHT_M, MAX_GAUGE_MM = 1.5 * 0.0019, 1.5 * 0.0004, 1.5 * 0.8
"""Greatest RMSE of the rails in plan and in height, and greatest error of a track's gauge: 1.5 times the figures that
the README states."""

MIN_SHARE = 0.999
"""Smallest share of the lines to be found and to be correct; the README states 100.0 %."""


@pytest.mark.parametrize(("kind", "count"), [("rail", 6), ("centerline", 3)])
def test_lines_against_truth(extracted, truth, kind, count):
    path = extracted.rails if kind == "rail" else extracted.centerlines
    comparison = compare_lines(read_lines(path), truth(kind))
    assert comparison.completeness >= MIN_SHARE
    assert comparison.correctness >= MIN_SHARE
    assert comparison.lateral_rmse_m <= MAX_LATERAL_M
    assert comparison.height_rmse_m <= MAX_HEIGHT_M
    assert (comparison.line_count, comparison.truth_count) == (count, count)


def test_gauge_against_truth(extracted):
    for _, items in read_features(extracted.centerlines):
        assert items["gauge_mm"] == pytest.approx(TRUE_GAUGE_MM, abs=MAX_GAUGE_MM)


def test_bad_input_is_one_sentence_and_an_exit_code(qgis_process, sample, tmp_path):
    rails = tmp_path / "rails.gpkg"
    given = {"INPUT": sample / "sample.laz", "STANDARD": STANDARD, "RAIL_CLASSES": "40", "RAILS": rails}
    run = qgis_process(given)
    assert run.returncode == 1
    said = run.stdout + run.stderr
    assert "has no points of class 40; its classes, with the number of points, are 1 (" in said
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())
