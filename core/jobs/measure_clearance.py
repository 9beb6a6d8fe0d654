"""Measure Clearance: sweeps a structure gauge along tracks through the raw cloud, and measures platforms and wires."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..clearance.profiles import COLUMNS, CUSTOM, NO_RULE, named
from ..errors import ParameterError, RailExtractError
from ..fields import INTRUSION_FIELDS, LENGTH
from ..progress import Recording
from . import inputs, methods, outputs
from .declaration import (
    CLOUD_NEEDS,
    CLOUD_WORDS,
    POINT,
    RAIL_WORDS,
    TABLE,
    TRACK_WORDS,
    Choice,
    Figure,
    LayerInput,
    LayerOutput,
    Number,
    Text,
)
from .values import Job, class_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np

    from ..clearance.measure import Clearance
    from ..kilometres.axes import PlacedAxes
    from ..progress import Progress
    from ..report.clearance_pictures import Slice
    from .result import Result
    from .values import Values

DEFAULT_PROFILE, WIDENINGS, TRAINS = "EBO_G1", ("NONE", "EBO"), ("MARK", "LEAVE_OUT")
DEFAULT_FLOOR_MM = 80.0
"""Heads, check rails and level crossings are lower: 80 mm over the rail tops the space for vehicles begins (EBO)."""

MAX_MARGIN_MM, FLOOR_MM, MAX_DISTANCE_M = 2000.0, (-200.0, 1000.0), 100.0
"""Values beyond are in another unit."""

READING = 0.05
"""Fraction of the progress bar at which the lines are read."""

HEIGHTS_OFF_M = 20.0
"""A cloud whose middle is further above or below the tracks has other heights: within ten metres of a track, its points
are on the ground or on what stands there."""


BED_SHARE = 0.01
"""Share of the points beside a track that are within a metre of its height, at least: its bed and its rails are."""


def _check(values: Values) -> None:
    """Check the profile, the classes, the lines and the axis."""
    from .clearance_inputs import read_profile

    profile = read_profile(values)
    if values["WIDENING"] == "EBO" and profile.rule == NO_RULE:
        raise ParameterError(f"PROFILE {profile.name} has no rule for curves: leave WIDENING at NONE, or use MARGIN.")
    _left_out(values)
    for name in ("INPUT", "RAILS"):
        if values.filled(name):
            values.source(name)
    if values.has_axis():
        values.axes(values.cloud_crs("POINTS"))


def _left_out(values: Values) -> tuple[int, ...]:
    """Return the classes that count nowhere."""
    text = (values["CLASSES_OUT"] or "").strip()
    return class_numbers(text, "CLASSES_OUT") if text else ()


def _run(values: Values, progress: Progress) -> Result:
    """Measure the clearance."""
    from ..clearance.measure import measure
    from ..clearance.settings import Settings
    from ..clearance.sweep import EVERY_CLASS
    from ..report.clearance import remarks, step_remarks
    from ..report.clearance_pictures import slices
    from .clearance_inputs import read_courses, read_profile, read_steps

    progress = Recording(progress)
    profile, request = read_profile(values), values.request(EVERY_CLASS, progress, name="POINTS")
    if profile.said:
        progress.warning(profile.said)
    if values.filled("PROFILE_FILE") and values["PROFILE"] != CUSTOM:
        progress.warning(f"PROFILE_FILE is not used: PROFILE is {profile.name}. Choose CUSTOM for your own profile.")
    courses = read_courses(values, request.zero, progress.span(0.0, READING))
    step_m, rule, distance_m, trains = (values[name] for name in ("STEP", "WIDENING", "DISTANCE", "TRAINS"))
    margin_m, floor_m = values["MARGIN"] / 1000, values["FLOOR"] / 1000
    settings = Settings(profile, margin_m, floor_m, step_m, rule, distance_m, _left_out(values), trains)
    with values.scratch() as folder, values.runner() as runner:
        found = measure(request, courses, settings, folder / "points", runner, progress.span(READING, 1.0))
        _check_cloud(found, progress)
        axes = values.axes(values.cloud_crs("POINTS")) if values.has_axis() else None
        found = found if axes is None else _placed(found, axes, progress)
        worst = tuple(slices(found))
    steps = read_steps(values, progress) if values.filled("QUALITY") else None
    for sentence in (*remarks(found), *step_remarks(found, steps or {})):
        progress.warning(sentence)
    return _result(replace(found, warnings=progress.warnings), worst, axes, _step_words(steps), values)


def _check_cloud(found: Clearance, progress: Progress) -> None:
    """Refuse a cloud of another place or with other heights, and say what is odd about its classes."""
    import numpy as np

    swept = found.swept
    if not found.point_count:
        raise RailExtractError("POINTS has no point beside a track: check the coordinate systems.")
    above_m = float(np.median([*swept.heights.elements()]))
    on_bed = sum(swept.heights[height] for height in (-1, 0, 1)) / sum(swept.heights.values())
    if abs(above_m) > HEIGHTS_OFF_M or (abs(above_m) > 1 and on_bed < BED_SHARE):
        where = "above" if above_m > 0 else "below"
        raise RailExtractError(
            f"The cloud lies {abs(above_m):.0f} m {where} the tracks: are these ellipsoidal against levelled "
            "heights? Give both in the same heights."
        )
    used = np.flatnonzero(swept.census)
    if len(used) == 1 and used[0] not in (0, 1):
        progress.warning(
            f"Every point is of class {used[0]}: take the raw cloud, which shows what is beside the rails."
        )
    unused = [str(code) for code in found.settings.left_out if not swept.census[code]]
    if unused:
        progress.warning(f"The cloud has no points of class {', '.join(unused)}, which CLASSES_OUT names.")


def _placed(found: Clearance, axes: PlacedAxes, progress: Progress) -> Clearance:
    """Return what was found with its kilometres."""
    import numpy as np

    def at(xyz: np.ndarray) -> np.ndarray:
        return found.frame.to_crs(xyz)[:, :2]

    km = axes.kilometres(at(np.reshape([one.xyz for one in found.intrusions], (-1, 3))), progress)
    intrusions = (replace(one, km=float(a), km_text=text) for one, a, text in zip(found.intrusions, km.km, km.km_text))
    stations = (replace(one, kilometres=axes.locate(at(one.xyz), progress)) for one in found.stations)
    return replace(found, intrusions=tuple(intrusions), stations=tuple(stations))


def _step_words(steps: Mapping[int, np.ndarray] | None) -> str:
    """Return in words how far strips are apart, given chainages and millimetres by track; None if that is not known."""
    if steps is None:
        return "unknown: QUALITY was not given"
    most_mm = max((float(own[:, 1].max()) for own in steps.values()), default=0.0)
    return f"up to {most_mm:.1f} mm" if steps else "none: no place is shown by several strips"


def _result(found: Clearance, worst: Sequence[Slice], axes: PlacedAxes | None, steps: str, values: Values) -> Result:
    """Return the result."""
    import numpy as np

    from ..files.clearance import clearance_makers
    from ..report.clearance import clearance_page, summary
    from .result import Result, ShownCloud, ShownProfile

    least_m = found.least_margin_m
    figures = {
        "INTRUSION_COUNT": len(found.sure),
        "LEAST_MARGIN": round(1000 * least_m, 1) + 0.0 if np.isfinite(least_m) else None,
        "PLATFORM_COUNT": len(found.platforms),
        "WIRE_LENGTH": LENGTH.value(sum(one.length_m for one in found.wires)),
        "POINT_COUNT": found.point_count,
    }
    source = values.cloud("POINTS").paths[0].resolve().name
    profile, margin_m = found.settings.profile, found.settings.margin_m
    spacing_m = {one.track_id: float(np.median(one.spacing_m)) for one in found.courses}
    return Result(
        figures,
        found.frame,
        clearance_makers(found, axes),
        {
            "REPORT": lambda: clearance_page(
                found, worst, source, {"Steps between strips": steps, "Command": values.command}
            )
        },
        tuple(summary(found)),
        ShownCloud("POINTS", tuple(range(256)), 0.07, ShownProfile(profile.name, profile.points, margin_m, spacing_m)),
        found=found,
    )


JOB = Job(
    "measureclearance",
    "Measure clearance",
    "Sweeps a structure gauge along tracks through the cloud: what stands inside, by how much, where, and how surely.",
    "Takes the lines of Extract Rails and the raw cloud. Each object inside the profile becomes one point with its "
    "depth, standard error, place, height and class. Stations state the margins left and right, the distance of the "
    "neighbour tracks, platform edges and the contact wire.\n\n"
    "Profiles are swept in the plane of both rail tops, so that cant and curves count; give Rails for the cant. Only "
    "profiles with a public source ship by name. Others are read from a file: EN 15273 and company rules are sold, or "
    "forbid copies.\n\n"
    "This is a screening and no proof of conformity: steps between the strips of a survey, often 5 to 20 mm, are not "
    "in the standard errors.",
    (
        *(*RAIL_WORDS, *CLOUD_WORDS, *TRACK_WORDS, "clearance", "structure gauge", "loading gauge", "profile"),
        *("platform", "contact wire", "catenary", "tunnel", "Lichtraum", "Lichtraumprofil", "gabarit", "gálibo"),
    ),
    CLOUD_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Track centerlines",
            "3D lines of Extract Rails or Build Track Centerlines, with track_id, left_ids and right_ids.",
            transformed=True,
        ),
        replace(
            inputs.CLOUD,
            name="POINTS",
            help=f"The raw cloud: every class is read, withheld points are not. {inputs.CLOUD.help}",
        ),
        LayerInput(
            "RAILS",
            "Rails",
            "3D lines of the rails of the same run, which give the cant. Without them, what stands beside canted track "
            "is not judged surely.",
            optional=True,
            transformed=True,
        ),
        LayerInput(
            "QUALITY",
            "Track geometry",
            "Points of Extract Rails or Measure Track Geometry for these tracks: the report states how far the strips "
            "of the survey are apart.",
            advanced=True,
            optional=True,
            transformed=True,
            kinds=(POINT,),
        ),
        Choice(
            "PROFILE",
            "Profile",
            "Outline that is swept along the tracks. CUSTOM takes it from PROFILE_FILE.",
            options=(*named(), CUSTOM),
            default=DEFAULT_PROFILE,
        ),
        LayerInput(
            "PROFILE_FILE",
            "Profile from a file",
            f"CSV file with the columns {' and '.join(COLUMNS)}, or a layer with one line or polygon, x being v and y "
            "being w, in metres: to the left of the middle of the track, and above the rail tops. With v >= 0 only, a "
            "half from its foot to its top.",
            advanced=True,
            optional=True,
            transformed=True,
            kinds=(TABLE,),
        ),
        Number(
            "MARGIN",
            "Margin [mm]",
            "The profile grows by this all round, but not downwards.",
            advanced=True,
            default=0.0,
            high=MAX_MARGIN_MM,
        ),
        Choice(
            "WIDENING",
            "Widening in curves",
            "EBO widens the profile by the measured curvature and gauge, as the German regulations ask.",
            advanced=True,
            options=WIDENINGS,
            default=WIDENINGS[0],
        ),
        Number(
            "FLOOR",
            "Lowest height [mm]",
            "Points lower over the rail tops are left out: rails, bed, level crossings.",
            advanced=True,
            default=DEFAULT_FLOOR_MM,
            low=FLOOR_MM[0],
            high=FLOOR_MM[1],
        ),
        Text(
            "CLASSES_OUT",
            "Classes to leave out",
            "Classes that count nowhere, such as 3,4,5 for vegetation.",
            advanced=True,
            optional=True,
        ),
        Choice(
            "TRAINS",
            "Vehicles on tracks",
            "MARK names trains that stand on tracks and does not count them; LEAVE_OUT omits them.",
            advanced=True,
            options=TRAINS,
            default=TRAINS[0],
        ),
        Number(
            "DISTANCE",
            "Least distance between tracks [m]",
            "Tracks nearer to each other are listed. Empty: 4.00 m for EBO profiles, else nothing is judged.",
            advanced=True,
            optional=True,
            high=MAX_DISTANCE_M,
        ),
        replace(
            methods.STEP,
            label="Step of the stations [m]",
            help="Distance between the stations along each track at which margins are given.",
            high=100.0,
        ),
        *inputs.AREA,
        methods.WORKERS,
        *inputs.axis(optional=True),
    ),
    (
        LayerOutput(
            "INTRUSIONS",
            "Intrusions",
            "A point for each object inside the profile, at its worst place, the deepest sure one first.",
            kind=POINT,
        ),
        LayerOutput(
            "OUTPUT",
            "Clearance",
            "Points along each track with margins, distances of what stands beside, neighbour tracks, platforms, wire.",
            advanced=True,
            optional=True,
            kind=POINT,
        ),
        LayerOutput(
            "PLATFORMS",
            "Platforms",
            "Lines along platform edges, with offset and height.",
            advanced=True,
            optional=True,
        ),
        LayerOutput(
            "WIRES",
            "Contact wires",
            "Lines along contact wires, with height and stagger.",
            advanced=True,
            optional=True,
        ),
        replace(outputs.REPORT, help="A web page with a verdict, diagrams, the worst cross-sections and tables."),
    ),
    (
        Figure("INTRUSION_COUNT", "Number of objects surely inside"),
        Figure("LEAST_MARGIN", "Least margin, negative inside [mm]"),
        Figure("PLATFORM_COUNT", "Number of platform edges"),
        Figure("WIRE_LENGTH", "Length of the contact wires [m]"),
        Figure("POINT_COUNT", "Points within reach"),
    ),
    fields=INTRUSION_FIELDS,
    picture="gauge.svg",
    guide="clearance",
    pages=("clearance", "reference"),
    call="clearance",
    resumes=True,
    check=_check,
    run=_run,
)
