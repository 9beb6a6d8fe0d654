"""LandXML: what is written, and that it is read again as the same elements."""

import math
import os
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained, stations_of
from rail_extract.core.files.design import Delivery
from rail_extract.core.files.landxml import NAMESPACE, write_landxml
from rail_extract.core.files.landxml_reading import read_landxml, stated_system
from rail_extract.core.frame import LocalFrame

DELIVERY = Delivery(1.435, 0.072, 25832, "ETRS89 / UTM zone 32N", "DHHN2016 height", "1.0", datetime(2026, 5, 1, 9))
FRAME = LocalFrame(np.array([500_000.0, 5_800_000.0, 0.0]))
SCHEMA = "RAIL_EXTRACT_LANDXML_XSD"
"""Names the file of the schema LandXML-1.2.xsd, which is not part of the project."""

LEFT, RIGHT = 1 / 500, -1 / 400


@pytest.fixture
def written(tmp_path):
    """Write alignments, and return the root of the file without namespaces."""

    def write(*alignments, circles=True):
        path = tmp_path / "Trasse Süd 1.xml"
        write_landxml(path, alignments, DELIVERY, circles)
        root = ET.parse(path).getroot()
        for node in root.iter():
            assert node.tag.startswith(f"{{{NAMESPACE}}}")
            node.tag = node.tag.rpartition("}")[2]
        return root

    write.path = tmp_path / "Trasse Süd 1.xml"
    return write


def design(shapes, vertical=(), cant=(), frame=FRAME, name=""):
    return Alignment(3, frame, chained((10.0, 20.0), 0.4, shapes), tuple(vertical), tuple(cant), name)


def numbers(node):
    return [float(word) for word in node.text.split()]


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=40, deadline=None)
def test_what_is_written_is_read_as_the_same_elements(tmp_path_factory, random_design, with_km, seed, rises):
    design = with_km(random_design(seed), 40.0, rises, {3: 0.25, 5: -0.12})
    path = tmp_path_factory.mktemp("landxml") / "design.xml"
    write_landxml(path, [design], DELIVERY, circles=seed % 2 == 0)
    (found,) = read_landxml(path)
    assert found.track_id == 7
    crossing = [one for one in design.plan if one.k_from * one.k_to < 0]
    assert len(found.plan) == len(design.plan) + len(crossing)
    assert [one.type for one in found.vertical] == [one.type for one in design.vertical]
    s = np.linspace(0, design.s_to, 300)
    np.testing.assert_allclose(found.frame.to_crs(found.xyz(s)), design.frame.to_crs(design.xyz(s)), rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.curvatures(s[1:-1]), design.curvatures(s[1:-1]), atol=1e-8)
    np.testing.assert_allclose(found.grades(s[1:-1]), design.grades(s[1:-1]), atol=1e-6)
    np.testing.assert_allclose(found.cants(s), design.cants(s), atol=1e-6)
    ours, theirs = stations_of(design), stations_of(found)
    for place in s[1:-1]:
        assert theirs.ahead(place) == pytest.approx(ours.ahead(place), abs=1e-4)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_each_element_ends_where_the_next_one_starts(tmp_path_factory, random_design, seed):
    path = tmp_path_factory.mktemp("landxml") / "design.xml"
    write_landxml(path, [random_design(seed)], DELIVERY)
    parts = list(ET.parse(path).getroot().find(".//{*}CoordGeom"))
    for one, after in zip(parts, parts[1:]):
        assert one.find("{*}End").text == after.find("{*}Start").text
        assert float(one.get("staStart")) + float(one.get("length")) == pytest.approx(
            float(after.get("staStart")), abs=1e-6
        )


def test_points_are_northing_first_and_no_direction_is_stated(written):
    root = written(design([(100.0, 0, 0), (50.0, 0, LEFT), (80.0, LEFT, LEFT)]))
    line, spiral, curve = root.find(".//CoordGeom")
    assert numbers(line.find("Start")) == [5_800_020.0, 500_010.0]
    assert [node.tag for node in root.iter() if any(key.startswith("dir") for key in node.attrib)] == []
    assert (spiral.get("rot"), spiral.get("radiusStart"), float(spiral.get("radiusEnd"))) == ("ccw", "INF", 500.0)
    assert float(spiral.get("constant")) == pytest.approx(math.sqrt(50 * 500))
    assert float(curve.get("radius")) == 500.0
    centre, start = (np.array(numbers(curve.find(name))) for name in ("Center", "Start"))
    assert np.hypot(*(centre - start)) == pytest.approx(500.0, abs=1e-6)


