"""The other parameters, in the groups that several algorithms share."""

from __future__ import annotations

from qgis.core import (
    QgsProcessing,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFile,
    QgsProcessingParameterString,
)

from ...core.frpdf import DEVICES, ENGINES, MAX_PASSES
from ...core.frpdf.models import NAMES
from ...core.parameters import (
    DEFAULT_EPOCHS,
    DEFAULT_GUIDE_DISTANCE_M,
    DEFAULT_STEP_M,
    DEFAULT_WORKERS,
    GEOMETRY,
    LEAVE_OUT,
    MAX_WORKERS,
    METHODS,
    STRIPS,
    TRANSITIONS,
    AirborneParameters,
    ComparisonParameters,
    FitParameters,
    GrowParameters,
    Parameters,
)
from ...core.standards import CUSTOM, DEFAULT, DETECT, LAST_CLASS, RAIL_CLASS, STANDARDS
from .definitions import FINE_M_DECIMALS, MM_DECIMALS, Definitions, advanced, choice, choices, helped, number

TORCH_BUILDS = ("NONE", "CPU", "CUDA")

# The maxima below only reject values that must be millimetres in a field of metres; they are not recommendations.

MAX_TOLERANCE_M = 0.5
"""Points further away than about half of the narrowest gauge in use (600 mm) may belong to another rail."""

MAX_SIMPLIFICATION_M = 1.0
"""A line simplified with a larger tolerance no longer represents a rail, which is about 0.07 m wide."""

MAX_SMOOTHING_M = 100.0
"""Removes even the tightest curves and dips of a railway."""

MAX_CROWN_RADIUS_M = 10_000.0
"""A disc of this radius is practically flat over any dip."""

MAX_LENGTH_M = 100_000.0
"""Longer than any gap to close, any minimum line length and any step between stations."""


MIN_FIT_TOLERANCE_MM, MAX_ELEMENT_M = 0.1, 1000.0
"""No scanner resolves a smaller tolerance, and no element that is left out on purpose is longer."""

MAX_GUIDE_REACH_M, MAX_FOOTPRINT_M, MAX_RAIL_M = 6.0, 2.0, 0.5
"""Beyond, a guide means another track, a footprint covers both rails, and a rail is not a rail."""

MAX_REACH_M = 2.0
"""Two tracks are further apart than this."""

MAX_EPOCHS, MAX_SEED = 10_000, 2**31 - 1
"""Weeks on any computer, and the largest seed of a random generator."""


VERTICAL_CURVES = ("CIRCLES", "PARABOLAS")

STANDARD_WIDGET = {"widget_wrapper": {"class": f"{__package__}.standard_widget.StandardWidgetWrapper"}}
"""Metadata by which QGIS finds the list of standards. Models contain it: the class never changes its place."""


def rail(detect: bool = False) -> Definitions:
    """Define the rail standard, gauge and railhead width; with `detect`, the points may tell them."""
    hint = " DETECT measures the rails in part of the points, and says how sure it is." if detect else ""
    standard = choice("STANDARD", "Rail standard", (*STANDARDS, CUSTOM, *([DETECT] if detect else [])), DEFAULT)
    standard.setMetadata(STANDARD_WIDGET)
    return (
        helped(
            standard,
            (
                "Rail profile and gauge, which give the rail spacing and the railhead width. CUSTOM takes both from "
                "GAUGE and HEAD_WIDTH."
            )
            + hint,
        ),
        advanced(
            number("GAUGE", "Gauge [mm]", minimum=1.0, optional=True, decimals=MM_DECIMALS),
            "Distance between the inner faces of the two railheads. Leave empty to use the value of the standard.",
        ),
        advanced(
            number("HEAD_WIDTH", "Railhead width [mm]", minimum=1.0, optional=True, decimals=MM_DECIMALS),
            "Width of the head of one rail. Leave empty to use the value of the standard.",
        ),
    )


def airborne() -> Definitions:
    """Define how tracks are looked for in an airborne cloud."""
    return (
        advanced(
            number("REACH", "Reach [m]", AirborneParameters.reach_m, 0.5, MAX_GUIDE_REACH_M),
            "Largest distance of a track from its guide.",
        ),
        helped(
            number("FOOTPRINT", "Footprint [m]", AirborneParameters.footprint_m, 0.01, MAX_FOOTPRINT_M),
            "Diameter of the laser beam on the ground: flying height times divergence, such as 1000 m times 0.25 "
            "mrad. If it is not known, 0.3 m suits most flights; a warning says if the rails look wider.",
        ),
        advanced(
            number("RAIL_HEIGHT", "Rails above the bed [m]", AirborneParameters.rail_height_m, 0.0, MAX_RAIL_M),
            "Top of the rails above the bed between them, which the points show. It depends on the ballast.",
        ),
    )


