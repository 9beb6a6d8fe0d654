"""The commands `classify` and `grow`: they write classified copies; and extraction from a raw cloud."""

import json

import laspy
import numpy as np
import pyproj
import pytest
from built import raw_track
from rail_extract.__main__ import main
from rail_extract.core.clouds.points import ask
from rail_extract.core.pipeline import Parameters, extract_files
from rail_extract.core.pipeline.sources import Grown, Raw
from rail_extract.core.run import processes
from rail_extract.core.run.tasks import Runner
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, flat, rough, with_track
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip

CORNER = np.array([500_000.0, 5_000_000.0, 100.0])
STRIP = strip(14.0)
X, Y = CORNER[:2] + STRIP.at(7.0, SPACING_M / 2)


@pytest.fixture
def save(tmp_path):
    def save(xyz, name="raw.laz", crs=None):
        return write_las(tmp_path / name, xyz + CORNER, crs, offsets=CORNER, scales=0.0005)

    return save


def test_too_little_memory_is_one_sentence(tmp_path, monkeypatch, capsys):
    """Also where lazrs finds none for its threads."""
    for error in (MemoryError("Unable to allocate 9 GiB"), Exception("ThreadPoolBuildError { kind: IOError }")):

        def fail(*_, error=error, **__):
            raise error

        monkeypatch.setattr("laspy.open", fail)
        (tmp_path / "raw.las").write_bytes(b"LASF")
        assert main(["classify", str(tmp_path / "raw.las"), "--output", str(tmp_path / "new.las")]) == 1
        assert capsys.readouterr().err.endswith("Not enough memory: choose a smaller extent.\n")


def test_a_classified_copy_is_written(save, tmp_path, capsys):
    xyz, on = raw_track(10.0, 2500)
    new = tmp_path / "out" / "new.las"
    assert main(["classify", str(save(xyz)), "--output", str(new), "--rail-class", "20"]) == 0
    found = laspy.read(new).classification == 20
    assert (found & on).sum() / on.sum() > 0.97
    assert f"{found.sum()} of {len(xyz)} points are on rails" in capsys.readouterr().out
    assert [one.name for one in new.parent.iterdir()] == ["new.las"]


def test_workers_change_nothing(save, tmp_path, monkeypatch):
    """However small the cloud is."""
    monkeypatch.setattr(processes, "WORTH_S", 0.0)
    source = str(save(raw_track(10.0, 2500)[0]))
    for count in ("1", "2"):
        assert main(["classify", source, "--output", str(tmp_path / f"{count}.las"), "--workers", count]) == 0
    assert (tmp_path / "1.las").read_bytes() == (tmp_path / "2.las").read_bytes()


def test_a_raw_cloud_with_few_points_is_doubted(save, tmp_path):
    xyz, _ = with_track(flat(20.0, rng=np.random.RandomState(3), per_m2=80), 1.435, 0.072, 0.3)
    request = ask([save(rough(xyz, np.random.RandomState(4), 0.01, 0.01))], SEARCHED_CLASSES)
    network = extract_files(Raw(request), tmp_path, Parameters(1.435, 0.072, engine="OPENCV"), Runner())
    assert [warning for warning in network.warnings if "cells with points per metre; below 10" in warning]


def test_points_of_a_raw_cloud_that_give_no_rail_are_not_blamed_on_the_classes(save, tmp_path):
    request = ask([save(raw_track(10.0, 2500)[0])], SEARCHED_CLASSES)
    parameters = Parameters(1.435, 0.072, engine="OPENCV", min_length_m=1000.0)
    network = extract_files(Raw(request), tmp_path, parameters, Runner())
    assert network.search.points and not network.rails
    assert [warning for warning in network.warnings if "give no rail" in warning and "MIN_LENGTH" in warning]
    assert not [warning for warning in network.warnings if "rail classes" in warning]


def along_track(left=0.0, angle=0.3, length=60.0):
    """A line along the track of `raw_track`, or turned from it, in UTM zone 32 N."""
    direction, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    return MIDDLE + left * across + np.outer([-length, length], direction) + CORNER[:2]


def geojson(path, line):
    """Write a line as GeoJSON, which is in degrees."""
    change = pyproj.Transformer.from_crs("EPSG:32632", "EPSG:4326", always_xy=True)
    places = np.column_stack(change.transform(*line.T)).tolist()
    shape = {"type": "LineString", "coordinates": places}
    feature = {"type": "Feature", "properties": {}, "geometry": shape}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    return str(path)


