"""Tracks along guides as they are written: stations every 10 m, and lines where a track is seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from ..frame import LocalFrame
from ..polyline import length_along
from ..standards import GAUGE_RANGE_MM
from .cross_sections import STATION_M
from .fitting import BED_SIGMA_M, REASONS, SEEN, Stations

MAX_UNSEEN_M, LEAST_STATIONS = 30.0, 3
"""A line ends where its track is not seen for longer, and is none with fewer stations that are."""

VERTEX_M = 2.0
"""Distance between the vertices of a line: a chord of a curve of 200 m radius is then 2.5 mm off."""

ARM_M = 40.0
"""Radius and gradient are those of a parabola through the stations this far on either side."""

MAX_RADIUS_M = 10_000.0
"""Above it, noise bends a line as much."""

SAME_OTHER_M = 1.0
"""Places of a track without a guide whose distances differ by less belong to the same one."""


@dataclass(frozen=True)
class Guide:
    """A line, `xy` (n, 2) in units of the cloud's coordinate system, that says which track is meant.

    `gauge_m` is the gauge of this track, such as OpenStreetMap states it; None for that of the run. `name` and `ref`
    are carried over from the layer.
    """

    guide_id: int
    xy: np.ndarray
    gauge_m: float | None = None
    name: str = ""
    ref: str = ""


def gauge_of(text: object) -> float | None:
    """Return the gauge, metres, that a field of a guide states in millimetres, such as 1435 or "1435;1000".

    >>> gauge_of("1000;1435"), gauge_of("standard"), gauge_of(None)
    (1.0, None, None)
    """
    word = str(text).split(";")[0].strip()
    try:
        gauge_mm = float(word)
    except ValueError:
        return None
    low, high = GAUGE_RANGE_MM
    return gauge_mm / 1000 if low <= gauge_mm <= high else None


@dataclass(frozen=True)
class OtherTrack:
    """A track without a guide, on average `left_m` to the left of another one, between two chainages of the guide."""

    first_m: float
    last_m: float
    left_m: float


@dataclass(frozen=True)
class AirborneTrack:
    """The stations of a track along its guide; lengths in metres unless the name states millimetres.

    Attributes
    ----------
    track_id : (n,) int array
        Line that each station belongs to, 0 where there is none.
    xyz : (n, 3) array
        Middle of the track at the top of its rails, local metres.
    s_m : (n,) array
        Chainage along the guide.
    seen : (n,) int array
        1 where the track is seen.
    sigma_mm, sigmaz_mm : (n,) arrays
        Standard errors across and of the height, without the flight's own error.
    bed_m : (n,) array
        Height of the bed above the zero of the cloud's heights.
    cant_mm : (n,) array
        Left minus right, seen along the guide.
    radius_m, grade_pm : (n,) arrays
        Radius in plan, positive to the left, and gradient, per mille.
    margin : (n,) array
    reason : tuple of str
        Why a station is not seen; empty where it is.
    """

    guide: Guide
    track_id: np.ndarray
    xyz: np.ndarray
    s_m: np.ndarray
    seen: np.ndarray
    sigma_mm: np.ndarray
    sigmaz_mm: np.ndarray
    bed_m: np.ndarray
    cant_mm: np.ndarray
    radius_m: np.ndarray
    grade_pm: np.ndarray
    margin: np.ndarray
    reason: tuple[str, ...]
    others: tuple[OtherTrack, ...] = ()

    @property
    def guide_id(self) -> int:
        """Number of the guide."""
        return self.guide.guide_id

    @property
    def name(self) -> str:
        """Name of the guide."""
        return self.guide.name

    @property
    def ref(self) -> str:
        """Reference of the guide."""
        return self.guide.ref


@dataclass(frozen=True)
class AirborneLine:
    """A centerline, `xyz` (n, 3) local metres, where its track is seen; fields as in `fields.AIRBORNE_FIELDS`."""

    xyz: np.ndarray
    track_id: int
    guide_id: int
    length_m: float
    seen_m: float
    sigma_mm: float
    sigmaz_mm: float
    gauge_mm: float
    name: str
    ref: str
    hint: int


@dataclass(frozen=True)
class Survey:
    """What a run has found: a track for each guide, its lines, and the points per square metre along the guides."""

    tracks: tuple[AirborneTrack, ...]
    lines: tuple[AirborneLine, ...]
    frame: LocalFrame
    density: float
    warnings: tuple[str, ...] = ()

    @property
    def guides_m(self) -> float:
        """Length of the guides, in whole sections."""
        return STATION_M * sum(len(track.s_m) for track in self.tracks)

    @property
    def seen_m(self) -> float:
        """Length on which tracks are seen."""
        return STATION_M * float(sum(track.seen.sum() for track in self.tracks))


def track_of(
    guide: Guide,
    stations: Stations,
    spacing_m: float,
    rail_height_m: float,
    frame: LocalFrame,
    others: Sequence[OtherTrack] = (),
) -> AirborneTrack:
    """Compute the figures of a track from its stations, whose places are local metres of `frame`."""
    seen = stations.reason == SEEN
    z = stations.bed + rail_height_m
    xyz = np.column_stack([stations.xy, z])
    radius_m, grade_pm = _shape_of(xyz, seen)
    bed_m = stations.bed + frame.origin[2] * frame.vertical_unit_m
    return AirborneTrack(
        guide,
        np.zeros(len(seen), dtype=np.int64),
        xyz,
        stations.t,
        seen.astype(np.int64),
        1000 * stations.sigma,
        1000 * np.hypot(stations.sigma_bed, BED_SIGMA_M),
        np.where(seen, bed_m, np.nan),
        np.where(seen, 1000 * spacing_m * stations.tilt, np.nan),
        radius_m,
        grade_pm,
        stations.margin,
        tuple(_reason(code, switch) for code, switch in zip(stations.reason.tolist(), stations.switch.tolist())),
        tuple(others),
    )


def _reason(code: int, switch: bool) -> str:
    return REASONS[code] if code != SEEN or not switch else SWITCH


SWITCH = "seen, at a switch: another track is less than 3 m away"


def _shape_of(xyz: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return radius, metres, and gradient, per mille, of parabolas through the stations around each, (n,) each."""
    arm = int(ARM_M / STATION_M)
    radius, grade = np.full(len(xyz), np.nan), np.full(len(xyz), np.nan)
    for at in np.flatnonzero(seen):
        part = slice(max(at - arm, 0), at + arm + 1)
        place = xyz[part][seen[part]]
        if len(place) < arm:
            continue
        direction = place[-1, :2] - place[0, :2]
        direction /= np.hypot(*direction)
        step = place - xyz[at]
        along = step[:, :2] @ direction
        across = step[:, 1] * direction[0] - step[:, 0] * direction[1]
        bend, lean, _ = np.polyfit(along, across, 2)
        curvature = 2 * bend / (1 + lean**2) ** 1.5
        if abs(curvature) > 1 / MAX_RADIUS_M:
            radius[at] = 1 / curvature
        grade[at] = 1000 * np.polyfit(along, place[:, 2], 1)[0]
    return radius, grade


