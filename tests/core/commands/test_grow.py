"""The command `grow`: seeds from the command line and from files, and its messages."""

import json

import laspy
import numpy as np
import pyproj
import pytest
from rail_extract.__main__ import main
from rail_extract.core.clouds.points import ask
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline import extract_files
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.core.tasks import InTurn
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip

CORNER = np.array([500_000.0, 5_000_000.0, 100.0])
TRACK = strip(14.0)
X, Y = CORNER[:2] + TRACK.at(7.0, SPACING_M / 2)


@pytest.fixture
def raw(tmp_path):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.0005] * 3, CORNER
    header.add_crs(pyproj.CRS(25832))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = (TRACK.xyz + CORNER).T
    cloud.write(tmp_path / "raw.las")
    return str(tmp_path / "raw.las")


def test_a_classified_copy_is_written(raw, tmp_path, capsys):
    new = tmp_path / "out" / "new.las"
    assert main(["grow", raw, "--output", str(new), "--seed", f"{X},{Y}", "--rail-class", "20", "--single"]) == 0
    found = np.asarray(laspy.read(new).classification) == 20
    left = TRACK.head & (TRACK.xyz[:, 1] > 0)
    assert (found & left).sum() > 0.94 * left.sum()
    assert not found[TRACK.xyz[:, 1] < 0].any()
    said = capsys.readouterr()
    assert f"{found.sum()} of {len(found)} points are on rails" in said.out
    assert "where the cloud ends" in said.err


def test_seeds_of_a_file_are_transformed(raw, tmp_path):
    pytest.importorskip("pyogrio")
    longitude, latitude = pyproj.Transformer.from_crs(25832, 4326, always_xy=True).transform(X, Y)
    point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [longitude, latitude]}}
    (tmp_path / "seeds.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [point]}))
    new = tmp_path / "new.las"
    assert main(["grow", raw, "--output", str(new), "--seeds", str(tmp_path / "seeds.geojson")]) == 0
    assert (laspy.read(new).classification == 10).sum() > 0.9 * TRACK.head.sum()


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


def test_rails_grow_and_are_extracted_in_one_call(tmp_path):
    """Of two tracks, only the one with the seed."""
    lefts = np.array([0.5, -0.5, 3.5, 2.5]) * SPACING_M
    rails = [lambda along, left=left: np.full_like(along, left) for left in lefts]
    tracks = strip(16.0, rails=rails, per_m2=800, half_width_m=6.0)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.0005] * 3, CORNER
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = (tracks.xyz + CORNER).T
    cloud.write(tmp_path / "two.las")
    request = ask([tmp_path / "two.las"], SEARCHED_CLASSES)
    seeds = [np.atleast_2d(CORNER[:2] + tracks.at(8.0, lefts[0]))]
    parameters = Parameters(1.435, 0.072, passes=1, engine="OPENCV")
    folder = tmp_path / "work"
    folder.mkdir()
    network = extract_files(request, folder, parameters, InTurn(), seeds=seeds)
    assert [rail.length_m for rail in network.rails] == pytest.approx([15.5, 15.5], abs=0.6)
    middles = sorted(float(np.median(network.frame.to_crs(rail.xyz)[:, 1])) - CORNER[1] for rail in network.rails)
    assert middles == pytest.approx([-SPACING_M / 2, SPACING_M / 2], abs=0.01)
    assert network.search.paired_m == pytest.approx(32, abs=2)
    assert not list(folder.iterdir())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "A rail is followed from seeds: give --seeds or --seed."),
        (["--seed", "5"], '--seed "5" should be two numbers: x,y.'),
        (["--seed", "nan,5"], '--seed "nan,5" should be two numbers: x,y.'),
        (["--seed", "1e300,5"], '--seed "1e300,5" should be two numbers: x,y.'),
        (["--seed", "1,2"], "No seed is in the cloud"),
        (["--seed", f"{X},{Y}", "--max-outliers", "-1"], "--max-outliers must be 0 or more, not -1."),
        (["--seed", f"{X},{Y}", "--stops", "a.shp"], "The option --stops writes .gpkg files: give a.shp this suffix."),
        (["--seed", f"{X},{Y}", "--rail-class", "300"], "--rail-class must be a number from 0 to 255, not 300."),
    ],
)
def test_each_mistake_gets_a_sentence(raw, tmp_path, capsys, options, message):
    assert main(["grow", raw, "--output", str(tmp_path / "new.las"), *options]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new.las").exists()
