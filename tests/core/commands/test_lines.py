"""The commands of alignments and kilometres, and what Python gives as functions of the same names."""

import json
import re

import numpy as np
import pytest
import rail_extract as rx
from rail_extract.__main__ import main
from rail_extract.core.alignment.elements import Alignment, VerticalElement, chained
from rail_extract.core.errors import ParameterError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.progress import SILENT, Recording
from rail_extract.laboratory.designs import surveyed

pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")

SHAPES = [(120.0, 0, 0), (60.0, 0, 1 / 400), (150.0, 1 / 400, 1 / 400), (50.0, 1 / 400, 0), (140.0, 0, 0)]
CORNER = np.array([578_200.0, 5_804_300.0, 0.0])


def table(path, layer):
    meta, ids, shapes, columns = pyogrio.raw.read(path, layer=layer, return_fids=True)
    return dict(zip(meta["fields"].tolist(), columns)), shapely.from_wkb(shapes)


def written(path, layer, lines, **columns):
    """Write 3D lines in EPSG:25832."""
    pyogrio.raw.write(
        str(path), layer=layer, driver="GPKG", geometry_type="LineString Z", crs="EPSG:25832",
        geometry=np.array([shapely.to_wkb(shapely.linestrings(line), output_dimension=3) for line in lines], object),
        field_data=[np.array(values) for values in columns.values()], fields=list(columns),
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a measured track, its elements as `fit` writes them, and these as LandXML."""
    place = tmp_path_factory.mktemp("alignment")
    vertical = (VerticalElement(0, 200, 50, 0.01, 0.01), VerticalElement(200, 80, 52, 0.01, -0.01))
    vertical = (*vertical, VerticalElement(280, 240, 52, -0.01, -0.01))
    design = Alignment(4, LocalFrame(CORNER), chained((100.0, 200.0), 0.3, SHAPES), vertical)
    line = surveyed(design, np.random.default_rng(2), 0.001) + CORNER
    written(place / "tracks.gpkg", "centerlines", [line], track_id=[4])
    written(place / "moved.gpkg", "centerlines", [line + [0, 0, 0.010]], track_id=[4])
    assert main(["fit-alignment", str(place / "tracks.gpkg"), "--elements", str(place / "out.gpkg"),
                 "--deviations", str(place / "out.gpkg"), "--report", str(place / "fit.html")]) == 0  # fmt: skip
    file = str(place / "design.xml")
    assert main(["export-alignment", f"{place / 'out.gpkg'}|layername=elements", "--output", file]) == 0
    return place


def test_fit_writes_elements_deviations_and_a_report(folder):
    rows, shapes = table(folder / "out.gpkg", "elements")
    plan = rows["layout"] == "H"
    assert rows["type"][plan].tolist() == ["line", "clothoid", "arc", "clothoid", "line"]
    np.testing.assert_allclose(rows["s_from"][plan], [0, 120, 180, 330, 380], atol=0.5)
    assert rows["r1_m"][plan][2] == pytest.approx(400, abs=0.3)
    assert set(rows["track_id"]) == {4}
    first = shapely.get_coordinates(shapes[0], include_z=True)[0]
    np.testing.assert_allclose(first, [*CORNER[:2] + [100, 200], 50], atol=0.01)
    away, _ = table(folder / "out.gpkg", "deviations")
    assert len(away["s"]) == 521
    assert np.std(away["slew_mm"]) == pytest.approx(1.0, abs=0.15)
    assert "<svg" in (folder / "fit.html").read_text()


def test_a_fit_says_how_far_the_track_lies_off_in_each_direction(folder, capsys):
    assert main(["fit-alignment", str(folder / "tracks.gpkg"), "--elements", str(folder / "said.gpkg")]) == 0
    away, _ = table(folder / "out.gpkg", "deviations")
    across, height = (np.sqrt(np.nanmean(away[name] ** 2)) for name in ("slew_mm", "lift_mm"))
    found = re.search(r"root mean square ([\d.]+) mm across, ([\d.]+) mm in height", capsys.readouterr().out)
    assert [float(one) for one in found.groups()] == pytest.approx([across, height], abs=0.02)


def test_a_design_is_read_again_and_compared_with_the_track(folder):
    out = folder / "design.gpkg"
    values = ["--tracks", str(folder / "moved.gpkg"), "--elements", str(out), "--axis", str(out)]
    values += ["--deviations", str(out), "--report", str(folder / "off.html")]
    assert main(["import-alignment", str(folder / "design.xml"), *values]) == 0
    rows, read = table(folder / "out.gpkg", "elements")[0], table(out, "elements")[0]
    plan = rows["layout"] == "H"
    np.testing.assert_allclose(read["s_from"][read["layout"] == "H"], rows["s_from"][plan], atol=1e-3)
    away, _ = table(out, "deviations")
    assert np.mean(away["lift_mm"]) == pytest.approx(10, abs=0.3)
    assert np.mean(away["slew_mm"]) == pytest.approx(0, abs=0.3)
    assert "<svg" in (folder / "off.html").read_text()


def points(path, places):
    features = [
        {"type": "Feature", "properties": {"name": str(number)}, "geometry": {"type": "Point", "coordinates": place}}
        for number, place in enumerate(places)
    ]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))


def test_an_axis_may_state_kilometres_as_m_values(tmp_path):
    place = tmp_path / "km.gpkg"
    measured_line = pytest.importorskip("rail_extract.core.files.writing").measured_line
    line = measured_line(np.array([[*CORNER, 3.0], [*CORNER + [1000, 0, 0], 4.0]]))
    pyogrio.raw.write(str(place), layer="axis", driver="GPKG", geometry_type="Unknown", crs="EPSG:25832",
                      geometry=np.array([line], object),
                      field_data=[np.array(["main"])], fields=["name"])  # fmt: skip
    points(tmp_path / "places.json", [(CORNER[:2] + [250, 3]).tolist()])
    out = tmp_path / "out.gpkg"
    values = [str(tmp_path / "places.json"), str(place), "--output", str(out), "--format", "KILOMETRES"]
    assert main(["station", *values]) == 0
    rows, _ = table(out, "places")
    assert rows["km"][0] == pytest.approx(3.25)
    assert rows["km_text"][0] == "3+250.00"


def layer_of(path, shapes, **properties):
    """Write shapes beside an axis of 1 km, in EPSG:25832; the axis is in another file."""
    features = [
        {"type": "Feature", "properties": {name: values[number] for name, values in properties.items()},
         "geometry": shape and json.loads(shapely.to_geojson(shapely.transform(shape, lambda xy: xy + CORNER[:2])))}
        for number, shape in enumerate(shapes)
    ]  # fmt: skip
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    written(path.with_name("axis.gpkg"), "axis", [CORNER + [[0, 0, 0], [1000, 0, 0]]], name=["main"])
    return path, path.with_name("axis.gpkg")


def test_python_gives_lines_and_polygons_the_kilometres_of_their_ends(tmp_path):
    shapes = [shapely.LineString([(100, 4), (300, 4)]), shapely.box(500, 1, 600, 9), shapely.Point(2000, 0), None]
    places, axis = layer_of(tmp_path / "places.json", shapes, km=[7.0, 8.0, 9.0, 10.0])
    said = Recording(SILENT)
    found = rx.station(places, axis, tmp_path / "out.gpkg", start_km=2.0, progress=said)
    assert found.figures == {"PLACE_COUNT": 2, "BEYOND_COUNT": 2, "AMBIGUOUS_COUNT": 0}
    assert found.sentences == ("2 of 4 features have a kilometre.",)
    assert list(said.warnings) == ["1 of 3 places are beyond the ends of AXIS: their kilometres are empty."]
    rows, copied = table(tmp_path / "out.gpkg", "places")
    assert rows["km"].tolist() == [7.0, 8.0, 9.0, 10.0]
    np.testing.assert_allclose(rows["km_2"], [2.2, 2.55, np.nan, np.nan])
    np.testing.assert_allclose(rows["km_from"], [2.1, 2.5, np.nan, np.nan])
    np.testing.assert_allclose(rows["km_to"], [2.3, 2.6, np.nan, np.nan])
    assert rows["side"].tolist() == ["left", "left", None, None]
    assert [shape and shape.geom_type for shape in copied] == ["LineString", "Polygon", "Point", None]
    pytest.importorskip("geopandas")
    frame = found.to_geodataframe("output")
    assert (frame.crs.to_epsg(), frame["km_2"].tolist()[:2]) == (25832, [2.2, 2.55])


def test_points_with_kilometres_go_into_a_table_and_polygons_do_not(tmp_path):
    axis_of = {"start_km": 2.0}
    places, axis = layer_of(tmp_path / "places.json", [shapely.Point(100, 4), shapely.Point(5000, 0)], sign=["A", None])
    rx.station(places, axis, tmp_path / "out.csv", **axis_of)
    head, first, second = (tmp_path / "out.csv").read_text().splitlines()
    assert head == "WKT,sign,axis,piece,km,km_text,offset_m,side,ambiguous"
    assert first == "POINT (578300.0000 5804304.0000),A,main,1,2.1,2.1+00.00,4.0,left,0"
    assert second == "POINT (583200.0000 5804300.0000),,,,,,,,"
    places, axis = layer_of(tmp_path / "areas.json", [shapely.box(500, 1, 600, 9)])
    with pytest.raises(ParameterError, match="out.csv can only have points, or only lines: choose a GeoPackage"):
        rx.station(places, axis, tmp_path / "out.csv", **axis_of)
