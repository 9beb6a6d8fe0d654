"""The engines agree on real rails: a short cut of the sample's first track."""

from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints, read_rail_points
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.frpdf.engine import make_engine
from rail_extract.core.frpdf.models import choose
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.core.pipeline import Parameters
from rail_extract.core.polyline import interpolate, length_along, project, resample
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.steps import lines_of

SAMPLE = Path(__file__).resolve().parents[3] / "resources" / "sample" / "sample.laz"
GAUGE_M, HEAD_WIDTH_M = 1.0, 0.06191
EXTENT = (578_214.0, 2_494_300.0, 578_228.0, 2_494_309.5)
"""Some 12 m of the southern track."""

END_M = 0.5
"""Lines may end a few centimetres apart."""


@pytest.fixture(scope="module")
def points() -> RailPoints:
    return read_rail_points(SAMPLE, [10], extent=EXTENT)[0]


@pytest.fixture(scope="module")
def rasters(points):
    """What each engine makes of the same raster."""
    raster = rasterize(points.xyz, cell_size(GAUGE_M, HEAD_WIDTH_M))
    arrays = load_arrays(choose(GAUGE_M, HEAD_WIDTH_M).path)
    return {name: clean(raster, make_engine(arrays, name, "CPU")) for name in ("TORCH", "OPENCV")}


def test_engines_differ_in_few_cells(rasters):
    torch, opencv = (set(map(tuple, raster.cells().tolist())) for raster in rasters.values())
    assert len(torch) > 1000
    # `benchmarks/speed.py changes` holds longer cuts to half a percent; cells that differ come in small groups.
    assert len(torch ^ opencv) <= 0.01 * len(torch)


def test_lines_of_the_engines_lie_together(rasters, points):
    # Thinning by 2 mm may keep other vertices of the same curve, so lines are compared whole.
    parameters = Parameters(GAUGE_M, HEAD_WIDTH_M, simplify_xy_m=0.0, simplify_z_m=0.0)
    torch, opencv = (lines_of(raster, 10, points, parameters) for raster in rasters.values())
    assert len(torch) == len(opencv) == 2
    for line, other in zip(torch, opencv):
        xyz, t = resample(line.xyz, 0.05)
        xyz = xyz[(t > END_M) & (t < t[-1] - END_M)]
        feet = project([other.xyz[:, :2]], xyz[:, :2], 0.1)
        assert len(feet.t) == len(xyz) > 100
        height = interpolate(other.xyz[:, 2:], length_along(other.xyz[:, :2]), feet.t)[:, 0]
        above = xyz[feet.point, 2] - height
        assert np.sqrt(np.mean(feet.across**2 + above**2)) < 0.001
