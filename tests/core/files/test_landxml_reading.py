"""LandXML of other programs: what is read, and what is refused besides the faults of `docs/faults.md`."""

import re

import numpy as np
import pytest
from rail_extract.core.errors import AlignmentFileError, Cancelled, RailExtractError
from rail_extract.core.files.design_files import check_designs, write_designs
from rail_extract.core.files.landxml_reading import read_landxml
from rail_extract.core.files.layers import elements_layer
from rail_extract.core.progress import Progress, Recording
from rail_extract.core.standards import STANDARDS

METRIC = '<Units><Metric linearUnit="meter"/></Units>'
LINE = "<Line><Start>5000 1000</Start><End>5000 1100 7</End></Line>"
"""Eastwards."""
SPIRAL = (
    '<Spiral rot="cw" spiType="clothoid" length="60" radiusStart="INF" radiusEnd="300">'
    "<Start>5000 1100</Start><PI>5000 1140.046</PI><End>4998.003 1159.940</End></Spiral>"
)
CURVE = (
    '<Curve rot="cw" radius="300"><Start>4998.003 1159.940</Start><Center>4699.501 1129.990</Center>'
    "<End>4953.041 1290.351</End></Curve>"
)


def landxml(parts=LINE + SPIRAL + CURVE, units=METRIC, further="", start="100"):
    alignment = (
        f'<Alignment name="Siding" length="1" staStart="{start}"><CoordGeom>{parts}</CoordGeom>{further}</Alignment>'
    )
    return f'<LandXML version="1.2" xmlns="http://www.landxml.org/schema/LandXML-1.2">{units}<Alignments>{alignment}</Alignments></LandXML>'


@pytest.fixture
def read(tmp_path):
    def read(text=None, **options):
        path = tmp_path / "design.xml"
        path.write_bytes(text if isinstance(text, bytes) else (text or landxml()).encode())
        return read_landxml(path, **options)

    return read


def test_elements_are_placed_by_their_ends_and_shaped_by_their_radii(read):
    (found,) = read()
    assert [one.type for one in found.plan] == ["line", "clothoid", "arc"]
    assert [one.length_m for one in found.plan[:2]] == [100, 60]
    assert found.plan[2].length_m == pytest.approx(139.189, abs=0.001)
    assert found.plan[1].k_to == found.plan[2].k_from == pytest.approx(-1 / 300)
    np.testing.assert_allclose(found.frame.to_crs(found.xyz([0.0]))[0, :2], [1000, 5000])
    joints = np.array([found.plan[1].s_from, found.plan[2].s_from])
    np.testing.assert_allclose(found.headings(joints), found.headings(joints - 1e-9), atol=1e-4)
    assert found.plan[0].figures.km_from == 0.1


def test_a_profile_with_circles_becomes_parabolas_of_the_same_tangents(read):
    profile = (
        "<Profile><ProfAlign name='p'><PVI>100 10</PVI><CircCurve length='80' radius='2000'>200 12</CircCurve>"
        "<PVI>300 10</PVI></ProfAlign></Profile>"
    )
    (found,) = read(landxml(further=profile))
    assert [one.type for one in found.vertical] == ["grade", "parabola", "grade"]
    assert found.vertical[1].length_m == pytest.approx(2000 * 2 * np.arctan(0.02))
    np.testing.assert_allclose(found.heights(np.array([0.0, 50.0, 150.0, 200.0])), [10, 11, 11, 10])
    assert found.heights(np.array([100.0]))[0] == pytest.approx(12 - 0.02 * found.vertical[1].length_m / 4)


def test_cant_has_the_sign_of_the_curve_and_adverse_cant_the_other(read):
    stations = "".join(
        f'<CantStation station="{100 + s}" appliedCant="{mm}" curvature="{turn}" {more}/>'
        for s, mm, turn, more in (
            (0, 0, "cw", ""),
            (50, 100, "cw", ""),
            (90, 100, "ccw", ""),
            (99, 20, "cw", 'adverse="1"'),
        )
    )
    (found,) = read(landxml(further=f'<Cant name="c" gauge="1.435">{stations}</Cant>'))
    np.testing.assert_allclose(found.cants(np.array([0, 25, 50, 70, 90, 99.0])), [0, 0.05, 0.1, 0, -0.1, -0.02])


