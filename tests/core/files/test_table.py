"""The element table: rows of alignments, and alignments from rows."""

import dataclasses
import math

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, Figures, VerticalElement, chained
from rail_extract.core.errors import RailExtractError
from rail_extract.core.fields import ELEMENT_FIELDS
from rail_extract.core.files.table import alignments, read_table, rows
from rail_extract.core.frame import LocalFrame
from rail_extract.core.progress import Progress, Recording

FRAME = LocalFrame(np.array([23_460_000.0, 6_675_000.0, 100.0]))


def design(track_id=1):
    plan = chained((3.0, 4.0), np.pi / 2, [(80.0, 0, 0), (60.0, 0, -1 / 400), (90.0, -1 / 400, -1 / 400)])
    first = dataclasses.replace(plan[0], figures=Figures(joint="G2", sigma_len_m=0.02))
    vertical = (VerticalElement(0, 100, 5, 0.01, 0.01), VerticalElement(100, 130, 6, 0.01, -0.003))
    cant = (CantElement(0, 80, 0, 0), CantElement(80, 60, 0, 0.1))
    return Alignment(track_id, FRAME, (first, *plan[1:]), vertical, cant)


def test_a_table_gives_back_the_alignment():
    given = [design(2), design(1)]
    back = alignments([row for one in given for row in rows(one)], FRAME)
    assert [one.track_id for one in back] == [1, 2]
    s = np.linspace(0, 230, 40)
    for one in back:
        np.testing.assert_allclose(one.xyz(s), given[0].xyz(s), atol=1e-8)
        np.testing.assert_allclose(one.cants(s), given[0].cants(s), atol=1e-12)
        assert [part.type for part in one.elements] == [part.type for part in given[0].elements]
        assert one.plan[0].figures == given[0].plan[0].figures


def test_rows_have_every_field_and_state_the_values_of_the_design():
    table = rows(design())
    assert all(set(row) == {field.name for field in ELEMENT_FIELDS} for row in table)
    assert [(row["layout"], row["no"], row["type"]) for row in table] == [
        *(("H", 1, "line"), ("H", 2, "clothoid"), ("H", 3, "arc")),
        *(("V", 1, "grade"), ("V", 2, "parabola"), ("C", 1, "constant"), ("C", 2, "ramp")),
    ]
    line, clothoid, arc, _, parabola, _, ramp = table
    assert (line["x"], line["y"], line["z"]) == pytest.approx((23_460_003.0, 6_675_004.0, 105.0))
    assert (line["azimuth_gon"], line["rot"], line["r1_m"]) == (pytest.approx(0.0, abs=1e-9), None, None)
    assert (clothoid["r1_m"], clothoid["r2_m"]) == (None, pytest.approx(-400))
    assert clothoid["a_param"] == pytest.approx(np.sqrt(60 * 400))
    assert (arc["rot"], arc["s_from"], arc["s_to"]) == ("R", 140, 230)
    assert arc["azimuth_gon"] == pytest.approx(60 / 800 * 200 / np.pi)
    assert parabola["r1_m"] == pytest.approx(-130 / 0.013)
    assert (ramp["cant1_mm"], ramp["cant2_mm"]) == (0, 100)


@pytest.mark.parametrize(
    ("row", "values", "words"),
    [
        (0, {"layout": "Q"}, "layout 'Q'"),
        (0, {"x": None}, "no value in the field x"),
        (0, {"s_to": 0.0}, "end after its start"),
        (0, {"type": "curve"}, "line, arc or clothoid"),
        (3, {"type": "parabola"}, "values are those of a grade: fill r1_m"),
        (4, {"type": "clothoid"}, "'clothoid', but its values are those of a parabola"),
        (5, {"type": "ramp"}, "values are those of a constant: change cant2_mm"),
        (2, {"s_from": 75.0}, "element 3 of layout H .* starts at s_from = 75 m, before element 2 at 80 m"),
        (2, {"r1_m": 0.0}, "r1_m 0, but radii"),
        (2, {"r1_m": 1e-6}, "the turn 1432[0-9.]+, but an element turns by up to 100"),
        (0, {"km_from": "one"}, "'one' in the field km_from, which is not a number"),
        (0, {"km_from": 1e308}, "the km_from 1e.308, but kilometres are"),
        (0, {"x": math.inf}, "the x inf, but numbers of a design"),
        (0, {"heading": 1e18}, "the heading 1e.18, but"),
        (2, {"s_to": 2e7}, "the length 2000[0-9]+, but lengths are above 0 and up to 10,000 km"),
        (3, {"z": -math.inf}, "the z -inf"),
        (3, {"grade1_pm": 3000.0}, "the grade1_pm 3000, but gradients are up to 2000 per mille"),
        (5, {"cant1_mm": 1001.0}, "the cant1_mm 1001, but cants are up to 1000 mm"),
    ],
)
def test_a_wrong_row_is_named(row, values, words):
    table = rows(design())
    table[row].update(values)
    with pytest.raises(RailExtractError, match=words):
        alignments(read_table(table, "INPUT"), FRAME)


def test_texts_are_read_as_numbers():
    plain = rows(design())
    texts = [{name: "" if value is None else str(value) for name, value in row.items()} for row in plain]
    texts[0]["km_from"], plain[0]["km_from"] = "12,3 + 45", 12.345
    texts[0]["km_to"], plain[0]["km_to"] = "12.4+40", 12.44
    assert plain[0]["track_id"] == 1
    for read, row in zip(read_table(texts, "INPUT"), plain):
        assert {name: value or None for name, value in read.items()} == {name: row[name] or None for name in read}


def test_what_lies_beyond_the_plan_is_left_out_and_what_lacks_is_unknown():
    table = rows(design())
    table[3]["s_from"] = table[3]["s_from"] + 10
    table[4]["s_to"] = 5000.0
    heard = Recording(Progress())
    (made,) = alignments(read_table(table, "INPUT"), FRAME, heard)
    assert (made.vertical[0].s_from, made.vertical[-1].s_to) == (10.0, pytest.approx(230.0))
    assert np.isnan(made.heights(np.array([0.0, 8.9, 9.1, 230.0, 231.0]))).tolist() == [True, True, False, False, False]
    assert made.vertical[-1].grade_to == pytest.approx(0.01 - 0.013 * 130 / 4900)
    assert [one.split(" reaches")[0] for one in heard.warnings] == ["The profile of track 1", "The cant of track 1"]
    assert np.isnan(made.cants(np.array([140.0, 141.5]))).tolist() == [False, True]
