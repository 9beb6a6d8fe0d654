"""The four steps, individually and chained."""

import re
from dataclasses import replace

import numpy as np
import pytest
from lines import farthest, read_features, read_lines
from qgis.core import QgsRasterLayer
from rail_extract.core.frpdf import engines
from rail_extract.core.raster import cell_size
from rail_extract.rail_extract_plugin.reading.geotiff import read_header, read_rasters

LAST_DIGIT = 0.11
"""Numbers that differ by less than the last decimal may be rounded differently."""


@pytest.fixture
def cloud(write_cloud, track):
    return write_cloud(track())


@pytest.fixture
def chain(run_step, tmp_path):
    """Run the steps one after the other, and return the paths of their outputs."""

    def run(cloud, standard=None, folder=tmp_path):
        standard = standard or {}
        raster, cleaned, rails, tracks = (folder / f"{name}" for name in ("räster 1.tif", "c.tif", "r.gpkg", "t.gpkg"))
        for name, parameters in (
            ("rasterizerailpoints", {"INPUT": cloud, **standard, "OUTPUT": raster}),
            ("frpdfcleanup", {"INPUT": raster, "ITERATIONS": 1, "OUTPUT": cleaned}),
            ("vectorizerails", {"INPUT": cleaned, "POINTS": cloud, "OUTPUT": rails}),
            ("buildtrackcenterlines", {"INPUT": rails, **standard, "OUTPUT": tracks}),
        ):
            outcome = run_step(name, parameters)
            assert outcome.ok, outcome.error
        return raster, cleaned, rails, tracks

    return run


def test_chained_steps_give_the_lines_of_extract_rails(chain, run, write_cloud, track, tmp_path):
    points = track()
    left, x = points[:, 1] > 3_000_000, points[:, 0] - 500_000
    cloud = write_cloud(points[~((left & (np.abs(x - 4.5) < 1)) | (~left & (np.abs(x - 8) < 1)))])
    whole = {"RAILS": tmp_path / "rails.gpkg", "CENTERLINES": tmp_path / "tracks.gpkg"}
    assert run({"INPUT": cloud, "ITERATIONS": 1, **whole}).ok
    _, _, rails, tracks = chain(cloud)
    for mine, theirs in ((rails, whole["RAILS"]), (tracks, whole["CENTERLINES"])):
        assert farthest(read_lines(mine), read_lines(theirs)) < 0.001
    for mine, theirs in zip(read_features(rails), read_features(whole["RAILS"])):
        # Rails know their tracks once they are paired: the centerlines step returns them with track_ids.
        assert (mine[1].pop("track_ids") or "", theirs[1].pop("track_ids")) == ("", "1")
        assert mine[1].pop("gaps") == theirs[1].pop("gaps")
        assert mine[1] == pytest.approx(theirs[1], rel=1e-6, abs=LAST_DIGIT)
    ((_, mine),), ((_, theirs),) = read_features(tracks), read_features(whole["CENTERLINES"])
    assert mine["bridged_m"] == pytest.approx(theirs["bridged_m"], abs=2 * LAST_DIGIT)
    assert mine["bridged_m"] == pytest.approx(4.0, abs=0.2)


@pytest.fixture
def raster(run_step, cloud, tmp_path):
    """The raster of a short track with dense points, which can be vectorized without the network."""
    outcome = run_step("rasterizerailpoints", {"INPUT": cloud, "OUTPUT": tmp_path / "raster.tif"})
    assert outcome.ok, outcome.error
    return tmp_path / "raster.tif"


def test_rasterize_alone(raster, track):
    header = read_header(raster)
    assert (header.class_codes, header.cell_m) == ((10,), pytest.approx(cell_size(1.435, 0.072)))
    (found,) = read_rasters(raster, header)
    cells = np.floor((track()[:, :2] - header.frame.origin[:2]) / header.cell_m)
    # Coordinates in the file are rounded to millimetres, so a point may move to the next cell.
    assert found.count() == pytest.approx(len(np.unique(cells, axis=0)), rel=0.02)
    layer = QgsRasterLayer(str(raster), "raster")
    assert layer.crs().authid() == "EPSG:32643"
    assert layer.width() * layer.height() == header.window[2] * header.window[3]


def test_rasterize_makes_one_band_per_class(run_step, write_cloud, track, tmp_path):
    for code in (11, 10):
        write_cloud(track() + [0, 0.2 * code, 0], f"{code}.las", class_code=code)
    outcome = run_step(
        "rasterizerailpoints", {"INPUT": tmp_path, "RAIL_CLASSES": "10,11", "OUTPUT": tmp_path / "both.tif"}
    )
    assert outcome.ok, outcome.error
    header = read_header(tmp_path / "both.tif")
    rasters = read_rasters(tmp_path / "both.tif", header)
    assert header.class_codes == (10, 11)
    y = [raster.to_local(raster.cells())[:, 1].mean() for raster in rasters]
    assert y[1] - y[0] == pytest.approx(0.2, abs=0.01)


