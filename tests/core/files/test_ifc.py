"""IFC: instances of the file, and its curves as IfcOpenShell evaluates them, where it is installed."""

import math
import re
from datetime import datetime

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.files.design import Delivery
from rail_extract.core.files.ifc import write_ifc
from rail_extract.core.frame import LocalFrame

DELIVERY = Delivery(1.435, 0.072, 25832, "ETRS89 / UTM zone 32N", "DHHN2016 height", "1.0", datetime(2026, 5, 1, 9))
FRAME = LocalFrame(np.array([578_200.0, 5_804_300.0, 0.0]))
SHAPES = [
    (100.0, 0, 0),
    (60.0, 0, 1 / 500),
    (80.0, 1 / 500, 1 / 500),
    (70.0, 1 / 500, -1 / 400),
    (50.0, -0.0025, -0.0025),
]
VERTICAL = [VerticalElement(0, 200, 50, 0.01, 0.01), VerticalElement(200, 160, 52, 0.01, -0.02)]
CANT = [CantElement(0, 100, 0, 0), CantElement(100, 60, 0, -0.1), CantElement(160, 200, -0.1, -0.1)]


@pytest.fixture
def written(tmp_path):
    """Write alignments, and return the attributes of the instances by entity, in order."""

    def write(*alignments, name="t.ifc"):
        path = tmp_path / name
        write_ifc(path, alignments, DELIVERY)
        text = path.read_text(encoding="ascii")
        assert text.startswith("ISO-10303-21;\nHEADER;\n") and text.endswith("ENDSEC;\nEND-ISO-10303-21;\n")
        found = {}
        for number, line in enumerate(text.split("DATA;\n")[1].splitlines()[:-2], start=1):
            of, entity, attributes = re.fullmatch(r"#(\d+)=([A-Z0-9]+)\((.*)\);", line).groups()
            assert int(of) == number
            assert all(int(other) < number for other in re.findall(r"#(\d+)", attributes))
            found.setdefault(entity, []).append(split(attributes))
        return found

    return write


def split(attributes):
    """Split attributes at the commas outside of brackets and texts."""
    return re.findall(r"(?:[^,('](?!\()|'(?:''|[^'])*'|\w*\((?:[^()]|\([^()]*\))*\))+", attributes)


def design(track_id=4, vertical=VERTICAL, cant=CANT):
    return Alignment(track_id, FRAME, chained((10.0, 20.0), 0.4, SHAPES), tuple(vertical), tuple(cant))


def columns(rows, *numbers):
    assert all("." in row[number] for row in rows for number in numbers if row[number] != "$")  # of the type REAL
    return [tuple(float(row[number]) if row[number] != "$" else None for number in numbers) for row in rows]


def test_layouts_have_their_elements_and_end_with_one_of_length_0(written):
    found = written(design())
    plan = found["IFCALIGNMENTHORIZONTALSEGMENT"]
    assert [row[8] for row in plan] == [
        ".LINE.",
        ".CLOTHOID.",
        ".CIRCULARARC.",
        ".CLOTHOID.",
        ".CIRCULARARC.",
        ".LINE.",
    ]
    np.testing.assert_allclose(
        columns(plan, 4, 5, 6),
        [(0, 0, 100), (0, 500, 60), (500, 500, 80), (500, -400, 70), (-400, -400, 50), (0, 0, 0)],
    )
    profile = found["IFCALIGNMENTVERTICALSEGMENT"]
    assert [row[8] for row in profile] == [".CONSTANTGRADIENT.", ".PARABOLICARC.", ".CONSTANTGRADIENT."]
    assert columns(profile, 2, 3, 4, 5, 6)[1] == (200, 160, 52, 0.01, -0.02)
    assert columns(profile, 7)[0] == (None,)
    assert columns(profile, 7)[1][0] == pytest.approx(-160 / 0.03)
    cant = found["IFCALIGNMENTCANTSEGMENT"]
    assert [row[8] for row in cant] == [".CONSTANTCANT.", ".LINEARTRANSITION.", ".CONSTANTCANT.", ".CONSTANTCANT."]
    assert columns(cant, 4, 5, 6, 7)[1] == (0, -0.05, 0, 0.05)
    assert float(found["IFCALIGNMENTCANT"][0][7]) == pytest.approx(1.507)
    assert len(found["IFCALIGNMENTSEGMENT"]) == len(found["IFCCURVESEGMENT"]) == 6 + 3 + 4


