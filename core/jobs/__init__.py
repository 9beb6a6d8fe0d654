"""The jobs: what the toolbox, the command line and Python can do, one module each."""

from __future__ import annotations

from . import (
    airborne_centerlines,
    build_track_centerlines,
    classify_rail_points,
    compare_tracks,
    export_alignment,
    extract_rails,
    fit_alignment,
    frpdf_cleanup,
    grow_rail_points,
    import_alignment,
    measure_clearance,
    measure_track_geometry,
    rasterize_rail_points,
    station_along_axis,
    train_rail_classifier,
    vectorize_rails,
)

JOBS = tuple(
    module.JOB
    for module in (
        extract_rails,
        classify_rail_points,
        grow_rail_points,
        airborne_centerlines,
        rasterize_rail_points,
        frpdf_cleanup,
        vectorize_rails,
        build_track_centerlines,
        measure_track_geometry,
        measure_clearance,
        station_along_axis,
        fit_alignment,
        compare_tracks,
        export_alignment,
        import_alignment,
        train_rail_classifier,
    )
)
"""The whole extraction first, then its steps in order."""

CALLS = {job.call: job for job in JOBS}
"""The jobs of the command line and of Python, by their name."""