def test_cleanup_logs_engine_and_cells(run_step, raster, tmp_path, new_feedback):
    feedback = new_feedback()
    given = {"INPUT": raster, "ITERATIONS": 1, "ENGINE": "OPENCV", "OUTPUT": tmp_path / "cleaned.tif"}
    assert run_step("frpdfcleanup", given, feedback).ok
    engine, cells = feedback.infos
    assert engine.startswith("Network fast, OpenCV ")
    before, after = re.fullmatch(r"Class 10: ([\d,]+) rail cells before, ([\d,]+) after\.", cells).groups()
    before, after = (int(text.replace(",", "")) for text in (before, after))
    assert 100 < before < 2 * after


def test_cleanup_without_torch_keeps_grid_and_tags(run_step, raster, tmp_path, monkeypatch):
    find_spec = engines.find_spec
    monkeypatch.setattr(engines, "find_spec", lambda name: None if name == "torch" else find_spec(name))
    outcome = run_step("frpdfcleanup", {"INPUT": raster, "ITERATIONS": 1, "OUTPUT": tmp_path / "cleaned.tif"})
    assert outcome.ok, outcome.error
    assert outcome.results["ENGINE_USED"].startswith("OpenCV")
    before, after = read_header(raster), read_header(tmp_path / "cleaned.tif")
    assert after.frame.origin.tolist() == before.frame.origin.tolist()
    assert replace(after, frame=before.frame) == before
    dirty, clean = (read_rasters(path, before)[0] for path in (raster, tmp_path / "cleaned.tif"))
    assert clean.count() == pytest.approx(dirty.count(), rel=0.3)


def test_vectorize_without_points_gives_flat_lines_with_a_warning(run_step, raster, context, new_feedback):
    feedback = new_feedback()
    outcome = run_step("vectorizerails", {"INPUT": raster, "OUTPUT": "memory:rails"}, feedback)
    assert outcome.ok, outcome.error
    assert "no heights" in feedback.warnings[0]
    rails = list(context.getMapLayer(outcome.results["OUTPUT"]).getFeatures())
    assert outcome.results["RAIL_COUNT"] == len(rails) == 2
    assert outcome.results["RAIL_LENGTH"] == pytest.approx(24, abs=0.5)
    assert not any(rail.geometry().constGet().is3D() for rail in rails)
    sides = sorted(rail.geometry().centroid().asPoint().y() - 3_000_000 for rail in rails)
    assert sides == pytest.approx([-0.7535, 0.7535], abs=0.02)


@pytest.mark.parametrize(("epsg", "unit_m", "south_m"), [(32643, 1.0, 0.0), (2263, 1200 / 3937, 2_940_000.0)])
def test_vectorize_with_points_follows_the_railheads_in_every_unit(
    run_step, write_cloud, track, tmp_path, epsg, unit_m, south_m
):
    points = track() - [0.0, south_m, 0.0]
    cloud, raster, rails = write_cloud(points / unit_m, epsg=epsg), tmp_path / "r.tif", tmp_path / "r.gpkg"
    assert run_step("rasterizerailpoints", {"INPUT": cloud, "OUTPUT": raster}).ok
    outcome = run_step("vectorizerails", {"INPUT": raster, "POINTS": cloud, "OUTPUT": rails})
    assert outcome.ok, outcome.error
    assert outcome.results["RAIL_LENGTH"] == pytest.approx(24, abs=0.5)
    lines = sorted((line * unit_m for line in read_lines(rails)), key=lambda line: line[0, 1])
    for line, side in zip(lines, (-0.7535, 0.7535)):
        assert np.abs(line[:, 1] + south_m - 3_000_000 - side).max() < 0.005  # at the ends, which points show less
        assert np.abs(line[:, 2] - 100).max() < 0.004
    assert all(items["class_code"] == 10 and items["points"] > 1000 for _, items in read_features(rails))


@pytest.mark.parametrize("name", ["rasterizerailpoints", "frpdfcleanup", "vectorizerails"])
def test_cancelled_step_writes_nothing(run_step, raster, cloud, tmp_path, new_feedback, name):
    output = tmp_path / ("o.gpkg" if name == "vectorizerails" else "o.tif")
    source = {"INPUT": cloud} if name == "rasterizerailpoints" else {"INPUT": raster, "POINTS": cloud}
    outcome = run_step(name, {**source, "OUTPUT": output}, new_feedback(cancel_at=1))
    assert outcome.error == "Cancelled; nothing was written."
    assert not output.exists()
