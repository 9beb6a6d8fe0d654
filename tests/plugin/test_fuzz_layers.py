"""Damaged rasters and arbitrary lines: they are read, or refused with a sentence."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from qgis.core import QgsFeature, QgsGeometry, QgsLineString, QgsPoint, QgsVectorLayer
from rail_extract.core.clouds.crs import import_pyproj
from rail_extract.core.errors import RailExtractError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.raster import rasterize
from rail_extract.core.raster_file import header_for
from rail_extract.core.standards import STANDARDS
from rail_extract.rail_extract_plugin.reading.geotiff import read_header, read_rasters, write_rasters

BOUNDED = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(scope="module")
def good(qgis, tmp_path_factory):
    """The bytes of a small rail raster."""
    path = tmp_path_factory.mktemp("good") / "r.tif"
    wkt = import_pyproj().CRS.from_epsg(32643).to_wkt()
    raster = rasterize(np.random.default_rng(0).uniform(0, 4, (200, 2)), 0.04)
    frame = LocalFrame(np.array([500_000.0, 3_000_000.0, 0.0]), crs_wkt=wkt)
    write_rasters(path, header_for([raster], (10,), frame, STANDARDS["EN_60E1_1435"]), [raster])
    return path.read_bytes()


def read_or_explain(path, data):
    path.write_bytes(data)
    try:
        header = read_header(path)
        rasters = read_rasters(path, header)
    except RailExtractError as error:
        assert str(error)
        assert "\n" not in str(error)
    else:
        assert any(raster.count() for raster in rasters)
        assert math.isfinite(header.cell_m)


@BOUNDED
@given(at=st.integers(2, 1200), value=st.binary(min_size=1, max_size=4))
def test_changed_bytes_in_a_raster(good, tmp_path, at, value):
    read_or_explain(tmp_path / "r.tif", good[:at] + value + good[at + len(value) :])


@BOUNDED
@given(length=st.integers(0, 3000))
def test_truncated_raster(good, tmp_path, length):
    read_or_explain(tmp_path / "r.tif", good[:length])


NUMBER = st.one_of(
    st.floats(0, 20), st.sampled_from([0.0, 1.507, 10.0]), st.floats(-1e9, 1e9), st.sampled_from([math.nan, math.inf])
)
LINE = st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=0, max_size=6)


@BOUNDED
@given(lines=st.lists(LINE, min_size=0, max_size=4))
def test_arbitrary_lines(qgis, plugin, outcome, lines):
    layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643", "lines", "memory")
    for line in lines:
        feature = QgsFeature()
        feature.setGeometry(QgsGeometry(QgsLineString([QgsPoint(500_000 + x, 3_000_000 + y, z) for x, y, z in line])))
        layer.dataProvider().addFeature(feature)
    algorithm = qgis.processingRegistry().createAlgorithmById("railextract:buildtrackcenterlines")
    run = outcome(algorithm, {"INPUT": layer, "OUTPUT": "memory:"})
    assert "Traceback" not in run.error
    assert run.ok or run.error
    assert not run.ok or run.results["CENTERLINE_LENGTH"] >= 0