def raster_rail() -> Definitions:
    """Define gauge and railhead width for a raster without tags."""
    return (
        advanced(
            number("GAUGE", "Gauge [mm]", minimum=1.0, optional=True, decimals=MM_DECIMALS),
            "Needed for a raster from other software, which does not state its gauge. Overrides the tag of the raster.",
        ),
        advanced(
            number("HEAD_WIDTH", "Railhead width [mm]", minimum=1.0, optional=True, decimals=MM_DECIMALS),
            "Needed for a raster from other software, which does not state the width. Overrides the tag of the raster.",
        ),
    )


def model(is_advanced: bool = False) -> QgsProcessingParameterDefinition:
    """Define the choice of the network's weights."""
    return (advanced if is_advanced else helped)(
        choice("MODEL", "Model", NAMES, Parameters.model),
        "Trained weights of the network: base is the network of the paper, fast a smaller one. AUTO selects those "
        "that fit the gauge and railhead width.",
    )


def step() -> QgsProcessingParameterDefinition:
    """Define the spacing of the stations of the track geometry."""
    return advanced(
        number("STEP", "Step of the track geometry [m]", DEFAULT_STEP_M, 0.1, MAX_LENGTH_M),
        "Distance between the stations along each track at which gauge, cant, twist, radius and gradient are given.",
    )


def strips() -> QgsProcessingParameterDefinition:
    """Define what happens to strips that differ."""
    return advanced(
        choice("STRIPS", "Strips of the scanner", STRIPS, Parameters.strips),
        "What happens where passes of the scanner differ. AS_THEY_ARE uses their points together and states the "
        "difference in strip_mm and sigma_mm. ALIGNED moves each pass onto the mean of all that show the same "
        "rail, which removes steps. Passes are told apart by the source ids and GPS times of the points.",
    )


def head() -> Definitions:
    """Define the railhead width, which the measured gauge depends on, and the gauge to compare it with."""
    standard, gauge, head_width = rail()
    standard.setHelp("Rail profile, which gives the railhead width, and the gauge that findings compare with.")
    advanced(gauge, "Gauge that findings compare with, instead of that of the standard.")
    return standard, gauge, head_width


def vertical_curves() -> QgsProcessingParameterDefinition:
    """Define how LandXML states the curves of a profile."""
    return advanced(
        choice("VERTICAL_CURVES", "Curves of the profile in LandXML", VERTICAL_CURVES, VERTICAL_CURVES[0]),
        "CIRCLES writes circles, as railways state them; PARABOLAS writes parabolas of the same length. Between "
        "the same gradients they differ by less than a millimetre.",
    )


def area() -> Definitions:
    """Define the extent and the coordinate system of the cloud."""
    return (
        advanced(
            QgsProcessingParameterExtent("EXTENT", "Extent", optional=True),
            "Only points inside this rectangle are read. Leave empty to read all points.",
        ),
        advanced(
            QgsProcessingParameterFeatureSource(
                "MASK", "Mask", [QgsProcessing.SourceType.TypeVectorPolygon], optional=True
            ),
            "Only points inside these polygons are read, for example a strip along the line.",
        ),
        crs(),
        leave_out(),
    )


def crs() -> QgsProcessingParameterDefinition:
    """Define the coordinate system of a cloud that states none."""
    return advanced(
        QgsProcessingParameterCrs("CRS", "CRS of a cloud without one", optional=True),
        "Projected coordinate system for files that do not state one; other files keep their own.",
    )


def leave_out() -> QgsProcessingParameterDefinition:
    """Define which points are left out by their flag."""
    return advanced(
        choices("LEAVE_OUT", "Points to leave out", LEAVE_OUT),
        "OVERLAP leaves out points that are marked as overlap of strips, SYNTHETIC those that are marked as "
        "computed, not measured. Withheld points are always left out.",
    )