def test_tangents_of_a_spiral_meet_in_its_pi(written):
    alignment = design([(60.0, LEFT, -RIGHT)])
    spiral = written(alignment).find(".//Spiral")
    start, meet, end = (np.array(numbers(spiral.find(name)))[::-1] for name in ("Start", "PI", "End"))
    for one, other, s in ((start, meet, 0.0), (meet, end, 60.0)):
        heading = alignment.headings(np.array([s]))[0]
        np.testing.assert_allclose(
            (other - one) / np.hypot(*(other - one)), [np.cos(heading), np.sin(heading)], atol=1e-6
        )


def test_a_clothoid_between_reverse_curves_is_two_spirals(written):
    first, second = written(design([(90.0, LEFT, RIGHT)])).findall(".//Spiral")
    assert (first.get("rot"), first.get("radiusEnd")) == ("ccw", "INF")
    assert (second.get("rot"), second.get("radiusStart")) == ("cw", "INF")
    assert float(first.get("length")) == pytest.approx(90 * LEFT / (LEFT - RIGHT))
    assert float(first.get("constant")) == pytest.approx(float(second.get("constant")))


def test_cant_is_unsigned_with_the_direction_of_the_curve(written):
    shapes = [(50.0, RIGHT, RIGHT), (50.0, RIGHT, LEFT), (50.0, LEFT, LEFT)]
    cants = [CantElement(0, 50, 0.1, 0.1), CantElement(50, 50, 0.1, -0.08), CantElement(100, 50, -0.08, 0.02)]
    found = written(design(shapes, cant=cants)).findall(".//CantStation")
    stated = [(float(one.get("appliedCant")), one.get("curvature"), one.get("adverse")) for one in found]
    assert stated == [(100, "cw", None), (100, "cw", None), (80, "ccw", None), (-20, "ccw", "true")]


def test_jumps_of_the_kilometres_are_equations(written, with_km):
    shapes = [(100.0, 0, 0), (80.0, LEFT, LEFT), (50.0, 0, 0)]
    root = written(with_km(design(shapes), 10.0, jumps={1: 0.3}))
    assert float(root.find(".//Alignment").get("staStart")) == 10_000.0
    (jump,) = root.findall(".//StaEquation")
    facts = {name: float(jump.get(name)) for name in ("staInternal", "staBack", "staAhead")}
    assert facts == pytest.approx({"staInternal": 10_100.0, "staBack": 10_100.0, "staAhead": 10_400.0})
    falls = written(with_km(design(shapes), 10.0, rises=False)).findall(".//StaEquation")
    assert [(float(one.get("staAhead")), one.get("staIncrement")) for one in falls] == [(10_000.0, "decreasing")]


def test_profiles_have_circles_or_parabolas(written):
    vertical = [VerticalElement(0, 40, 100, 0.01, 0.01), VerticalElement(40, 60, 100.4, 0.01, -0.02)]
    profile = written(design([(100.0, 0, 0)], vertical)).find(".//ProfAlign")
    assert [node.tag for node in profile] == ["PVI", "CircCurve", "PVI"]
    assert float(profile[1].get("radius")) == pytest.approx(2000.0, rel=2e-4)
    np.testing.assert_allclose([numbers(node) for node in profile], [[0, 100], [70, 100.7], [100, 100.1]])
    road = written(design([(100.0, 0, 0)], vertical), circles=False).find(".//ProfAlign")
    assert road[1].tag == "ParaCurve" and float(road[1].get("length")) == 60.0


def test_names_are_distinct_and_kept(written):
    twice = [design([(10.0, 0, 0)], name="Gleis 1 östlich"), replace(design([(10.0, 0, 0)], name="Gleis 1 östlich"))]
    written(*twice)
    assert [one.name for one in read_landxml(written.path)] == ["Gleis 1 östlich", "Gleis 1 östlich (2)"]
    assert [one.track_id for one in read_landxml(written.path)] == [1, 2]
    assert stated_system(written.path) == "EPSG:25832"


@pytest.mark.skipif(SCHEMA not in os.environ, reason=f"{SCHEMA} names no schema")
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_files_are_valid_against_the_schema(tmp_path_factory, random_design, with_km, seed):
    etree = pytest.importorskip("lxml.etree")
    schema = etree.XMLSchema(etree.parse(os.environ[SCHEMA]))
    path = tmp_path_factory.mktemp("landxml") / "design.xml"
    alignments = [with_km(random_design(seed), jumps={2: 0.4}), random_design(seed + 1, track_id=8)]
    write_landxml(path, alignments, DELIVERY, circles=seed % 2 == 0)
    schema.assertValid(etree.parse(str(Path(path))))
