"""Faults of seeds, in Grow Rail Points from Seeds."""

import numpy as np
import pytest
from faults import cancelled, faults
from memory_layers import layer_of
from qgis.core import QgsGeometry, QgsLineString
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
ON_RAIL = f"POINT(500006 {3_000_000 + SPACING_M / 2})"
ALONG = f"500004 {3_000_000 + SPACING_M / 2}, 500008 {3_000_000 + SPACING_M / 2}"
ON_MAP = f"500006,{3e6 + SPACING_M / 2}"
BESIDE = "POINT(500006 3000000)"


def raw(of=None, **parameters):
    """A raw cloud of a strip, and these parameters."""
    return lambda bench: {"INPUT": bench.cloud((of or strip(12.0)).xyz + CORNER, "raw.laz", 2), **parameters}


def seeds(*shapes, kind="Point", **parameters):
    """The same, and a layer with these seeds."""
    return lambda bench: {**raw(**parameters)(bench), "SEEDS": layer_of(*shapes, kind=kind)}


FAULTS = {
    "growrailpoints": {
        "no seeds": raw(),
        "layer of seeds that is empty": seeds(),
        "seed between the rails": seeds(BESIDE),
        "seed far from the cloud": seeds("POINT(700000 3000000)"),
        "one seed on a rail and one beside": seeds(ON_RAIL, BESIDE),
        "seed on a lone rail": raw(strip(12.0, rails=[lambda along: np.full_like(along, SPACING_M / 2)]), SEED=ON_MAP),
        "seed on the map": raw(SEED=ON_MAP),
        "400 seeds at one place": seeds(*[ON_RAIL] * 400),
        "line without a vertex among the seeds": seeds(
            QgsGeometry(QgsLineString()), f"LINESTRING({ALONG})", kind="LineString"
        ),
        "seed outside of any map": seeds("POINT(1e200 3000000)"),
        "class of grown rails beyond a byte": seeds(ON_RAIL, RAIL_CLASS=256),
        "growth cancelled at 10 %": cancelled(seeds(ON_RAIL), 10),
        "growth cancelled at 40 %": cancelled(seeds(ON_RAIL), 40),
        "growth cancelled at 65 %": cancelled(seeds(ON_RAIL), 65),
    },
    "extractrails": {
        "extraction of rails off their seeds": seeds(BESIDE),
        "extraction from seeds, and of all rails": seeds(ON_RAIL, CLASSIFY=True),
        "rail standard to be detected from seeds": seeds(ON_RAIL, STANDARD="DETECT"),
    },
}


@pytest.mark.parametrize("fault", faults("Seeds", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
