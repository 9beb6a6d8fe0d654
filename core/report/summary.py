"""The verdict in two lines, for the log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..progress import counted
from ..rails import RailNetwork
from .findings import examine
from .listing import listed
from .markup import metres
from .verdict import verdict


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


def _rms(values: np.ndarray) -> float:
    """Return the root mean square, which the output SIGMA states."""
    return float(np.sqrt(np.mean(values**2)))
