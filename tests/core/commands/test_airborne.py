"""The command `airborne`: its outputs, the attributes of guides, and its messages."""

import json

import numpy as np
import pyogrio
import pytest
from rail_extract.__main__ import main
from rail_extract.laboratory.airborne.designs import curved_line, drawn_together
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.airborne.write import write_airborne, write_guides


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flown ü")
    design = curved_line(5, 160.0, tracks=1, cant_m=0.08, radius_m=700.0)
    design.world.bands.clear()
    write_airborne(fly(design.world, design.where, 8.0, Flight(10.0, 0.25), seed=5), folder / "air.laz")
    write_guides(drawn_together(design.tracks, 5), folder / "guide.geojson", name=["line"], ref=["12"], gauge=["1435"])
    return folder


def run(flown, tmp_path, *more):
    return main(
        [
            *("airborne", str(flown / "air.laz"), "--guide", str(flown / "guide.geojson"), "--footprint", "0.25"),
            *("--centerlines", str(tmp_path / "out.gpkg"), *more),
        ]
    )


def test_all_outputs_are_written(flown, tmp_path, capsys):
    layers = [word for name in ("stations", "findings") for word in (f"--{name}", str(tmp_path / "out.gpkg"))]
    assert run(flown, tmp_path, *layers, "--report", str(tmp_path / "report.html")) == 0
    assert "Good" in capsys.readouterr().out
    meta, _, shapes, columns = pyogrio.raw.read(tmp_path / "out.gpkg", layer="centerlines")
    line = dict(zip(meta["fields"].tolist(), (column[0] for column in columns)))
    assert meta["geometry_type"] == "LineString Z"
    assert len(shapes) == 1
    assert (line["name"], line["ref"], line["gauge_mm"]) == ("line", "12", 1435)
    assert line["seen_m"] >= 140
    assert 3 < line["sigma_mm"] < 30
    meta, _, shapes, columns = pyogrio.raw.read(tmp_path / "out.gpkg", layer="stations")
    stations = dict(zip(meta["fields"].tolist(), columns))
    assert len(shapes) == 16
    assert np.array_equal(stations["s_m"], np.arange(16) * 10 + 5)
    assert stations["seen"].sum() >= 14


def test_an_output_that_is_no_longer_made_is_said(flown, tmp_path, capsys):
    assert run(flown, tmp_path, "--workers", "2", "--proposed", str(tmp_path / "proposed.gpkg")) == 0
    said = capsys.readouterr().err
    assert "--proposed is not written: a run with these inputs does not make it." in said
    assert "Guides are not proposed: draw them, or import them" in said
    assert not (tmp_path / "proposed.gpkg").exists()


def test_polygons_as_guide_are_refused(flown, tmp_path, capsys):
    guide = json.loads((flown / "guide.geojson").read_text())
    ring = guide["features"][0]["geometry"]["coordinates"]
    guide["features"][0]["geometry"] = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
    (tmp_path / "polygon.geojson").write_text(json.dumps(guide))
    words = [str(flown / "air.laz"), "--guide", str(tmp_path / "polygon.geojson")]
    assert main(["airborne", *words, "--centerlines", str(tmp_path / "out.gpkg")]) == 1
    assert "has polygons: give lines along the tracks, one for each." in capsys.readouterr().err
    assert not (tmp_path / "out.gpkg").exists()
