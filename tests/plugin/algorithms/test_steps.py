"""The steps of an extraction in QGIS; `tests/core/jobs/test_steps.py` chains them."""

import re

import numpy as np
import pytest
from qgis.core import QgsRasterLayer
from rail_extract.core.files.rail_rasters import RasterSource
from rail_extract.core.raster import cell_size
from rail_extract.rail_extract_plugin.reading.rasters import open_with_gdal


@pytest.fixture
def cloud(write_cloud, track):
    return write_cloud(track())


@pytest.fixture
def raster(run_step, cloud, tmp_path):
    """The raster of a short track with dense points, which can be vectorized without the network."""
    outcome = run_step("rasterizerailpoints", {"INPUT": cloud, "OUTPUT": tmp_path / "raster.tif"})
    assert outcome.ok, outcome.error
    return tmp_path / "raster.tif"


def test_rasterize_alone(raster, track):
    source = RasterSource(raster, open_with_gdal)
    header = source.header
    assert (header.class_codes, header.cell_m) == ((10,), pytest.approx(cell_size(1.435, 0.072)))
    (found,) = source.read()
    cells = np.floor((track()[:, :2] - header.frame.origin[:2]) / header.cell_m)
    # Coordinates in the file are rounded to millimetres, so a point may move to the next cell.
    assert found.count() == pytest.approx(len(np.unique(cells, axis=0)), rel=0.02)
    layer = QgsRasterLayer(str(raster), "raster")
    assert layer.crs().authid() == "EPSG:32643"
    assert layer.width() * layer.height() == header.window[2] * header.window[3]


def test_cleanup_logs_engine_and_cells(run_step, raster, tmp_path, new_feedback):
    feedback = new_feedback()
    given = {"INPUT": raster, "ITERATIONS": 1, "ENGINE": "OPENCV", "OUTPUT": tmp_path / "cleaned.tif"}
    assert run_step("frpdfcleanup", given, feedback).ok
    engine, cells = feedback.infos
    assert engine.startswith("Network fast, OpenCV ")
    before, after = re.fullmatch(r"Class 10: ([\d,]+) rail cells before, ([\d,]+) after\.", cells).groups()
    before, after = (int(text.replace(",", "")) for text in (before, after))
    assert 100 < before < 2 * after


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


@pytest.mark.parametrize("name", ["rasterizerailpoints", "frpdfcleanup", "vectorizerails"])
def test_cancelled_step_writes_nothing(run_step, raster, cloud, tmp_path, new_feedback, name):
    output = tmp_path / ("o.gpkg" if name == "vectorizerails" else "o.tif")
    source = {"INPUT": cloud} if name == "rasterizerailpoints" else {"INPUT": raster, "POINTS": cloud}
    outcome = run_step(name, {**source, "OUTPUT": output}, new_feedback(cancel_at=1))
    assert outcome.error == "Cancelled; nothing was written."
    assert not output.exists()
