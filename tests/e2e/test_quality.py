"""Track geometry, report and cleaned raster of the sample, compared with the truth, through qgis_process."""

import re

import numpy as np
import pytest
from osgeo import ogr

STANDARD = "IN_75R_1000"
HEAD_M = 0.06191
GAUGE_MM = 1000.0

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


@pytest.fixture(scope="module")
def measured(extracted, truth):
    """Stations of each true track from west to east: fields and the true values."""
    places, values = read_points(extracted.quality)
    rails, centerlines = truth("rail"), truth("centerline")
    tracks = []
    for line in centerlines:
        # The middle of each rail is half the rail spacing from the middle of its centerline.
        mine = sorted(rails, key=lambda rail: np.hypot(*(rail[len(rail) // 2] - line[len(line) // 2])[:2]))[:2]
        left, right = sorted(mine, key=lambda rail: -sideways(line, rail[len(rail) // 2]))
        near = np.array([abs(sideways(line, place)) < 0.3 for place in places])
        tracks.append(({name: column[near] for name, column in values.items()}, line, left, right, places[near]))
    assert sum(len(track[4]) for track in tracks) == len(places)
    return tracks


def foot(line, place):
    """Return the nearest point on a line, (3,), its plan chainage, and the offset of the given point to the left."""
    start, step = line[:-1], np.diff(line, axis=0)
    length = np.hypot(*step.T[:2])
    share = np.clip(((place - start)[:, :2] * step[:, :2]).sum(axis=1) / length**2, 0, 1)
    feet = start + share[:, None] * step
    away = place[:2] - feet[:, :2]
    number = np.hypot(*away.T).argmin()
    left = (step[number, 0] * away[number, 1] - step[number, 1] * away[number, 0]) / length[number]
    return feet[number], length[:number].sum() + share[number] * length[number], left


def sideways(line, place):
    return foot(line, place)[2]


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def test_gauge_and_cant_match_the_truth(measured):
    off = []
    for values, _, left, right, places in measured:
        true_left, true_right = (np.array([foot(rail, place)[0] for place in places]) for rail in (left, right))
        gauge_mm = 1000 * (np.linalg.norm(true_left - true_right, axis=1) - HEAD_M)
        np.testing.assert_allclose(gauge_mm, GAUGE_MM, atol=1)
        cant_mm = 1000 * (true_left - true_right)[:, 2]
        assert cant_mm.min() < -19  # the left rail is the lower one in this curve to the left
        supported = values["bridged"] == 0
        off.append(
            [rms((values[name] - true)[supported]) for name, true in (("gauge_mm", gauge_mm), ("cant_mm", cant_mm))]
        )
    assert np.max(off) <= ALL
    assert np.min(off, axis=0)[0] <= DENSE
    assert np.min(off, axis=0)[1] <= DENSE


def test_radius_gradient_and_twist_match_the_truth(measured):
    for values, line, left, right, places in measured:
        along = np.array([foot(line, place)[1] for place in places])
        vertices = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T[:2]))])

        def at(t, vertices=vertices, line=line):
            return np.column_stack([np.interp(t, vertices, column) for column in line.T])

        inner = (along > 15) & (along < vertices[-1] - 15)
        before, here, after = at(along - 10), at(along), at(along + 10)
        first, second = (here - before)[:, :2], (after - here)[:, :2]
        turn = np.arctan2(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0], (first * second).sum(axis=1))
        curvature = turn / np.hypot(*second.T)
        found = np.nan_to_num(1 / values["radius_m"])
        assert rms((found - curvature)[inner]) < 1e-4
        curved = inner & (curvature > 4e-4)
        assert curved.sum() > 50
        assert np.median(np.abs(found / curvature - 1)[curved]) < 0.1
        assert (values["radius_m"][curved] > 0).all()  # to the left
        assert np.isnan(values["radius_m"][inner & (along < 30)]).all()
        grade_pm = 1000 * (at(along + 5) - at(along - 5))[:, 2] / 10
        assert rms((values["grade_pm"] - grade_pm)[inner]) < 0.2
        cants = [
            1000 * np.array([foot(left, place)[0][2] - foot(right, place)[0][2] for place in at(along + step)])
            for step in (-1.5, 1.5)
        ]
        assert rms((values["twist_mm"] - (cants[1] - cants[0]))[inner]) < 2


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
