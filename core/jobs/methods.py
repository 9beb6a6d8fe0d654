"""Parameters of several jobs for how they compute: search, network, lines, pairing, geometry and processes."""

from __future__ import annotations

from dataclasses import replace

from ..frpdf import DEVICES, ENGINES, MAX_PASSES
from ..frpdf.models import NAMES
from ..parameters import (
    DEFAULT_STEP_M,
    DEFAULT_WORKERS,
    GEOMETRY,
    MAX_WORKERS,
    METHODS,
    Parameters,
)
from ..standards import LAST_CLASS, RAIL_CLASS
from .declaration import (
    FINE_M_DECIMALS,
    Choice,
    FileInput,
    Number,
    Parameter,
    Text,
)

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

WEIGHT_FILES = "Weights (*.npz)"

OTHER_GAUGES = Text(
    "OTHER_GAUGES",
    "Other gauges [mm]",
    "Gauges of other tracks in the same cloud, such as 1000;1067, or 1000/66 with the width of the railhead.",
    advanced=True,
    optional=True,
)
PAIRING: tuple[Parameter, ...] = (
    OTHER_GAUGES,
    Number(
        "CENTERLINE_TOLERANCE",
        "Gauge tolerance of tracks [m]",
        "Rails whose gauge deviates by more than this do not make a track.",
        advanced=True,
        default=Parameters.centerline_tolerance_m,
        low=0.001,
        high=MAX_TOLERANCE_M,
    ),
)

METHOD: tuple[Parameter, ...] = (
    Choice(
        "METHOD",
        "What finds rail points",
        "The shape of rails, or a network that has learned them from labelled clouds and needs PyTorch.",
        advanced=True,
        options=METHODS,
        default=GEOMETRY,
    ),
    FileInput(
        "WEIGHTS",
        "Weights of the classifier",
        "The file that Train Rail Classifier has written, used if METHOD is LEARNED. Leave empty to use the weights "
        "that were trained on simulated clouds.",
        advanced=True,
        optional=True,
        kinds=WEIGHT_FILES,
    ),
)

CONTENT: tuple[Parameter, ...] = (
    Number(
        "RAIL_CLASS",
        "Class of rail points",
        "The class that points on rails get. In point formats 0 to 5, classes end at 31.",
        advanced=True,
        default=RAIL_CLASS,
        high=LAST_CLASS,
        whole=True,
    ),
    Choice(
        "CONTENT",
        "Content of the output",
        "The whole cloud (0), or only the points on rails (1).",
        advanced=True,
        default=0,
        options=("Whole cloud", "Rail points only"),
        numbered=True,
    ),
)
"""The class of rail points, and whether the others are written as well."""

MODEL = Choice(
    "MODEL",
    "Model",
    "Trained weights of the network: base is the network of the paper, fast a smaller one. AUTO selects those that fit "
    "the gauge and railhead width.",
    options=NAMES,
    default=Parameters.model,
)

DEVICE = Choice(
    "DEVICE",
    "Device of the network",
    "CPU, or CUDA for an Nvidia GPU, which needs PyTorch. AUTO uses the GPU if there is one.",
    advanced=True,
    options=DEVICES,
    default=Parameters.device,
)

CLEANUP: tuple[Parameter, ...] = (
    Number(
        "ITERATIONS",
        "Passes of the network",
        "Each pass starts from the result of the pass before. 0 repeats until fewer than one rail cell in a thousand "
        "changes, with at most five passes.",
        advanced=True,
        default=Parameters.passes,
        high=MAX_PASSES,
        whole=True,
    ),
    Choice(
        "ENGINE",
        "Engine of the network",
        "Python package that runs the network: PyTorch or OpenCV. AUTO uses PyTorch if it is installed.",
        advanced=True,
        options=ENGINES,
        default=Parameters.engine,
    ),
    DEVICE,
)

