"""Extract Rails: the whole way from a classified cloud to 3D rails and track centerlines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..errors import ParameterError
from ..frpdf.models import choose as choose_model
from ..parameters import LEARNED, STRIPS, Parameters
from ..progress import Estimating, Progress
from ..standards import DEFAULT, SEARCHED_CLASSES
from . import inputs, methods, outputs
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, TRACK_WORDS, Choice, Flag, RasterOutput
from .result import Result, ShownCloud
from .values import Job, Values

if TYPE_CHECKING:
    from ..clouds.points import Request
    from ..pipeline.sources import Source
    from ..rails import RailNetwork
    from ..report import Origin
    from ..standards import RailStandard
    from .result import Rasters

MEASURED = ("QUALITY", "FINDINGS", "REPORT")
"""Outputs for which the geometry of tracks is measured."""


def _check(values: Values) -> None:
    """Check all values, as far as no points are needed."""
    names = [output.name for output in values.job.outputs]
    if not values.keeps and not any(map(values.wanted, names)):
        raise ParameterError(f"No output is chosen: name at least one of {', '.join(names)}.")
    classify, grow = values["CLASSIFY"], values.filled("SEEDS")
    if classify and grow:
        raise ParameterError("CLASSIFY finds all rails, and SEEDS those that are pointed at: choose one of them.")
    if grow and values.detects():
        raise ParameterError("STANDARD DETECT measures classified points, which SEEDS do not need: choose another.")
    if values["METHOD"] == LEARNED and not classify:
        raise ParameterError("METHOD LEARNED is for raw clouds: set CLASSIFY, or set METHOD to GEOMETRY.")
    values.weights()
    values.engine()
    _class_codes(values)
    standard = values.standard(DEFAULT if values.detects() else None)
    choose_model(standard.gauge_m, standard.head_width_m, values["MODEL"])
    values.settings(standard, values.other_gauges(standard))
    if grow:
        values.seeds(values.cloud_crs())
    if values.has_axis():
        if not _measures(values):
            raise ParameterError("AXIS gives QUALITY, FINDINGS and REPORT kilometres: name at least one of these.")
        values.axes(values.cloud_crs())


def _measures(values: Values) -> bool:
    """Return whether the geometry of tracks is measured."""
    return values.keeps or any(map(values.wanted, MEASURED))


def _class_codes(values: Values) -> tuple[int, ...]:
    """Return the classes to read: all in which the rails of a raw cloud may be, or those of rails."""
    return SEARCHED_CLASSES if values["CLASSIFY"] or values.filled("SEEDS") else values.class_codes()


def _detected(values: Values, request: Request, progress: Progress) -> RailStandard:
    """Return the rail standard, if need be the one that fits the points."""
    from ..checks.standard import detect_in_raw, detect_standard

    if not values.detects():
        return values.standard()
    progress.status("Measuring gauge and railheads")
    detect = detect_in_raw if values["CLASSIFY"] else detect_standard
    standard = values.standard(detect(request, progress.span(0, 0)).name)
    choose_model(standard.gauge_m, standard.head_width_m, values["MODEL"])
    return standard


def _source(values: Values, request: Request) -> Source:
    """Return where the rail points come from."""
    from ..pipeline.sources import Classified, Grown, Raw

    if values["CLASSIFY"]:
        weights = values.weights()
        return Raw(request, weights and weights.resolve())
    if values.filled("SEEDS"):
        return Grown(request, values.seeds(values.cloud_crs()))
    return Classified(replace(request, merged=values["MERGE_CLASSES"]))


def _run(values: Values, progress: Progress) -> Result:
    """Extract the rails and tracks."""
    from ..pipeline import extract_files
    from ..report import Origin

    progress = Estimating(progress)
    with values.scratch() as folder, values.runner() as runner:
        request = values.request(_class_codes(values), progress, runner.failures if runner.tolerant else None)
        standard = _detected(values, request, progress)
        other_gauges = values.other_gauges(standard)
        settings = replace(
            values.settings(standard, other_gauges),
            quality_step_m=values["STEP"] if _measures(values) else None,
            keep_cleaned=values.wanted("CLEANED"),
        )
        network = extract_files(_source(values, request), folder, settings, runner, progress)
    progress.check()
    if values.has_axis():
        geometry = values.axes(values.cloud_crs()).along(network.geometry, network.frame, progress)
        network = replace(network, geometry=geometry)
    for failure in network.failures:
        progress.warning(failure)
    return _result(values, network, Origin(values.cloud().paths, standard, other_gauges, values.command, settings))


def _result(values: Values, network: RailNetwork, origin: Origin) -> Result:
    """Return what was extracted as a result."""
    from ..checks.findings import summary
    from ..files.layers import network_makers

    figures: dict[str, Any] = {
        **outputs.figures_of(network.rails, "RAIL"),
        **outputs.figures_of(network.centerlines, "CENTERLINE"),
        **(outputs.figures_of_stations(network.geometry) if _measures(values) else {}),
        "ENGINE_USED": network.engine,
    }
    return Result(
        figures,
        network.frame,
        {name.upper(): make for name, make in network_makers(network, origin.gauges_m).items()},
        {"REPORT": lambda: origin.report(network)},
        summary(network, origin.gauges_m),
        ShownCloud("INPUT", _class_codes(values), origin.standard.head_width_m),
        {"CLEANED": lambda: _cleaned(values, network, origin.standard)},
        network,
    )


def _cleaned(values: Values, network: RailNetwork, standard: RailStandard) -> Rasters | None:
    """Return the network's output as Clean Rail Raster writes it; None if no rail cell is left."""
    from ..files.rail_rasters import header_for, on_one_grid

    if not any(raster.tiles for raster in network.cleaned):
        return None
    rasters, frame = on_one_grid(network.cleaned, network.frame)
    extent, model = values.extent(network.frame.crs_wkt), values["MODEL"]
    return header_for(rasters, network.cleaned_classes, frame, standard, extent, model), rasters