def test_curves_have_the_signs_and_constants_of_the_format(written):
    found = written(design())
    assert [float(row[1]) for row in found["IFCCIRCLE"]] == [500, 400]
    lengths = [float(re.findall(r"\((.*)\)", row[3])[0]) for row in found["IFCCURVESEGMENT"][:6]]
    assert lengths == [100, 60, 80, 70, -50, 0]
    constants = [float(row[1]) for row in found["IFCCLOTHOID"][:2]]
    assert constants == pytest.approx([math.sqrt(60 * 500), -math.sqrt(70 / (1 / 500 + 1 / 400))])
    ways = [row[0] for row in found["IFCCURVESEGMENT"][:6]]
    assert ways == [*4 * [".CONTSAMEGRADIENTSAMECURVATURE."], ".CONTSAMEGRADIENT.", ".DISCONTINUOUS."]


def test_coordinates_are_small_and_the_map_conversion_states_their_place(written):
    found = written(design())
    assert found["IFCMAPCONVERSION"][0][2:] == ["578200.0", "5804300.0", "0.0", "1.0", "0.0", "1.0"]
    assert found["IFCPROJECTEDCRS"][0][0] == "'EPSG:25832'"
    places = [float(word) for row in found["IFCCARTESIANPOINT"] for word in re.findall(r"-?[\d.]+(?:E-?\d+)?", row[0])]
    assert max(map(abs, places)) < 1000


def test_jumps_are_referents_with_the_station_behind(written, with_km):
    found = written(with_km(design(), 10.0, jumps={1: 0.3}))
    stated = [(row[0], float(row[2][17:-1])) for row in found["IFCPROPERTYSINGLEVALUE"] if "LENGTH" in row[2]]
    assert stated == [("'Station'", 10_000), ("'Station'", pytest.approx(10_400)), ("'IncomingStation'", 10_100)]
    assert len(found["IFCREFERENT"]) == 2
    assert [row[0][17:-1] for row in found["IFCPOINTBYDISTANCEEXPRESSION"]] == ["0.0", "100.0"]


def test_a_plan_alone_has_a_plane_curve_and_a_station(written):
    found = written(design(vertical=()))
    assert "IFCGRADIENTCURVE" not in found and "IFCALIGNMENTCANT" not in found
    assert [row[2] for row in found["IFCSHAPEREPRESENTATION"] if row[2] != "'Segment'"] == ["'Curve2D'"]
    assert len(found["IFCREFERENT"]) == 1


def test_ids_are_distinct_and_those_of_the_run_before(written):
    first, second = written(design(), design(5)), written(design(), design(5), name="again.ifc")
    ids = [row[0] for entity, rows in first.items() for row in rows if entity.startswith(("IFCREL", "IFCALIGNMENT"))]
    ids = [one for one in ids if re.fullmatch(r"'[0-3][\w$]{21}'", one)]
    assert len(ids) == len(set(ids)) > 40
    assert first == second


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ifcopenshell_finds_no_fault_and_evaluates_the_same_curve(tmp_path, random_design, with_km, seed):
    ifcopenshell = pytest.importorskip("ifcopenshell", reason="IfcOpenShell is not installed")
    from ifcopenshell import geom, ifcopenshell_wrapper, validate

    alignments = [with_km(random_design(seed), jumps={2: 0.5}), random_design(seed + 100, 8)]
    path = tmp_path / "t.ifc"
    write_ifc(path, alignments, DELIVERY)
    model, log = ifcopenshell.open(str(path)), validate.json_logger()
    validate.validate(model, log, express_rules=True)
    assert log.statements == []
    options = geom.settings()
    for found, alignment in zip(model.by_type("IfcAlignment"), alignments):
        curve = found.Representation.Representations[1].Items[0]
        function = ifcopenshell_wrapper.map_shape(options, curve)
        evaluator = ifcopenshell_wrapper.function_item_evaluator(options, function)
        s = np.linspace(0, alignment.s_to, 150)
        frames = np.array([evaluator.evaluate(float(place)) for place in s])
        np.testing.assert_allclose(frames[:, :3, 3], alignment.xyz(s), atol=1e-4)
        # Its tilt follows the rise of a ramp within a fraction of a millimetre.
        np.testing.assert_allclose(1.507 * frames[:, 2, 1], alignment.cants(s), atol=1e-3)
