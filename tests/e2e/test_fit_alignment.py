"""Design elements through qgis_process, compared with the design that the line was made from."""

import json
import sqlite3

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.frame import LocalFrame

EAST, NORTH = 500_000.0, 3_000_000.0
SHAPES = [(150.0, 0, 0), (60.0, 0, -1 / 500), (150.0, -1 / 500, -1 / 500), (60.0, -1 / 500, 0), (100.0, 0, 0)]
FITTED = "layout, type, s_from, s_to, r1_m, r2_m, sigma_r_m, x, cant2_mm, r_round_m"


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    """A line without track_id and its stations, with errors of 1 mm, as GeoJSON."""
    folder, random = tmp_path_factory.mktemp("Gleis östlich"), np.random.default_rng(7)
    vertical = (VerticalElement(0, 200, 50, 0.01, 0.01), VerticalElement(200, 100, 52, 0.01, -0.01))
    vertical = (*vertical, VerticalElement(300, 220, 52, -0.01, -0.01))
    cant = (CantElement(0, 150, 0, 0), CantElement(150, 60, 0, 0.08), CantElement(210, 150, 0.08, 0.08))
    cant = (*cant, CantElement(360, 60, 0.08, 0), CantElement(420, 100, 0, 0))
    design = Alignment(1, LocalFrame(np.zeros(3)), chained((0.0, 0.0), 0.7, SHAPES), vertical, cant)
    s = np.arange(0.0, 521.0)
    line = design.xyz(s) + [EAST, NORTH, 0] + 0.001 * random.standard_normal((len(s), 3))
    mm = 1000 * design.cants(s) + 0.4 * random.standard_normal(len(s))
    write_survey(folder, line, s, mm)
    return folder


def write_survey(folder, line, s, mm):
    """Write a line, and stations with its cant."""
    stations = [
        ({"track_id": 0, "chainage_m": t, "cant_mm": value}, place) for t, value, place in zip(s, mm, line.tolist())
    ]
    written = {"line.geojson": [("LineString", {}, line.tolist())]}
    written["quality.geojson"] = [("Point", values, place) for values, place in stations]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32643"}}
    for name, shapes in written.items():
        features = [
            {"type": "Feature", "properties": values, "geometry": {"type": kind, "coordinates": places}}
            for kind, values, places in shapes
        ]
        (folder / name).write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))


def table(path):
    with sqlite3.connect(path) as database:
        rows = list(database.execute(f"SELECT {FITTED} FROM {path.stem} ORDER BY fid"))
    return {layout: [row[1:] for row in rows if row[0] == layout] for layout in "HVC"}


def rows_of(path):
    """Rows of an element table without their geometries."""
    with sqlite3.connect(path) as database:
        found = database.execute(f"SELECT * FROM {path.stem} ORDER BY fid")
        names = [column[0] for column in found.description]
        return [{name: value for name, value in zip(names, row) if name != "geom"} for row in found]


def as_csv(source, path, radii):
    """Write an element table as a person edits it in a spreadsheet: with other radii in some rows."""
    table = rows_of(source)
    for at, radius in radii.items():
        table[at].update(r1_m=radius(table[at]))
    lines = [",".join("" if value is None else str(value) for value in row.values()) for row in table]
    path.write_text("\n".join([",".join(table[0]), *lines]) + "\n")
    types = {"layout": "String", "type": "String", "rot": "String", "joint": "String"}
    path.with_suffix(".csvt").write_text(",".join(types.get(name, "Real") for name in table[0]))


def test_elements_and_deviations_and_a_corrected_table(succeed, survey):
    given = {"INPUT": survey / "line.geojson", "QUALITY": survey / "quality.geojson"}
    outputs = {"ELEMENTS": survey / "elements.gpkg", "DEVIATIONS": survey / "deviations.gpkg"}
    results = succeed("fitalignment", {**given, **outputs})
    assert results["ELEMENT_COUNT"] == 13
    assert results["RMS"] == pytest.approx(1.0, abs=0.15)
    found = table(outputs["ELEMENTS"])
    assert [row[0] for row in found["H"]] == ["line", "clothoid", "arc", "clothoid", "line"]
    np.testing.assert_allclose([row[1] for row in found["H"]], [0, 150, 210, 360, 420], atol=0.15)
    arc = found["H"][2]
    assert arc[3] == arc[4] == pytest.approx(-500, abs=4 * arc[5])
    assert arc[8] == -500
    assert found["H"][0][3] is None
    assert found["H"][0][6] == pytest.approx(EAST, abs=0.01)
    assert [row[0] for row in found["V"]] == ["grade", "parabola", "grade"]
    assert found["V"][1][3] == pytest.approx(-5000, rel=0.02)
    assert [row[0] for row in found["C"]] == ["constant", "ramp", "constant", "ramp", "constant"]
    assert found["C"][1][7] == pytest.approx(80, abs=0.5)
    with sqlite3.connect(outputs["DEVIATIONS"]) as database:
        away = np.array(list(database.execute("SELECT s, slew_mm, lift_mm, cant_diff_mm FROM deviations")), dtype=float)
    assert away[:, 0].tolist() == list(range(len(away)))
    np.testing.assert_allclose(np.nanstd(away[:, 1:], axis=0), [1.0, 1.0, 0.4], atol=0.2)
    edited = survey / "edited.csv"
    as_csv(outputs["ELEMENTS"], edited, {2: lambda row: -498.0})
    succeed("fitalignment", {**given, "FIXED": edited, "ELEMENTS": survey / "held.gpkg"})
    held = table(survey / "held.gpkg")["H"]
    assert held[2][3] == held[2][4] == pytest.approx(-498.0, abs=1e-4)
    assert [row[0] for row in held] == [row[0] for row in found["H"]]


def test_lines_of_an_extraction_have_the_elements_of_the_scene(extracted, succeed, tmp_path):
    """The errors of extracted lines are smooth, and must not be taken for elements."""
    given = {"INPUT": extracted.centerlines, "ELEMENTS": tmp_path / "elements.gpkg"}
    succeed("fitalignment", given)
    plan = [row for row in rows_of(tmp_path / "elements.gpkg") if row["layout"] == "H"]
    assert [row["type"] for row in plan] == 3 * ["line", "clothoid", "arc"]
    np.testing.assert_allclose([row["s_to"] for row in plan[::3]], 40, atol=1)
    np.testing.assert_allclose([row["length_m"] for row in plan[1::3]], 40, atol=2)
    np.testing.assert_allclose([row["r1_m"] for row in plan[2::3]], 1500, atol=25)
