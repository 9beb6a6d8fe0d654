"""Export and import of alignments through qgis_process: a table in a GeoPackage, files, and the table again."""

import pytest
from lines import read_features

SOURCE = """<LandXML version="1.2"><Units><Metric linearUnit="meter"/></Units><CoordinateSystem epsgCode="25832"/>
<Alignments><Alignment name="Gleis 3" staStart="12000" length="310"><CoordGeom>
<Line><Start>5804300 578200</Start><End>5804300 578300</End></Line>
<Spiral rot="cw" spiType="clothoid" length="60" radiusStart="INF" radiusEnd="300">
<Start>5804300 578300</Start><PI>5804300 578340.046</PI><End>5804298.003 578359.940</End></Spiral>
</CoordGeom><StaEquation staInternal="12100" staBack="12100" staAhead="12500" staIncrement="increasing"/>
<Cant name="c" gauge="1.435"><CantStation station="12100" appliedCant="0" curvature="cw"/>
<CantStation station="12160" appliedCant="90" curvature="cw"/></Cant>
<Profile><ProfAlign name="p"><PVI>12000 80</PVI><CircCurve length="40" radius="2000">12080 80</CircCurve>
<PVI>12160 81.6</PVI></ProfAlign></Profile></Alignment></Alignments></LandXML>"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("Größe östlich 3")


@pytest.fixture(scope="module")
def table(succeed, folder):
    """Elements of the source."""
    (folder / "quelle.xml").write_text(SOURCE, encoding="utf-8")
    elements, axis = folder / "elements.gpkg", folder / "axis.gpkg"
    found = succeed("importalignment", {"INPUT": folder / "quelle.xml", "ELEMENTS": elements, "AXIS": axis})
    assert (found["ALIGNMENT_COUNT"], found["ELEMENT_COUNT"]) == (1, 6)
    return elements


def figures(path):
    names = ("layout", "type", "s_from", "length_m", "r2_m", "km_from", "x", "y", "grade2_pm", "cant2_mm")
    return [[items[name] for name in names] for _, items in read_features(path)]


def test_elements_come_back_through_landxml(succeed, folder, table):
    succeed("exportalignment", {"INPUT": table, "OUTPUT": folder / "b.xml"})
    succeed("importalignment", {"INPUT": folder / "b.xml", "ELEMENTS": folder / "again.gpkg"})
    first, second = figures(table), figures(folder / "again.gpkg")
    assert [row[:2] for row in first] == [
        ["H", "line"],
        ["H", "clothoid"],
        ["V", "grade"],
        ["V", "parabola"],
        ["V", "grade"],
        ["C", "ramp"],
    ]
    for one, other in zip(first, second):
        assert one[:2] == other[:2]
        assert [value and pytest.approx(value, rel=1e-5, abs=1e-4) for value in one[2:]] == other[2:]
    assert [row[5] for row in first][:2] == [12.0, 12.5]