@pytest.mark.parametrize(("left", "found"), [(0.0, True), (2.0, False)])
def test_only_the_track_along_the_guide_is_classified(save, tmp_path, capsys, left, found):
    guide = geojson(tmp_path / "guide.json", along_track(left))
    new = tmp_path / "new.las"
    options = ["--guide", guide, "--only-guided", "--crs", "EPSG:32632"]
    assert main(["classify", str(save(raw_track(10.0, 2500)[0])), "--output", str(new), *options]) == 0
    assert (laspy.read(new).classification == 10).any() == found
    assert ("No track has the guide within 0.5 m of its middle" in capsys.readouterr().err) == (not found)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--only-guided"], "--only-guided needs lines to compare tracks with: choose --guide."),
        (["--guide", "nothing.json"], "nothing.json can't be read as a vector file: give a GeoPackage or GeoJSON"),
        (["--guide", "far.json"], "The guide has no line within 4 m of the cloud: check its place and coordinate"),
        (["--guide", "empty.json"], "--guide has no lines: give a line layer."),
    ],
)
def test_each_mistake_of_a_search_gets_a_sentence(save, tmp_path, capsys, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    geojson(tmp_path / "far.json", along_track(50.0))
    (tmp_path / "empty.json").write_text('{"type": "FeatureCollection", "features": []}')
    options = ["--output", str(tmp_path / "new.las"), "--crs", "EPSG:32632", *options]
    assert main(["classify", str(save(raw_track(10.0, 2500)[0])), *options]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new.las").exists()


@pytest.fixture
def raw(save):
    return str(save(STRIP.xyz, "raw.las", "EPSG:25832"))


def test_seeds_of_a_file_are_transformed(raw, tmp_path):
    pytest.importorskip("pyogrio")
    longitude, latitude = pyproj.Transformer.from_crs(25832, 4326, always_xy=True).transform(X, Y)
    point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [longitude, latitude]}}
    (tmp_path / "seeds.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [point]}))
    new = tmp_path / "new.las"
    assert main(["grow", raw, "--output", str(new), "--seeds", str(tmp_path / "seeds.geojson")]) == 0
    assert (laspy.read(new).classification == 10).sum() > 0.9 * STRIP.head.sum()


@pytest.mark.parametrize("name", ["stops.gpkg", "stops.csv"])
def test_stops_are_written_with_their_reason(raw, tmp_path, name):
    pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")
    stops = tmp_path / "out" / name
    values = ["grow", raw, "--output", str(tmp_path / "new.las"), "--seed", f"{X},{Y}", "--stops", str(stops)]
    assert main(values) == 0
    _, _, shapes, columns = pyogrio.raw.read(stops)
    places = shapely.get_coordinates(shapely.from_wkb(shapes), include_z=True)
    assert sorted(places[:, 0]) == pytest.approx([500_000.0, 500_014.0], abs=1.0)
    assert places[:, 1] == pytest.approx(Y, abs=0.02)
    assert columns[-2].tolist() == [1, 2]
    assert columns[-1].tolist() == ["the cloud ends"] * 2


def test_rails_grow_and_are_extracted_in_one_call(save, tmp_path):
    """Of two tracks, only the one with the seed."""
    lefts = np.array([0.5, -0.5, 3.5, 2.5]) * SPACING_M
    rails = [lambda along, left=left: np.full_like(along, left) for left in lefts]
    tracks = strip(16.0, rails=rails, per_m2=800, half_width_m=6.0)
    request = ask([save(tracks.xyz, "two.las")], SEARCHED_CLASSES)
    seeds = [np.atleast_2d(CORNER[:2] + tracks.at(8.0, lefts[0]))]
    parameters = Parameters(1.435, 0.072, passes=1, engine="OPENCV")
    folder = tmp_path / "work"
    folder.mkdir()
    network = extract_files(Grown(request, seeds), folder, parameters, Runner())
    assert [rail.length_m for rail in network.rails] == pytest.approx([15.5, 15.5], abs=0.6)
    middles = sorted(float(np.median(network.frame.to_crs(rail.xyz)[:, 1])) - CORNER[1] for rail in network.rails)
    assert middles == pytest.approx([-SPACING_M / 2, SPACING_M / 2], abs=0.01)
    assert network.search.paired_m == pytest.approx(32, abs=2)
    assert not list(folder.iterdir())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "A rail is followed from seeds: choose a layer for --seeds, or pick a point for --seed."),
        (["--seed", "5"], '--seed "5" should be two numbers: x,y.'),
        (["--seed", "nan,5"], '--seed "nan,5" should be two numbers: x,y.'),
        (["--seed", "1e300,5"], '--seed "1e300,5" should be two numbers: x,y.'),
    ],
)
def test_each_mistake_of_a_growth_gets_a_sentence(raw, tmp_path, capsys, options, message):
    assert main(["grow", raw, "--output", str(tmp_path / "new.las"), *options]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new.las").exists()
