"""Faults of lines to compare, in Compare Tracks."""

import pytest
from faults import FINE, WARNED, Fault, refused
from memory_layers import layer_of

TITLE = "Comparison"

LINE = "LINESTRING Z (500000 3000000 100, 500040 3000000 100)"
BESIDE = LINE.replace(" 3000000 ", " 3000000.01 ")
FAR = LINE.replace(" 3000000 ", " 3000500 ")
POINT = "POINT Z (500000 3000000 100)"
STATED = {"REFERENCE_SIGMA": 1, "INPUT_SIGMA": 1}


def given(reference=(LINE,), lines=(BESIDE,), kind="LineStringZ", crs="EPSG:32643", **parameters):
    """Lines of a reference in UTM zone 43N, and lines to compare."""

    def prepare(bench):
        made = {name: value() if callable(value) else value for name, value in parameters.items()}
        return {"REFERENCE": layer_of(*reference), "INPUT": layer_of(*lines, kind=kind, crs=crs), **STATED, **made}

    return prepare


FAULTS = [
    Fault(
        "two surveys of one line", given(), FINE, gives={"ACROSS_RMS": 10.0, "SHIFT_NORTH": 10.0, "MOVED_LENGTH": 0.0}
    ),
    refused("empty reference", given(()), "REFERENCE has no lines: give a line layer."),
    refused("empty layer to compare", given(lines=()), "INPUT has no lines: give a line layer."),
    refused(
        "points instead of lines",
        given(lines=(POINT,), kind="PointZ"),
        "INPUT has the geometry type PointZ: give a line layer.",
    ),
    refused(
        "surveys in different coordinate systems",
        given(crs="EPSG:32644"),
        "INPUT are in WGS 84 / UTM zone 44N but REFERENCE in WGS 84 / UTM zone 43N: give both "
        "in the same coordinate system.",
    ),
    refused(
        "lines in degrees",
        given(lines=("LINESTRING Z (75 27.1 0, 75.1 27.1 0)",), crs="EPSG:4326"),
        "The lines are in degrees (WGS 84), where lengths can't be measured: reproject them, for example to the UTM "
        "zone of the place.",
    ),
    Fault(
        "lines of another place",
        given(lines=(FAR,)),
        WARNED,
        "The two surveys have no line in common: check that they are of the same place, and REACH.",
        {"MISSING_LENGTH": 40.0, "EXTRA_LENGTH": 40.0, "ACROSS_RMS": None, "SHIFT_EAST": None},
    ),
    refused(
        "rails of one survey only",
        given(RAILS=lambda: layer_of(LINE)),
        "Gauge and cant are compared between the rails of both surveys: choose REFERENCE_RAILS, too.",
    ),
    Fault(
        "surveys without standard errors",
        given(REFERENCE_SIGMA=None, INPUT_SIGMA=None),
        WARNED,
        "A survey has no standard errors: the scatter of the differences is used instead, 1.0 mm across. Fill in "
        "REFERENCE_SIGMA and INPUT_SIGMA if it is known.",
    ),
    refused("standard error below zero", given(INPUT_SIGMA=-1), "INPUT_SIGMA can't be -1: give 0 or more."),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "comparetracks")