JOB = Job(
    "extractrails",
    "Extract rails",
    "Turns lidar points classified as rail into the 3D lines of the railheads and of the track centerlines.",
    "Choose the cloud and press Run; everything else has a default. If nobody has classified the cloud, tick the "
    "box that finds the rail points. The coordinate system must be a projected one.\n\n"
    "A rail line follows the top of the railhead on the axis of the head. Gauge is the distance between the two rail "
    "lines minus the railhead width; it is not measured 14 mm below the top. Cant is left minus right, as seen along "
    "the line.\n\n"
    "The report says where the lines are good and where not. Findings are the places to look at.",
    (*RAIL_WORDS, *CLOUD_WORDS, *TRACK_WORDS, "centerline", "centreline", "axis", "vectorize", "line", "3d"),
    (*CLOUD_NEEDS, ("cv2", "torch")),
    (
        inputs.CLOUD,
        inputs.RAIL_CLASSES,
        Flag(
            "MERGE_CLASSES",
            "Take all rail classes for one",
            "For tracks whose rails, or parts of rails, are of different classes. The results have the first class.",
            advanced=True,
            default=False,
        ),
        Flag(
            "CLASSIFY",
            "Find the rail points of a raw cloud",
            "For clouds that nobody has classified: finds the rail points first, as Classify Rail Points does. The "
            "rail classes are ignored.",
            default=False,
        ),
        *methods.METHOD,
        replace(
            inputs.SEEDS,
            label="Seeds in a raw cloud",
            help="Points on railheads, or lines along them: only the rails that grow from these are extracted, as Grow "
            "Rail Points from Seeds follows them. The rail classes are ignored.",
            advanced=True,
        ),
        inputs.DETECTED_STANDARD,
        inputs.GAUGE,
        inputs.HEAD_WIDTH,
        *inputs.AREA,
        replace(methods.MODEL, advanced=True),
        *methods.CLEANUP,
        *methods.LINES,
        *methods.PAIRING,
        Choice(
            "STRIPS",
            "Strips of the scanner",
            "What happens where passes of the scanner differ. AS_THEY_ARE uses their points together and states the "
            "difference in strip_mm and sigma_mm. ALIGNED moves each pass onto the mean of all that show the same "
            "rail, which removes steps. Passes are told apart by the source ids and GPS times of the points.",
            advanced=True,
            options=STRIPS,
            default=Parameters.strips,
        ),
        methods.STEP,
        methods.WORKERS,
        *inputs.axis(optional=True),
    ),
    (
        outputs.RAILS_OUTPUT,
        replace(outputs.CENTERLINES_OUTPUT, advanced=True),
        replace(outputs.QUALITY_OUTPUT, advanced=True, on_demand=True),
        outputs.FINDINGS_OUTPUT,
        RasterOutput(
            "CLEANED",
            "Cleaned rail raster",
            "The raster after the network, as from Clean Rail Raster.",
            advanced=True,
            optional=True,
            on_demand=True,
        ),
        outputs.REPORT,
    ),
    (*outputs.RAIL_FIGURES, *outputs.CENTERLINE_FIGURES, *outputs.QUALITY_FIGURES, outputs.ENGINE_USED),
    picture="gauge.svg",
    pages=("parameters", "tutorial", "limits", "troubleshooting"),
    call="extract",
    resumes=True,
    check=_check,
    run=_run,
)
