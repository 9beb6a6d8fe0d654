"""The algorithms of the toolbox, one module each."""

from __future__ import annotations

from ...core.jobs import (
    airborne_centerlines,
    classify_rail_points,
    compare_tracks,
    export_alignment,
    fit_alignment,
    grow_rail_points,
    import_alignment,
    train_rail_classifier,
)
from ...core.jobs.declaration import Job
from .base import JobAlgorithm, RailAlgorithm
from .build_track_centerlines import BuildTrackCenterlines
from .check_installation import CheckInstallation
from .extract_rails import ExtractRails
from .frpdf_cleanup import FrpdfCleanup
from .install_packages import InstallPackages
from .measure_track_geometry import MeasureTrackGeometry
from .rasterize_rail_points import RasterizeRailPoints
from .station_along_axis import StationAlongAxis
from .vectorize_rails import VectorizeRails


def _of(job: Job) -> type[RailAlgorithm]:
    """Return the algorithm of a job."""
    return type(job.name, (JobAlgorithm,), {"JOB": job, "__doc__": job.summary})


ALGORITHMS = (
    ExtractRails,
    _of(classify_rail_points.JOB),
    _of(grow_rail_points.JOB),
    _of(airborne_centerlines.JOB),
    RasterizeRailPoints,
    FrpdfCleanup,
    VectorizeRails,
    BuildTrackCenterlines,
    MeasureTrackGeometry,
    StationAlongAxis,
    _of(fit_alignment.JOB),
    _of(compare_tracks.JOB),
    _of(export_alignment.JOB),
    _of(import_alignment.JOB),
    _of(train_rail_classifier.JOB),
    InstallPackages,
    CheckInstallation,
)
"""The whole extraction first, then its steps in order, then the setup."""
