"""Kilometres along an axis through qgis_process, compared with numbers that are known."""

import json
import sqlite3

import numpy as np
import pytest

EAST, NORTH, RADIUS_M = 500_000.0, 3_000_000.0, 500.0


def write(path, kind, coordinates, **fields):
    """Write a GeoJSON layer in UTM zone 43N with one feature for each item of the fields."""
    rows = [dict(zip(fields, row)) for row in zip(*fields.values())] or [{} for _ in coordinates]
    features = [
        {"type": "Feature", "properties": row, "geometry": {"type": kind, "coordinates": one}}
        for row, one in zip(rows, coordinates)
    ]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32643"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}), encoding="utf-8")
    return path


def on_circle(angle, left_m=0.0):
    r = RADIUS_M - left_m
    return np.column_stack([EAST + r * np.sin(angle), NORTH + RADIUS_M - r * np.cos(angle)]).tolist()


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "Größe östlich 1"
    made.mkdir()
    return made


def test_signals_beside_a_curve_with_posts_and_an_overlap(succeed, folder):
    """Posts every 100 m of a circle of 500 m; km 20.3 to 20.5 exist twice, from 500 m on."""
    axis = write(folder / "Achse.geojson", "LineString", [on_circle(np.arange(0, 1.61, 1 / RADIUS_M))])
    s = np.arange(0, 900, 100.0)
    numbers = 20 + s / 1000 - np.where(s >= 500, 0.2, 0.0)
    posts = write(folder / "Posten.geojson", "Point", on_circle(s / RADIUS_M, -3.0), km=numbers.round(3).tolist())
    jumps = folder / "jumps.csv"
    jumps.write_text("km_back,km_ahead\n20.5,20.3\n", encoding="utf-8")
    jumps.with_suffix(".csvt").write_text("Real,Real\n", encoding="utf-8")
    places_m = np.array([123.4, 450.0, 650.0])
    signals = write(folder / "Signale.geojson", "Point", on_circle(places_m / RADIUS_M, 5.5), name=["A", "B", "C"])
    output = folder / "gestellt.gpkg"
    given = {"INPUT": signals, "AXIS": axis, "POSTS": posts, "JUMPS": jumps, "FORMAT": "GERMAN", "OUTPUT": output}
    results = succeed("stationalongaxis", given)
    assert (results["PLACE_COUNT"], results["BEYOND_COUNT"], results["AMBIGUOUS_COUNT"]) == (3, 0, 0)
    names = "name, piece, km, km_text, offset_m, side, ambiguous"
    with sqlite3.connect(output) as database:
        rows = list(database.execute(f"SELECT {names} FROM gestellt ORDER BY name"))
    km = [row[2] for row in rows]
    np.testing.assert_allclose(km, [20.1234, 20.45, 20.45], atol=2e-5)
    assert [(row[0], row[1], row[3], row[5], row[6]) for row in rows] == [
        ("A", 1, "20,1 + 23", "left", 0),
        ("B", 1, "20,2 + 250", "left", 0),
        ("C", 2, "20,4 + 50", "left", 0),
    ]
    np.testing.assert_allclose([row[4] for row in rows], 5.5, atol=0.001)
