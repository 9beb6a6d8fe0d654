"""Vectorize Rails: turns a cleaned rail raster into lines, in 3D if a point cloud is given."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..fields import RAILS
from ..progress import Progress
from . import inputs, methods, outputs
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, STEPS
from .result import Result, ShownCloud
from .values import Job, Values

if TYPE_CHECKING:
    from ..frame import LocalFrame
    from ..rails import RailLine
    from ..raster import RailRaster
    from ..standards import RailStandard


def _standard(values: Values) -> RailStandard:
    """Return the rails of the raster, whose header is checked."""
    return values.raster("INPUT").header.standard(values["GAUGE"], values["HEAD_WIDTH"])


def _check(values: Values) -> None:
    """Check the header of the raster."""
    _standard(values)


def _run(values: Values, progress: Progress) -> Result:
    """Vectorize each class."""
    from ..checks.warnings import warn_of_rails
    from ..files.layers import lines_layer
    from ..squares.steps import lines_of
    from .clouds import Area, read_points_in

    source, header = values.raster("INPUT"), values.raster("INPUT").header
    reading, drawing = progress.after_reading()
    of_raster, of_cloud = reading.split(2)
    rasters, frame, clouds = source.read(of_raster), header.frame, {}
    if values.filled("POINTS"):
        area = Area("raster", header.class_codes, header.bounds, header.frame)
        clouds = read_points_in(area, values.cloud("POINTS"), of_cloud)
        frame = clouds[header.class_codes[0]].frame
        rasters = tuple(moved(raster, header.frame, frame) for raster in rasters)
    else:
        progress.warning("Without POINTS, the rails have no heights and are only as accurate as the raster.")
    standard = _standard(values)
    settings = values.settings(standard)
    rails: list[RailLine] = []
    for raster, code, share in zip(rasters, header.class_codes, drawing.split(len(rasters))):
        found = lines_of(raster, code, clouds.get(code), settings, share, first_id=len(rails) + 1)
        warn_of_rails(found, code, settings, progress)
        rails += found
    shown = ShownCloud("POINTS", header.class_codes, standard.head_width_m) if clouds else None
    makers = {"OUTPUT": lambda: lines_layer(RAILS, rails)}
    return Result(outputs.figures_of(rails, "RAIL"), frame, makers, cloud=shown)


def moved(raster: RailRaster, frame: LocalFrame, other: LocalFrame) -> RailRaster:
    """Return a raster of one frame in another local frame of the same coordinate system."""
    right, up, _ = frame.shift_to(other)
    return replace(raster, x0=raster.x0 + float(right), y0=raster.y0 + float(up))


JOB = Job(
    "vectorizerails",
    "Vectorize rails",
    "Turns a rail raster into lines of the railheads; a point cloud gives them their exact position and height.",
    "Takes the raster of Clean Rail Raster, or a similar one. With the cloud from which the raster was made, a "
    "line follows the top of the railhead on the axis of the head. Without the cloud, lines have no heights and "
    "are only as accurate as the raster.\n\n"
    "A raster from other software does not state its gauge and railhead width: fill them in.",
    (*RAIL_WORDS, *CLOUD_WORDS, "raster", "vectorize", "line", "3d"),
    CLOUD_NEEDS,
    (
        inputs.RASTER,
        replace(
            inputs.CLOUD,
            name="POINTS",
            help="The cloud from which the raster was made: it moves the lines onto the railheads and gives them "
            "heights.",
            optional=True,
        ),
        *methods.LINES,
        *inputs.RASTER_RAIL,
        inputs.LEFT_OUT,
    ),
    (replace(outputs.RAILS_OUTPUT, name="OUTPUT", optional=False),),
    outputs.RAIL_FIGURES,
    STEPS,
    picture="gauge.svg",
    call="vectorize",
    check=_check,
    run=_run,
)
