"""The report and the findings of a run along guides in an airborne cloud."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ..airborne.guide_line import STATION_M
from ..airborne.survey import FLIGHT, AirborneSurvey, AirborneTrack
from ..checks.findings import OFF_RAIL_MM, Finding
from ..progress import counted, metres, written
from .markup import legend, made, page, section, table, verdict_box
from .page import stated
from .plots import MapTrack, draw_plan

GOOD_SHARE, FAIR_SHARE = 0.95, 0.7
"""Shares of the guides' length that must be seen for a verdict of good, and of usable."""

UNSEEN = "unsupported"
"""CSS class of the marks where a track is not seen."""

KEYS = (("seen", {"class_": "fine"}), ("not seen", {"class_": UNSEEN}))
"""Legend of the map; its numbers are those of the guides."""

OTHER = "a second track without a guide {:.1f} m to the {}: give it a guide, so that neither is taken for the other"


def airborne_findings(survey: AirborneSurvey) -> tuple[Finding, ...]:
    """Return the sections that are not seen and the tracks without a guide, the longest first."""
    found = [one for track in survey.tracks for one in (*_unseen(track), *_others(track))]
    found.sort(key=lambda one: -one.harm)
    return tuple(replace(one, finding=number) for number, one in enumerate(found, start=1))


def _unseen(track: AirborneTrack) -> Iterator[Finding]:
    """Yield the sections in which a track is not seen for the same reason."""
    codes = np.array([reason if not seen else "" for reason, seen in zip(track.reason, track.seen)])
    turns = np.flatnonzero(codes[1:] != codes[:-1]) + 1
    for run in np.split(np.arange(len(codes)), turns):
        if codes[run[0]]:
            yield _finding(track, run, str(codes[run[0]]))


def _others(track: AirborneTrack) -> Iterator[Finding]:
    """Yield the tracks beside one that have no guide."""
    for one in track.others:
        run = np.flatnonzero((track.s_m >= one.first_m - 25) & (track.s_m <= one.last_m + 25))
        yield _finding(track, run, OTHER.format(abs(one.left_m), "left" if one.left_m > 0 else "right"))


def _finding(track: AirborneTrack, run: np.ndarray, reason: str) -> Finding:
    length_m = len(run) * STATION_M
    around = np.clip([run[0] - 1, *run, run[-1] + 1], 0, len(track.s_m) - 1)
    sigma_mm = float(np.nanmax(track.sigma_mm[run])) if np.isfinite(track.sigma_mm[run]).any() else np.nan
    worst = run[int(np.nanargmax(track.sigma_mm[run]))] if np.isfinite(sigma_mm) else run[len(run) // 2]
    ids = track.track_id[run]
    return Finding(
        reason,
        xyz=track.xyz[np.unique(around)],
        harm=OFF_RAIL_MM * length_m,
        doubt_m=length_m,
        track_id=int(ids.max()) or None,
        from_m=float(track.s_m[run[0]] - STATION_M / 2),
        to_m=float(track.s_m[run[-1]] + STATION_M / 2),
        worst_m=float(track.s_m[worst]),
        sigma_mm=sigma_mm,
    )


def airborne_summary(survey: AirborneSurvey) -> list[str]:
    """Return the verdict and what it rests on, in sentences for a log."""
    return [
        _verdict(survey)[1],
        f"{metres(survey.seen_m)} of {metres(survey.guides_m)} along {counted(len(survey.tracks), 'guide')} are seen, "
        f"in {counted(len(survey.lines), 'line')}.",
    ]


def _verdict(survey: AirborneSurvey) -> tuple[str, str]:
    """Return the CSS class and the words of the verdict."""
    share = survey.seen_m / survey.guides_m
    if not survey.lines:
        return "poor", "No track is seen along the guides. The findings and the table below state the reasons."
    if survey.warnings or share < FAIR_SHARE:
        return "poor", f"{100 * share:.0f} % of the guides' length is seen. Read the reasons before you use the lines."
    if share < GOOD_SHARE or any(track.others for track in survey.tracks):
        return "fair", f"Usable: {100 * share:.0f} % of the guides' length is seen. Look at the findings."
    return "good", f"Good: {100 * share:.0f} % of the guides' length is seen."


def airborne_page(survey: AirborneSurvey, source: str, facts: Mapping[str, str]) -> str:
    """Return the report as a complete HTML document, with the name of the cloud and further facts by name."""
    kind, words = _verdict(survey)
    return page(
        f"Rail Extract: {source}",
        "Track centerlines from airborne lidar",
        source,
        verdict_box(kind, words, (*survey.warnings, FLIGHT)),
        section("Map", draw_plan(_courses(survey)), legend(KEYS)),
        section("Tracks", _tracks(survey)),
        section("Where to look", _places(survey)),
        made({**stated(survey.frame.crs_wkt), **facts, "Density": f"{survey.density:.1f} points per square metre"}),
    )


def _courses(survey: AirborneSurvey) -> list[MapTrack]:
    """Return the tracks for the map; where one is not seen, its guide is near."""
    return [MapTrack(str(one.guide_id), one.xyz, {UNSEEN: ~one.seen.astype(bool)}) for one in survey.tracks]


def _tracks(survey: AirborneSurvey) -> str:
    headings = ("Guide", "Name", "Length", "Seen", "Standard error", "of the height", "Cant", "Tightest radius")
    return table(headings, map(_row, survey.tracks))


def _row(track: AirborneTrack) -> tuple[object, ...]:
    seen = track.seen.astype(bool)
    cant, radius = track.cant_mm[seen], track.radius_m[np.isfinite(track.radius_m)]
    return (
        track.guide_id,
        " ".join(filter(None, (track.ref, track.name))),
        metres(STATION_M * len(seen)),
        f"{100 * seen.mean():.0f} %",
        f"{np.median(track.sigma_mm[seen]):.0f} mm" if seen.any() else "",
        f"{np.median(track.sigmaz_mm[seen]):.0f} mm" if seen.any() else "",
        f"{written(cant.min(), '.0f')} to {written(cant.max(), '.0f')} mm" if seen.any() else "",
        f"{np.abs(radius).min():,.0f} m" if len(radius) else "straight",
    )


def _places(survey: AirborneSurvey) -> str:
    found = airborne_findings(survey)
    rows = ((one.finding, one.track_id or "", f"{one.from_m:,.0f} to {one.to_m:,.0f} m", one.reason) for one in found)
    return table(("Finding", "Line", "Along the guide", "Why"), rows, "scroll tall", "words")