def cleanup() -> Definitions:
    """Define the passes, engine and device of the network."""
    return (
        advanced(
            number("ITERATIONS", "Passes of the network", Parameters.passes, maximum=MAX_PASSES, whole=True),
            "Each pass starts from the result of the pass before. 0 repeats until fewer than one rail cell in a "
            "thousand changes, with at most five passes.",
        ),
        advanced(
            choice("ENGINE", "Engine of the network", ENGINES, Parameters.engine),
            "Python package that runs the network: PyTorch or OpenCV. AUTO uses PyTorch if it is installed.",
        ),
        advanced(
            choice("DEVICE", "Device of the network", DEVICES, Parameters.device),
            "CPU, or CUDA for an Nvidia GPU, which needs PyTorch. AUTO uses the GPU if there is one.",
        ),
    )


def torch() -> QgsProcessingParameterDefinition:
    """Define the build of PyTorch to install."""
    return helped(
        choice("TORCH", "PyTorch", TORCH_BUILDS, "NONE"),
        "NONE does not install PyTorch; OpenCV runs the network. CPU works on any computer. CUDA needs an Nvidia GPU.",
    )


def smoothing_xy() -> QgsProcessingParameterDefinition:
    """Define the smoothing in plan."""
    return advanced(
        number("SMOOTHING_XY", "Smoothing in plan [m]", Parameters.smoothing_xy_m, 0.05, MAX_SMOOTHING_M),
        "Standard deviation of the smoothing: bends shorter than a few times this length are flattened.",
    )


def lines() -> Definitions:
    """Define how the raster becomes lines with heights."""
    return (
        smoothing_xy(),
        *_heights(),
        max_gap(),
        advanced(
            number("GAP_ANGLE", "Largest bend across a gap [°]", Parameters.gap_angle_deg, maximum=90.0),
            "Line ends that meet at a larger angle are not joined.",
        ),
        *simplification(),
        min_length(),
    )


def _heights() -> Definitions:
    """Define how lines get their heights."""
    return (
        advanced(
            number("SMOOTHING_Z", "Smoothing in height [m]", minimum=0.05, maximum=MAX_SMOOTHING_M, optional=True),
            "If empty, heights are smoothed as much as the points require. Otherwise the standard deviation of the "
            "smoothing of the paper: dips shorter than a few times this length are flattened.",
        ),
        advanced(
            number("TOLERANCE_XY", "Tolerance in plan [m]", Parameters.tolerance_xy_m, 0.005, MAX_TOLERANCE_M),
            "Only points within this distance of the line determine its height. Half the railhead width is the "
            "limit in any case.",
        ),
        advanced(
            number("TOLERANCE_Z", "Tolerance in height [m]", Parameters.tolerance_z_m, 0.001, MAX_TOLERANCE_M),
            "Only points within this distance below the top of the rail determine the height of the line.",
        ),
        advanced(
            number(
                "CROWN_RADIUS",
                "Crown radius of the rolling disc [m]",
                Parameters.crown_radius_m,
                1.0,
                MAX_CROWN_RADIUS_M,
            ),
            "A disc of this radius, rolled along the points from above, finds the top of the rail. The value "
            "hardly affects the line: reduce it only where short, deep dips lose their points.",
        ),
    )


def max_gap() -> QgsProcessingParameterDefinition:
    """Define the longest gap to close."""
    return advanced(
        number("MAX_GAP", "Longest gap to close [m]", Parameters.max_gap_m, maximum=MAX_LENGTH_M),
        "Line ends up to this distance apart are joined if they point at each other; 0 joins none. Where only one "
        "rail of a track continues, the centerline follows it for up to 30 m, regardless of this value.",
    )


def simplification() -> Definitions:
    """Define the tolerances of the simplification."""
    return (
        advanced(
            number(
                "SIMPLIFY_XY",
                "Simplification in plan [m]",
                Parameters.simplify_xy_m,
                maximum=MAX_SIMPLIFICATION_M,
                decimals=FINE_M_DECIMALS,
            ),
            "Vertices are removed while the line stays within this distance in plan.",
        ),
        advanced(
            number(
                "SIMPLIFY_Z",
                "Simplification in height [m]",
                Parameters.simplify_z_m,
                maximum=MAX_SIMPLIFICATION_M,
                decimals=FINE_M_DECIMALS,
            ),
            "Vertices are removed while the line stays within this distance in height.",
        ),
    )


def min_length() -> QgsProcessingParameterDefinition:
    """Define the minimum length of lines."""
    return advanced(
        number("MIN_LENGTH", "Shortest line [m]", Parameters.min_length_m, maximum=MAX_LENGTH_M),
        "Shorter lines are dropped.",
    )


