"""Build Track Centerlines: pairs rails to tracks and draws the line midway between the two rails of each track."""

from __future__ import annotations

from dataclasses import replace

from . import shared
from .declaration import LINE_NEEDS, RAIL_WORDS, STEPS, TRACK_WORDS, Job, LayerInput

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
        *shared.RAIL,
        *shared.PAIRING,
        shared.MAX_GAP,
        shared.SMOOTHING_XY,
        shared.SIMPLIFY_XY,
        shared.SIMPLIFY_Z,
        shared.MIN_LENGTH,
    ),
    (
        replace(shared.CENTERLINES_OUTPUT, name="OUTPUT", optional=False),
        replace(shared.RAILS_OUTPUT, on_demand=True),
    ),
    shared.CENTERLINE_FIGURES,
    STEPS,
    picture="gauge.svg",
)
