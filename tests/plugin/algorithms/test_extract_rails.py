import re
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from lines import farthest, read_features
from memory_layers import layer_of
from osgeo import gdal
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsProcessingOutputLayerDefinition,
    QgsProject,
    QgsRectangle,
    QgsVectorLayer,
)
from rail_extract.core.disk import PREFIX
from rail_extract.core.kernels import blas

POINTS = f"{PREFIX}*/*/10_*"
"""Files with temporary points of class 10."""

ALL_OUTPUTS = ("RAILS", "CENTERLINES", "QUALITY", "FINDINGS", "CLEANED", "REPORT")


@pytest.fixture
def scene(write_cloud, track):
    """A short track and a single pass of the network, for a quick run."""
    return {"INPUT": write_cloud(track()), "ITERATIONS": 1}


@pytest.fixture
def outputs(tmp_path):
    return {"RAILS": tmp_path / "räils out.gpkg", "CENTERLINES": tmp_path / "tracks.gpkg"}


def lines_of(path):
    layer = QgsVectorLayer(str(path), "lines", "ogr")
    assert layer.isValid()
    return layer, list(layer.getFeatures())


@pytest.mark.skipif(not find_spec("rasterio"), reason="needs the packages of the cluster")
def test_the_command_writes_what_qgis_writes(run, run_step, write_cloud, track, tmp_path):
    """Two strips, 20 mm apart across and 8 mm in height, are aligned, and there is a finding."""
    points = track()
    strips = 7 + np.arange(len(points)) % 2
    points[strips == 8] += [0.0, 0.020, 0.008]
    kept = (points[:, 1] < 3_000_000) | (np.abs(points[:, 0] - 500_007) > 1)
    points, strips = points[kept], strips[kept]
    west, south = points[:, :2].min(axis=0) + [3.0, -5.0]
    east, north = points[:, :2].max(axis=0) + 5.0
    cloud, suffixes = write_cloud(points, strips=strips), {"CLEANED": "tif", "REPORT": "html"}
    mine, theirs = (
        {name: tmp_path / f"{who}_{name.lower()}.{suffixes.get(name, 'gpkg')}" for name in ALL_OUTPUTS}
        for who in ("qgis", "command")
    )
    settings = {"INPUT": cloud, "ITERATIONS": 1, "ENGINE": "OPENCV", "EXTENT": f"{west},{east},{south},{north}"}
    settings |= {"MODEL": "fast", "STRIPS": "ALIGNED"}
    assert run({**settings, **mine}).ok
    words = ["extract", cloud, "--iterations", "1", "--engine", "OPENCV", f"--extent={west},{south},{east},{north}"]
    words += ["--model", "fast", "--strips", "ALIGNED"]
    words += [word for name, path in theirs.items() for word in (f"--{name.lower()}", path)]
    told = subprocess.run([sys.executable, "-m", "rail_extract", *words, "--workers", "1"], capture_output=True)
    assert told.returncode == 0, told.stderr
    for name in ("RAILS", "CENTERLINES", "FINDINGS"):
        lines, others = read_features(mine[name]), read_features(theirs[name], name.lower())
        assert farthest([line for line, _ in lines], [line for line, _ in others]) < 0.0001
        assert [items for _, items in lines] == [items for _, items in others]
    (_, stations), (_, others) = (lines_of(path["QUALITY"]) for path in (mine, theirs))
    assert [one.attributes()[1:] for one in stations] == [one.attributes()[1:] for one in others]
    assert [one.geometry().asWkt(3) for one in stations] == [one.geometry().asWkt(3) for one in others]
    same_rasters(mine["CLEANED"], theirs["CLEANED"])
    pages = (path["REPORT"].read_text(encoding="utf-8") for path in (mine, theirs))
    page, other = (re.sub("<dt>(Command|Date)</dt><dd>.*?</dd>", "", page) for page in pages)
    assert page == other
    vectorized = run_step(
        "vectorizerails", {"INPUT": theirs["CLEANED"], "POINTS": cloud, "OUTPUT": tmp_path / "v.gpkg"}
    )
    assert vectorized.ok and vectorized.results["RAIL_COUNT"] == 2


def same_rasters(path, other):
    """Cells, place, coordinate system and tags agree."""
    first, second = gdal.Open(str(path)), gdal.Open(str(other))
    assert (first.ReadAsArray() == second.ReadAsArray()).all()
    np.testing.assert_allclose(first.GetGeoTransform(), second.GetGeoTransform(), rtol=1e-15)
    assert first.GetSpatialRef().IsSame(second.GetSpatialRef())
    assert first.GetMetadata() == second.GetMetadata()
    one, two = first.GetRasterBand(1), second.GetRasterBand(1)
    for name in ("GetDescription", "GetNoDataValue", "GetBlockSize"):
        assert getattr(one, name)() == getattr(two, name)(), name
    assert one.DataType == two.DataType


