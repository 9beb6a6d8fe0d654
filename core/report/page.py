"""The report as a single page of HTML that needs no network and no other file, and the origin of its result.

The origin is cloud, rails, parameters, and the command that repeats the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from pathlib import Path

import numpy as np

from .. import VERSION
from ..checks.findings import (
    DOUBTS,
    GAUGE_OFF_MM,
    UNSUPPORTED,
    Doubt,
    Finding,
    Findings,
    TrackFindings,
    examine,
    listed,
    verdict,
)
from ..clouds.crs import parse_crs
from ..frame import LocalFrame
from ..parameters import Parameters
from ..progress import metres, written
from ..rails import ENOUGH_CELLS_PER_M, RailNetwork, SearchFigures
from ..spread import known, median
from ..standards import Gauge, RailStandard
from .limits import limits_table
from .markup import figure, legend, made, note, page, section, table, tag, text, tiles, verdict_box
from .plots import MapTrack, draw_plan, draw_profiles, draw_strips

CLASSES_ADVICE = (
    "Rail classes: choose the class of the rails; in a raw cloud, which has none, have the rail points found."
)
ADVICE = (
    "Rail standard: have it detected, and gauge and railhead width are measured in the points.",
    "Density: points must be at most a few centimetres apart along the head; in clouds from aircraft they seldom are.",
    "Extent and shortest line: the extent must contain rails that are longer than the shortest line.",
)
"""What to try if no track was found; the classes only if the rail points were not searched for."""

NOTES = (
    "A rail line is the top of the railhead, on the axis of the railhead. Gauge is the 3D distance between the two "
    "rail lines minus the railhead width; it is not measured 14 mm below the top. Cant is the height of the left rail "
    "minus that of the right rail, seen along the track; curvature is positive in left-hand curves. Chainage is the "
    "plan distance from the western end of the line, or from its southern end if it runs north.",
    "The standard error is that of the centerline's lateral position: about two thirds of the true positions are "
    "within it. The report judges the tracks that were found. To see whether one was missed, compare the map with the "
    "cloud.",
)


STRIP_NOTE = (
    "Offsets of each strip, a pass of the scanner, from the mean of the strips that show the same place, as they are "
    "before any alignment: to the left, seen along the track, and upwards. Only places are listed where several strips "
    "show a rail or one passes on to the next. Where the points state neither source ids nor GPS times, strips are the "
    "levels on which all heads are, from the lowest on; lines are on the mean of the passes."
)

STATED_APART = ("gauge_m", "head_width_m", "other_gauges_m", "other_heads_m", "engine", "device", "keep_cleaned")
"""Parameters that the report states elsewhere, or that change no line."""

INTERFACE = {"passes": "iterations", "quality_step": "step"}
"""Names of parameters in QGIS where they differ."""


def build_page(
    network: RailNetwork, gauges_m: Sequence[float], source: str, facts: Mapping[str, str] | None = None
) -> str:
    """Return the report on a network with the geometry of its tracks, a complete HTML document.

    Tracks may have the gauges `gauges_m`; `source` names the cloud, and `facts`, such as parameters, are stated by
    name.
    """
    findings = examine(network, gauges_m)
    return page(
        f"Rail Extract: {source}",
        "Rail Extract report",
        source,
        _verdict(findings, network),
        _tiles(network, findings),
        *(_of_all(findings) if findings.tracks else []),
        _search(network.search),
        _strips(network),
        *(_profiles(track, network.frame) for track in findings.tracks),
        made({**(facts or {}), "Engine": network.engine}, NOTES),
    )


def _of_all(findings: Findings) -> list[str]:
    """Write what is shown of all tracks together."""
    plan, limits = (
        section("Map", draw_plan(_courses(findings)), _keys()),
        section("Limits", limits_table(findings.tracks)),
    )
    return [plan, _findings(findings), _tracks(findings), limits]


def _courses(findings: Findings) -> list[MapTrack]:
    """Return the tracks for the map, the most severe doubts on top."""
    return [
        MapTrack(
            str(track.line.track_id),
            track.geometry.xyz,
            {doubt.name: track.doubtful[doubt] for doubt in reversed(DOUBTS)},
        )
        for track in findings.tracks
    ]


def _verdict(findings: Findings, network: RailNetwork) -> str:
    """Write the verdict, the reasons for doubt, and what the user was warned of."""
    if not findings.tracks:
        words = f"{_without_track(len(network.rails))} What to try:"
        advice = ADVICE if network.search else (CLASSES_ADVICE, *ADVICE)
        return verdict_box("poor", words, (*network.warnings, *advice))
    kind, headline = verdict(findings)
    if findings.lonely:
        count = len(findings.lonely)
        belong = "1 rail does not belong" if count == 1 else f"{count} rails do not belong"
        headline += f" {belong} to a track ({metres(findings.lonely_m)})."
    reasons = [_reason(findings, doubt) for doubt in DOUBTS if findings.length_of(doubt) > 0]
    return verdict_box(kind, headline, (*reasons, *_hole_reasons(findings), *network.warnings))


def _without_track(rail_count: int) -> str:
    """Say that no track was found, and how many rails."""
    if not rail_count:
        return "No rail was found."
    rails = "There is 1 rail" if rail_count == 1 else f"There are {rail_count} rails"
    return f"No track was found. {rails}, but no two rails are parallel at the gauge."


def _hole_reasons(findings: Findings) -> Iterator[str]:
    """Write which tracks are likely one."""
    for hole in findings.holes:
        between = metres(hole.length_m)
        yield f"Track {hole.first} likely goes on as track {hole.second}: no rails were found in the {between} between."


def _reason(findings: Findings, doubt: Doubt) -> str:
    """Write how much is in doubt for a reason, and where the longest place is."""
    length_m, place = findings.length_of(doubt), next(one for one in findings.places() if one.doubt == doubt)
    share = f"{metres(length_m)} of {metres(findings.length_m)} ({100 * length_m / findings.length_m:.1f} %)"
    where = f"track {place.track_id} between {place.start_m:,.1f} and {place.end_m:,.1f} m"
    return f"{share}: {doubt.label}. Longest: {metres(place.length_m)} of {where}."


def _tiles(network: RailNetwork, findings: Findings) -> str:
    """Write the most important figures."""
    sigma = np.concatenate([track.geometry.sigma_mm for track in findings.tracks] or [np.empty(0)])
    density = [track.geometry.points / track.geometry.cells_m for track in findings.tracks]
    figures = [
        (f"{len(findings.tracks):,}", "track" if len(findings.tracks) == 1 else "tracks"),
        (metres(findings.length_m), "of track"),
        (str(len(network.rails)), f"rails, {metres(sum(rail.length_m for rail in network.rails))}"),
        (figure(median(sigma)), "standard error across, median"),
        (f"{100 * (1 - findings.share):.1f} %", "of it without doubt"),
        (f"{np.median(np.concatenate(density)) if density else 0:.0f}", "points per metre of track, median"),
    ]
    return tiles(figures)


def _keys(**more: str) -> str:
    """Write the legend of marks, with `more` of them: texts by class."""
    keys = {"fine": "not in doubt", **{doubt.name: doubt.label for doubt in DOUBTS}, **more}
    return legend((what, {"class_": name}) for name, what in keys.items())


def _findings(findings: Findings) -> str:
    """Write the list of places to look at, which the layer FINDINGS has as well."""
    found = listed(findings)
    if not found:
        return ""
    columns: dict[str, Callable[[Finding], object]] = {
        "Finding": lambda one: one.finding,
        "Where": lambda one: f"track {one.track_id}" if one.rail_id is None else f"rail {one.rail_id}",
        "Chainage": lambda one: f"{one.from_m:,.1f} to {one.to_m:,.1f} m" if np.isfinite(one.from_m) else "",
        "In doubt": lambda one: metres(one.doubt_m),
        "Worst at": lambda one: figure(one.worst_m, unit="m", unknown=""),
        "Gauge": lambda one: figure(one.gauge_mm, unknown=""),
        "Standard error across": lambda one: figure(one.sigma_mm, unknown=""),
        "in height": lambda one: figure(one.sigmaz_mm, unknown=""),
        "Why": lambda one: one.reason,
    }
    if any(one.km_text for one in found):
        columns["Kilometre of the worst place"] = lambda one: one.km_text or ""
    rows = [[cell(one) for cell in columns.values()] for one in found]
    order = "The first findings may do most harm: they are in the order of possible error times length."
    return section("Where to look", table(columns, rows, "scroll tall", "words"), note(order))


def _tracks(findings: Findings) -> str:
    """Write the table of tracks."""
    columns: dict[str, Callable[[TrackFindings], object]] = {
        "Track": lambda one: one.line.track_id,
        "Length": lambda one: metres(one.length_m),
        "Gauge": lambda one: f"{one.line.gauge_mm:.1f} ± {one.line.gaugesd_mm:.1f} mm",
        "Cant": lambda one: _span(one.geometry.cant_mm, "mm"),
        "Twist": lambda one: _span(one.geometry.twist_mm, "mm"),
        "Tightest radius": lambda one: _tightest(one.geometry.radius_m),
        "Gradient": lambda one: _span(one.geometry.grade_pm, "‰"),
        "Standard error across": lambda one: figure(median(one.geometry.sigma_mm)),
        "in height": lambda one: figure(median(one.geometry.sigmaz_mm)),
        "No points": lambda one: metres(one.length_of(UNSUPPORTED)),
    }
    if any(track.geometry.kilometres is not None for track in findings.tracks):
        columns["Kilometres"] = _kilometres
    return section("Tracks", table(columns, [[cell(one) for cell in columns.values()] for one in findings.tracks]))


def _kilometres(track: TrackFindings) -> str:
    """Write the kilometres of the first and the last station that have one."""
    along = track.geometry.kilometres
    known = [] if along is None else [text for text in along.km_text if text]
    return f"{known[0]} to {known[-1]}" if known else "none"


def _span(values: np.ndarray, unit: str, form: str = ".1f") -> str:
    values = known(values)
    return f"{written(values.min(), form)} to {written(values.max(), form)} {unit}" if len(values) else "unknown"


def _tightest(radius_m: np.ndarray) -> str:
    tightest = min(known(radius_m).tolist(), key=abs, default=None)
    return f"{abs(tightest):,.0f} m {'left' if tightest > 0 else 'right'}" if tightest else "straight"


def _search(found: SearchFigures | None) -> str:
    """Write what was found in a raw cloud, and what to doubt."""
    if found is None:
        return ""
    rows = [
        ("Rail points", f"{found.points:,}", "All others were left out."),
        ("Rails with a partner", metres(found.paired_m), "Another rail runs at the distance of the gauge."),
        (
            "Rails without a partner",
            metres(found.single_m),
            "The other rail is hidden or was not found, or it is a straight bar of the height and width of a rail.",
        ),
        (
            "Cells with points per metre",
            f"{found.cells_per_m:.0f}",
            f"Below {ENOUGH_CELLS_PER_M:.0f}, lines are less accurate and may have gaps.",
        ),
        ("Squares with rails", f"{found.squares:,}", "Squares of about 41 m are searched one by one."),
        (
            "Thin squares",
            f"{found.thin:,}",
            "With fewer than 400 points per square metre, heads and ballast blend: more may be missed.",
        ),
        (
            "Paved squares",
            f"{found.paved:,}",
            "Rails level with the pavement are found by their grooves, and less accurately.",
        ),
    ]
    if found.blunt_m:
        meaning = "Beams or images blur the head to a round ridge: its width and its edges cannot be seen."
        if found.sharp_m:
            meaning += " Other sources of the cloud are sharp: blunt ones count where these show no rail."
        rows.append(("Rails with blunt heads", f"{metres(found.blunt_m)}, by {1000 * found.blur_m:.0f} mm", meaning))
    rows = rows if found.squares else rows[:4]  # rails that grow from seeds are not searched by squares
    written = table(("Found", "", "What it means"), rows, kind="words")
    return section("Rail points in the raw cloud", written)


def _strips(network: RailNetwork) -> str:
    """Write how the strips differ, if there are several: mean and range of the offsets along each track."""
    if not network.strips:
        return ""
    rows, drawn = [], []
    for course in network.strips:
        offsets = [
            cell
            for values in (course.across_mm, course.up_mm)
            for cell in (figure(values.mean(), "+.1f"), _span(values, "mm", "+.1f"))
        ]
        rows.append((course.track_id, course.strip, metres(float(len(course.chainage_m))), *offsets))
    for track_id in dict.fromkeys(course.track_id for course in network.strips):
        courses = [course for course in network.strips if course.track_id == track_id]
        drawn += [tag("p", text(f"Track {track_id}")), draw_strips(courses)]
    headings = ("Track", "Strip", "With others", "Across", "Range", "Height", "Range")
    return section("Strips", table(headings, rows), *drawn, note(STRIP_NOTE))


def _profiles(track: TrackFindings, frame: LocalFrame) -> str:
    """Draw a track by its chainage, with heights above the cloud's datum."""
    height_m = frame.to_crs(track.geometry.xyz)[:, 2] * frame.vertical_unit_m
    keys = _keys(band=f"gauge within {GAUGE_OFF_MM:g} mm of nominal")
    return section(f"Track {track.line.track_id}", draw_profiles(track, height_m), keys)


