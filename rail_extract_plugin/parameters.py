"""The parameters of the algorithms, in the groups in which several algorithms share them.

Labels carry the unit; numbers are plain numbers, so that no layer's unit is put in their place.
"""

from __future__ import annotations

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterNumber,
    QgsProcessingParameterPointCloudLayer,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from ..core.frpdf.zoo import MODELS
from ..core.standards import CUSTOM, DEFAULT, RAIL_CLASS, STANDARDS
from .i18n import tr

AUTO = "AUTO"
ENGINES = (AUTO, "TORCH", "OPENCV")
DEVICES = (AUTO, "CPU", "CUDA")
TORCH_BUILDS = ("NONE", "CPU", "CUDA")

Definitions = tuple[QgsProcessingParameterDefinition, ...]

MOST_ITERATIONS = 5
"""The network's repairs have settled by then."""


def cloud() -> Definitions:
    """Which points are rail."""
    return (
        _helped(
            QgsProcessingParameterPointCloudLayer("INPUT", tr("Point cloud (layer, file or folder)")),
            tr("A loaded point cloud, or the path of a LAS, LAZ or COPC file, of a folder of them or of a .vpc file."),
        ),
        _helped(
            QgsProcessingParameterString("RAIL_CLASSES", tr("Rail classes"), defaultValue=str(RAIL_CLASS)),
            tr("Classes whose points lie on rails, such as 10 or 10,11. Each class is extracted on its own."),
        ),
    )


def rail() -> Definitions:
    """Which rails lie there."""
    return (
        _helped(
            _choice("STANDARD", tr("Rail standard"), (*STANDARDS, CUSTOM), DEFAULT),
            tr("Rail profile and gauge. CUSTOM takes both from the two fields below."),
        ),
        _helped(
            _number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True),
            tr("Distance between the inner faces of the two railheads; if filled, instead of the standard's."),
        ),
        _helped(
            _number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True),
            tr("Width of the top of one rail; if filled, instead of the standard's."),
        ),
    )


def raster() -> QgsProcessingParameterDefinition:
    """Which raster of rails."""
    return _helped(
        QgsProcessingParameterRasterLayer("INPUT", tr("Rail raster")),
        tr("One band a class, 1 where there is rail, as Rasterize Rail Points makes it. North up, square cells."),
    )


def raster_rail() -> Definitions:
    """Which rails a raster is of that does not say so itself."""
    return (
        _advanced(
            _number("GAUGE", tr("Gauge [mm]"), minimum=1.0, optional=True),
            tr("For a raster made elsewhere, which does not say its gauge; if filled, instead of what it says."),
        ),
        _advanced(
            _number("HEAD_WIDTH", tr("Railhead width [mm]"), minimum=1.0, optional=True),
            tr("For a raster made elsewhere, which does not say its width; if filled, instead of what it says."),
        ),
    )


def model() -> QgsProcessingParameterDefinition:
    """Which weights the network has."""
    return _helped(
        _choice("MODEL", tr("Model"), (AUTO, *(one.name for one in MODELS)), AUTO),
        tr("Trained weights; AUTO takes those that fit the gauge and the railhead width of the raster."),
    )


def points() -> QgsProcessingParameterDefinition:
    """Which points give lines their heights."""
    return _helped(
        QgsProcessingParameterPointCloudLayer("POINTS", tr("Point cloud (layer, file or folder)"), optional=True),
        tr("The cloud that the raster was made from: it moves lines onto their railheads and gives them heights."),
    )


def rails() -> QgsProcessingParameterDefinition:
    """Which lines are rails."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return _helped(
        QgsProcessingParameterFeatureSource("INPUT", tr("Rails"), [line]),
        tr("Lines of railheads, from Vectorize Rails or drawn by hand."),
    )


def centerlines() -> QgsProcessingParameterDefinition:
    """Which lines are track centerlines."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return _helped(
        QgsProcessingParameterFeatureSource("INPUT", tr("Track centerlines"), [line]),
        tr("Lines midway between rails, from Build Track Centerlines or drawn by hand; chainage counts along them."),
    )


