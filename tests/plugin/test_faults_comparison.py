"""Faults of lines to compare, in Compare Tracks."""

import pytest
from faults import faults
from memory_layers import layer_of

LINE = "LINESTRING Z (500000 3000000 100, 500040 3000000 100)"
BESIDE = LINE.replace(" 3000000 ", " 3000000.01 ")
FAR = LINE.replace(" 3000000 ", " 3000500 ")
STATED = {"REFERENCE_SIGMA": 1, "INPUT_SIGMA": 1}


def given(line=BESIDE, crs="EPSG:32643", **parameters):
    """A line of a reference in UTM zone 43N, and a line to compare."""

    def prepare(bench):
        made = {name: value() if callable(value) else value for name, value in parameters.items()}
        return {"REFERENCE": layer_of(LINE), "INPUT": layer_of(line, crs=crs), **STATED, **made}

    return prepare


FAULTS = {
    "comparetracks": {
        "two surveys of one line": given(),
        "surveys in different coordinate systems": given(crs="EPSG:32644"),
        "lines of another place": given(FAR),
        "rails of one survey only": given(RAILS=lambda: layer_of(LINE)),
        "surveys without standard errors": given(REFERENCE_SIGMA=None, INPUT_SIGMA=None),
    },
}


@pytest.mark.parametrize("fault", faults("Comparison", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