def test_stations_follow_the_equations(read):
    equation = '<StaEquation staInternal="150" staBack="150" staAhead="500" staIncrement="decreasing"/>'
    (found,) = read(landxml(LINE + SPIRAL.replace("staStart", ""), further=equation))
    assert [(one.figures.km_from, one.figures.km_to) for one in found.plan] == [
        (0.1, 0.45),
        (0.45, pytest.approx(0.39)),
    ]


def test_points_with_the_easting_first_can_be_read(read):
    swapped = re.sub(r">([\d.]+) ([\d.]+)( \d+)?<", r">\2 \1<", landxml())
    (found,), (expected,) = read(swapped, east_first=True), read()
    np.testing.assert_allclose(found.places(np.array([0, 150, 250.0])), expected.places(np.array([0, 150, 250.0])))


def test_gaps_further_profiles_and_missing_units_are_told(read):
    heard = Recording(Progress())
    profile = "<Profile><ProfAlign><PVI>100 1</PVI><PVI>200 1</PVI></ProfAlign></Profile>"
    gap = (
        SPIRAL.replace("5000 1100<", "5000.02 1100<")
        .replace("5000 1140", "5000.02 1140")
        .replace("4998.003", "4998.023")
    )
    read(landxml(LINE + gap, units="", further=2 * profile), progress=heard)
    assert [any(word in one for one in heard.warnings) for word in ("20.0 mm", "2 profiles", "unit of length")] == 3 * [
        True
    ]


REFUSED = {
    "is empty": b"\n"[:0],
    "damaged or not XML \\(not well-formed": "Northing;Easting\n1;2\n",
    "neither line, arc nor clothoid": landxml("<IrregularLine/>"),
    "does not state cw or ccw": landxml(LINE + SPIRAL.replace("cw", "left")),
    "no coordinates for its End": landxml("<Line><Start>1 2</Start><End pntRef='7'/></Line>"),
    "not a list of numbers": landxml("<Line><Start>1 2</Start><End>1,5 2,5</End></Line>"),
    "states 'wide' as its radius": landxml(LINE + CURVE.replace('"300"', '"wide"')),
    "states a radius of 301": landxml(LINE + CURVE.replace('"300"', '"301"')),
    "has the radiusStart 0, but": landxml(LINE + SPIRAL.replace("INF", "0")),
    "has the length 0, but lengths": landxml(LINE + SPIRAL + CURVE.replace("<Curve", "<Curve length='0'")),
    "has the coordinate 1e.200, but": landxml(LINE + "<Line><Start>1 1</Start><End>1 1e200</End></Line>"),
    "has the staAhead inf, but": landxml(further="<StaEquation staInternal='150' staAhead='INF'/>"),
    "has the gradient 5, but": landxml(
        further="<Profile><ProfAlign><PVI>100 1</PVI><PVI>200 501</PVI></ProfAlign></Profile>"
    ),
    "does not state its length": landxml(LINE + SPIRAL.replace('length="60"', "")),
    "has no element": landxml(""),
    "goes back": landxml(further="<Profile><ProfAlign><PVI>100 1</PVI><PVI>90 1</PVI></ProfAlign></Profile>"),
    "overlap by 20.00 m": landxml(
        further="<Profile><ProfAlign><PVI>100 1</PVI><ParaCurve length='80'>150 2</ParaCurve>"
        "<ParaCurve length='60'>200 1</ParaCurve><PVI>300 1</PVI></ProfAlign></Profile>"
    ),
    "neither circle nor parabola": landxml(
        further="<Profile><ProfAlign><PVI>100 1</PVI><UnsymParaCurve/></ProfAlign></Profile>"
    ),
    "out of order": landxml(
        further="<Cant gauge='1'><CantStation station='200' appliedCant='0' curvature='cw'/>"
        "<CantStation station='150' appliedCant='0' curvature='cw'/></Cant>"
    ),
    "more in its alignments than any railway": landxml("<a>" * 200 + "</a>" * 200),
}


