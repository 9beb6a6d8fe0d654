"""Faults of seeds, in Grow Rail Points from Seeds."""

import resource

import numpy as np
import pytest
from faults import FINE, WARNED, Fault, refused
from memory_layers import layer_of
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip

TITLE = "Seeds"

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
ON_RAIL = f"POINT(500006 {3_000_000 + SPACING_M / 2})"
BESIDE = "POINT(500006 3000000)"
NO_RAIL = (
    "No seed is on a rail: put seeds within 0.25 m of railheads that stand 0.05 m above the bed, and check the rail "
    "standard and the unit of the coordinates."
)
NO_SEED = "No seed is in the cloud: check the place and the coordinate system of the seeds."


def cloud(bench, change=lambda xyz: xyz):
    return bench.cloud(change(strip(12.0).xyz) + CORNER, "raw.laz", 2)


def seeds(*texts, kind="Point", crs="EPSG:32643", change=lambda xyz: xyz, **parameters):
    """A raw cloud, and a layer with these shapes."""

    def prepare(bench):
        return {"INPUT": cloud(bench, change), "SEEDS": layer_of(*texts, kind=kind, crs=crs), **parameters}

    return prepare


def lone(bench):
    """A cloud with one rail."""
    xyz = strip(12.0, rails=[lambda along: np.full_like(along, SPACING_M / 2)]).xyz
    return {"INPUT": bench.cloud(xyz + CORNER, "raw.laz", 2), "SEED": f"500006,{3e6 + SPACING_M / 2}"}


def full_disk(bench):
    values = seeds(ON_RAIL)(bench)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    bench.run.callback(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard)))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    return values


def cancelled(percent):
    def prepare(bench):
        bench.feedback.progressChanged.connect(lambda done: bench.feedback.cancel() if done >= percent else None)
        return seeds(ON_RAIL)(bench)

    return prepare


FAULTS = [
    refused(
        "no seeds",
        lambda bench: {"INPUT": cloud(bench)},
        "A rail is followed from seeds: choose a layer for SEEDS, or pick a point for SEED.",
    ),
    refused(
        "layer of seeds that is empty",
        seeds(),
        "SEEDS has neither points nor lines: add points on railheads, or choose another layer.",
    ),
    refused("seed between the rails", seeds(BESIDE), NO_RAIL),
    refused("seeds of a cloud in millimetres", seeds(ON_RAIL, change=lambda xyz: 1000 * xyz), NO_RAIL),
    refused("seed far from the cloud", seeds("POINT(700000 3000000)"), NO_SEED),
    refused(
        "seeds with the coordinates of another system",
        seeds(ON_RAIL, crs="EPSG:4326"),
        "SEEDS can't be transformed to the coordinate system of the cloud (EPSG:32643): check that both are assigned "
        "as the data were made.",
    ),
    Fault(
        "one seed on a rail and one beside",
        seeds(ON_RAIL, BESIDE),
        WARNED,
        "1 of 2 seeds are not on a rail: move them onto railheads.",
    ),
    Fault(
        "seed on a lone rail",
        lone,
        WARNED,
        "1 of 1 followed rails have no other rail at the gauge: check that their seeds are on rails, and the rail "
        "standard.",
    ),
    Fault("seed on the map", lambda bench: {"INPUT": cloud(bench), "SEED": f"500006,{3e6 + SPACING_M / 2}"}, FINE),
    refused("seed on the map, off the rails", lambda bench: {"INPUT": cloud(bench), "SEED": "500006,3000000"}, NO_RAIL),
    refused(
        "polygons as seeds",
        seeds("POLYGON((500000 3000000, 500001 3000000, 500001 3000001, 500000 3000000))", kind="Polygon"),
        "SEEDS has neither points nor lines: add points on railheads, or choose another layer.",
    ),
    refused(
        "class of grown rails beyond a byte",
        seeds(ON_RAIL, RAIL_CLASS=256),
        "RAIL_CLASS can't be 256: give a number from 0 to 255.",
    ),
    refused(
        "full disk, points near seeds",
        full_disk,
        "… can't be written to (…): free space on the disk, or choose another folder.",
    ),
    refused("extraction of rails off their seeds", seeds(BESIDE), NO_RAIL, run="extractrails"),
    refused(
        "extraction from seeds, and of all rails",
        seeds(ON_RAIL, CLASSIFY=True),
        "CLASSIFY finds all rails, and SEEDS those that are pointed at: choose one of them.",
        run="extractrails",
    ),
    refused(
        "rail standard to be detected from seeds",
        seeds(ON_RAIL, STANDARD="DETECT"),
        "STANDARD DETECT measures classified points, which SEEDS do not need: choose another.",
        run="extractrails",
    ),
    *(
        refused(f"growth cancelled at {percent} %", cancelled(percent), "Cancelled; nothing was written.")
        for percent in (10, 40, 65)
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "growrailpoints")
