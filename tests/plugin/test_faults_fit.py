"""Faults of tracks and tables, in Fit Alignment."""

import numpy as np
import pytest
from faults import faults
from memory_layers import layer_of

AT = np.arange(200.0)
RING = np.linspace(0, 2 * np.pi, 400)
ARC = np.arange(0, 0.5, 1 / 300)


def line(x=AT, y=0.0, kind="LineStringZ", fields=""):
    """A layer with one line, straight to the east unless there is another shape."""
    xy = np.column_stack(np.broadcast_arrays(500_000.0 + x, 3_000_000.0 + y))
    heights = np.full((len(xy), int(kind.endswith("Z"))), 50.0)
    return layer_of(np.hstack([xy, heights]), kind=kind, fields=fields)


def in_two_parts():
    """A track of two straight lines in one feature."""
    parts = [
        "(" + ", ".join(f"{x} {3_000_000} 50" for x in range(first, first + 100)) + ")" for first in (500_000, 500_150)
    ]
    return layer_of(f"MultiLineString Z({', '.join(parts)})", kind="MultiLineStringZ")


def given(*shape, **kind):
    return lambda bench: {"INPUT": line(*shape, **kind)}


FAULTS = {
    "fitalignment": {
        "line without heights": given(kind="LineString"),
        "short line": given(AT[:30]),
        "line with few vertices, as digitized": given(100 * AT[:6]),
        "stray vertex": given(AT, 0.3 * (AT == 100)),
        "ring": given(100 * np.cos(RING), 100 * np.sin(RING)),
        "two lines of one track": lambda bench: {"INPUT": in_two_parts()},
        "branch that ends in a switch": given(300 * np.sin(ARC), 300 - 300 * np.cos(ARC)),
        "line that turns back": given(100 - np.abs(100 - AT), 0.001 * AT),
        "track geometry without cant": lambda bench: {
            "INPUT": line(),
            "QUALITY": line(fields="&field=track_id:integer"),
        },
    },
}


@pytest.mark.parametrize("fault", faults("Design elements", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