@pytest.mark.parametrize(("sentence", "text"), REFUSED.items())
def test_faults_are_refused_in_a_sentence(read, sentence, text):
    with pytest.raises(RailExtractError, match=sentence) as caught:
        read(text)
    assert str(caught.value).endswith((".", "LandXML."))


def test_a_profile_elsewhere_is_left_out_with_a_warning(read):
    heard = Recording(Progress())
    profile = "<Profile><ProfAlign><PVI>9100 1</PVI><PVI>9200 1</PVI></ProfAlign></Profile>"
    (found,) = read(landxml(further=profile), progress=heard)
    assert found.vertical == ()
    assert any("from 9100.00 m to 9200.00 m, and the plan from 100.00 m" in one for one in heard.warnings)


def test_long_texts_and_attributes_count(read, monkeypatch):
    comments = "<Feature>" + "word <!-- --> " * 20_000 + "</Feature>"
    assert len(read(landxml(comments + LINE))[0].plan) == 1
    monkeypatch.setattr("rail_extract.core.files.landxml_reading.MAX_CHARACTERS", 10_000)
    with pytest.raises(AlignmentFileError, match="any railway"):
        read(landxml(f"<Feature name='{'word' * 5_000}'/>" + LINE))


def test_what_is_beside_the_alignments_does_not_fill_the_memory(read, monkeypatch):
    surface = "<Surfaces>" + "<P>1 2 3</P>" * 1000 + "</Surfaces>"
    monkeypatch.setattr("rail_extract.core.files.landxml_reading.MAX_NODES", 100)
    text = landxml().replace("<Alignments>", surface + "<Alignments>")
    assert len(read(text)[0].plan) == 3
    with pytest.raises(AlignmentFileError, match="any railway"):
        read(text.replace("Surfaces>", "Alignments>"))


class Impatient(Progress):
    """Cancels at a check."""

    def __init__(self, at):
        self.checks, self._at = 0, at

    def check(self):
        self.checks += 1
        if self.checks == self._at:
            raise Cancelled


def many(count):
    """A line of as many elements, with as many points of a profile and of cant, and as many station equations."""
    places = [f"5000 {1000 + 10 * number}" for number in range(count + 1)]
    lines = "".join(f"<Line><Start>{a}</Start><End>{b}</End></Line>" for a, b in zip(places, places[1:]))
    s = [100 + 10 * number for number in range(count + 1)]
    profile = "".join(f"<PVI>{station} {10 + number % 2 / 100}</PVI>" for number, station in enumerate(s))
    cant = "".join(f'<CantStation station="{one}" appliedCant="{one % 7}" curvature="cw"/>' for one in s)
    jumps = "".join(f'<StaEquation staInternal="{one + 3}" staAhead="{2 * one}"/>' for one in s[:-1])
    further = f"{jumps}<Profile><ProfAlign>{profile}</ProfAlign></Profile><Cant>{cant}</Cant>"
    return landxml(lines, further=further)


def work(read, tmp_path, progress):
    """Read a long alignment, make its layer, and write it in all formats."""
    found = read(many(40), progress=progress)
    check_designs(found, progress)
    for name in ("a.xml", "a.ifc", "a.dxf"):
        write_designs(tmp_path / name, found, STANDARDS["EN_60E1_1435"], True, "1", progress)
    return elements_layer(found, progress)


def test_every_step_can_be_cancelled_between_two_elements(read, tmp_path):
    counting = Impatient(None)
    assert len(work(read, tmp_path, counting).xyz) == 120
    assert counting.checks > 5 * 117  # parts, kilometres, joints, rows and curves
    for at in range(1, counting.checks, 50):
        with pytest.raises(Cancelled):
            work(read, tmp_path, Impatient(at))
