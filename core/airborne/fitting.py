"""The tracks along guides, fitted together, with the verdict on every station: seen, or why not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from ..progress import SILENT, Progress
from .guide_line import SECTION_M, STATION_M, GuidePoints, gather
from .ridges import BIN_M, HALF_M, RidgeShape
from .rounds import REACHES_M, REPEATED_M, WIDE_M, Beside, Refined, Traced, look_beside, refine, strip_error
from .search import (
    APART_M,
    LONG,
    TRACKS_APART_M,
    Evidence,
    GuideCourse,
    certainty,
    courses,
    evidence,
    groups,
    slopes,
)

LONG_GAIN = 7.0
"""Gain that two rails must have over 70 m: roads, hedges and ditches stay below."""

OWN_GAIN = 4.0
"""Gain with which a section shows a track by itself."""

CHANCE = 1.5
"""Standard deviations by which the gain of a section may be below the expected gain E: noise changes it by √(2 E)."""

RIVAL_SHARE = 1.1
"""Share of a line's score over 70 m that no place so close that it excludes the line may have."""

REPEATED_SHARE = 0.6
"""The same for places closer than a gauge, where no switch is: the furrows of a field repeat."""

SURE = 0.9
"""Least likelihood that the guide means this track and not another one."""

MARGIN = 3.0
"""Least score of the course above that of one elsewhere."""

SWITCH_M, TOE_M, TOE_FACTOR = 3.0, 0.5, 2.0
"""Two results this close are those of a switch; this close, both pull each other, and the standard error grows by this
factor."""

SHARED, FOOTPRINT_SHARE = 1.2, 0.015
"""Neighbouring sections share errors, by sleepers and by waves of the ballast, which the curve takes as independent:
its standard error is this much too small. What ballast beside the rails adds, as a share of the footprint."""

BED_SIGMA_M = 0.03
"""Standard deviation of the rails' height above the bed, which depends on the fill of the ballast."""

ASIDE_M, ASIDE_SIGMAS = 0.15, 3.0
"""A section whose own rails lie farther from the curve than this, and by more of its own standard errors, does not
support it."""

FEW_POINTS = 8
"""Points on the bed of a section up to which it shows nothing."""

MAX_SIGMA_M = 0.05
"""Standard error above which a station is not seen: of those below, 95 % lie within 10 cm."""

REASONS = (
    "",
    "too few points: a bridge above, a tunnel, or a gap of the cloud",
    "no two rails show: something covers them, or they do not stand out of their bed",
    "what shows there is not a bed with two rails: the edge of a platform, a trough, or the space between two tracks",
    "another track fits the guide as well: give each track of the line a guide",
    "two guides lead to this track: move one of them onto its own track",
    "the rails found there lie beside the curve",
    "too few points per square metre for this footprint",
)
"""Why a station is not seen; the first is that of a station that is."""

SEEN, EMPTY, HIDDEN, MISLED, UNSURE, TWIN, ASIDE, SPARSE = range(len(REASONS))


@dataclass(frozen=True)
class TrackStations:
    """Stations of a track every `STATION_M` along its guide, (n,) arrays; lengths in metres.

    `t` is the chainage along the guide, `xy`, (n, 2), the middle of the track, `bed` the height of the bed there, and
    `tilt` its rise per metre to the left; `sigma` and `sigma_bed` are the standard errors across and of the bed's
    height. `margin` is the score of the place above that of another one, `reason` a place in `REASONS`, 0 where the
    track is seen, and `switch` holds where another track begins or ends beside it.
    """

    t: np.ndarray
    xy: np.ndarray
    bed: np.ndarray
    tilt: np.ndarray
    sigma: np.ndarray
    sigma_bed: np.ndarray
    margin: np.ndarray
    reason: np.ndarray
    switch: np.ndarray


@dataclass(frozen=True)
class Fitted:
    """What was found along a guide.

    `shape` has the ridges as they were measured, None where no track was found; `shown_m` is the distance of the rails
    that the points show where it is clearly not the expected one, else NaN. `others`, (k, 2), holds chainages and
    distances to the left of places that look like tracks and have no guide.
    """

    stations: TrackStations
    shape: RidgeShape | None
    shown_m: float
    others: np.ndarray