def test_outputs_left_blank_in_the_batch_dialog_are_skipped(run, scene, tmp_path):
    blank = {name: QgsProcessingOutputLayerDefinition("", None) for name in ("CENTERLINES", "QUALITY", "CLEANED")}
    outcome = run({**scene, **blank, "RAILS": tmp_path / "rails.gpkg", "REPORT": ""})
    assert outcome.ok, outcome.error
    assert not {*blank, "REPORT", "SIGMA"} & {name for name, value in outcome.results.items() if value is not None}
    assert [path.name for path in tmp_path.glob("*.gpkg")] == ["rails.gpkg"]


@pytest.mark.parametrize("crs", ["EPSG:32643", "EPSG:4326"])
def test_a_mask_limits_the_points(run, scene, outputs, crs):
    """Two polygons that overlap, around 6 m of the track."""
    systems = map(QgsCoordinateReferenceSystem, ("EPSG:32643", crs))
    change = QgsCoordinateTransform(*systems, QgsProject.instance().transformContext())
    sides = ((500_002, 500_006), (500_005, 500_008))
    shapes = [QgsGeometry.fromRect(QgsRectangle(west, 2_999_990, east, 3_000_010)) for west, east in sides]
    for shape in shapes:
        shape.transform(change)
    mask = layer_of(*shapes, kind="Polygon", crs=crs)
    outcome = run({**scene, **outputs, "MASK": mask})
    assert outcome.ok, outcome.error
    assert outcome.results["RAIL_COUNT"] == 2
    assert outcome.results["RAIL_LENGTH"] == pytest.approx(12, abs=0.2)


def test_rails_of_two_classes_make_a_track_when_merged(run, new_feedback, write_cloud, track, tmp_path):
    points = track()
    left = points[:, 1] > 3_000_000
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    for code, mine in ((10, left), (11, ~left)):
        write_cloud(points[mine], f"{code}.las", class_code=code, folder=tiles)
    values = {"INPUT": tiles, "RAIL_CLASSES": "11,10", "ITERATIONS": 1, "RAILS": tmp_path / "rails.gpkg"}
    feedback = new_feedback()
    apart, merged = run(values, feedback), run({**values, "MERGE_CLASSES": True})
    assert (apart.results["CENTERLINE_COUNT"], merged.results["CENTERLINE_COUNT"]) == (0, 1)
    assert any("Rails of the classes 10, 11 form tracks" in text for text in feedback.warnings)
    assert {items["class_code"] for _, items in read_features(tmp_path / "rails.gpkg")} == {11}


def test_the_log_names_steps_figures_and_verdict(run, scene, new_feedback, tmp_path):
    feedback = new_feedback()
    assert run({**scene, "ENGINE": "OPENCV", "REPORT": tmp_path / "report.html"}, feedback).ok
    patterns = (
        r"Reading 1 file with 7,200 points\.",
        r"Class 10: 7,200 points in 1 square; network fast, 1 pass\.",
        r"Class 10: 2 rails, 24 m\.",
        r"Paired: 1 track, 12 m\.",
        r"Measured: 13 stations, one every 1 m\.",
        r"Engine of the network: OpenCV .*, CPU, float32\.",
        r"Good throughout.*",
        r"2 rails \(24 m\), 1 track \(12 m\): standard error [\d.]+ mm \(median\), [\d.]+ mm \(rms\), 0\.0 % of the "
        r"tracks in doubt, "
        r"0 findings\.",
    )
    assert len(feedback.infos) == len(patterns)
    for pattern, said in zip(patterns, feedback.infos):
        assert re.fullmatch(pattern, said), said


@pytest.mark.skipif(not blas(), reason="This numpy has a BLAS that knows one thread only.")
@pytest.mark.parametrize("ends", ["well", "badly"])
def test_libraries_have_one_thread_during_a_run_and_as_many_as_before_afterwards(run, scene, new_feedback, ends):
    seen, feedback, before = set(), new_feedback(1 if ends == "badly" else None), [one.get() for one in blas()]
    feedback.progressChanged.connect(lambda _: seen.update(one.get() for one in blas()))
    try:
        for one in blas():
            one.set(2)
        assert run(scene, feedback).ok == (ends == "well")
        assert seen == {1}
        assert {one.get() for one in blas()} == {2}
    finally:
        for one, threads in zip(blas(), before):
            one.set(threads)
