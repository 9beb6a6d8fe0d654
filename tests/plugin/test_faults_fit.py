"""Faults of tracks and tables, in Fit Alignment."""

import numpy as np
import pytest
from faults import FINE, WARNED, Fault, refused
from memory_layers import layer_of

TITLE = "Design elements"


def line(count=200, kind="LineStringZ", crs="EPSG:32643", shape=None, fields=""):
    """A layer with one line, straight to the east unless there is another shape."""
    x = np.arange(count, dtype=float)
    xy = np.column_stack([500_000 + x, 3_000_000 + 0 * x]) if shape is None else np.asarray(shape, dtype=float)
    heights = np.full((len(xy), int(kind.endswith("Z"))), 50.0)
    return layer_of(np.hstack([xy, heights]), kind=kind, crs=crs, fields=fields)


def ring():
    angle = np.linspace(0, 2 * np.pi, 400)
    return np.column_stack([500_000 + 100 * np.cos(angle), 3_000_000 + 100 * np.sin(angle)])


def stray():
    """A straight line with a vertex 30 cm beside it."""
    return [(500_000.0 + x, 3_000_000.0 + 0.3 * (x == 100)) for x in range(200)]


def in_two_parts():
    """A track of two straight lines in one feature."""
    parts = [
        "(" + ", ".join(f"{x} {3_000_000} 50" for x in range(first, first + 100)) + ")" for first in (500_000, 500_150)
    ]
    return layer_of(f"MultiLineString Z({', '.join(parts)})", kind="MultiLineStringZ")


def branch():
    """The arc of a switch, up to the point where it leaves the main track."""
    angle = np.arange(0, 0.5, 1 / 300)
    return line(shape=np.column_stack([500_000 + 300 * np.sin(angle), 3_000_300 - 300 * np.cos(angle)]))


def given(make=line, **parameters):
    def prepare(bench):
        return {"INPUT": make(), **{name: value() for name, value in parameters.items()}}

    return prepare


FAULTS = [
    refused(
        "line without heights",
        given(lambda: line(kind="LineString")),
        "The line of track 1 has no heights: give a 3D line, such as a centerline of Extract rails.",
    ),
    refused(
        "short line",
        given(lambda: line(30)),
        "The line of track 1 has 30 vertices over 29 m, but a fit needs at least 20 over 50 m: leave it out, or join "
        "it with the track that continues it.",
    ),
    refused(
        "line with few vertices, as digitized",
        given(lambda: line(shape=[(500_000 + 100 * x, 3_000_000) for x in range(6)])),
        "The line of track 1 has 6 vertices over 500 m, but a fit needs at least 20 over 50 m: give a line that was "
        "measured point by point, such as a centerline of Extract rails.",
    ),
    Fault(
        "stray vertex",
        given(lambda: line(shape=stray())),
        WARNED,
        "5 points of track 1, the first 98 m from its start, lie more than 15 mm off the neighbours and do not count: "
        "look at the line there.",
        {"ELEMENT_COUNT": 2},
    ),
    refused(
        "ring",
        given(lambda: line(shape=ring())),
        "The line of track 1 ends where it begins: cut the ring into two lines.",
    ),
    refused(
        "two lines of one track",
        given(in_two_parts),
        "Track 1 has 2 lines, but its elements follow one: join them, or give each its own track_id.",
    ),
    Fault(
        "branch that ends in a switch",
        given(branch),
        FINE,
        gives={"ELEMENT_COUNT": 2},
    ),
    refused(
        "line that turns back",
        given(lambda: line(shape=[(500_000 + 100 - abs(100 - x), 3_000_000 + 0.001 * x) for x in range(200)])),
        "The line of track 1 turns back 100 m from its start: remove the stray vertices there, or cut the line.",
    ),
    refused(
        "track geometry without cant",
        given(QUALITY=lambda: line(fields="&field=track_id:integer")),
        "QUALITY has no field chainage_m: give the track geometry of Extract rails or Measure track geometry.",
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "fitalignment")
