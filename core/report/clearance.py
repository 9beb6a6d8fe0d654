"""The page about the clearance along tracks, with diagrams and the worst cross-sections, and what a run says of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..clearance.along import grade_pm, nominal_mm, traced_at
from ..clearance.intrusions import VEHICLE_WORDS, Intrusion
from ..clearance.measure import UNSEEN_SHARE, Clearance, Stations
from ..clearance.sweep import SECTION_M
from ..polyline import runs
from ..progress import counted, metres, written
from .clearance_pictures import RULES, Slice, cross_section, diagram
from .markup import figure, legend, made, note, page, section, table, tag, tiles, verdict_box
from .page import stated
from .plots import Curve, MapTrack, Panel, broken, draw_panels, draw_plan

NOTES = (
    "This is a screening and no proof of conformity. The standard error holds the fit of the object's surface, the "
    "error of the centerline, and that of the cant times the height. Registration between passes, often 5 to 20 mm, is "
    "not in it.",
    "Penetration is that of the object's surface, not of its deepest point, which is noise. Margins of stations are "
    "those of the third nearest point. Rails, bed, single stray points, and the vehicle of the scanner do not "
    "count; contact wires, platforms and trains are named and do not count.",
    "Distances and heights are in the plane of both rail tops, from the middle of the track. The overhang of vehicles "
    "beyond the ends of lines is not swept.",
)

WIRE_LIMITS = (
    "Heights of contact wires to compare with: 5000 to 5750 mm nominal, 5080 to 5300 mm from 250 km/h, at most 6500 mm "
    "(Regulation (EU) 1301/2014, table 4.2.9.1); at least 4950 mm at 15 kV and 5020 mm at 25 kV (EBO annex 3)."
)

KEYS = (
    ("free", {"class_": "fine"}),
    ("too few points", {"class_": "unsupported"}),
    ("in doubt", {"class_": "unsure"}),
    ("surely inside the profile", {"class_": "offgauge"}),
)
"""Legend of the map; its numbers are those of the tracks."""

LEAST_SPAN_MM = 20.0
"""Smallest range of a panel, so that noise does not look alarming."""

NEAR_END_M = 20.0
"""An intrusion so near to the end of a line may be entered by vehicles beyond it, which are not swept."""

TIGHTEST_M = 100.0
"""Radius of the last row of the tables of widening."""

CANTED_M = 0.02
"""Cant from which an unknown one keeps from judging."""


def clearance_page(found: Clearance, worst: Sequence[Slice], source: str, facts: Mapping[str, str]) -> str:
    """Return the page, a complete HTML document.

    Given are the points around the worst places, the name of the cloud, and further facts to state, by name.
    """
    kind, words = verdict(found)
    return page(
        f"Clearance: {source}",
        "Clearance",
        source,
        verdict_box(kind, words, found.warnings),
        _tiles(found),
        section("Map", draw_plan([_course(found, number) for number in range(len(found.courses))]), legend(KEYS)),
        *(diagram(found, number) for number in range(len(found.courses))),
        *_cross_sections(found, worst),
        *_intrusions(found),
        *_distances(found),
        *_platforms(found),
        *_wires(found),
        made({**stated(found.frame.crs_wkt), **_facts(found), **facts}, NOTES),
        style=RULES,
    )


def verdict(found: Clearance) -> tuple[str, str]:
    """Return the CSS class and the words of the verdict."""
    reasons = cannot_be_judged(found)
    sure = found.sure
    if sure:
        worst = max(sure, key=lambda one: one.pen_mm)
        places = counted(len(sure), "place")
        words = f"{places} inside the profile, the worst {written(worst.pen_mm, '.0f')} mm {_where(worst)}."
        return "poor", f"{words} The rest cannot be judged." if reasons else words
    if reasons:
        return "poor", "Cannot be judged."
    doubtful = [one for one in found.intrusions if not one.what]
    if not np.isfinite(found.least_margin_m):
        return "good", "Free. Nothing stands within reach."
    least = figure(1000 * found.least_margin_m, ".0f")
    if doubtful:
        return "fair", f"Free, with {counted(len(doubtful), 'place')} in doubt. The least margin is {least}."
    return "good", f"Free. The least margin is {least}."


def _where(one: Intrusion) -> str:
    """Return the place of an intrusion in words."""
    place = f"at km {one.km_text}" if one.km_text else f"at {one.chainage_m:,.1f} m of track {one.track_id}"
    return f"{place} on the {one.side}"


def summary(found: Clearance) -> list[str]:
    """Return the verdict and what it rests on, in sentences for a log."""
    length_m = sum(one.length_m for one in found.courses)
    return [
        verdict(found)[1],
        f"{counted(len(found.courses), 'track')} ({metres(length_m)}), profile {found.settings.profile.name}: "
        f"{counted(found.point_count, 'point')} within reach, {counted(len(found.platforms), 'platform edge')}, "
        f"{metres(sum(one.length_m for one in found.wires))} of contact wire.",
    ]


def _facts(found: Clearance) -> dict[str, str]:
    settings = found.settings
    return {
        "Profile": f"{settings.profile.name} ({settings.profile.source})",
        "MARGIN": f"{1000 * settings.margin_m:g} mm",
        "WIDENING": settings.widening,
        "FLOOR": f"{1000 * settings.floor_m:g} mm",
        "Classes left out": ", ".join(map(str, settings.left_out)) or "none",
    }


def _tiles(found: Clearance) -> str:
    doubtful = sum(not one.what and not one.sure for one in found.intrusions)
    figures = (
        (str(len(found.sure)), "surely inside"),
        (str(doubtful), "in doubt"),
        (figure(1000 * found.least_margin_m, ".0f"), "least margin"),
        (str(len(found.platforms)), "platform edges"),
        (metres(sum(one.length_m for one in found.wires)), "of contact wire"),
        (metres(sum(one.length_m for one in found.courses)), "of track"),
    )
    return tiles(figures)


def _course(found: Clearance, number: int) -> MapTrack:
    """Return a track for the map, with the sections that are inside the profile on top."""
    stations = found.stations[number]
    marks = {"unsupported": found.unseen(stations)}
    for name, sure in (("unsure", False), ("offgauge", True)):
        marks[name] = np.zeros(len(stations.s), dtype=bool)
        for one in found.intrusions:
            if one.course == number and not one.what and one.sure == sure:
                first, last = np.searchsorted(stations.s, [one.from_m, one.to_m])
                marks[name][max(first - 1, 0) : last + 1] = True
    return MapTrack(str(stations.course.track_id), stations.xyz, marks)


def _cross_sections(found: Clearance, worst: Sequence[Slice]) -> Iterator[str]:
    if worst:
        drawn = (cross_section(found, one) for one in worst)
        yield section("Worst cross-sections", tag("div", *drawn, class_="crosses"))


def _intrusions(found: Clearance) -> Iterator[str]:
    if not found.intrusions:
        return
    headings = (
        "No.",
        "Track",
        "Place",
        "Side",
        "Inside",
        "Standard error",
        "Height",
        "From",
        "To",
        "Points",
        "Class",
        "Sure",
        "What",
    )
    rows = [
        (
            one.intrusion,
            one.track_id,
            one.km_text or f"{one.chainage_m:,.1f} m",
            one.side,
            figure(one.pen_mm),
            figure(one.sigma_mm),
            figure(one.w_mm, ".0f"),
            f"{one.from_m:,.1f} m",
            f"{one.to_m:,.1f} m",
            f"{one.points:,}",
            one.class_code,
            "yes" if one.sure else "in doubt",
            one.what,
        )
        for one in found.intrusions
    ]
    yield section("Inside the profile", table(headings, rows, "scroll tall"))


def _distances(found: Clearance) -> Iterator[str]:
    """List where tracks are nearer than required, and where they join."""
    rows = [row for one in found.stations for row in _short(found, one)]
    if rows:
        headings = ("Track", "Neighbour", "From", "To", "Least distance", "Required", "What")
        yield section("Distance between tracks", table(headings, rows, "scroll tall"))


def _short(found: Clearance, stations: Stations) -> Iterator[Sequence[object]]:
    for side in (stations.left, stations.right):
        for first, last in runs(side.short):
            at = first + int(np.argmin(side.distance_m[first : last + 1]))
            yield (
                stations.course.track_id,
                found.courses[side.track[at]].track_id,
                f"{stations.s[first]:,.1f} m",
                f"{stations.s[last]:,.1f} m",
                f"{side.distance_m[at]:.3f} m",
                f"{side.least_m[at]:.3f} m",
                "too near",
            )
        for at in side.fouling:
            place = f"{stations.s[at]:,.1f} m"
            other = found.courses[side.track[at]].track_id
            yield (stations.course.track_id, other, place, place, f"{side.distance_m[at]:.3f} m", "", "fouling point")


def _platforms(found: Clearance) -> Iterator[str]:
    if not found.platforms:
        return
    headings = ("Track", "Side", "From", "To", "Offset", "least", "largest", "Height", "least", "largest", "Nominal")
    rows = [
        (
            found.courses[one.course].track_id,
            "left" if one.side > 0 else "right",
            *(f"{end:,.1f} m" for end in one.ends),
            *(figure(1000 * float(pick(values))) for values in (np.abs(one.v), one.w) for pick in PICKS),
            nominal_mm(one) or "",
        )
        for one in found.platforms
    ]
    drawn = (_drawn(found, at) for at in _with(found.platforms))
    yield section("Platform edges", table(headings, rows), *drawn)


PICKS = (np.mean, np.min, np.max)


def _with(things: Sequence) -> list[int]:
    """Return the numbers of the tracks that have things."""
    return sorted({one.course for one in things})


def _drawn(found: Clearance, number: int) -> str:
    """Draw offset and height of the platform edges of a track."""
    course, panels = found.courses[number], []
    s = np.arange(0.0, course.length_m, 1.0)
    for side, name in ((1, "Platform on the left"), (-1, "Platform on the right")):
        for what, values in zip(("offset", "height"), 1000 * np.abs(traced_at(found.platforms, number, s, side)).T):
            if np.isfinite(values).any():
                panels.append(Panel(f"{name}: {what}", "[mm]", [Curve(s, values)], LEAST_SPAN_MM))
    return draw_panels(f"Platforms of track {course.track_id}", panels, (0.0, course.length_m), "chainage [m]")


def _wires(found: Clearance) -> Iterator[str]:
    if not found.wires:
        return
    headings = ("Track", "From", "To", "Height", "least", "largest", "Stagger, least", "largest", "Steepest gradient")
    rows = [
        (
            found.courses[one.course].track_id,
            *(f"{end:,.1f} m" for end in one.ends),
            *(figure(1000 * float(pick(one.w))) for pick in PICKS),
            *(figure(1000 * float(pick(one.v))) for pick in PICKS[1:]),
            figure(grade_pm(one), ".1f", "‰"),
        )
        for one in found.wires
    ]
    drawn = []
    for number in _with(found.wires):
        course = found.courses[number]
        s = np.arange(0.0, course.length_m, 0.5)
        stagger, height = traced_at(found.wires, number, s).T
        panels = [
            Panel(name, "[mm]", [Curve(*broken(s, 1000 * values, 1.0))], LEAST_SPAN_MM)
            for name, values in (("Height", height), ("Stagger, positive to the left", stagger))
        ]
        drawn.append(draw_panels(f"Wire of track {course.track_id}", panels, (0.0, course.length_m), "chainage [m]"))
    yield section("Contact wires", table(headings, rows), *drawn, note(WIRE_LIMITS))


def cannot_be_judged(found: Clearance) -> list[str]:
    """Return why nothing can be judged; nothing if it can."""
    reasons = []
    canted = [one.track_id for one in found.courses if not one.has_cant and one.cant_sigma_m > CANTED_M]
    if canted:
        reasons.append(f"RAILS has no rails of canted tracks: {', '.join(map(str, canted))}.")
    total = sum(len(one.s) for one in found.stations)
    unseen = sum(int(found.unseen(one).sum()) for one in found.stations)
    if unseen > UNSEEN_SHARE * total:
        reasons.append(
            f"Too few points are within reach on {100 * unseen / total:.0f} % of the length: {_place_of(found)}."
        )
    return reasons


def _place_of(found: Clearance) -> str:
    """Return the sections without points in words, the first few."""
    sections = [
        f"track {one.course.track_id} {one.s[first]:,.0f} to {one.s[last]:,.0f} m"
        for one in found.stations
        for first, last in runs(found.unseen(one))
    ]
    more = f" and {len(sections) - MOST_NAMED} more" if len(sections) > MOST_NAMED else ""
    return ", ".join(sections[:MOST_NAMED]) + more


MOST_NAMED = 4
"""Sections that a sentence names."""


def remarks(found: Clearance) -> list[str]:
    """Return the sentences."""
    said = cannot_be_judged(found)
    for at in sorted({at for at, _ in found.vehicle}):
        start_m = SECTION_M * min(section for number, section in found.vehicle if number == at)
        track = found.courses[at].track_id
        said.append(f"The vehicle of the scanner was left out on track {track}, from {start_m:,.0f} m on.")
    for one in found.intrusions:
        if one.what.startswith(VEHICLE_WORDS.format("")):
            said.append(
                f"A {one.what} stands at {one.from_m:,.0f} to {one.to_m:,.0f} m of track {one.track_id}: behind the "
                "vehicle nothing is measured."
            )
    for course in found.courses:
        if (np.abs(course.curvature) * TIGHTEST_M > 1.0).any() and found.settings.widening != "NONE":
            said.append(
                f"Track {course.track_id} is tighter than {TIGHTEST_M:g} m: the last row of the table was used."
            )
    near = [one for one in found.sure if _to_end(found, one.course, one.chainage_m) < NEAR_END_M]
    if near:
        said.append(
            f"{counted(len(near), 'intrusion')} within {metres(NEAR_END_M)} of the end of a line: vehicles beyond are "
            "not swept."
        )
    return said


def step_remarks(found: Clearance, steps: Mapping[int, np.ndarray]) -> list[str]:
    """Return sentences on how far strips are apart, given chainages and millimetres, (n, 2), by track."""
    said = []
    for course in (one for one in found.courses if one.track_id in steps):
        own = steps[course.track_id]
        chainage_m, most_mm = own[np.argmax(own[:, 1])]
        deep = [one for one in found.sure if one.track_id == course.track_id]
        less = sum(one.pen_mm < np.interp(one.chainage_m, *own.T) for one in deep)
        shallow = f" {counted(less, 'place')} inside the profile: less deep than the strips are apart there."
        said.append(
            f"The strips of the survey are up to {most_mm:.1f} mm apart on track {course.track_id}, at "
            f"{chainage_m:,.0f} m; the standard errors do not hold this.{shallow if less else ''}"
        )
    return said


def _to_end(found: Clearance, course: int, chainage_m: float) -> float:
    """Return the distance of a place from the nearer end of its track."""
    return min(chainage_m, found.courses[course].length_m - chainage_m)
