"""Every constant of the core has a reason."""

import constants
import pytest


def test_every_constant_of_the_core_has_a_docstring():
    groups = [
        (path.name, group)
        for path in constants.modules()
        if "core" in path.relative_to(constants.ROOT).parts
        for group in constants.groups_of(path.read_text(encoding="utf-8"))
    ]
    assert len(groups) > 500
    assert [
        (name, group.names) for name, group in groups if not group.meaning and not group.names[0].startswith("_")
    ] == []


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ('A = 1\nB = 2.5\n"""Both."""\nC = 3', [(("A", "B"), ("1", "2.5"), "Both."), (("C",), ("3",), "")]),
        ('LOW, HIGH = -1, 2 * A\n"""Ends of\na range."""', [(("LOW", "HIGH"), ("-1", "2 * A"), "Ends of a range.")]),
        ('ANGLE = np.radians(10.0)\n"""Radians."""', [(("ANGLE",), ("np.radians(10.0)",), "Radians.")]),
        ('NAME = "a"\n"""No number."""\nvalue = 3\nKEPT = list(3)\nON = True', []),
    ],
)
def test_numbers_are_grouped_by_their_docstring(source, expected):
    assert [(group.names, group.values, group.meaning) for group in constants.groups_of(source)] == expected
