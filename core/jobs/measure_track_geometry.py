"""Measure Track Geometry: gauge, cant, twist, radius and gradient by chainage, with their accuracy and support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..fields import QUALITY_FIELDS
from ..parameters import Parameters
from ..progress import Progress, Recording
from ..standards import CUSTOM, RailStandard, resolve
from . import inputs, methods, outputs
from .declaration import CLOUD_NEEDS, RAIL_WORDS, TRACK_WORDS, LayerInput
from .result import Result, ShownCloud
from .values import Job, Values

if TYPE_CHECKING:
    from ..rails import TrackGeometry


def _check(values: Values) -> None:
    """Check the rail, the gauges and the axis."""
    values.head_width_m()
    standard = _stated(values)
    if standard is not None:
        values.other_gauges(standard)
    if values.has_axis():
        values.axes(values.system("INPUT"))


def _stated(values: Values) -> RailStandard | None:
    """Return the standard; None if no gauge is stated."""
    if values["GAUGE"] is None and values["STANDARD"] == CUSTOM:
        return None
    return resolve(values["STANDARD"], values["GAUGE"], values["HEAD_WIDTH"])


def _run(values: Values, progress: Progress) -> Result:
    """Measure each track."""
    from ..checks.findings import summary
    from ..files.layers import network_makers
    from ..rails import RailNetwork
    from ..report import Origin
    from ..squares.remeasuring import measure_rails
    from ..tracks.geometry import measure_track_geometry
    from ..tracks.parallels import widths_by_gauge
    from .track_inputs import check_gauges, read_inputs, with_measured_gauge

    progress, standard, head_width_m = Recording(progress), _stated(values), values.head_width_m()
    other_gauges = values.other_gauges(standard) if standard else ()
    gauges = ((standard.gauge_m if standard else 0.0, head_width_m), *other_gauges)
    with values.scratch() as folder, values.runner() as runner:
        reading, rest = progress.after_reading()
        measuring, share = rest.split(2)
        tracks = read_inputs(values, folder, reading)
        heads_m = widths_by_gauge(tracks.rails, gauges, Parameters.centerline_tolerance_m)
        rails = measure_rails(tracks.rails, tracks.clouds, heads_m, runner, measuring)
    step_m, frame = values["STEP"], tracks.frame
    measured = measure_track_geometry(tracks.centerlines, rails, head_width_m, step_m, share, gauges)
    check_gauges(tracks, measured, progress)
    progress.check()
    if values.has_axis():
        measured = values.axes(values.system("INPUT")).along(measured, frame, progress)
    centerlines = with_measured_gauge(tracks.centerlines, measured)
    network = RailNetwork(tuple(rails), centerlines, frame, geometry=measured, warnings=progress.warnings)
    with_points = values.filled("POINTS")
    paths = values.cloud("POINTS").paths if with_points else (Path(values.title("INPUT")),)
    origin = Origin(paths, standard or _own_standard(measured, head_width_m), other_gauges, values.command)
    made, codes = network_makers(network, origin.gauges_m), tuple(cloud.class_code for cloud in tracks.clouds)
    return Result(
        outputs.figures_of_stations(measured),
        frame,
        {"OUTPUT": made["quality"], "FINDINGS": made["findings"]},
        {"REPORT": lambda: origin.report(network)},
        tuple(summary(network, origin.gauges_m)),
        ShownCloud("POINTS", codes, head_width_m) if with_points else None,
    )


def _own_standard(measured: Sequence[TrackGeometry], head_width_m: float) -> RailStandard:
    """Return a standard with the median gauge of the tracks where no gauge is stated."""
    import numpy as np

    gauge_mm = round(float(np.nanmedian(np.concatenate([track.gauge_mm for track in measured]))))
    label = f"{1000 * head_width_m:g} mm head, {gauge_mm} mm as measured"
    return RailStandard(CUSTOM, label, gauge_mm / 1000, head_width_m)


JOB = Job(
    "measuretrackgeometry",
    "Measure track geometry",
    "Measures gauge, cant, twist, radius and gradient along tracks, and their support by points.",
    "Takes the lines of Extract Rails, or lines drawn by hand, and returns points along each centerline.\n\n"
    "With a point cloud, heights are measured again and smoothed over 1 m only, and sigma_mm, points and "
    "bridged apply to each station. Without one, the heights are those of the rails, each rail's sigma_mm and "
    "points are taken as uniform along it, and bridged is 1 where a rail is missing or its field gaps names "
    "the place.\n\n"
    "The findings and the report compare the gauge with that of the standard, with Gauge and with Other "
    "gauges, whichever is nearest.\n\n"
    "With an axis, points, findings and report have kilometres as well.",
    (*RAIL_WORDS, *TRACK_WORDS, "twist", "radius", "curvature", "gradient", "quality", "chainage"),
    CLOUD_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Track centerlines",
            "Lines midway between rails, from Build Track Centerlines or drawn by hand. Chainage is measured along "
            "them.",
        ),
        LayerInput(
            "RAILS",
            "Rails",
            "The rails of these tracks: those named in left_ids and right_ids, otherwise the nearest.",
        ),
        replace(
            inputs.CLOUD,
            name="POINTS",
            help="The cloud from which the rails were extracted: it gives heights, sigma_mm and points for each "
            "station.",
            optional=True,
        ),
        methods.STEP,
        replace(
            inputs.STANDARD,
            help="Rail profile, which gives the railhead width, and the gauge that findings compare with.",
        ),
        replace(inputs.GAUGE, help="Gauge that findings compare with, instead of that of the standard."),
        inputs.HEAD_WIDTH,
        methods.OTHER_GAUGES,
        inputs.LEFT_OUT,
        methods.WORKERS,
        *inputs.axis(optional=True),
    ),
    (
        replace(outputs.QUALITY_OUTPUT, name="OUTPUT"),
        replace(outputs.FINDINGS_OUTPUT, on_demand=True),
        outputs.REPORT,
    ),
    outputs.QUALITY_FIGURES,
    fields=QUALITY_FIELDS,
    picture="gauge.svg",
    pages=("parameters", "reference"),
    call="measure_track_geometry",
    check=_check,
    run=_run,
)
