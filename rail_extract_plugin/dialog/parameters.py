"""What algorithms can be told, in the groups in which several of them share it."""

from __future__ import annotations

from qgis.core import (
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterExtent,
    QgsProcessingParameterString,
)

from ...core.frpdf import AUTO, DEVICES, ENGINES, MOST_PASSES
from ...core.frpdf.models import MODELS
from ...core.parameters import DEFAULT_STEP_M, Parameters
from ...core.standards import CUSTOM, DEFAULT, STANDARDS, UNCONFIRMED_PROFILES
from ..i18n import tr
from .definitions import MM_DECIMALS, Definitions, advanced, choice, helped, number

TORCH_BUILDS = ("NONE", "CPU", "CUDA")

# The largest values keep out what can only be millimetres in a field of metres; they are no advice.

WIDEST_REACH_M = 0.5
"""Points further away than half of the narrowest gauge in use (600 mm) could as well be of another rail."""

COARSEST_M = 1.0
"""Vertices that are left out more coarsely than this give no line of a rail, which is a tenth as wide."""

LONGEST_SMOOTHING_M = 100.0
"""Nothing of the tightest curves and dips of a railway is left then."""

FLATTEST_CROWN_M = 10_000.0
"""A disc as large as this is flat over any dip."""

LONGEST_M = 100_000.0
"""Longer than any gap to bridge, any line to leave out, any stretch between two measurements."""


def rail() -> Definitions:
    """Which rails lie there."""
    return (
        helped(
            choice("STANDARD", tr("Rail standard"), (*STANDARDS, CUSTOM), DEFAULT),
            tr(
                "Rail profile and gauge: EN_60E1_1435 is 60E1 of EN 13674 on 1435 mm. It says how far apart the rails "
                "are and how wide a railhead is. CUSTOM takes both from the two fields below. No table confirms the "
                "width of {}."
            ).format(", ".join(UNCONFIRMED_PROFILES)),
        ),
        helped(
            number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True, decimals=MM_DECIMALS),
            tr("Distance between the inner faces of the two railheads. Leave it empty to take the standard's."),
        ),
        helped(
            number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True, decimals=MM_DECIMALS),
            tr("Width of the top of one rail. Leave it empty to take the standard's."),
        ),
    )


def raster_rail() -> Definitions:
    """Which rails a raster is of that does not say so itself."""
    return (
        advanced(
            number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True, decimals=MM_DECIMALS),
            tr("For a raster made elsewhere, which does not say its gauge; if filled, instead of what it says."),
        ),
        advanced(
            number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True, decimals=MM_DECIMALS),
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
        number("STEP", tr("Step of the track geometry [m]"), DEFAULT_STEP_M, 0.1, LONGEST_M),
        tr("Gauge, cant, twist, radius and gradient are stated once in this distance along each track."),
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
            tr("Only points inside this rectangle are read. Leave it empty to read them all."),
        ),
        advanced(
            QgsProcessingParameterCrs("CRS", tr("CRS of a cloud without one"), optional=True),
            tr("The projected coordinate system of files that state none; others keep their own."),
        ),
    )


def cleanup() -> Definitions:
    """How the network repairs the raster."""
    return (
        advanced(
            number("ITERATIONS", tr("Passes of the network"), Parameters.passes, maximum=MOST_PASSES, whole=True),
            tr(
                "How often the network looks again at what it found. 0: until fewer than one rail cell in a thousand "
                "changes, at most five times."
            ),
        ),
        advanced(
            choice("ENGINE", tr("Engine of the network"), ENGINES, Parameters.engine),
            tr("Python package that runs the network: PyTorch or OpenCV. AUTO takes the faster one that is installed."),
        ),
        advanced(
            choice("DEVICE", tr("Device of the network"), DEVICES, Parameters.device),
            tr("CPU is the processor, CUDA an Nvidia GPU, which takes PyTorch. AUTO uses the GPU where there is one."),
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
        number("SMOOTHING_XY", tr("Smoothing in plan [m]"), Parameters.smoothing_xy_m, 0.05, LONGEST_SMOOTHING_M),
        tr("Bends shorter than a few times this length are evened out: standard deviation of the smoothing."),
    )


def lines() -> Definitions:
    """How the raster becomes lines with heights."""
    return (
        smoothing_xy(),
        advanced(
            number("SMOOTHING_Z", tr("Smoothing in height [m]"), Parameters.smoothing_z_m, 0.05, LONGEST_SMOOTHING_M),
            tr("Dips shorter than a few times this length are evened out: standard deviation of the smoothing."),
        ),
        advanced(
            number("TOLERANCE_XY", tr("Tolerance in plan [m]"), Parameters.tolerance_xy_m, 0.005, WIDEST_REACH_M),
            tr(
                "Points up to this far beside the line give it its height, others none. Half a railhead is the limit "
                "in any case."
            ),
        ),
        advanced(
            number("TOLERANCE_Z", tr("Tolerance in height [m]"), Parameters.tolerance_z_m, 0.001, WIDEST_REACH_M),
            tr("Points up to this far below the top of the rail give the line its height, others none."),
        ),
        advanced(
            number(
                "CROWN_RADIUS",
                tr("Crown radius of the rolling disc [m]"),
                Parameters.crown_radius_m,
                1.0,
                FLATTEST_CROWN_M,
            ),
            tr(
                "A disc rolled along the heights from above finds the top of the rail. It hardly changes the line: "
                "reduce it only where short, deep dips lose their points."
            ),
        ),
        max_gap(),
        advanced(
            number("GAP_ANGLE", tr("Largest bend across a gap [°]"), Parameters.gap_angle_deg, maximum=90.0),
            tr("Line ends that meet at a larger angle stay apart."),
        ),
        *simplification(),
        min_length(),
    )


def max_gap() -> QgsProcessingParameterDefinition:
    """Which gaps are closed."""
    return helped(
        number("MAX_GAP", tr("Longest gap to close [m]"), Parameters.max_gap_m, maximum=LONGEST_M),
        tr(
            "Line ends up to this far apart are joined if they point at each other; 0 joins none. Where one rail of a "
            "track goes on, its centerline does for up to 30 m, whatever is set here."
        ),
    )


def simplification() -> Definitions:
    """How many vertices lines keep."""
    return (
        advanced(
            number("SIMPLIFY_XY", tr("Simplification in plan [m]"), Parameters.simplify_xy_m, maximum=COARSEST_M),
            tr("Vertices are left out as long as the line stays this close in plan."),
        ),
        advanced(
            number("SIMPLIFY_Z", tr("Simplification in height [m]"), Parameters.simplify_z_m, maximum=COARSEST_M),
            tr("Vertices are left out as long as the line stays this close in height."),
        ),
    )


def min_length() -> QgsProcessingParameterDefinition:
    """Which lines are too short."""
    return advanced(
        number("MIN_LENGTH", tr("Shortest line [m]"), Parameters.min_length_m, maximum=LONGEST_M),
        tr("Shorter lines are left out."),
    )


def pairing() -> Definitions:
    """Which rails make a track."""
    return (
        advanced(
            QgsProcessingParameterString("OTHER_GAUGES", tr("Other gauges [mm]"), optional=True),
            tr("Gauges of further tracks in the same cloud, such as 1000;1067, for mixed traffic."),
        ),
        advanced(
            number(
                "CENTERLINE_TOLERANCE",
                tr("Centerline tolerance of the gauge [m]"),
                Parameters.centerline_tolerance_m,
                0.001,
                WIDEST_REACH_M,
            ),
            tr("Rails whose distance is off by more than this make no track."),
        ),
    )
