"""Findings: how much of the tracks is in doubt, why and where; the most harmful first, with a verdict in words.

The list is the table of the report and the layer FINDINGS. See docs/method.md section 9.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..progress import counted, metres
from ..rails import STRIP_OFF_M, Centerline, HeadWidths, RailLine, RailNetwork, TrackGeometry, cell_borders
from ..spread import known, median, rms
from .doubts import ARM_M, find_jumps
from .ends import EarlyEnd, Hole, ends_of, find_early_ends, find_holes

GAUGE_OFF_MM = 10.0
"""Plain track is not left in service with a larger deviation from its gauge. Curves of less than 200 m radius are
widened by more, and deserve a look."""

GAUGE_SIGMAS = 4.0
"""Standard errors of the centerline by which a gauge must be off to count: two of the gauge's own, which is twice that
of a line midway between two rails whose errors are independent."""

UNSURE_MM = 5.0
"""A track survey does not accept larger standard errors of a centerline."""

MERGE_M = 5.0
"""Doubtful places closer than this along the track count as one."""

SILENT_SHARE = 0.02
"""Share of the length in doubt for a reason that the stations of tracks do not show, above which a result is not good
throughout."""

FEW, MANY = 0.05, 0.25
"""Share of the length in doubt up to which a result is good with a few exceptions, and above which it is poor."""

OFF_RAIL_MM = 70.0
"""Possible error where a line is missing, or belongs to no track: a line off by the width of a railhead is off its
rail, and being further off makes it no worse."""

STEP = "the track steps {:.0f} mm to the side"

LONE_RAIL, HOLE, EARLY_END = (
    "a rail belongs to no track",
    "no rails were found between tracks {} and {}, which are likely one",
    "the track ends {:.0f} m before track {} beside it: more of its rails may be there",
)

VERDICTS = (
    (0.0, "good", "Good throughout: every metre is supported by points, at gauge, with a small standard error."),
    (FEW, "good", "Good, except for a few places to look at."),
    (MANY, "fair", "Usable, but look at the findings before you rely on the lines."),
    (np.inf, "poor", "Poor: large parts are in doubt. Check rail points, gauge, railhead width and point density."),
)
"""Share of the length in doubt up to which a verdict applies, CSS class of the verdict, and its words."""


@dataclass(frozen=True)
class Doubt:
    """A reason to look at a place: CSS class of its marks in the pictures, and the reason in words, for lists."""

    name: str
    label: str


UNSUPPORTED = Doubt("unsupported", "a rail has no points")
OFF_GAUGE = Doubt("offgauge", f"gauge off by more than {GAUGE_OFF_MM:g} mm and {GAUGE_SIGMAS:g} standard errors")
UNSURE = Doubt("unsure", f"standard error above {UNSURE_MM:g} mm across or in height")
DOUBTS = (UNSUPPORTED, OFF_GAUGE, UNSURE)
"""In order of severity; a place counts under the first that applies."""


@dataclass(frozen=True)
class DoubtfulPlace:
    """A section of a track to look at between two chainages; `length_m` is the length in doubt within it."""

    track_id: int
    doubt: Doubt
    start_m: float
    end_m: float
    length_m: float


@dataclass(frozen=True)
class TrackFindings:
    """The findings on one track, and the nearest of the gauges that tracks may have, `nominal_mm`.

    `doubtful` has the stations in doubt, (n,), by reason; a station has at most one. `steps` are chainage and size in
    metres of its steps to the side.
    """

    line: Centerline
    geometry: TrackGeometry
    nominal_mm: float
    doubtful: dict[Doubt, np.ndarray]
    steps: tuple[tuple[float, float], ...] = ()

    @property
    def length_m(self) -> float:
        """Plan length."""
        return float(self.geometry.cells_m.sum())

    @property
    def strips_apart_m(self) -> float:
        """Plan length on which strips differ by as much as the user is warned of."""
        apart = np.nan_to_num(self.geometry.strip_mm) >= 1000 * STRIP_OFF_M
        return float(self.geometry.cells_m[apart].sum())

    def length_of(self, doubt: Doubt) -> float:
        """Return the length in doubt for a reason."""
        return float(self.geometry.cells_m[self.doubtful[doubt]].sum())

    def places(self, doubt: Doubt, merge_m: float = MERGE_M) -> list[DoubtfulPlace]:
        """Return the places in doubt for a reason; those no more than `merge_m` apart are merged."""
        return list(_places(self.geometry, doubt, self.doubtful[doubt], merge_m))


@dataclass(frozen=True)
class Findings:
    """The findings on all tracks, and on what the stations of tracks do not show.

    `lonely` rails belong to no track, and `rails_m` is the length of all rails. Tracks with `early_ends` may be right:
    they are places to look at, and nothing is in doubt for them. `heads` has the width of the heads only if another one
    is stated. `stepped_m` is the plan length of the tracks that step to the side: on one side of a step, all of it is
    off.
    """

    tracks: tuple[TrackFindings, ...]
    lonely: tuple[RailLine, ...] = ()
    rails_m: float = 0.0
    holes: tuple[Hole, ...] = ()
    early_ends: tuple[EarlyEnd, ...] = ()
    heads: HeadWidths | None = None
    stepped_m: float = 0.0

    @property
    def lonely_m(self) -> float:
        """Length of the rails that belong to no track."""
        return float(sum(rail.length_m for rail in self.lonely))

    @property
    def silent_share(self) -> float:
        """Share of the length that is in doubt although every station of the tracks is good."""
        if self.heads is not None:
            return 1.0
        hole_m = sum(hole.length_m for hole in self.holes)
        lonely = self.lonely_m / self.rails_m if self.rails_m else 0.0
        off_m = max(self.stepped_m, sum(track.strips_apart_m for track in self.tracks))
        off = off_m / self.length_m if off_m else 0.0
        return max(lonely, off, hole_m / (self.length_m + hole_m) if hole_m else 0.0)

    @property
    def length_m(self) -> float:
        """Plan length of all tracks."""
        return sum(track.length_m for track in self.tracks)

    def length_of(self, doubt: Doubt) -> float:
        """Return the length of all tracks in doubt for a reason."""
        return sum(track.length_of(doubt) for track in self.tracks)

    @property
    def share(self) -> float:
        """Share of the length that is in doubt for any reason."""
        return sum(self.length_of(doubt) for doubt in DOUBTS) / self.length_m if self.tracks else 1.0

    def places(self) -> list[DoubtfulPlace]:
        """Return all places to look at, in order of decreasing length in doubt."""
        found = [place for track in self.tracks for doubt in DOUBTS for place in track.places(doubt)]
        return sorted(found, key=lambda place: -place.length_m)


def examine(network: RailNetwork, gauges_m: Sequence[float]) -> Findings:
    """Find where the tracks of a network with their geometry, which may have `gauges_m`, are in doubt."""
    geometry = {track.track_id: track for track in network.geometry}
    tracks = tuple(
        _examine_track(line, geometry[line.track_id], gauges_m, find_jumps(line, network.rails))
        for line in network.centerlines
    )
    heads, ends = network.heads, list(ends_of(network.centerlines))
    holes = tuple(find_holes(ends))
    return Findings(
        tracks,
        _lonely(network),
        float(sum(rail.length_m for rail in network.rails)),
        holes,
        tuple(find_early_ends(ends, holes)),
        heads if heads is not None and heads.differ else None,
        sum(track.length_m for track in tracks if track.steps),
    )


def _lonely(network: RailNetwork) -> tuple[RailLine, ...]:
    """Return the rails that belong to no track; none if a track does not name its rails, as one drawn by hand."""
    named = [(*line.left_ids, *line.right_ids) for line in network.centerlines]
    if not all(named):
        return ()
    paired = {rail_id for ids in named for rail_id in ids}
    return tuple(rail for rail in network.rails if rail.rail_id not in paired)


def _examine_track(
    line: Centerline, geometry: TrackGeometry, gauges_m: Sequence[float], steps: Sequence[tuple[float, float]]
) -> TrackFindings:
    nominal_mm = min((1000 * gauge_m for gauge_m in gauges_m), key=lambda gauge: abs(gauge - line.gauge_mm))
    with np.errstate(invalid="ignore"):
        unsupported = geometry.bridged | np.isnan(geometry.gauge_mm)
        off = ~unsupported & (gauge_off(geometry, nominal_mm) > GAUGE_OFF_MM)
        unsure = ~unsupported & ~off & (np.fmax(geometry.sigma_mm, geometry.sigmaz_mm) > UNSURE_MM)
    doubtful = {UNSUPPORTED: unsupported, OFF_GAUGE: off, UNSURE: unsure}
    return TrackFindings(line, geometry, nominal_mm, doubtful, tuple(steps))


def gauge_off(geometry: TrackGeometry, nominal_mm: float) -> np.ndarray:
    """Return the deviations from a gauge at the stations, (n,) mm: 0 where they may be errors, NaN where unknown."""
    off_mm = np.abs(geometry.gauge_mm - nominal_mm)
    return np.where(off_mm <= GAUGE_SIGMAS * geometry.sigma_mm, 0.0, off_mm)


def _places(geometry: TrackGeometry, doubt: Doubt, doubtful: np.ndarray, merge_m: float) -> Iterator[DoubtfulPlace]:
    """Join stations in doubt into places."""
    numbers = np.flatnonzero(doubtful)
    if not len(numbers):
        return
    borders = cell_borders(geometry.chainage_m)
    starts, ends = borders[numbers], borders[numbers + 1]
    apart = np.flatnonzero(starts[1:] - ends[:-1] > merge_m) + 1
    for mine in np.split(np.arange(len(numbers)), apart):
        length_m = geometry.cells_m[numbers[mine]].sum()
        yield DoubtfulPlace(geometry.track_id, doubt, float(starts[mine[0]]), float(ends[mine[-1]]), float(length_m))


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
        Chainages along the track or the lone rail; NaN for a section between tracks or beyond one.
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
    """Return all places of a network to look at, in order of decreasing harm; see `examine`."""
    return listed(examine(network, gauges_m))


def listed(findings: Findings) -> tuple[Finding, ...]:
    """Return the places that an examination found, in order of decreasing harm."""
    found = [
        *_of_tracks(findings),
        *map(_of_hole, findings.holes),
        *map(_of_early_end, findings.early_ends),
        *map(_of_lone_rail, findings.lonely),
    ]
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


def _of_early_end(end: EarlyEnd) -> Finding:
    reason = EARLY_END.format(end.length_m, end.beside)
    return Finding(reason, end.xyz, OFF_RAIL_MM * end.length_m, end.length_m, track_id=end.track_id)


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
