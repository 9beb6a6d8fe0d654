"""A double track with cant, flown once for all tests of the package."""

from dataclasses import dataclass

import pytest
from rail_extract.laboratory.airborne.designs import Design, curved_line, drawn_together
from rail_extract.laboratory.airborne.flight import AirborneCloud, Flight, fly

LENGTH_M = 260.0


@dataclass(frozen=True)
class Flown:
    design: Design
    cloud: AirborneCloud
    guides: list


@pytest.fixture(scope="session")
def flown():
    design = curved_line(5, LENGTH_M, cant_m=0.1, radius_m=450.0)
    design.world.bands.clear()
    cloud = fly(design.world, design.where, 9.0, Flight(10.0, 0.25, plants=0.03), seed=5)
    return Flown(design, cloud, drawn_together(design.tracks, 5, off_m=0.4))