SMOOTHING_XY = Number(
    "SMOOTHING_XY",
    "Smoothing in plan [m]",
    "Standard deviation of the smoothing: bends shorter than a few times this length are flattened.",
    advanced=True,
    default=Parameters.smoothing_xy_m,
    low=0.05,
    high=MAX_SMOOTHING_M,
)

TOLERANCE_Z = Number(
    "TOLERANCE_Z",
    "Tolerance in height [m]",
    "Only points within this distance below the top of the rail determine the height of the line.",
    advanced=True,
    default=Parameters.tolerance_z_m,
    low=0.001,
    high=MAX_TOLERANCE_M,
)

HEIGHTS = (
    Number(
        "SMOOTHING_Z",
        "Smoothing in height [m]",
        "If empty, heights are smoothed as much as the points require. Otherwise the standard deviation of the "
        "smoothing of the paper: dips shorter than a few times this length are flattened.",
        advanced=True,
        optional=True,
        low=0.05,
        high=MAX_SMOOTHING_M,
    ),
    Number(
        "TOLERANCE_XY",
        "Tolerance in plan [m]",
        "Only points within this distance of the line determine its height. Half the railhead width is the limit in "
        "any case.",
        advanced=True,
        default=Parameters.tolerance_xy_m,
        low=0.005,
        high=MAX_TOLERANCE_M,
    ),
    TOLERANCE_Z,
    Number(
        "CROWN_RADIUS",
        "Crown radius of the rolling disc [m]",
        "A disc of this radius, rolled along the points from above, finds the top of the rail. The value hardly "
        "affects the line: reduce it only where short, deep dips lose their points.",
        advanced=True,
        default=Parameters.crown_radius_m,
        low=1.0,
        high=MAX_CROWN_RADIUS_M,
    ),
)

MAX_GAP = Number(
    "MAX_GAP",
    "Longest gap to close [m]",
    "Line ends up to this distance apart are joined if they point at each other; 0 joins none. Where only one rail of "
    "a track continues, the centerline follows it for up to 30 m, regardless of this value.",
    advanced=True,
    default=Parameters.max_gap_m,
    high=MAX_LENGTH_M,
)

SIMPLIFY_XY = Number(
    "SIMPLIFY_XY",
    "Simplification in plan [m]",
    "Vertices are removed while the line stays within this distance in plan.",
    advanced=True,
    default=Parameters.simplify_xy_m,
    high=MAX_SIMPLIFICATION_M,
    decimals=FINE_M_DECIMALS,
)

SIMPLIFY_Z = replace(
    SIMPLIFY_XY,
    name="SIMPLIFY_Z",
    label="Simplification in height [m]",
    help="Vertices are removed while the line stays within this distance in height.",
    default=Parameters.simplify_z_m,
)

MIN_LENGTH = Number(
    "MIN_LENGTH",
    "Shortest line [m]",
    "Shorter lines are dropped.",
    advanced=True,
    default=Parameters.min_length_m,
    high=MAX_LENGTH_M,
)

LINES = (
    SMOOTHING_XY,
    *HEIGHTS,
    MAX_GAP,
    Number(
        "GAP_ANGLE",
        "Largest bend across a gap [°]",
        "Line ends that meet at a larger angle are not joined.",
        advanced=True,
        default=Parameters.gap_angle_deg,
        high=90.0,
    ),
    SIMPLIFY_XY,
    SIMPLIFY_Z,
    MIN_LENGTH,
)
"""How a raster becomes lines with heights."""

STEP = Number(
    "STEP",
    "Step of the track geometry [m]",
    "Distance between the stations along each track at which gauge, cant, twist, radius and gradient are given.",
    advanced=True,
    default=DEFAULT_STEP_M,
    low=0.1,
    high=MAX_LENGTH_M,
)

WORKERS = Number(
    "WORKERS",
    "Processes",
    "Processes that compute at a time, on squares of a large cloud or on its files; results do not depend on them. 0 "
    "starts one per core, as far as a quarter of the memory or 2 GB allow; 1 computes in QGIS itself.",
    advanced=True,
    default=DEFAULT_WORKERS,
    high=MAX_WORKERS,
    whole=True,
)