def rails_of_tracks() -> QgsProcessingParameterDefinition:
    """Which rails lie beside the centerlines."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return _helped(
        QgsProcessingParameterFeatureSource("RAILS", tr("Rails"), [line]),
        tr("The lines that the centerlines were built from; those that left_ids and right_ids name, else the nearest."),
    )


def points_of_rails() -> QgsProcessingParameterDefinition:
    """Which points support the rails."""
    return _helped(
        QgsProcessingParameterPointCloudLayer("POINTS", tr("Point cloud (layer, file or folder)"), optional=True),
        tr("The cloud that the rails came from: it tells heights, sigma_mm and points metre by metre."),
    )


def step() -> QgsProcessingParameterDefinition:
    """How often tracks are measured."""
    return _advanced(
        _number("STEP", tr("Distance of the measurements [m]"), 1.0, minimum=0.1),
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
        _helped(
            QgsProcessingParameterExtent("EXTENT", tr("Extent"), optional=True),
            tr("Only points inside this rectangle are read."),
        ),
        _advanced(
            QgsProcessingParameterCrs("CRS", tr("Coordinate system of a cloud without one"), optional=True),
            tr("Used where the cloud states none."),
        ),
    )


def cleanup() -> Definitions:
    """How the network repairs the raster."""
    return (
        _advanced(
            _number("ITERATIONS", tr("Passes of the network"), 2, maximum=MOST_ITERATIONS, whole=True),
            tr("0 repeats until nothing changes, at most five times."),
        ),
        _advanced(
            _choice("ENGINE", tr("Engine"), ENGINES, AUTO),
            tr("Library that runs the network; AUTO takes the fastest one installed."),
        ),
        _advanced(
            _choice("DEVICE", tr("Device"), DEVICES, AUTO),
            tr("Processor that runs the network; AUTO takes a GPU where there is one."),
        ),
    )


def torch() -> QgsProcessingParameterDefinition:
    """Which PyTorch to install."""
    return _helped(
        _choice("TORCH", tr("PyTorch"), TORCH_BUILDS, "NONE"),
        tr("NONE leaves PyTorch out, and OpenCV runs the network; CPU suits every computer; CUDA needs an Nvidia GPU."),
    )


def smoothing_xy() -> QgsProcessingParameterDefinition:
    """How smooth lines are in plan."""
    return _advanced(
        _number("SMOOTHING_XY", tr("Smoothing in plan [m]"), 0.8, minimum=0.05),
        tr("Standard deviation of the smoothing along the line."),
    )


def lines() -> Definitions:
    """How the raster becomes lines with heights."""
    return (
        smoothing_xy(),
        _advanced(
            _number("SMOOTHING_Z", tr("Smoothing in height [m]"), 3.0, minimum=0.05),
            tr("Standard deviation of the smoothing of heights along the line."),
        ),
        _advanced(
            _number("TOLERANCE_XY", tr("Points count up to this far from the line [m]"), 0.10, minimum=0.005),
            tr("Points further away in plan give the line no height."),
        ),
        _advanced(
            _number("TOLERANCE_Z", tr("Points count up to this far below the top [m]"), 0.03, minimum=0.001),
            tr("Points further below the top of the rail give the line no height."),
        ),
        _advanced(
            _number("CROWN_RADIUS", tr("Radius that finds the top [m]"), 20.0, minimum=1.0),
            tr("The disc that is rolled along the height profile from above; smaller follows sharper dips."),
        ),
        max_gap(),
        _advanced(
            _number("GAP_ANGLE", tr("Largest bend across a gap [°]"), 10.0, maximum=90.0),
            tr("Line ends that meet at a larger angle stay apart."),
        ),
        *simplification(),
        min_length(),
    )


def max_gap() -> QgsProcessingParameterDefinition:
    """Which gaps are closed."""
    return _helped(
        _number("MAX_GAP", tr("Longest gap to close [m]"), 5.0),
        tr("Line ends up to this far apart are joined if they point at each other."),
    )


def simplification() -> Definitions:
    """How many vertices lines keep."""
    return (
        _advanced(
            _number("SIMPLIFY_XY", tr("Simplification in plan [m]"), 0.002),
            tr("Vertices are left out as long as the line stays this close in plan."),
        ),
        _advanced(
            _number("SIMPLIFY_Z", tr("Simplification in height [m]"), 0.002),
            tr("Vertices are left out as long as the line stays this close in height."),
        ),
    )


def min_length() -> QgsProcessingParameterDefinition:
    """Which lines are too short."""
    return _advanced(_number("MIN_LENGTH", tr("Shortest line [m]"), 1.0), tr("Shorter lines are left out."))


def pairing() -> Definitions:
    """Which rails make a track."""
    return (
        _advanced(
            QgsProcessingParameterString("OTHER_GAUGES", tr("Other gauges [mm]"), optional=True),
            tr("Gauges of further tracks in the same cloud, such as 1000;1067."),
        ),
        _advanced(
            _number("CENTERLINE_TOLERANCE", tr("Tolerance of the gauge [m]"), 0.05, minimum=0.001),
            tr("Rails whose distance is off by more than this make no track."),
        ),
    )


def quality_figures() -> tuple[QgsProcessingOutputNumber, ...]:
    """Numbers that tell how well tracks are measured."""
    return (
        QgsProcessingOutputNumber("STATION_COUNT", tr("Number of measured places")),
        QgsProcessingOutputNumber("SIGMA", tr("Standard error of the centerlines [mm]")),
        QgsProcessingOutputNumber("BRIDGED_LENGTH", tr("Length without points on a rail [m]")),
    )


def _number(
    name: str,
    label: str,
    default: float | None = None,
    minimum: float = 0.0,
    maximum: float = 1e9,
    whole: bool = False,
    optional: bool = False,
) -> QgsProcessingParameterNumber:
    kinds = QgsProcessingParameterNumber.Type
    kind = kinds.Integer if whole else kinds.Double
    number = QgsProcessingParameterNumber(name, label, kind, default, optional, minimum, maximum)
    if not whole:
        number.setMetadata({"widget_wrapper": {"decimals": 3}})
    return number


def _choice(name: str, label: str, options: tuple[str, ...], default: str) -> QgsProcessingParameterEnum:
    return QgsProcessingParameterEnum(name, label, list(options), defaultValue=default, usesStaticStrings=True)


def _helped(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    definition.setHelp(text)
    return definition


def _advanced(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    definition.setFlags(definition.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    return _helped(definition, text)
