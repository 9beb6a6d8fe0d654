"""Build Track Centerlines: pairs rails to tracks and draws the line midway between the two rails of each track."""

from __future__ import annotations

from dataclasses import replace

from ..fields import CENTERLINES, RAILS
from ..progress import Progress
from . import inputs, methods, outputs
from .declaration import LINE_NEEDS, RAIL_WORDS, STEPS, TRACK_WORDS, LayerInput
from .result import Result
from .values import Job, Values


def _check(values: Values) -> None:
    """Check the rail and the gauges."""
    values.other_gauges(values.standard())


def _run(values: Values, progress: Progress) -> Result:
    """Pair the rails of each class."""
    from ..checks.warnings import with_tracks
    from ..files.layers import lines_layer
    from ..tracks.centerlines import tracks_of

    reading, pairing = progress.after_reading()
    lines, standard = values.lines("INPUT", reading), values.standard()
    rails = lines.rails(progress)
    tracks = tracks_of(rails, values.settings(standard, values.other_gauges(standard)), pairing)
    progress.check()
    layers = {
        "OUTPUT": lambda: lines_layer(CENTERLINES, tracks),
        "RAILS": lambda: lines_layer(RAILS, with_tracks(rails, tracks, progress)),
    }
    return Result(outputs.figures_of(tracks, "CENTERLINE"), lines.frame, layers)


JOB = Job(
    "buildtrackcenterlines",
    "Build track centerlines",
    "Pairs rails that are one gauge apart and draws the line midway between the two rails of each track.",
    "Takes the lines of Vectorize Rails, or rails drawn by hand: lines in any direction, also curved and "
    "multi-part ones. The fields rail_id and class_code are used if they exist. Both rails of a track have the "
    "same class.\n\n"
    "For mixed and dual gauge, fill in Other gauges: on track with three rails, the common rail belongs to both "
    "tracks. Lines without heights give centerlines without heights.\n\n"
    "RAILS, if asked for, has the rails again, with the tracks of each in track_ids. Lone lines that are too high "
    "or too low for a rail, compared with the tracks alongside, are left out of it.",
    (*RAIL_WORDS, *TRACK_WORDS, "centerline", "centreline", "axis"),
    LINE_NEEDS,
    (
        LayerInput("INPUT", "Rails", "Lines of railheads, from Vectorize Rails or drawn by hand."),
        *inputs.RAIL,
        *methods.PAIRING,
        methods.MAX_GAP,
        methods.SMOOTHING_XY,
        methods.SIMPLIFY_XY,
        methods.SIMPLIFY_Z,
        methods.MIN_LENGTH,
    ),
    (
        replace(outputs.CENTERLINES_OUTPUT, name="OUTPUT", optional=False),
        replace(outputs.RAILS_OUTPUT, on_demand=True),
    ),
    outputs.CENTERLINE_FIGURES,
    STEPS,
    picture="gauge.svg",
    call="build_track_centerlines",
    check=_check,
    run=_run,
)
