"""Measured tracks: what a fit is given, its cant, and the points that count; and how far tracks lie off alignments.

The points are a signal of one variable. The direction of a chord is that of the curve at its middle. Its sum along the
line, y, therefore has the curvature as its second derivative, for any turn: a line is a polynomial of degree 1, an arc
of degree 2, a clothoid of degree 3. Lateral errors of the points appear in y as they are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np

from ..errors import ParameterError, RailExtractError
from ..polyline import Polyline, distance_to, runs
from ..progress import Progress, counted
from .elements import SAME_PLACE_M, Alignment
from .noise import strays

LEAST_TRACK_M, LEAST_POINTS = 50.0, 20
"""Least length of a track, metres, and least number of its points: the shortest curve that has a radius."""

BESIDE_M = 1.0
"""A point is on a part of the line that ends nearer than this before it, metres: the noise of the line makes it a few
centimetres longer than its design on a kilometre."""

STATION_NEEDS = ("track_id", "chainage_m", "cant_mm")
"""Fields of the track geometry that state the cant."""

TURNS_BACK_RAD = np.pi / 3.0
"""Largest bend of a line at a vertex: a track that turns back has a stray vertex, or runs through a switch twice."""

OFF_TRACK_M = 2.0
"""Largest median distance of a track from its alignment, metres: that of its neighbour is at least 3.4 m away."""


@dataclass(frozen=True)
class Track:
    """A measured track: vertices of the centerline, `xyz` (n, 3), local metres.

    `cant`, (k, 2), holds the plan distance from the first vertex, increasing, and the cant there, left rail minus right
    rail, metres; it is empty if the cant is unknown. Vertices at which the line bridges a gap, `is_bridged` (n,), do
    not count.
    """

    track_id: int
    xyz: np.ndarray
    cant: np.ndarray
    is_bridged: np.ndarray


def with_stations(track_id: int, xyz: np.ndarray, stations: np.ndarray) -> Track:
    """Return a track with the cant of its stations, (k, 3): chainage, cant in metres or NaN, and 1 in a bridged gap."""
    known = np.isfinite(stations[:, 1]) & (stations[:, 2] == 0)
    bridged = np.zeros(len(xyz), dtype=bool)
    if len(stations):
        at = np.clip(np.searchsorted(stations[:, 0], Polyline(xyz).t), 0, len(stations) - 1)
        bridged = stations[at, 2] != 0
    return Track(track_id, xyz, stations[known][:, :2], bridged)


def stations_by_track(rows: Iterable[Mapping[str, Any]], fields: Collection[str], name: str) -> dict[int, np.ndarray]:
    """Return chainage, cant and whether a gap is bridged of the stations of each track, (n, 3); NaN without cant.

    Raises ParameterError if a field is missing in the layer of this name.
    """
    lacking = next((one for one in STATION_NEEDS if one not in fields), None)
    if lacking:
        raise ParameterError(
            f"{name} has no field {lacking}: give the track geometry of Extract rails or Measure track geometry."
        )
    found: dict[int, list[tuple[float, float, float]]] = {}
    for row in rows:
        if row["track_id"] is not None and row["chainage_m"] is not None:
            cant = np.nan if row["cant_mm"] is None else float(row["cant_mm"]) / 1000.0
            station = float(row["chainage_m"]), cant, float(row.get("bridged") or 0)
            found.setdefault(int(row["track_id"]), []).append(station)
    return {number: np.array(sorted(stations)) for number, stations in found.items()}


def with_cant(
    lines: Sequence[tuple[int, np.ndarray]], stations: Mapping[int, np.ndarray], quality: str, tracks: str
) -> list[Track]:
    """Return tracks, given by number and vertices, with the cant of their stations.

    Raises ParameterError if no track has stations; `quality` and `tracks` are the parameters that the message names.
    """
    if not any(number in stations for number, _ in lines):
        raise ParameterError(f"{quality} has no stations of the tracks in {tracks}: give their track geometry.")
    none = np.zeros((0, 3))
    return [with_stations(number, xyz, stations.get(number, none)) for number, xyz in lines]


@dataclass(frozen=True)
class Measured:
    """Points of a track, or of a part of it: its vertices, those averaged that are closer than a metre; `xyz` (n, 3).

    `along`, (n,), is the plan distance from the first vertex of the track, and `share`, (n,), the number of vertices in
    each point that do not bridge a gap. `is_stray`, (n, 2), says whether a point lies off its neighbours, so that it
    does not count: in plan, in height.
    """

    xyz: np.ndarray
    along: np.ndarray
    share: np.ndarray
    is_stray: np.ndarray

    @property
    def in_plan(self) -> np.ndarray:
        """How much each point counts in plan, (n,)."""
        return np.where(self.is_stray[:, 0], 0.0, self.share)

    @property
    def in_height(self) -> np.ndarray:
        """How much each point counts in height, (n,)."""
        return np.where(self.is_stray.any(axis=1), 0.0, self.share)

    def without_stray_ends(self) -> Measured:
        """Return the points from the first to the last one that does not lie off in plan."""
        kept = np.flatnonzero(~self.is_stray[:, 0])
        return self._part(int(kept[0]), int(kept[-1]))

    def _part(self, first: int, last: int) -> Measured:
        part = slice(first, last + 1)
        return Measured(self.xyz[part], self.along[part], self.share[part], self.is_stray[part])

    def between(self, first_m: float, last_m: float) -> Measured:
        """Return the points between two distances along the line, with those next to them."""
        inside = np.flatnonzero((self.along > first_m - BESIDE_M) & (self.along < last_m + BESIDE_M))
        return self._part(int(inside[0]), int(inside[-1])) if len(inside) else self

    def between_strays(self) -> list[Measured]:
        """Return the parts between the points that lie off in plan and are long enough for a fit, the longest first."""
        parts = [self._part(first, last) for first, last in runs(~self.is_stray[:, 0])]
        fit = [
            one
            for one in parts
            if np.count_nonzero(one.share) >= LEAST_POINTS and one.along[-1] - one.along[0] >= LEAST_TRACK_M
        ]
        return sorted(fit, key=lambda one: one.along[0] - one.along[-1])


def measured_of(track: Track, limit_m: float, progress: Progress) -> Measured:
    """Return the points of a track; warn of those that lie off their neighbours by more than a limit."""
    _check(track)
    made = _points(track)
    across, up = lateral_signal(made.xyz[:, :2])[1], made.xyz[:, 2]
    off = np.column_stack([strays(made.along, values, limit_m) for values in (across, up)])
    places = made.along[off.any(axis=1)]
    if len(places):
        progress.warning(
            f"{counted(len(places), 'point')} of track {track.track_id}, the first {places[0]:.0f} m from its start, "
            f"{'lies' if len(places) == 1 else 'lie'} more than {1000 * limit_m:.0f} mm off the neighbours and "
            f"{'does' if len(places) == 1 else 'do'} not count: look at the line there."
        )
    return replace(made, is_stray=off)


def _check(track: Track) -> None:
    """Refuse lines that cannot have an alignment."""
    name, xy = f"The line of track {track.track_id}", track.xyz[:, :2]
    if np.isnan(track.xyz[:, 2]).any():
        raise ParameterError(f"{name} has no heights: give a 3D line, such as a centerline of Extract rails.")
    if Polyline(xy).is_closed:
        raise ParameterError(f"{name} ends where it begins: cut the ring into two lines.")
    length = Polyline(xy).length_m
    if length < LEAST_TRACK_M or len(xy) < LEAST_POINTS:
        remedy = "leave it out, or join it with the track that continues it"
        if length >= LEAST_TRACK_M:
            remedy = "give a line that was measured point by point, such as a centerline of Extract rails"
        raise ParameterError(
            f"{name} has {counted(len(xy), 'vertex', 'vertices')} over {length:.0f} m, but a fit needs at least "
            f"{LEAST_POINTS} over {LEAST_TRACK_M:.0f} m: {remedy}."
        )


def _points(track: Track) -> Measured:
    """Return the points of a track."""
    starts, counts = groups(track.xyz[:, :2])
    along = Polyline(track.xyz).t
    sums = np.add.reduceat(np.column_stack([track.xyz, along, ~track.is_bridged]), starts)
    made = Measured(sums[:, :3] / counts[:, None], sums[:, 3] / counts, sums[:, 4], np.zeros((len(starts), 2), bool))
    step = np.diff(made.xyz[:, :2], axis=0)
    turn = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(step[:, 1], step[:, 0])))))
    if turn.max(initial=0.0) > TURNS_BACK_RAD:
        raise ParameterError(
            f"The line of track {track.track_id} turns back {made.along[int(turn.argmax()) + 1]:.0f} m from its start: "
            "remove the stray vertices there, or cut the line."
        )
    if np.count_nonzero(made.share) < LEAST_POINTS:
        raise ParameterError(
            f"Track {track.track_id} has fewer than {LEAST_POINTS} points outside of bridged gaps: leave it out."
        )
    return made


SPACING_M = 1.0
"""Least distance of the points, and distance at which cant is taken from rails, metres: errors of 2 mm lengthen a line
with closer points by 1 in 10,000."""


def groups(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Divide vertices, (n, 2), into groups that are averaged, so that points are `SPACING_M` apart or more.

    Returns the first vertex and the size of each group, (k,). The first and the last vertex are groups of their own.
    """
    s = Polyline(xy).t
    number = np.floor((s + 0.5 * SPACING_M) / SPACING_M).astype(int)
    number[0], number[-1] = -1, number[-1] + 1
    starts = np.flatnonzero(np.diff(number, prepend=-2))
    return starts, np.diff(starts, append=len(s))


