"""The algorithms of the toolbox, one module each."""

from .airborne_centerlines import AirborneCenterlines
from .build_track_centerlines import BuildTrackCenterlines
from .check_installation import CheckInstallation
from .classify_rail_points import ClassifyRailPoints
from .compare_tracks import CompareTracks
from .export_alignment import ExportAlignment
from .extract_rails import ExtractRails
from .fit_alignment import FitAlignment
from .frpdf_cleanup import FrpdfCleanup
from .grow_rail_points import GrowRailPoints
from .import_alignment import ImportAlignment
from .install_packages import InstallPackages
from .measure_track_geometry import MeasureTrackGeometry
from .rasterize_rail_points import RasterizeRailPoints
from .station_along_axis import StationAlongAxis
from .train_rail_classifier import TrainRailClassifier
from .vectorize_rails import VectorizeRails

ALGORITHMS = (
    ExtractRails,
    ClassifyRailPoints,
    GrowRailPoints,
    AirborneCenterlines,
    RasterizeRailPoints,
    FrpdfCleanup,
    VectorizeRails,
    BuildTrackCenterlines,
    MeasureTrackGeometry,
    StationAlongAxis,
    FitAlignment,
    CompareTracks,
    ExportAlignment,
    ImportAlignment,
    TrainRailClassifier,
    InstallPackages,
    CheckInstallation,
)
"""The whole extraction first, then its steps in order, then the setup."""
