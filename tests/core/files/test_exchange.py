"""Files for other programs: what a DXF and a CSV file contain, byte for byte where a reader depends on it."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.fields import CENTERLINE_FIELDS, FINDING_FIELDS, QUALITY_FIELDS, RAIL_FIELDS
from rail_extract.core.files.exchange import MAX_TEXT, Shape, write_alignments, write_shapes
from rail_extract.core.frame import LocalFrame

FRAME = LocalFrame(np.zeros(3), crs_wkt="EPSG:32643")
PLACES = [[578_215.12344, 2_494_290, 410.5], [578_218.12344, 2_494_294, 410.75], [578_218.12344, 2_494_300, 411]]
LINE = np.array(PLACES)
IDS = {"rail_id": 3, "class_code": 10, "points": 500}
KNOWN = {**IDS, "length_m": 11.2, "sigma_mm": 0.42, "track_ids": "1,2", "gaps": ""}
RAIL = [KNOWN.get(field.name, 0.0) for field in RAIL_FIELDS]


def groups(path):
    """Return the pairs of code and value of a DXF file."""
    lines = path.read_text(encoding="ascii").splitlines()
    return list(zip(map(int, lines[::2]), lines[1::2]))


def test_rails_are_3d_polylines_on_a_layer_of_their_class(tmp_path):
    path = tmp_path / "r.dxf"
    write_shapes(path, [Shape(LINE, RAIL), Shape(LINE + 1.5, [4, 11, *RAIL[2:]])], RAIL_FIELDS, FRAME, "RAILS", True)
    found = groups(path)
    assert (1, "AC1009") in found
    assert [value for code, value in found if (code, value) == (0, "POLYLINE")] == 2 * ["POLYLINE"]
    names = [found[at + 1] for at, group in enumerate(found) if group == (0, "POLYLINE")]
    assert names == [(8, "RAILS_10"), (8, "RAILS_11")]
    assert [value for code, value in found if code == 70 and value == "8"] == ["8", "8"]  # a polyline in 3D
    places = [[value for code, value in found[at + 2 : at + 5]] for at, one in enumerate(found) if one == (0, "VERTEX")]
    assert places[:2] == [["578215.1234", "2494290.0000", "410.5000"], ["578218.1234", "2494294.0000", "410.7500"]]
    texts = [value for code, value in found if code == 1000]
    assert texts[:3] == ["rail_id=3", "class_code=10", "length_m=11.2"]
    assert "track_ids=1,2" in texts and not any(text.startswith("gaps=") for text in texts)
    assert found[-1] == (0, "EOF")


@pytest.mark.parametrize(
    ("fields", "kind", "first", "layer"),
    [
        (CENTERLINE_FIELDS, "TRACK", {"track_id": 7}, "TRACK_7"),
        (FINDING_FIELDS, "FINDINGS", {"finding": 1, "track_id": 7}, "FINDINGS"),
    ],
)
def test_other_lines_have_layers_of_their_own(tmp_path, fields, kind, first, layer):
    path = tmp_path / "other.dxf"
    write_shapes(path, [Shape(LINE, [first.get(field.name) for field in fields])], fields, FRAME, kind, True)
    assert {value for code, value in groups(path) if code == 8} == {layer}
    assert (2, layer) in groups(path)  # in the table of layers


def test_stations_are_points_by_track_and_texts_are_ascii_and_short(tmp_path):
    path = tmp_path / "q.dxf"
    values = [2, *[None] * (len(QUALITY_FIELDS) - 2), "°" + 400 * "x"]
    write_shapes(path, [Shape(LINE[:1] * [1, 1, np.nan], values)], QUALITY_FIELDS, FRAME, "STATIONS", False)
    found = groups(path)
    at = found.index((0, "POINT"))
    assert found[at + 1 : at + 5] == [(8, "STATIONS_2"), (10, "578215.1234"), (20, "2494290.0000"), (30, "0.0000")]
    assert max(len(value) for code, value in found) == MAX_TEXT


def test_csv_has_geometry_as_text_with_types_and_coordinate_system(tmp_path):
    path = tmp_path / "r.csv"
    write_shapes(path, [Shape(LINE, RAIL)], RAIL_FIELDS, FRAME, "RAILS", True)
    names, row = csv.reader(path.open(encoding="utf-8"))
    assert names == ["WKT", *(field.name for field in RAIL_FIELDS)]
    assert row[0].startswith("LINESTRING Z (578215.1234 2494290.0000 410.5000,578218.1234 ")
    assert row[1:] == [str(value) for value in RAIL]
    types = path.with_suffix(".csvt").read_text().strip().split(",")
    assert types[:9] == ["WKT", "Integer", "Integer", "Real", "Integer", "Real", "Real", "Real", "String"]
    assert len(types) == len(names)
    assert path.with_suffix(".prj").read_text().startswith('PROJCS["WGS 84 / UTM zone 43N"')
    flat = Shape(LINE * [1, 1, np.nan], RAIL)
    write_shapes(path, [flat], RAIL_FIELDS, LocalFrame(np.zeros(3)), "RAILS", True)
    assert "LINESTRING (578215.1234 2494290.0000," in path.read_text(encoding="utf-8")


def test_csv_of_vertices_has_chainage_in_metres(tmp_path):
    path = tmp_path / "rails_points.csv"
    write_shapes(path, [Shape(LINE, RAIL)], RAIL_FIELDS, LocalFrame(np.zeros(3), 0.3048, 0.3048), "RAILS", True)
    rows = list(csv.DictReader(path.open(encoding="utf-8")))
    assert list(rows[0]) == ["rail_id", "class_code", "x", "y", "z", "chainage_m"]
    assert [row["chainage_m"] for row in rows] == ["0.000", f"{5 * 0.3048:.3f}", f"{11 * 0.3048:.3f}"]
    assert rows[1] == {
        **{"rail_id": "3", "class_code": "10", "x": "578218.1234", "y": "2494294.0000", "z": "410.7500"},
        "chainage_m": "1.524",
    }
    assert [file.name for file in tmp_path.iterdir()] == ["rails_points.csv"]


def test_csv_of_stations_has_all_fields(tmp_path):
    path = tmp_path / "stations_points.csv"
    values = list(range(len(QUALITY_FIELDS)))
    write_shapes(path, [Shape(LINE[:1], values)], QUALITY_FIELDS, FRAME, "STATIONS", False)
    names, row = csv.reader(path.open(encoding="utf-8"))
    assert names == [*(field.name for field in QUALITY_FIELDS), "x", "y", "z"]
    assert row == [*map(str, values), "578215.1234", "2494290.0000", "410.5000"]


@given(st.lists(st.tuples(*3 * [st.floats(-1e7, 1e7)]), min_size=2, max_size=6))
def test_coordinates_are_kept_to_a_tenth_of_a_millimetre(tmp_path_factory, places):
    folder = tmp_path_factory.mktemp("exchange")
    for name in ("r.dxf", "r_points.csv"):
        write_shapes(folder / name, [Shape(np.array(places), RAIL)], RAIL_FIELDS, FRAME, "RAILS", True)
    rows = csv.DictReader((folder / "r_points.csv").open(encoding="utf-8"))
    written = [[float(row[axis]) for axis in "xyz"] for row in rows]
    np.testing.assert_allclose(written, places, atol=0.5001e-4)
    found = groups(folder / "r.dxf")
    starts = [at for at, group in enumerate(found) if group == (0, "VERTEX")]
    drawn = [[float(value) for _, value in found[at + 2 : at + 5]] for at in starts]
    np.testing.assert_allclose(drawn, written, atol=1e-9)


def test_an_alignment_is_a_polyline_with_a_point_and_a_text_for_each_element(tmp_path):
    plan = chained((10.0, 20.0), 0.0, [(100.0, 0, 0), (60.0, 0, -1 / 500), (80.0, -1 / 500, -1 / 500)])
    profile, cant = (VerticalElement(0, 240, 50, 0.01, 0.0),), (CantElement(0, 240, 0.02, 0.12),)
    design = Alignment(7, LocalFrame(np.array([1000.0, 2000.0, 0.0])), plan, profile, cant)
    path = tmp_path / "design.dxf"
    write_alignments(path, [design])
    found = groups(path)
    layers = [value for code, value in found if code == 8]
    assert {"ALIGNMENT_7", "PLAN_7", "PROFILE_7", "CANT_7"} == set(layers)
    assert [value for code, value in found if code == 1][1:] == [
        "  line, L 100.00",
        "  clothoid R straight to -500.00, L 60.00",
        "  arc R -500.00, L 80.00",
        "  parabola 10.00 to 0.00 per mille, L 240.00, R -24000",
        "  ramp 20 to 120 mm, L 240.00",
    ]
    vertices = [at for at, group in enumerate(found) if group == (0, "VERTEX")]
    places = [[float(value) for _, value in found[at + 2 : at + 5]] for at in vertices]
    assert places[0] == [1010, 2020, 50] and places[-1][2] == 51.2
    points = [at for at, group in enumerate(found) if group == (0, "POINT")]
    assert [float(found[at + 2][1]) for at in points[:3]] == pytest.approx([1010, 1110, 1170], abs=0.2)
