"""The engines agree on a short section of the sample's first track."""

from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints, read_rail_points
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.frpdf.engines import make_engine
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.core.pipeline import Parameters
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.squares.steps import lines_of
from rail_extract.laboratory.ruler.lines import match

pytest.importorskip("torch")

SAMPLE = Path(__file__).resolve().parents[3] / "resources" / "sample" / "sample.laz"
GAUGE_M, HEAD_WIDTH_M = 1.0, 0.06191
EXTENT = (578_214.0, 2_494_300.0, 578_228.0, 2_494_309.5)
"""About 12 m of the southern track."""

END_M = 0.5
"""Length left out at either end, because lines may end a few centimetres apart."""


@pytest.fixture(scope="module")
def points() -> RailPoints:
    return read_rail_points(SAMPLE, [10], extent=EXTENT)[0]


@pytest.fixture(scope="module", params=MODELS, ids=lambda model: model.name)
def rasters(points, request):
    """The same raster cleaned by each engine."""
    raster = rasterize(points.xyz, cell_size(GAUGE_M, HEAD_WIDTH_M))
    arrays = load_arrays(request.param.path)
    return {name: clean(raster, make_engine(arrays, name, "CPU")) for name in ("TORCH", "OPENCV")}


def test_engines_differ_in_few_cells(rasters):
    torch, opencv = (set(map(tuple, raster.cells().tolist())) for raster in rasters.values())
    assert len(torch) > 1000
    # `benchmarks/speed.py changes` holds longer cuts to half a percent; cells that differ come in small groups.
    assert len(torch ^ opencv) <= 0.01 * len(torch)


def test_lines_of_the_engines_agree(rasters, points):
    # Thinning by 2 mm may keep different vertices of the same curve, so lines are compared before thinning.
    parameters = Parameters(GAUGE_M, HEAD_WIDTH_M, simplify_xy_m=0.0, simplify_z_m=0.0)
    torch, opencv = (lines_of(raster, 10, points, parameters) for raster in rasters.values())
    assert len(torch) == len(opencv) == 2
    for line, other in zip(torch, opencv):
        found = match([line.xyz], [other.xyz])
        inside = (found.t > END_M) & (found.t < found.t[-1] - END_M)
        offsets = np.hypot(found.back.distance, found.back.height)[inside]
        assert len(offsets) > 100
        assert np.sqrt(np.mean(offsets**2)) < 0.001
