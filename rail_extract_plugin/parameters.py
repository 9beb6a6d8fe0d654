"""What algorithms can be told, in the groups in which several of them share it."""

from __future__ import annotations

from qgis.core import (
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterExtent,
    QgsProcessingParameterString,
)

from ..core.frpdf.zoo import MODELS
from ..core.standards import CUSTOM, DEFAULT, STANDARDS
from .definitions import Definitions, advanced, choice, helped, number
from .i18n import tr

AUTO = "AUTO"
ENGINES = (AUTO, "TORCH", "OPENCV")
DEVICES = (AUTO, "CPU", "CUDA")
TORCH_BUILDS = ("NONE", "CPU", "CUDA")

MOST_ITERATIONS = 5
"""The network's repairs have settled by then."""


def rail() -> Definitions:
    """Which rails lie there."""
    return (
        helped(
            choice("STANDARD", tr("Rail standard"), (*STANDARDS, CUSTOM), DEFAULT),
            tr("Rail profile and gauge. CUSTOM takes both from the two fields below."),
        ),
        helped(
            number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True),
            tr("Distance between the inner faces of the two railheads; if filled, instead of the standard's."),
        ),
        helped(
            number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True),
            tr("Width of the top of one rail; if filled, instead of the standard's."),
        ),
    )


def raster_rail() -> Definitions:
    """Which rails a raster is of that does not say so itself."""
    return (
        advanced(
            number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True),
            tr("For a raster made elsewhere, which does not say its gauge; if filled, instead of what it says."),
        ),
        advanced(
            number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True),
            tr("For a raster made elsewhere, which does not say its width; if filled, instead of what it says."),
        ),
    )


def model() -> QgsProcessingParameterDefinition:
    """Which weights the network has."""
    return helped(
        choice("MODEL", tr("Model"), (AUTO, *(one.name for one in MODELS)), AUTO),
        tr("Trained weights; AUTO takes those that fit the gauge and the railhead width of the raster."),
    )


def step() -> QgsProcessingParameterDefinition:
    """How often tracks are measured."""
    return advanced(
        number("STEP", tr("Distance of the measurements [m]"), 1.0, minimum=0.1),
        tr("Gauge, cant, twist, radius and gradient are stated at these distances along each track."),
    )


def head() -> Definitions:
    """How wide the railheads are."""
    standard, _, head_width = rail()
    standard.setHelp(tr("Rail profile, which says how wide the railhead is."))
    return standard, head_width


def area() -> Definitions:
    """Where to look, and in which coordinates."""
    return (
        helped(
            QgsProcessingParameterExtent("EXTENT", tr("Extent"), optional=True),
            tr("Only points inside this rectangle are read."),
        ),
        advanced(
            QgsProcessingParameterCrs("CRS", tr("Coordinate system of a cloud without one"), optional=True),
            tr("Used where the cloud states none."),
        ),
    )


def cleanup() -> Definitions:
    """How the network repairs the raster."""
    return (
        advanced(
            number("ITERATIONS", tr("Passes of the network"), 2, maximum=MOST_ITERATIONS, whole=True),
            tr("0 repeats until nothing changes, at most five times."),
        ),
        advanced(
            choice("ENGINE", tr("Engine"), ENGINES, AUTO),
            tr("Library that runs the network; AUTO takes the fastest one installed."),
        ),
        advanced(
            choice("DEVICE", tr("Device"), DEVICES, AUTO),
            tr("Processor that runs the network; AUTO takes a GPU where there is one."),
        ),
    )


def torch() -> QgsProcessingParameterDefinition:
    """Which PyTorch to install."""
    return helped(
        choice("TORCH", tr("PyTorch"), TORCH_BUILDS, "NONE"),
        tr("NONE leaves PyTorch out, and OpenCV runs the network; CPU suits every computer; CUDA needs an Nvidia GPU."),
    )


def smoothing_xy() -> QgsProcessingParameterDefinition:
    """How smooth lines are in plan."""
    return advanced(
        number("SMOOTHING_XY", tr("Smoothing in plan [m]"), 0.8, minimum=0.05),
        tr("Standard deviation of the smoothing along the line."),
    )


def lines() -> Definitions:
    """How the raster becomes lines with heights."""
    return (
        smoothing_xy(),
        advanced(
            number("SMOOTHING_Z", tr("Smoothing in height [m]"), 3.0, minimum=0.05),
            tr("Standard deviation of the smoothing of heights along the line."),
        ),
        advanced(
            number("TOLERANCE_XY", tr("Points count up to this far from the line [m]"), 0.10, minimum=0.005),
            tr("Points further away in plan give the line no height."),
        ),
        advanced(
            number("TOLERANCE_Z", tr("Points count up to this far below the top [m]"), 0.03, minimum=0.001),
            tr("Points further below the top of the rail give the line no height."),
        ),
        advanced(
            number("CROWN_RADIUS", tr("Radius that finds the top [m]"), 20.0, minimum=1.0),
            tr("The disc that is rolled along the height profile from above; smaller follows sharper dips."),
        ),
        max_gap(),
        advanced(
            number("GAP_ANGLE", tr("Largest bend across a gap [°]"), 10.0, maximum=90.0),
            tr("Line ends that meet at a larger angle stay apart."),
        ),
        *simplification(),
        min_length(),
    )


def max_gap() -> QgsProcessingParameterDefinition:
    """Which gaps are closed."""
    return helped(
        number("MAX_GAP", tr("Longest gap to close [m]"), 5.0),
        tr("Line ends up to this far apart are joined if they point at each other."),
    )


def simplification() -> Definitions:
    """How many vertices lines keep."""
    return (
        advanced(
            number("SIMPLIFY_XY", tr("Simplification in plan [m]"), 0.002),
            tr("Vertices are left out as long as the line stays this close in plan."),
        ),
        advanced(
            number("SIMPLIFY_Z", tr("Simplification in height [m]"), 0.002),
            tr("Vertices are left out as long as the line stays this close in height."),
        ),
    )


def min_length() -> QgsProcessingParameterDefinition:
    """Which lines are too short."""
    return advanced(number("MIN_LENGTH", tr("Shortest line [m]"), 1.0), tr("Shorter lines are left out."))


def pairing() -> Definitions:
    """Which rails make a track."""
    return (
        advanced(
            QgsProcessingParameterString("OTHER_GAUGES", tr("Other gauges [mm]"), optional=True),
            tr("Gauges of further tracks in the same cloud, such as 1000;1067."),
        ),
        advanced(
            number("CENTERLINE_TOLERANCE", tr("Tolerance of the gauge [m]"), 0.05, minimum=0.001),
            tr("Rails whose distance is off by more than this make no track."),
        ),
    )
