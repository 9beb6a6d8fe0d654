"""DXF and CSV as GDAL, and with it QGIS, reads them."""

import numpy as np
import pytest
from lines import read_lines
from osgeo import ogr
from qgis.core import QgsProcessingOutputLayerDefinition, QgsProject


@pytest.fixture
def written(run, write_cloud, track, tmp_path):
    """Run with the same track for all outputs, and return the results and the rails of a GeoPackage."""

    def run_with(**outputs):
        rails = tmp_path / "reference.gpkg"
        cloud = write_cloud(track())
        assert run({"INPUT": cloud, "ITERATIONS": 1, "RAILS": rails}).ok
        outcome = run({"INPUT": cloud, "ITERATIONS": 1, **outputs})
        assert outcome.ok, outcome.error
        return outcome.results, read_lines(rails)

    return run_with


def test_gdal_reads_3d_polylines_from_dxf(written, tmp_path):
    paths = {name: tmp_path / f"{name}.dxf" for name in ("RAILS", "CENTERLINES", "QUALITY")}
    results, expected = written(**paths)
    assert results["RAILS"] == str(paths["RAILS"])
    dataset = ogr.Open(str(paths["RAILS"]))  # GDAL crashes if nothing refers to it
    found = list(dataset.GetLayer(0))
    assert [feature["Layer"] for feature in found] == ["RAILS_10", "RAILS_10"]
    for feature, line in zip(found, expected):
        geometry = feature.GetGeometryRef()
        assert geometry.GetGeometryType() == ogr.wkbLineString25D
        np.testing.assert_allclose(geometry.GetPoints(), line, atol=0.51e-4)
    for name, layer, kind in (
        ("CENTERLINES", "TRACK_1", ogr.wkbLineString25D),
        ("QUALITY", "STATIONS_1", ogr.wkbPoint25D),
    ):
        dataset = ogr.Open(str(paths[name]))
        kinds = {(feature["Layer"], feature.GetGeometryRef().GetGeometryType()) for feature in dataset.GetLayer(0)}
        assert kinds == {(layer, kind)}


def test_files_are_loaded_on_demand_and_replaced_whole(written, context, tmp_path):
    path = tmp_path / "rails.csv"
    path.write_text("old")
    written(RAILS=QgsProcessingOutputLayerDefinition(str(path), QgsProject.instance()))
    assert path.read_text(encoding="utf-8").startswith("WKT,rail_id,")
    assert list(context.layersToLoadOnCompletion()) == [str(path)]
    assert sorted(file.suffix for file in tmp_path.glob("rails.*")) == [".csv", ".csvt", ".prj"]