def other_gauges() -> QgsProcessingParameterDefinition:
    """Define the gauges of other tracks."""
    return advanced(
        QgsProcessingParameterString("OTHER_GAUGES", "Other gauges [mm]", optional=True),
        "Gauges of other tracks in the same cloud, such as 1000;1067, or 1000/66 with the width of the railhead.",
    )


def method() -> Definitions:
    """Define what finds the rail points of a raw cloud."""
    return (
        advanced(
            choice("METHOD", "What finds rail points", METHODS, GEOMETRY),
            "The shape of rails, or a network that has learned them from labelled clouds and needs PyTorch.",
        ),
        advanced(
            QgsProcessingParameterFile(
                "WEIGHTS", "Weights of the classifier", optional=True, fileFilter="Weights (*.npz)"
            ),
            "The file that Train Rail Classifier has written, used if METHOD is LEARNED. Leave empty to use the "
            "weights that were trained on simulated clouds.",
        ),
    )


def training() -> Definitions:
    """Define how a classifier is trained."""
    return (
        helped(
            number("EPOCHS", "Epochs", DEFAULT_EPOCHS, 1, MAX_EPOCHS, whole=True),
            "How many times each block of 4 m with rails is learned from. More take longer and may find more.",
        ),
        advanced(
            QgsProcessingParameterFile("START", "Weights to start from", optional=True, fileFilter="Weights (*.npz)"),
            "Weights that have learned from other clouds, such as rail_classifier.npz in the folder models of the "
            "plugin: fewer labels and epochs do. Leave empty to start from random weights.",
        ),
        advanced(
            number("SEED", "Seed", 0, maximum=MAX_SEED, whole=True),
            "Of the random numbers. It also chooses the places that are kept back.",
        ),
        advanced(
            choice("DEVICE", "Device of the training", DEVICES, "AUTO"),
            "CPU, or CUDA for an Nvidia GPU. AUTO uses the GPU if there is one.",
        ),
    )


def guide() -> Definitions:
    """Define where rails are searched."""
    return (
        advanced(
            number("GUIDE_DISTANCE", "Distance from the guide [m]", DEFAULT_GUIDE_DISTANCE_M, 0.5, MAX_LENGTH_M),
            "Tracks whose middle is at most this far from a line of the guide are searched.",
        ),
        advanced(
            QgsProcessingParameterBoolean("ONLY_GUIDED", "Only the tracks along the guide", defaultValue=False),
            "Keeps only tracks that have the guide within 0.5 m of their middle for more than half of their length.",
        ),
    )


def labels() -> Definitions:
    """Define which points are labelled as rails, and what is written."""
    return (
        helped(
            QgsProcessingParameterBoolean("KEEP_SINGLE", "Keep rails without a partner", defaultValue=True),
            "Straight rails of 5 m and more are kept although no other rail runs at the distance of the gauge, for "
            "example because it is hidden. Otherwise only pairs of rails are kept.",
        ),
        *content(),
        advanced(
            QgsProcessingParameterBoolean("RESET", "Reset the class of other points", defaultValue=True),
            "Points that already have the class of rail points, but are not found on rails, become class 1 "
            "(unclassified). Otherwise they keep it.",
        ),
    )


def content() -> Definitions:
    """Define the class of rail points, and whether the others are written as well."""
    contents = ["Whole cloud", "Rail points only"]
    return (
        advanced(
            number("RAIL_CLASS", "Class of rail points", RAIL_CLASS, maximum=LAST_CLASS, whole=True),
            "The class that points on rails get. In point formats 0 to 5, classes end at 31.",
        ),
        advanced(
            QgsProcessingParameterEnum("CONTENT", "Content of the output", contents, defaultValue=0),
            "The whole cloud (0), or only the points on rails (1).",
        ),
    )


