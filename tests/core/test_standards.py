"""Rail standards: the table, and numbers that override its values."""

from __future__ import annotations

import pytest
from rail_extract.core.errors import ParameterError
from rail_extract.core.standards import DEFAULT, STANDARDS, closest_standard, read_gauges, resolve

INTERFACE = """
US_90ARAA_1435 US_100ARAA_1435 US_100RE_1435 US_115RE_1435 US_119RE_1435 US_132RE_1435 US_133RE_1435 US_136RE_1435
US_141RE_1435 EN_45E1_1435 EN_46E2_1435 EN_49E1_1435 EN_50E2_1435 EN_50E4_1435 EN_50E6_1435 EN_54E1_1435 EN_60E1_1435
BS_113A_1435 GB_50_1435 GB_60_1435 GB_75_1435 AS_60_1435 AS_68_1435 JIS_60_1435 JIS_60_1067 JIS_40N_1067 JIS_37A_1067
AS_60_1067 AS_41_1067 AS_60_1600 EN_54E1_1600 EN_54E1_1668 EN_60E1_1668 IN_52KG_1676 IN_60KG_1676 IN_90R_1676
IN_90R_1000 IN_75R_1000 IN_60R_1000 RU_R50_1520 RU_R65_1520 S33_1000 S41_1000 EN_46E1_1000 EN_49E1_1000 EN_54E1_1000
"""


def test_names_never_change():
    assert set(STANDARDS) == set(INTERFACE.split())
    assert DEFAULT in STANDARDS


def test_each_gauge_is_the_one_in_the_name():
    for name, standard in STANDARDS.items():
        assert 1000 * standard.gauge_m == pytest.approx(float(name.rsplit("_", 1)[1]))
        assert 57 <= 1000 * standard.head_width_m <= 78


def test_numbers_override_the_standard():
    assert resolve("EN_60E1_1435", gauge_mm=1440).gauge_m == 1.44
    assert resolve("EN_60E1_1435", gauge_mm=1440).head_width_m == 0.072
    assert resolve("EN_60E1_1435", head_width_mm=70).head_width_m == pytest.approx(0.07)
    custom = resolve("CUSTOM", 1000, 61.91)
    assert (custom.gauge_m, custom.head_width_m) == (1.0, pytest.approx(0.06191))


@pytest.mark.parametrize(
    ("text", "others"),
    [
        ("", []),
        ("1000;1067", [(1.0, 0.072), (1.067, 0.072)]),
        ("1520.5 1000", [(1.5205, 0.072), (1.0, 0.072)]),
        ("1000/66, 1067 / 62.5", [(1.0, 0.066), (1.067, 0.0625)]),
        ("1000/66;1000;1435", [(1.0, 0.066)]),
    ],
)
def test_other_gauges_are_read_with_the_width_of_their_heads(text, others):
    found = read_gauges(text, "OTHER_GAUGES", STANDARDS[DEFAULT], 0.05)
    assert found == ((1.435, 0.072), *others)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *(
            (text, "must be millimetres")
            for text in ("wide", "0", "-1000", "1e3", "1000;x", "1000/", "1000/0", "1/2/3")
        ),
        ("1000/660", "A railhead width of 660 mm is not possible"),
        ("1/66", "A gauge of 1 mm is not possible"),
        ("1435/66", "can't have railheads of 72 and 66 mm"),
        ("1000/66;1000/62", "can't have railheads of 66 and 62 mm"),
        ("1450/66", "can't be distinguished"),
    ],
)
def test_other_gauges_that_make_no_sense_are_refused(text, said):
    with pytest.raises(ParameterError, match=said):
        read_gauges(text, "OTHER_GAUGES", STANDARDS[DEFAULT], 0.05)


@pytest.mark.parametrize(
    ("spacing_m", "width_m", "name"),
    [
        (1.0619, 0.0622, "IN_75R_1000"),
        (1.5055, 0.0707, "EN_60E1_1435"),
        (1.5120, 0.0715, "EN_60E1_1435"),
        (1.5115, 0.0765, "US_132RE_1435"),
        (1.7385, 0.0706, "EN_60E1_1668"),
        (1.7365, 0.0685, "EN_54E1_1668"),
        (1.5010, 0.0930, "EN_60E1_1435"),  # a blunt cloud
        (1.7480, 0.1100, "IN_60KG_1676"),
        (1.0620, 0.0950, "IN_75R_1000"),
        (1.300, 0.070, None),
    ],
)
def test_closest_standard(spacing_m, width_m, name):
    standard = closest_standard(spacing_m, width_m)
    assert (standard and standard.name) == name
