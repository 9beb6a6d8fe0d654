"""The verdict on the tracks that were found, in words."""

from __future__ import annotations

import numpy as np

from .findings import FEW, MANY, SILENT_SHARE, UNSURE, UNSURE_MM, Findings

VERDICTS = (
    (0.0, "good", "Good throughout: every metre is supported by points, at gauge, with a small standard error."),
    (FEW, "good", "Good, except for a few places to look at."),
    (MANY, "fair", "Usable, but look at the findings before you rely on the lines."),
    (np.inf, "poor", "Poor: large parts are in doubt. Check rail points, gauge, railhead width and the cloud's density."),
)
"""Share of the length in doubt up to which a verdict applies, CSS class of the verdict, and its words."""


def verdict(findings: Findings) -> tuple[str, str]:
    """Return the CSS class and the words of the verdict on tracks that were found."""
    # What no station shows is a reason to look, not to discard: conductor rails are lone lines, too.
    silent = min(findings.silent_share, MANY) if findings.silent_share > SILENT_SHARE else 0.0
    share = max(findings.share, silent)
    unsure = findings.length_of(UNSURE) / findings.length_m if findings.tracks else 0.0
    if share > MANY >= max(share - unsure, silent):
        # Points at gauge whose cloud resolves no more: nothing is wrong that a setting could mend.
        return "fair", (
            f"Less accurate than a track survey accepts: the standard error is above {UNSURE_MM:g} mm across "
            f"or in height on {100 * unsure:.0f} % of the length."
        )
    return next((kind, words) for limit, kind, words in VERDICTS if share <= limit)
