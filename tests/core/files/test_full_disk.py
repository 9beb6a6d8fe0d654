"""A full disk ends the writing of a file in one sentence, and leaves the old file."""

import subprocess
import sys

import pytest

RASTER = """
import resource, sys
from pathlib import Path
import numpy as np
from rail_extract.core.disk import Destination
from rail_extract.core.errors import DiskError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.raster import rasterize
from rail_extract.core.files.rail_rasters import header_for, write_rasters
from rail_extract.core.standards import STANDARDS
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
raster = rasterize(np.random.RandomState(1).uniform(0, 80, (200_000, 2)), 0.04)
try:
    header = header_for([raster], (10,), LocalFrame(np.zeros(3)), STANDARDS["EN_60E1_1435"])
    with Destination.at(Path(sys.argv[1])).replacing() as new:
        write_rasters(new, header, [raster])
except DiskError as error:
    print(error)
"""

LAYER = """
import resource, sys
from pathlib import Path
import numpy as np
from rail_extract.core.files.writing import write_layers
from rail_extract.core.disk import Destination
from rail_extract.core.errors import DiskError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.fields import RAILS
from rail_extract.core.rails import RailLine
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
rails = [RailLine(np.random.rand(20_000, 3), 1, 10, 5, 1.0, 1.0, 0.0)]
try:
    write_layers([lines_layer(RAILS, rails)], Destination.at(Path(sys.argv[1])), LocalFrame(np.zeros(3)))
except DiskError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on the size of files")
@pytest.mark.parametrize(("name", "program"), [("out.tif", RASTER), ("out.gpkg", LAYER)])
def test_a_full_disk_leaves_the_old_file(tmp_path, name, program):
    pytest.importorskip({"out.tif": "rasterio", "out.gpkg": "pyogrio"}[name])
    out = tmp_path / name
    out.write_bytes(b"before")
    run = subprocess.run([sys.executable, "-c", program, str(out)], capture_output=True, text=True)
    assert "free space" in run.stdout, run.stderr
    assert out.read_bytes() == b"before"
    assert [file.name for file in tmp_path.iterdir()] == [name]