@dataclass(frozen=True)
class Origin:
    """From what and how a result was computed; `command` repeats the run.

    The parameters are None if the lines come from another run. The time is that of the report, in the time zone of this
    computer.
    """

    paths: tuple[Path, ...]
    standard: RailStandard
    other_gauges: tuple[Gauge, ...]
    command: str
    parameters: Parameters | None = None
    time: datetime = field(default_factory=datetime.now)

    @property
    def gauges_m(self) -> tuple[float, ...]:
        """Gauges that tracks may have."""
        return self.standard.gauge_m, *(gauge_m for gauge_m, _ in self.other_gauges)

    def report(self, network: RailNetwork) -> str:
        """Build the report on a network with its track geometry, an HTML document."""
        first, *more = (path.resolve().name for path in self.paths)
        source = f"{first} and {len(more)} more" if more else first
        facts = {
            **stated(network.frame.crs_wkt, self.time),
            "Rail": self.standard.label,
            "Gauge": ", ".join(f"{1000 * gauge_m:g} mm" for gauge_m in self.gauges_m),
            "Railhead width": ", ".join(self._head_widths()),
            "Parameters": _stated(self.parameters) if self.parameters else "",
            "Command": self.command,
        }
        return build_page(network, self.gauges_m, source, facts)

    def _head_widths(self) -> list[str]:
        """Write the width of the railheads, and those of gauges where it differs."""
        width_m = self.standard.head_width_m
        others = [
            f"{1000 * own_m:g} mm on {1000 * gauge_m:g} mm gauge"
            for gauge_m, own_m in self.other_gauges
            if own_m != width_m
        ]
        return [f"{1000 * width_m:g} mm", *others]


def _stated(parameters: Parameters) -> str:
    """Write parameters under their names in QGIS, with units."""
    stated = []
    for one in fields(Parameters):
        value = getattr(parameters, one.name)
        if one.name in STATED_APART or value is None:
            continue
        name, _, unit = one.name.rpartition("_")
        named, unit = {"m": (name, " m"), "deg": (name, "°")}.get(unit, (one.name, ""))
        text = value if isinstance(value, str) else f"{value:g}{unit}"
        stated.append(f"{INTERFACE.get(named, named).upper()} {text}")
    return ", ".join(stated)


def stated(crs_wkt: str | None, time: datetime | None = None) -> dict[str, str]:
    """Return what a report states in every case: the time, now unless another one is given, version and system."""
    return {
        "Date": f"{time or datetime.now():%Y-%m-%d %H:%M}",
        "Version": f"Rail Extract {VERSION}",
        "Coordinate system": _title(crs_wkt),
    }


def _title(crs_wkt: str | None) -> str:
    """Code and name of a coordinate system, as QGIS shows them."""
    if not crs_wkt:
        return "none stated: metres"
    crs = parse_crs(crs_wkt)
    authority = crs.to_authority()
    return f"{':'.join(authority)} - {crs.name}" if authority else crs.name
