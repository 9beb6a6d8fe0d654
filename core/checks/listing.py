"""The list of findings, the most harmful first, and the verdict on the tracks that were found, in words.

The list is the table of the report and the layer FINDINGS.
See docs/method.md section 9.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..progress import counted, metres
from ..rails import RailLine, RailNetwork, TrackGeometry
from .doubts import ARM_M
from .findings import (
    DOUBTS,
    FEW,
    MANY,
    OFF_GAUGE,
    SILENT_SHARE,
    UNSUPPORTED,
    UNSURE,
    UNSURE_MM,
    DoubtfulPlace,
    Findings,
    Hole,
    TrackFindings,
    examine,
    known,
    median,
    rms,
)

OFF_RAIL_MM = 70.0
"""Possible error where a line is missing, or belongs to no track: a line off by the width of a railhead is off its
rail, and being further off makes it no worse."""

STEP = "the track steps {:.0f} mm to the side"

LONE_RAIL, HOLE = "a rail belongs to no track", "no rails were found between tracks {} and {}, which are likely one"

VERDICTS = (
    (0.0, "good", "Good throughout: every metre is supported by points, at gauge, with a small standard error."),
    (FEW, "good", "Good, except for a few places to look at."),
    (MANY, "fair", "Usable, but look at the findings before you rely on the lines."),
    (np.inf, "poor", "Poor: large parts are in doubt. Check rail points, gauge, railhead width and point density."),
)
"""Share of the length in doubt up to which a verdict applies, CSS class of the verdict, and its words."""


@dataclass(frozen=True)
class Finding:
    """A place to look at.

    Attributes
    ----------
    xyz : (n, 3) array
        The section in local metres.
    harm : float
        Possible error times length, mm m.
    doubt_m : float
        Length in doubt within the section.
    finding : int
        Number, from 1 for the finding with the largest harm.
    track_id, rail_id : int or None
        Track, or lone rail.
    from_m, to_m : float
        Chainages along the track or the lone rail; NaN for a section between tracks.
    worst_m : float
        Chainage of the largest possible error.
    gauge_mm, cant_mm, sigma_mm, sigmaz_mm : float
        Gauge, cant and standard errors there.
    points : int or None
        Points on both rails, or on the lone rail.
    review : str
        For the user's decision.
    km, km_text : float, str or None
        Kilometre of the worst place; NaN and None without an axis.
    """

    reason: str
    xyz: np.ndarray
    harm: float
    doubt_m: float
    finding: int = 0
    track_id: int | None = None
    rail_id: int | None = None
    from_m: float = np.nan
    to_m: float = np.nan
    worst_m: float = np.nan
    gauge_mm: float = np.nan
    cant_mm: float = np.nan
    sigma_mm: float = np.nan
    sigmaz_mm: float = np.nan
    points: int | None = None
    review: str = ""
    km: float = np.nan
    km_text: str | None = None


def list_findings(network: RailNetwork, gauges_m: Sequence[float]) -> tuple[Finding, ...]:
    """Return all places of a network to look at, in order of decreasing harm; see `findings.examine`."""
    return listed(examine(network, gauges_m))


def listed(findings: Findings) -> tuple[Finding, ...]:
    """Return the places that an examination found, in order of decreasing harm."""
    found = [*_of_tracks(findings), *map(_of_hole, findings.holes), *map(_of_lone_rail, findings.lonely)]
    found.sort(key=lambda one: -one.harm)
    return tuple(replace(one, finding=number) for number, one in enumerate(found, start=1))


def _of_tracks(findings: Findings) -> Iterator[Finding]:
    for track in findings.tracks:
        error_mm = _possible_error(track)
        for doubt in DOUBTS:
            for place in track.places(doubt):
                yield _of_place(track, place, error_mm)
        for at_m, size_m in track.steps:
            yield _of_step(track, at_m, 1000 * abs(size_m))


def _possible_error(track: TrackFindings) -> np.ndarray:
    """Return the possible error at the stations, (n,) mm: off gauge the deviation, else the larger standard error."""
    geometry = track.geometry
    off_mm = np.abs(geometry.gauge_mm - track.nominal_mm)
    standard_mm = geometry.sigma_mm + np.maximum(np.nan_to_num(geometry.sigmaz_mm - geometry.sigma_mm), 0.0)
    error_mm = np.where(track.doubtful[OFF_GAUGE], off_mm, standard_mm)
    return np.minimum(np.nan_to_num(error_mm, nan=OFF_RAIL_MM), OFF_RAIL_MM)


def _of_place(track: TrackFindings, place: DoubtfulPlace, error_mm: np.ndarray) -> Finding:
    geometry = track.geometry
    within = (geometry.chainage_m >= place.start_m) & (geometry.chainage_m <= place.end_m)
    numbers = np.flatnonzero(within & track.doubtful[place.doubt])
    worst = _middle_of_longest(numbers) if place.doubt is UNSUPPORTED else numbers[np.argmax(error_mm[numbers])]
    return Finding(
        place.doubt.label,
        xyz=track.line.part(place.start_m, place.end_m).xyz,
        harm=float(np.sum((error_mm * geometry.cells_m)[numbers])),
        doubt_m=place.length_m,
        track_id=place.track_id,
        from_m=place.start_m,
        to_m=place.end_m,
        worst_m=float(geometry.chainage_m[worst]),
        gauge_mm=float(geometry.gauge_mm[worst]),
        cant_mm=float(geometry.cant_mm[worst]),
        sigma_mm=float(geometry.sigma_mm[worst]),
        sigmaz_mm=float(geometry.sigmaz_mm[worst]),
        points=int(geometry.points[within].sum()),
        **_kilometre(geometry, geometry.chainage_m[worst]),
    )


def _kilometre(geometry: TrackGeometry, at_m: float) -> dict[str, Any]:
    """Return the kilometre of the station nearest to a chainage; nothing without an axis."""
    if geometry.kilometres is None:
        return {}
    nearest = np.argmin(np.abs(geometry.chainage_m - at_m))
    return {"km": float(geometry.kilometres.km[nearest]), "km_text": geometry.kilometres.km_text[nearest]}


def _middle_of_longest(numbers: np.ndarray) -> int:
    """Return the middle of the longest run of consecutive numbers: a rail is least sure in the middle of a gap."""
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    longest = max(runs, key=len)
    return int(longest[len(longest) // 2])


def _of_step(track: TrackFindings, at_m: float, size_mm: float) -> Finding:
    """Return the finding of a step: the part of the track that shows it."""
    start_m, end_m = max(at_m - ARM_M, 0.0), min(at_m + ARM_M, track.length_m)
    length_m = end_m - start_m
    return Finding(
        STEP.format(size_mm),
        track.line.part(start_m, end_m).xyz,
        min(size_mm, OFF_RAIL_MM) * length_m,
        length_m,
        track_id=track.line.track_id,
        from_m=start_m,
        to_m=end_m,
        worst_m=at_m,
        **_kilometre(track.geometry, at_m),
    )


def _of_hole(hole: Hole) -> Finding:
    reason = HOLE.format(hole.first, hole.second)
    return Finding(reason, hole.ends, OFF_RAIL_MM * hole.length_m, hole.length_m, track_id=hole.first)


def _of_lone_rail(rail: RailLine) -> Finding:
    plan_m = rail.line.length_m
    return Finding(
        LONE_RAIL,
        rail.xyz,
        OFF_RAIL_MM * plan_m,
        plan_m,
        rail_id=rail.rail_id,
        from_m=0.0,
        to_m=plan_m,
        worst_m=0.5 * plan_m,
        sigma_mm=rail.sigma_mm,
        points=round(rail.points),
    )


def summary(network: RailNetwork, gauges_m: Sequence[float]) -> tuple[str, str]:
    """Return the verdict on tracks, which may have `gauges_m`, in words, and the figures that it is based on."""
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
    error = f"{median(sigma):.1f} mm (median), {rms(sigma):.1f} mm (rms)" if known(sigma).size else "unknown"
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
