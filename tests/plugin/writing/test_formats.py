"""Every vector format that is offered keeps heights, fields, coordinates and the coordinate system."""

import numpy as np
import pytest
from memory_layers import layer_of
from osgeo import gdal
from qgis.core import NULL, QgsVectorLayer
from rail_extract.core.clouds.crs import import_pyproj
from rail_extract.core.fields import CENTERLINE_FIELDS

EXCHANGED = ("dxf", "csv")
"""Formats for other programs, which have a module of their own."""

FORMATS = ("gpkg", "shp", "geojson", "fgb", "gml")


@pytest.fixture
def rails():
    line = "LINESTRING Z (500000.12345 {0} 100.4321, 500020.98765 {0} 101.2345)"
    return layer_of(*map(line.format, (3000000.1234, 3000001.6304)))


def test_the_formats_are_those_of_the_dialog(plugin):
    assert tuple(plugin.provider.supportedOutputVectorLayerExtensions()) == (*FORMATS, *EXCHANGED)


@pytest.mark.parametrize("suffix", FORMATS)
def test_nothing_is_lost(run_step, rails, tmp_path, suffix):
    outcome = run_step("buildtrackcenterlines", {"INPUT": rails, "OUTPUT": tmp_path / f"tracks.{suffix}"})
    assert outcome.ok, outcome.error
    layer = QgsVectorLayer(outcome.results["OUTPUT"], "tracks", "ogr")
    assert layer.crs().authid() == "EPSG:32643"
    (feature,) = layer.getFeatures()
    vertices = [(vertex.x(), vertex.y(), vertex.z()) for vertex in feature.geometry().vertices()]
    expected = [(500000.12345, 3000000.8769, 100.4321), (500020.98765, 3000000.8769, 101.2345)]
    np.testing.assert_allclose([vertices[0], vertices[-1]], expected, rtol=0, atol=1e-4)
    values = {column.name: feature[column.name] for column in CENTERLINE_FIELDS}
    assert values == {
        "track_id": 1,
        "class_code": 0,
        "left_ids": "2",
        "right_ids": "1",
        "length_m": 20.88,
        "gauge_mm": 1435.0,
        "gaugesd_mm": 0.0,
        "cant_mm": 0.0,
        "cantmax_mm": 0.0,
        "bridged_m": NULL,  # lines drawn by hand do not state where points are missing
    }


@pytest.mark.parametrize(("suffix", "table"), [("gpkg", ""), ("gpkg", "rails"), ("shp", ""), ("fgb", "")])
def test_the_system_of_heights_is_kept(run, write_cloud, track, tmp_path, suffix, table):
    """QGIS before 3.34 drops it from its systems."""
    both = "25832+5783"
    cloud = write_cloud(track(), epsg=both)
    path = tmp_path / f"räils.{suffix}"
    output = f"ogr:dbname='{path}' table=\"{table}\" (geom)" if table else path
    outcome = run({"INPUT": cloud, "ITERATIONS": 1, "RAILS": output})
    assert outcome.ok, outcome.error
    dataset = gdal.OpenEx(str(path))
    layer = dataset.GetLayer(0)
    stated = import_pyproj().CRS.from_wkt(layer.GetSpatialRef().ExportToWkt(["FORMAT=WKT2"]))
    horizontal, vertical = stated.sub_crs_list
    assert (horizontal.to_epsg(), vertical.to_epsg(80)) == (25832, 5783)
    assert layer.GetFeatureCount() == 2
    assert layer.GetNextFeature().GetGeometryRef().GetZ() == pytest.approx(100, abs=0.1)
    assert QgsVectorLayer(outcome.results["RAILS"], "rails", "ogr").featureCount() == 2