def lateral_signal(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distance along a line and the lateral signal y at its points, (n,) metres each, from 0."""
    step = np.diff(xy, axis=0)
    h = np.hypot(*step.T)
    theta = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    s = np.concatenate([[0.0], np.cumsum(h)])
    return s, np.concatenate([[0.0], np.cumsum((theta - theta[0]) * h)])


NEAREST_M, FARTHEST_M = 0.25, 1.0
"""Distances of a rail from the middle of its track, metres: half of all gauges in use, with canted and wide track."""

LONGEST_GAP_M = 2.0
"""Distance from a station of a rail beyond which its height is unknown, metres."""


def cant_of_rails(line: np.ndarray, rails: Sequence[np.ndarray]) -> np.ndarray:
    """Return distance along a centerline, (n, 3), and cant, (m, 2) metres: height of the left rail minus the right one.

    Rails, (k, 3) metres, may be those of other tracks, too.
    """
    places = np.concatenate([Polyline(rail).resampled(SPACING_M).xyz for rail in rails]) if rails else np.zeros((0, 3))
    places = places[np.isfinite(places[:, 2])]
    if not len(places):
        return np.zeros((0, 2))
    own = Polyline(line)
    feet = own.feet(places[:, :2], FARTHEST_M)
    t = np.arange(0.0, own.length_m, SPACING_M)
    sides = []
    for side in (1.0, -1.0):
        across = side * feet.across
        mine = (across > NEAREST_M) & (across < FARTHEST_M)
        order = np.argsort(feet.t[mine], kind="stable")
        along, z = feet.t[mine][order], places[feet.point[mine][order], 2]
        if not len(along):
            return np.zeros((0, 2))
        sides.append(np.where(distance_to(along, t) < LONGEST_GAP_M, np.interp(t, along, z), np.nan))
    cant = sides[0] - sides[1]
    known = np.isfinite(cant)
    return np.column_stack([t[known], cant[known]])


@dataclass(frozen=True)
class Deviations:
    """How far a track lies off its design, by the metre.

    `s`, (n,), is the distance along the design, metres, and `xyz`, (n, 3), the place on it, local metres. Slew, lift
    and difference of the cant, (n,), are measured minus design: across, positive to the left, and in height; NaN where
    unknown.
    """

    track_id: Optional[int]
    s: np.ndarray
    xyz: np.ndarray
    slew_mm: np.ndarray
    lift_mm: np.ndarray
    cant_diff_mm: np.ndarray


def beside(alignments: Sequence[Alignment], xy: np.ndarray) -> Optional[Alignment]:
    """Return the alignment along which a line with vertices, (n, 2) local metres, lies; None if it lies along none."""
    distances = [(_distance_m(alignment, xy), number) for number, alignment in enumerate(alignments)]
    nearest_m, number = min(distances, default=(np.inf, 0))
    return alignments[number] if nearest_m <= OFF_TRACK_M else None


def _distance_m(alignment: Alignment, xy: np.ndarray) -> float:
    """Return the median distance of a line from an alignment; infinite if it lies past its ends."""
    foot = alignment.foot(xy)
    inside = foot.past_m == 0
    return float(np.median(np.abs(foot.across_m[inside]))) if np.count_nonzero(inside) > 1 else np.inf


def compared_with(
    alignments: Sequence[Alignment], tracks: Sequence[Track], progress: Progress
) -> list[tuple[Alignment, Deviations]]:
    """Return the deviations of each track, in the frame of the alignments, with the alignment beside it.

    Raises RailExtractError if none lies along an alignment; of some that do not, the user is told.
    """
    found, lost = [], []
    for track in tracks:
        alignment = beside(alignments, track.xyz[:, :2])
        if alignment is None:
            lost.append(str(track.track_id))
            continue
        along = Polyline(track.xyz).t
        found.append((alignment, deviations_of(alignment, track.track_id, track.xyz, along, track.cant)))
    if not found:
        raise RailExtractError("None of TRACKS lies along an alignment of INPUT: check the coordinate system of both.")
    if lost:
        progress.warning(f"Tracks {', '.join(lost)} do not lie along an alignment: they are left out.")
    return found


def deviations_of(
    alignment: Alignment, track_id: Optional[int], xyz: np.ndarray, along: np.ndarray, cant: np.ndarray
) -> Deviations:
    """Return how far a line, `xyz` (n, 3) in local metres, lies off an alignment, interpolated between its vertices.

    Some vertices may lie beside the alignment, and the line may run against it. `along`, (n,), is the plan distance of
    the vertices from the first one; `cant`, (k, 2), holds plan distance, increasing, and cant there, left rail minus
    right rail along the line, metres; empty if it is unknown.
    """
    foot = alignment.foot(xyz[:, :2])
    inside = foot.past_m == 0
    used = inside.copy()  # and the first vertex past either end, which lies beside the continued end
    used[1:] |= inside[:-1]
    used[:-1] |= inside[1:]
    order = np.argsort((foot.s + foot.past_m)[used], kind="stable")
    feet, across, z = (values[used][order] for values in (foot.s + foot.past_m, foot.across_m, xyz[:, 2]))
    first, last = max(feet[0], alignment.s_from), min(feet[-1], alignment.s_to)
    s = np.arange(np.ceil(first - SAME_PLACE_M), np.floor(last + SAME_PLACE_M) + 1.0)
    slew, lift = (np.interp(s, feet, values) for values in (across, z - alignment.heights(feet)))
    turned = foot.s[-1] < foot.s[0]
    cant_diff = np.full(len(s), np.nan)
    if len(cant):
        at = np.interp(cant[:, 0], along, foot.s)
        diff = np.where(turned, -cant[:, 1], cant[:, 1]) - alignment.cants(at)
        order = np.argsort(at, kind="stable")
        cant_diff = np.interp(s, at[order], diff[order], left=np.nan, right=np.nan)
    return Deviations(track_id, s, alignment.xyz(s), 1000 * slew, 1000 * lift, 1000 * cant_diff)