def growth() -> Definitions:
    """Define how rails are followed from seeds."""
    defaults = GrowParameters()
    lengths = (
        advanced(
            number("SEARCH", "Search distance [m]", defaults.search_m, 0.02, 1.0),
            "A seed finds the rail within this distance; a rail is lost further than this from its course.",
        ),
        advanced(
            number("THICKNESS", "Width of the strip of rail points [m]", defaults.thickness_m, 0.02, 0.5),
            "Points within half of this width of the rail's axis belong to it, if they are at its height.",
        ),
        advanced(
            number("WINDOW", "Length of a window [m]", defaults.window_m, 0.1, 5.0),
            "Length of rail that is looked at as one. In thin clouds, windows become longer by themselves.",
        ),
        advanced(
            number("MIN_HEIGHT", "Least height above the bed [m]", defaults.min_height_m, 0.001, 0.4),
            "The bed beside a rail is lower than its top by this, except in pavements beside a groove.",
        ),
        advanced(
            number("TOLERANCE_Z", "Tolerance in height [m]", defaults.tolerance_z_m, 0.001, MAX_TOLERANCE_M),
            "Largest difference in height between points of a head, and from one window to the next.",
        ),
    )
    longest = advanced(
        number("MAX_LENGTH", "Longest run [m]", defaults.max_length_m, 1.0, MAX_LENGTH_M),
        "Rails are followed for this length to either side of a seed; only these points are read.",
    )
    outliers = advanced(
        number("MAX_OUTLIERS", "Most windows without the rail", defaults.max_outliers, maximum=1000, whole=True),
        "A rail that is not seen in more windows in a row than this is not followed further.",
    )
    both = advanced(
        QgsProcessingParameterBoolean("BOTH", "Follow both rails of the track", defaultValue=defaults.both),
        "The other rail of the track, at the gauge, is followed as well. Otherwise only the one with the seed.",
    )
    return (both, *lengths, outliers, longest)


def comparison() -> Definitions:
    """Define how two surveys are compared."""
    sigma = "Across and in height, where lines state none; 0 for a design. Empty: the scatter shows it."
    defaults = ComparisonParameters()
    reach = number("REACH", "Greatest distance of the same line [m]", defaults.reach_m, 0.01, MAX_REACH_M)
    step = number("STEP", "Step of the comparison [m]", defaults.step_m, 0.1, MAX_LENGTH_M)
    shift = QgsProcessingParameterBoolean(
        "IGNORE_SHIFT", "Leave a constant shift out of account", defaultValue=defaults.ignore_shift
    )
    errors = (
        ("REFERENCE_SIGMA", "Standard error, reference [mm]"),
        ("INPUT_SIGMA", "Standard error, lines [mm]"),
    )
    return (
        *(advanced(number(name, label, optional=True, decimals=MM_DECIMALS), sigma) for name, label in errors),
        helped(
            shift,
            "moved is judged without the shift that most of the length shares. Switch it off for a design.",
        ),
        advanced(reach, "Lines further from those of the reference are not the same line: missing and extra."),
        advanced(step, "Distance between the points along each line."),
    )


def workers() -> QgsProcessingParameterDefinition:
    """Define how many processes compute."""
    return advanced(
        number("WORKERS", "Processes", DEFAULT_WORKERS, maximum=MAX_WORKERS, whole=True),
        "Processes that compute at a time, on squares of a large cloud or on its files; results do not depend on "
        "them. 0 starts one per core, as far as a quarter of the memory or 2 GB allow; 1 computes in QGIS itself.",
    )


def pairing() -> Definitions:
    """Define which rails make a track."""
    return (
        other_gauges(),
        advanced(
            number(
                "CENTERLINE_TOLERANCE",
                "Gauge tolerance of tracks [m]",
                Parameters.centerline_tolerance_m,
                0.001,
                MAX_TOLERANCE_M,
            ),
            "Rails whose gauge deviates by more than this do not make a track.",
        ),
    )


def alignment() -> Definitions:
    """Define how design elements are fitted."""
    default = FitParameters()
    tolerance = number(
        "TOLERANCE",
        "Tolerance [mm]",
        1000.0 * default.tolerance_m,
        minimum=MIN_FIT_TOLERANCE_MM,
        maximum=1000.0 * MAX_TOLERANCE_M,
        decimals=MM_DECIMALS,
    )
    length = number("MIN_LENGTH", "Shortest element [m]", default.min_length_m, 1.0, MAX_ELEMENT_M)
    return (
        helped(
            tolerance,
            "How far the track may be off its design. Misalignment up to this standard deviation is told from "
            "design by its length; more is followed by elements.",
        ),
        advanced(length, "Shorter elements are not sought."),
        advanced(
            choice("TRANSITIONS", "Between two radii", TRANSITIONS, default.transitions),
            "Jumps of the curvature, as in turnouts and sidings, or clothoids only.",
        ),
        advanced(
            QgsProcessingParameterBoolean("ROUND", "Propose round radii", defaultValue=default.rounded),
            "States the roundest radius that the track allows, beside the fitted one.",
        ),
    )
