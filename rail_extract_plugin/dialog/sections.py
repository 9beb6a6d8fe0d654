"""The sections of the advanced parameters in a dialog, in order."""

from __future__ import annotations

SECTIONS = {
    "Cloud": ("MERGE_CLASSES", "CLASSES", "CLASSES_OUT", "EXTENT", "MASK", "CRS", "LEAVE_OUT"),
    "Raw clouds": (
        *("METHOD", "WEIGHTS", "SEEDS", "SEED", "GUIDE", "GUIDE_DISTANCE", "ONLY_GUIDED", "KEEP_SINGLE", "RAIL_CLASS"),
        *("CONTENT", "RESET", "START", "MINUTES", "BOTH", "SEARCH", "THICKNESS", "WINDOW", "MIN_HEIGHT"),
        *("MAX_OUTLIERS", "MAX_LENGTH"),
    ),
    "Network": ("MODEL", "ITERATIONS", "ENGINE", "DEVICE"),
    "Lines": (
        *("SMOOTHING_XY", "SMOOTHING_Z", "TOLERANCE_XY", "TOLERANCE_Z", "CROWN_RADIUS", "MAX_GAP", "GAP_ANGLE"),
        *("SIMPLIFY_XY", "SIMPLIFY_Z", "MIN_LENGTH", "STRIPS"),
    ),
    "Tracks": (
        *("GAUGE", "HEAD_WIDTH", "OTHER_GAUGES", "CENTERLINE_TOLERANCE", "RAIL_HEIGHT", "REFERENCE_RAILS", "QUALITY"),
        *("RAILS", "REFERENCE_SIGMA", "INPUT_SIGMA", "REACH", "STEP", "TRANSITIONS", "ROUND", "FIXED"),
    ),
    "Clearance": ("PROFILE_FILE", "MARGIN", "WIDENING", "FLOOR", "TRAINS", "DISTANCE"),
    "Axis": ("AXIS", "START_KM", "POSTS", "POST_FIELD", "JUMPS", "DIRECTION", "FORMAT"),
    "Computer": ("WORKERS",),
    "Files of alignments": ("VERTICAL_CURVES", "EAST_FIRST"),
}
"""Parameters by section."""

OTHERS, RESULTS = "Others", "More results"
"""The last sections: of parameters that `SECTIONS` does not list, and of outputs."""


def section_of(parameter: str) -> str:
    """Return the section of a parameter."""
    return next((title for title, names in SECTIONS.items() if parameter in names), OTHERS)