def fit_tracks(
    xyz: np.ndarray,
    strip: np.ndarray,
    axes: Sequence[Polyline],
    spacings_m: Sequence[float],
    reach_m: float,
    footprint_m: float,
    progress: Progress = SILENT,
) -> list[Fitted]:
    """Fit the tracks along the guides of a line to the points around them, `xyz` (n, 3), metres.

    `strip`, (n,), is the number of each point's strip, `spacings_m` the distance between the middles of the railheads
    by guide, `reach_m` the largest distance of a track from its guide, and `footprint_m` the diameter of the beam on
    the ground.
    """
    shapes = [RidgeShape.expected(spacing_m, footprint_m) for spacing_m in spacings_m]
    looking, fitting = progress.divide((3.0, 2.0))
    near: list[GuidePoints] = []
    found: list[tuple[int, Evidence]] = []
    for number, axis in looking.follow(list(enumerate(axes)), len(axes)):
        near.append(GuidePoints.near(axis, xyz, strip, reach_m + WIDE_M + HALF_M))
        corridor = gather(near[number], axis, reach_m + HALF_M + slopes()[-1] * SECTION_M / 2)
        if corridor is not None:
            found.append((number, evidence(corridor, reach_m, shapes[number])))
    numbers = [number for number, _ in found]
    own, scores = courses([axes[number] for number in numbers], [one for _, one in found])
    lines: dict[int, _Line] = {}
    together = groups([axes[number] for number in numbers])
    for group in fitting.follow(together):
        tracks = [
            Traced(near[numbers[one]], axes[numbers[one]], own[one].across, shapes[numbers[one]]) for one in group
        ]
        for one, refined in zip(group, refine(tracks)):
            if refined is not None:
                sure = certainty(own[one], scores[one], found[one][1].across)
                lines[numbers[one]] = _Line.seen(near[numbers[one]], refined, own[one], sure)
    return _judged(axes, lines, footprint_m)


@dataclass(frozen=True)
class _Line:
    refined: Refined
    course: GuideCourse
    sure: np.ndarray
    beside: Beside | None

    @classmethod
    def seen(cls, points: GuidePoints, refined: Refined, course: GuideCourse, sure: np.ndarray) -> _Line:
        """Look beside a line that was fitted."""
        wide = gather(points, refined.line, WIDE_M + HALF_M)
        beside = None if wide is None else look_beside(wide, refined.seen.shape, len(refined.t))
        return cls(refined, course, sure, beside)


def _judged(axes: Sequence[Polyline], lines: dict[int, _Line], footprint_m: float) -> list[Fitted]:
    """Judge every station of every line, also by the other lines."""
    judged = []
    for number, axis in enumerate(axes):
        if number not in lines:
            judged.append(_nothing(axis))
            continue
        line, refined = lines[number], lines[number].refined
        distance, apart = _others(number, axes, lines)
        toe = np.where(distance < TOE_M, TOE_FACTOR, 1.0)
        blur = FOOTPRINT_SHARE * footprint_m
        sigma = toe * np.sqrt((SHARED * refined.curve.sigma) ** 2 + blur**2 + strip_error(refined) ** 2)
        reason = _reasons(line, distance < SWITCH_M)
        reason[(reason == SEEN) & (sigma > toe * MAX_SIGMA_M)] = SPARSE
        reason[(reason == SEEN) & (distance < APART_M) & (apart > TRACKS_APART_M)] = TWIN
        stations = TrackStations(
            refined.t,
            refined.curve.xy,
            refined.bed,
            refined.seen.sections.found.tilt,
            sigma,
            refined.sigma_bed,
            line.course.margin[np.minimum(np.arange(len(reason)) * 2, len(line.course.margin) - 1)],
            reason,
            distance < SWITCH_M,
        )
        judged.append(Fitted(stations, refined.seen.shape, refined.seen.shown_m, _unclaimed(number, lines)))
    return judged


def _nothing(axis: Polyline) -> Fitted:
    """Return the stations of a guide along which no track was found."""
    t = axis.t[0] + (np.arange(max(int(np.ceil((axis.t[-1] - axis.t[0]) / STATION_M)), 1)) + 0.5) * STATION_M
    unknown = np.full(len(t), np.nan)
    reason = np.full(len(t), HIDDEN)
    stations = TrackStations(
        t, axis.at(t), unknown, unknown, unknown, unknown, np.zeros(len(t)), reason, np.zeros(len(t), bool)
    )
    return Fitted(stations, None, np.nan, np.empty((0, 2)))


