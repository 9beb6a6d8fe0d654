"""Tracks along guides as they are written, stations every 10 m and lines where a track is seen, and what a run says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from ..errors import CloudError
from ..frame import LocalFrame
from ..parameters import AirborneParameters
from ..polyline import length_along
from ..spread import rms
from ..standards import GAUGE_RANGE_MM, STANDARDS
from .fitting import BED_SIGMA_M, REASONS, SEEN, Fitted, TrackStations
from .guide_line import STATION_M
from .ridges import OTHER_M, RidgeShape

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

MOBILE_DENSITY = 500.0
"""Points per square metre above which single railheads show, and Extract Rails is better: clouds from aeroplanes have
up to 100, lidar from drones up to 400."""

SPARSE_DENSITY, WIDE_FOOTPRINT_M = 5.0, 0.4
"""Below this density, a footprint this wide hides the rails in too many sections."""

FLIGHT = (
    "The standard errors are those of the fit. They leave out the error of the flight itself against its datum, often "
    "3 to 10 cm: compare with control points."
)

WIDE_RIDGES = 1.6
"""Ridges this much wider than the footprint makes them are warned of."""

FEW_GUIDES = 5
"""A sentence names no more guides than this."""


@dataclass(frozen=True)
class GuideLine:
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

    guide: GuideLine
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
class AirborneSurvey:
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
    guide: GuideLine,
    stations: TrackStations,
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
                    rms(track.sigma_mm[part][seen]),
                    rms(track.sigmaz_mm[part][seen]),
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


def refuse_mobile(density: float) -> None:
    """Raise `CloudError` for a cloud in whose points per square metre single railheads show."""
    if density > MOBILE_DENSITY:
        raise CloudError(
            f"The cloud has {density:.0f} points per square metre, as mobile lidar and dense drone surveys have: use "
            "Extract Rails, which finds the single railheads and is more accurate there."
        )


def are_hints(density: float, parameters: AirborneParameters) -> bool:
    """Return whether lines in a cloud with this many points per square metre are only hints."""
    return density < SPARSE_DENSITY and parameters.footprint_m > WIDE_FOOTPRINT_M


def on_density(density: float, parameters: AirborneParameters) -> list[str]:
    """Warn of a cloud that is too sparse for its footprint."""
    if not are_hints(density, parameters):
        return []
    return [
        f"The cloud has {density:.1f} points per square metre, too few for a footprint of "
        f"{parameters.footprint_m:g} m: take the lines as hints."
    ]


def on_shapes(found: Sequence[Fitted], parameters: AirborneParameters, spacings_m: Sequence[float]) -> list[str]:
    """Warn of ridges that do not fit the footprint."""
    shapes = [one.shape for one in found if one.shape is not None and (one.stations.reason == SEEN).any()]
    if not shapes:
        return []
    width_m = float(np.median([shape.width_m for shape in shapes]))
    expected_m = RidgeShape.expected(spacings_m[0], parameters.footprint_m).width_m
    if width_m < WIDE_RIDGES * expected_m:
        return []
    return [
        f"The rails show as ridges with a standard deviation of {1000 * width_m:.0f} mm, wider than a footprint of "
        f"{parameters.footprint_m:g} m makes them: set the footprint of the scanner."
    ]


def on_gauges(
    guides: Sequence[GuideLine], fitted: Sequence[Sequence[Fitted]], parameters: AirborneParameters
) -> list[str]:
    """Warn of guides along which rails at another gauge show, one sentence for those that share both gauges."""
    wrong: dict[tuple[int, int, bool], list[int]] = {}
    for guide, parts in zip(guides, fitted):
        shown = [one.shown_m for one in parts if np.isfinite(one.shown_m)]
        if 2 * len(shown) > len(parts):
            stated_mm = round(1000 * (guide.gauge_m or parameters.gauge_m))
            shown_mm = _nearest_gauge(float(np.median(shown)) - parameters.head_width_m)
            if shown_mm != stated_mm:
                wrong.setdefault((shown_mm, stated_mm, guide.gauge_m is not None), []).append(guide.guide_id)
    return [
        f"Along {_guides(ids)}, rails with a gauge of about {shown_mm} mm show, not {stated_mm} mm as "
        + ("its field gauge states: correct it." if own else "the rail standard states: choose another.")
        for (shown_mm, stated_mm, own), ids in wrong.items()
    ]


def _nearest_gauge(gauge_m: float) -> int:
    """Return the gauge of a rail standard next to a measured one, millimetres, or this one rounded."""
    known_m = min((one.gauge_m for one in STANDARDS.values()), key=lambda one: abs(one - gauge_m))
    return round(1000 * known_m) if abs(known_m - gauge_m) < OTHER_M else 10 * round(100 * gauge_m)


def _guides(ids: Sequence[int]) -> str:
    ids = list(dict.fromkeys(ids))
    if len(ids) == 1:
        return f"guide {ids[0]}"
    if len(ids) > FEW_GUIDES:
        return f"{len(ids)} guides, such as guide {ids[0]}"
    return f"guides {', '.join(map(str, ids[:-1]))} and {ids[-1]}"