def lines_of(
    tracks: Sequence[AirborneTrack], gauge_mm: float, hints: bool = False
) -> tuple[tuple[AirborneTrack, ...], tuple[AirborneLine, ...]]:
    """Draw the lines of tracks where they are seen, and number the stations by them.

    `gauge_mm` is for guides that state none; with `hints` the cloud is too sparse for more.
    """
    numbered: list[AirborneTrack] = []
    lines: list[AirborneLine] = []
    for track in tracks:
        ids = np.zeros(len(track.s_m), dtype=np.int64)
        for part in _runs(track):
            seen = track.seen[part].astype(bool)
            ids[part] = len(lines) + 1
            xyz = _drawn(track, part)
            lines.append(
                AirborneLine(
                    xyz,
                    len(lines) + 1,
                    track.guide_id,
                    float(length_along(xyz)[-1]),
                    float(seen.sum() * STATION_M),
                    _rms(track.sigma_mm[part][seen]),
                    _rms(track.sigmaz_mm[part][seen]),
                    1000 * track.guide.gauge_m if track.guide.gauge_m else gauge_mm,
                    track.name,
                    track.ref,
                    int(hints),
                )
            )
        numbered.append(replace(track, track_id=ids))
    return tuple(numbered), tuple(lines)


def _runs(track: AirborneTrack) -> Iterator[slice]:
    """Yield the stations of each line: from one that is seen to one that is, without a longer gap."""
    seen = np.flatnonzero(track.seen)
    if not len(seen):
        return
    for run in np.split(seen, np.flatnonzero(np.diff(track.s_m[seen]) > MAX_UNSEEN_M + STATION_M) + 1):
        if len(run) >= LEAST_STATIONS:
            yield slice(int(run[0]), int(run[-1]) + 1)


def _drawn(track: AirborneTrack, part: slice) -> np.ndarray:
    """Return the vertices of a line through stations, (n, 3), from half a section before to half a section behind."""
    s_m = track.s_m[part]
    count = int(np.ceil((s_m[-1] - s_m[0] + STATION_M) / VERTEX_M))
    at = np.linspace(s_m[0] - STATION_M / 2, s_m[-1] + STATION_M / 2, count + 1)
    return CubicSpline(s_m, track.xyz[part])(at)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def joined_others(places: np.ndarray) -> tuple[OtherTrack, ...]:
    """Join places beside a track, (k, 2) chainages and distances, to tracks without a guide."""
    found: list[OtherTrack] = []
    for t, left in places[np.argsort(places[:, 0])].tolist():
        for number, one in enumerate(found):
            if abs(one.left_m - left) < SAME_OTHER_M:
                found[number] = OtherTrack(one.first_m, t, (one.left_m + left) / 2)
                break
        else:
            found.append(OtherTrack(t, t, left))
    return tuple(found)
