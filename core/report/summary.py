"""The verdict on the tracks that were found, in words, and the figures that it is based on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..progress import counted
from ..rails import RailNetwork
from .findings import FEW, MANY, SILENT_SHARE, UNSURE, UNSURE_MM, Findings, examine
from .listing import listed
from .markup import metres

VERDICTS = (
    (0.0, "good", "Good throughout: every metre is supported by points, at gauge, with a small standard error."),
    (FEW, "good", "Good, except for a few places to look at."),
    (MANY, "fair", "Usable, but look at the findings before you rely on the lines."),
    (np.inf, "poor", "Poor: large parts are in doubt. Check rail points, gauge, railhead width and point density."),
)
"""Share of the length in doubt up to which a verdict applies, CSS class of the verdict, and its words."""


def summary(network: RailNetwork, gauges_m: Sequence[float]) -> tuple[str, str]:
    """Return the verdict in words, and the figures that it is based on.

    Parameters
    ----------
    network : RailNetwork
        The verdict needs the geometry of its tracks.
    gauges_m : sequence of float
        Gauges that tracks may have.
    """
    rails, tracks = (
        f"{counted(len(lines), what)} ({metres(sum(line.length_m for line in lines))})"
        for what, lines in (("rail", network.rails), ("track", network.centerlines))
    )
    figures = f"{rails}, {tracks}"
    if not network.centerlines:
        return "No track was found.", f"{figures}."
    if not network.geometry:
        return "No verdict: choose the output REPORT or FINDINGS for one.", f"{figures}."
    findings = examine(network, gauges_m)
    sigma = np.concatenate([track.sigma_mm for track in network.geometry])
    known = sigma[np.isfinite(sigma)]
    error = f"{np.median(known):.1f} mm (median), {_rms(known):.1f} mm (rms)" if len(known) else "unknown"
    _, words = verdict(findings)
    return words, (
        f"{figures}: standard error {error}, {100 * findings.share:.1f} % of the tracks in doubt, "
        f"{counted(len(listed(findings)), 'finding')}."
    )


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


def _rms(values: np.ndarray) -> float:
    """Return the root mean square, which the output SIGMA states."""
    return float(np.sqrt(np.mean(values**2)))
