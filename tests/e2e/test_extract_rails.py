import signal
from importlib.util import find_spec

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


def test_results_match_the_files(extracted):
    for path, figure in ((extracted.rails, "RAIL"), (extracted.centerlines, "CENTERLINE")):
        features = read_features(path)
        assert extracted.results[f"{figure}_COUNT"] == len(features)
        length_m = sum(items["length_m"] for _, items in features)
        assert extracted.results[f"{figure}_LENGTH"] == pytest.approx(length_m, abs=0.01)
    assert extracted.results["ENGINE_USED"].startswith("PyTorch" if find_spec("torch") else "OpenCV")


def test_rails_against_truth(extracted, truth):
    comparison = compare_lines(read_lines(extracted.rails), truth("rail"))
    assert comparison.completeness >= MIN_SHARE
    assert comparison.correctness >= MIN_SHARE
    assert comparison.lateral_rmse_m <= MAX_LATERAL_M
    assert comparison.height_rmse_m <= MAX_HEIGHT_M
    assert (comparison.line_count, comparison.truth_count) == (6, 6)


def test_centerlines_against_truth(extracted, truth):
    comparison = compare_lines(read_lines(extracted.centerlines), truth("centerline"))
    assert comparison.completeness >= MIN_SHARE
    assert comparison.correctness >= MIN_SHARE
    assert comparison.lateral_rmse_m <= MAX_LATERAL_M
    assert comparison.height_rmse_m <= MAX_HEIGHT_M
    assert (comparison.line_count, comparison.truth_count) == (3, 3)
    for _, items in read_features(extracted.centerlines):
        assert items["gauge_mm"] == pytest.approx(TRUE_GAUGE_MM, abs=MAX_GAUGE_MM)


def test_centerlines_refer_to_their_rails(extracted):
    rail_ids = {items["rail_id"] for _, items in read_features(extracted.rails)}
    for _, items in read_features(extracted.centerlines):
        left, right = ({int(word) for word in items[side].split(",")} for side in ("left_ids", "right_ids"))
        assert left | right <= rail_ids
        assert not left & right


def test_lines_start_in_the_west(extracted):
    for line in read_lines(extracted.rails) + read_lines(extracted.centerlines):
        assert line[0, 0] < line[-1, 0]


def test_bad_input_is_one_sentence_and_an_exit_code(qgis_process, sample, tmp_path):
    rails = tmp_path / "rails.gpkg"
    given = {"INPUT": sample / "sample.laz", "STANDARD": STANDARD, "RAIL_CLASSES": "40", "RAILS": rails}
    run = qgis_process(given)
    assert run.returncode == 1
    said = run.stdout + run.stderr
    assert "has no points of class 40; its classes, with the number of points, are 1 (" in said
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())


def wait_for(stream, text):
    """Read until `text` has been printed."""
    shown = b""
    while text not in shown:
        letter = stream.read(1)
        assert letter, f"the run ended without printing {text}: {shown}"
        shown += letter


def test_interrupted_run_leaves_nothing(start_qgis_process, sample, tmp_path):
    parameters = {"INPUT": sample / "sample.laz", "STANDARD": STANDARD, "RAILS": tmp_path / "rails.gpkg"}
    with start_qgis_process(parameters) as process:
        wait_for(process.stdout, b"...20")
        process.send_signal(signal.SIGINT)
    assert process.returncode != 0
    assert not list(tmp_path.iterdir())