def _reasons(line: _Line, switch: np.ndarray) -> np.ndarray:
    """Return why the stations of a line are not seen, by what shows along it; at a `switch`, (n,), it shows twice."""
    refined, sections = line.refined, line.refined.seen.sections
    most = sections.found.most
    own = sections.found.both > np.minimum(OWN_GAIN, most - CHANCE * np.sqrt(2 * most))
    own &= np.abs(sections.offset) < REACHES_M[-1] - BIN_M
    shown, flat = _over_70_m(line.beside, switch) if line.beside is not None else (own, own)
    half = np.minimum(np.arange(len(own)) * 2, len(line.sure) - 1)
    reason = np.full(len(own), SEEN)
    for code, holds in (
        (UNSURE, (line.sure[half] < SURE) | (line.course.margin[half] < MARGIN)),
        (ASIDE, np.abs(refined.curve.beside) > np.maximum(ASIDE_M, ASIDE_SIGMAS * sections.sigma)),
        (MISLED, ~flat),
        (HIDDEN, ~own | ~shown | _off_level(refined)),
        (EMPTY, sections.points <= FEW_POINTS),
    ):
        reason[holds] = code
    return reason


def _over_70_m(beside: Beside, switch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where two rails show, and where they lie on a flat bed that no other place excludes, (n,) bool each.

    Of the 70 m before, around and behind a station, the best count: beside a train, those on its other side.
    """
    gain, score = beside.on
    around = np.arange(len(gain)) + np.array([[-(LONG // 2)], [0], [LONG // 2]])
    around = np.clip(around, 0, len(gain) - 1)
    best = np.take_along_axis(around, score[around].argmax(axis=0)[None], axis=0)[0]
    flat = (score > LONG_GAIN) & (beside.rival < RIVAL_SHARE * score)
    alone = beside.repeated < REPEATED_SHARE * score
    return (gain > LONG_GAIN)[best], flat[best] & (alone[best] | switch)


JUMP_M = 1.0
"""Change of the bed's height over a station, beyond the gradient of the line, that no track makes: a train stands
there, a bridge crosses above, or the ground shows through an open one."""


def _off_level(refined: Refined) -> np.ndarray:
    """Return which stations lie on another level than most of the line, (n,) bool."""
    step = np.diff(refined.seen.sections.found.level + refined.seen.corridor.level_at(refined.t), prepend=np.nan)
    step = np.nan_to_num(step - np.nanmedian(step)) if len(step) > 1 else np.zeros(len(step))
    level = np.cumsum(np.where(np.abs(step) > JUMP_M, step, 0.0))
    return np.abs(level - np.median(level)) > JUMP_M


VERTEX_M = 0.1
"""Distance between the places on a line from which distances are measured."""


def _others(number: int, axes: Sequence[Polyline], lines: dict[int, _Line]) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of each station from the nearest other line, and how far apart their guides are there."""
    own = lines[number].refined.curve.xy
    distance, apart = np.full(len(own), np.inf), np.full(len(own), np.inf)
    for other, line in lines.items():
        if other == number:
            continue
        away = _places([line]).query(own)[0]
        guides = cKDTree(axes[other].xy).query(axes[number].xy)[0]
        at = np.linspace(0, len(guides) - 1, len(own)).round().astype(np.int64)
        nearer = away < distance
        distance, apart = np.where(nearer, away, distance), np.where(nearer, guides[at], apart)
    return distance, apart


def _places(lines: Iterable[_Line]) -> cKDTree:
    """Return the places on lines, from which distances are measured."""
    return cKDTree(np.concatenate([Polyline(line.refined.curve.xy).resampled(VERTEX_M).xy for line in lines]))


def _unclaimed(number: int, lines: dict[int, _Line]) -> np.ndarray:
    """Return chainages and distances of places beside a line that look like tracks without a guide, (k, 2)."""
    line = lines[number]
    if line.beside is None:
        return np.empty((0, 2))
    known = _places(lines.values())
    on = line.beside.on[1]
    found = []
    for section in range(min(LONG // 2, len(on) - 1), len(on), LONG):
        t, own, score = float(line.refined.t[section]), on[section], line.beside.score[section]
        for side in (-1, 1):
            there = np.where(side * line.beside.across > TRACKS_APART_M, score, -np.inf)
            best = int(there.argmax())
            at, across = np.array([t]), line.beside.across[best]
            place = line.refined.line.at(at) + across * line.refined.line.left_at(at)
            free = known.query(place)[0][0] > REPEATED_M
            if min(own, there[best]) > LONG_GAIN and free:
                found.append((t, float(across)))
    return np.array(found).reshape(-1, 2)
