"""From a raw cloud to rails through qgis_process: classified and then extracted, and in one call."""

import csv

import laspy
import numpy as np
import pytest
from lines import read_lines
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, TOP_M, flat, rough, with_track

CORNER, CRS = np.array([500_000.0, 3_000_000.0, 100.0]), "EPSG:32643"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("Größe östlich 3")


@pytest.fixture(scope="module")
def raw(folder):
    """Ten metres of track on ballast; which points are on heads."""
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(10.0, rng=rng, per_m2=2500), 1.435, 0.072, 0.3)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, CORNER
    cloud = laspy.LasData(header)
    cloud.xyz = rough(xyz, rng) + CORNER
    cloud.intensity = rng.randint(0, 60_000, len(xyz))
    cloud.write(folder / "roh 1.laz")
    return folder / "roh 1.laz", on


def test_a_raw_cloud_is_classified_and_becomes_rails(succeed, folder, raw):
    path, on = raw
    classified, rails = folder / "klassifiziert.laz", folder / "Schienen.gpkg"
    found = succeed("classifyrailpoints", {"INPUT": path, "CRS": CRS, "OUTPUT": classified})
    before, after = laspy.read(path), laspy.read(classified)
    rail = after.classification == 10
    assert found["RAIL_POINTS"] == rail.sum()
    assert (rail & on).sum() / on.sum() > 0.97
    assert np.array_equal(before.intensity, after.intensity)
    assert np.array_equal(before.X, after.X)
    done = succeed("extractrails", {"INPUT": path, "CRS": CRS, "CLASSIFY": True, "ITERATIONS": 1, "RAILS": rails})
    assert done["RAIL_COUNT"] == len(read_lines(rails)) == 2
    assert done["RAIL_LENGTH"] == pytest.approx(20 / np.cos(0.3), abs=0.5)


def test_rails_grow_from_a_seed_and_say_where_they_stop(succeed, folder, raw):
    path, on = raw
    along, across = np.array([np.cos(0.3), np.sin(0.3)]), np.array([-np.sin(0.3), np.cos(0.3)])
    seed = CORNER[:2] + MIDDLE + 0.75 * across
    output, stops = folder / "gewachsen.laz", folder / "Enden.csv"
    given = {"INPUT": path, "CRS": CRS, "SEED": f"{seed[0]},{seed[1]}"}
    found = succeed("growrailpoints", {**given, "OUTPUT": output, "STOPS": stops})
    rail = laspy.read(output).classification == 10
    assert found["RAIL_POINTS"] == rail.sum()
    assert (rail & on).sum() / on.sum() > 0.95
    assert (rail & on).sum() / rail.sum() > 0.97
    assert found["PAIRED_LENGTH"] == pytest.approx(2 * 10 / np.cos(0.3), abs=2.0)
    assert found["SINGLE_LENGTH"] == 0
    rows = list(csv.DictReader(stops.open(encoding="utf-8")))
    assert [row["reason"] for row in rows] == ["the cloud ends"] * 2
    places = np.array([row["WKT"].split("(")[1][:-1].split() for row in rows], dtype=float) - CORNER
    assert (places[:, :2] - MIDDLE) @ across == pytest.approx([0.7535, 0.7535], abs=0.01)
    assert np.abs((places[:, :2] - MIDDLE) @ along) == pytest.approx([5.0, 5.0], abs=0.8)
    assert places[:, 2] == pytest.approx([TOP_M, TOP_M], abs=0.01)
