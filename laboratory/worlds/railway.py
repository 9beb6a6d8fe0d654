"""Tracks drawn at random: standard, gauge, course, cant, heights, and switches and crossings between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.standards import STANDARDS, RailStandard
from ..curves import Curve, Element, trace
from ..rasters.alignments import bent, shifted
from ..rasters.turnouts import FORMS, TurnoutForm, branch
from ..scenes.plain import canted, spacing
from ..scenes.raw_world import along_and_left
from ..scenes.tracks import Track
from ..scenes.uneven import uneven
from .draws import chosen, even_in_log, maybe, one_of, stream

LENGTH_M = (60.0, 120.0)

TRAM_STANDARDS = ("EN_49E1_1435", "EN_49E1_1000", "S41_1000", "EN_54E1_1435", "EN_46E2_1435")

FAMILIES = {"main line": 0.5, "yard": 0.15, "narrow gauge": 0.12, "tram": 0.13, "metro": 0.10}
"""Shares of the kinds of railways."""

LEAST_RADIUS_M = {"main line": 250.0, "yard": 140.0, "narrow gauge": 60.0, "tram": 25.0, "metro": 120.0}

TRACKS = {
    "main line": {1: 30, 2: 40, 3: 14, 4: 10, 5: 3, 6: 3},
    "yard": {2: 20, 3: 20, 4: 20, 5: 15, 6: 10, 7: 8, 8: 7},
    "narrow gauge": {1: 60, 2: 25, 3: 15},
    "tram": {1: 25, 2: 65, 3: 10},
    "metro": {1: 40, 2: 60},
}
"""Numbers of tracks beside each other, and their shares."""

CANTED_M, TWIST = 800.0, 1 / 300
"""Radius above which the cant is in proportion to the curvature, and the steepest change of cant along a track."""

APART_M = {
    "main line": (3.7, 7.0),
    "yard": (4.2, 5.5),
    "narrow gauge": (3.4, 5.0),
    "tram": (3.2, 4.2),
    "metro": (3.4, 5.0),
}
"""Distances of the axes of neighbouring tracks."""

PLAIN, TURNOUT, LADDER, CROSSOVER, DIAMOND, SINGLE_SLIP, DOUBLE_SLIP, THREE_WAY, DUAL_GAUGE = (
    *("plain", "turnout", "ladder", "crossover", "diamond", "single slip", "double slip", "three-way"),
    "dual gauge",
)

LAYOUTS: dict[str, dict[str, float]] = {
    "main line": {PLAIN: 62, TURNOUT: 18, CROSSOVER: 10, DIAMOND: 3, SINGLE_SLIP: 1.5, DOUBLE_SLIP: 1.5, DUAL_GAUGE: 4},
    "yard": {
        PLAIN: 35,
        TURNOUT: 25,
        LADDER: 20,
        CROSSOVER: 8,
        DIAMOND: 3,
        SINGLE_SLIP: 2,
        DOUBLE_SLIP: 4,
        THREE_WAY: 3,
    },
    "narrow gauge": {PLAIN: 70, TURNOUT: 25, CROSSOVER: 5},
    "tram": {PLAIN: 70, TURNOUT: 25, CROSSOVER: 5},
    "metro": {PLAIN: 80, TURNOUT: 10, CROSSOVER: 10},
}
"""Shares of what tracks do."""

FORM_RADII_M = {"tram": (20.0, 100.0), "narrow gauge": (40.0, 320.0), "yard": (150.0, 320.0)}
"""Radii of the turnouts of a kind of railway; others have any from 150 m upwards."""

FREE_M = 12.0
"""Plain track before the first and behind the last switch."""

LADDER_APART_M = (25.0, 40.0)
"""Distance of the toes of the two turnouts of a ladder, which leave to the same side: from the length of one on."""


@dataclass(frozen=True)
class Railway:
    """Tracks in space, all in the direction of the scanner, which rides on the first.

    They are `plain` if all are parallel throughout; for the crown, see `raw_world.World`.
    """

    family: str
    layout: str
    standard: RailStandard
    tracks: tuple[Track, ...]
    plain: bool
    other_gauges_m: tuple[float, ...] = ()
    crown: float = 1.0

    @property
    def reference(self) -> Curve:
        """The line of the track that the scanner rides on."""
        return self.tracks[0].curve

    @property
    def lefts_m(self) -> tuple[float, float]:
        """How far to the right and to the left of the reference line the parallel tracks are."""
        lefts = [track.left_m for track in self.tracks if track.curve is self.reference]
        return min(lefts), max(lefts)


def draw_railway(seed: int) -> Railway:
    """Draw the tracks of a world."""
    rng = stream(seed, "railway")
    family = chosen(rng, FAMILIES)
    layout = chosen(rng, LAYOUTS[family])
    standard = _standard(rng, family, layout)
    count = chosen(rng, TRACKS[family])
    lefts = _lefts(rng, family, max(count, 2) if layout == CROSSOVER else count)
    curve = _course(rng, family, layout, lefts)
    through = _through(rng, family, layout, standard, curve, lefts)
    added = _added(rng, family, layout, standard, through)
    tracks: tuple[Track, ...] = (*through, *added)
    other: tuple[float, ...] = ()
    if layout == DUAL_GAUGE:
        narrow = STANDARDS["EN_49E1_1000"]
        tracks, other = (*tracks, _third(rng, through[0], spacing(narrow))), (narrow.gauge_m,)
    plain = not added
    if plain and layout == PLAIN and maybe(rng, 0.6):
        size = rng.uniform(0.2, 1.2)
        tracks = tuple(_uneven(rng, track, size) for track in tracks)
    crown = 1.0 if maybe(rng, 0.5) else rng.uniform(0.3, 1.0)
    return Railway(family, layout, standard, tracks, plain, other, crown)


def _standard(rng: np.random.RandomState, family: str, layout: str) -> RailStandard:
    if layout == DUAL_GAUGE:
        return STANDARDS["EN_49E1_1435"]
    if family == "tram":
        return STANDARDS[one_of(rng, TRAM_STANDARDS)]
    if family == "narrow gauge":
        return one_of(rng, [one for one in STANDARDS.values() if one.gauge_m < 1.1])
    wide = [one for one in STANDARDS.values() if one.gauge_m > 1.1]
    standard = one_of(rng, wide)
    return STANDARDS["EN_60E1_1435"] if maybe(rng, 0.25) else standard


def _lefts(rng: np.random.RandomState, family: str, count: int) -> list[float]:
    """Draw where the axes of parallel tracks are, from right to left; one is at 0."""
    apart = rng.uniform(*APART_M[family]) + rng.uniform(0, 0.3, count - 1) * maybe(rng, 0.3)
    apart = np.where(rng.random_sample(count - 1) < 0.15, apart + rng.uniform(0.5, 3.0, count - 1), apart)
    lefts = np.concatenate([[0.0], np.cumsum(np.minimum(apart, 7.0))])
    return [float(left) for left in lefts - lefts[rng.randint(count)]]


def _course(rng: np.random.RandomState, family: str, layout: str, lefts: Sequence[float]) -> Curve:
    """Draw the plan of the first track."""
    length_m = rng.uniform(*LENGTH_M)
    start, heading = (float(rng.uniform(-20, 20)), float(rng.uniform(-20, 20))), float(rng.uniform(-np.pi, np.pi))
    # Beside tight curves, profiles that are perpendicular to the first track must not meet.
    least_m = max(LEAST_RADIUS_M[family], 2.2 * max(abs(left) for left in lefts))
    bend = one_of(rng, (1, -1)) / even_in_log(rng, least_m, 4000.0)
    if layout in (DIAMOND, SINGLE_SLIP, DOUBLE_SLIP, THREE_WAY) or maybe(rng, 0.3):
        return trace([Element(length_m)], start, heading)
    if layout in (TURNOUT, LADDER, CROSSOVER):
        bend = np.sign(bend) * min(abs(bend), 1 / 500)
        return trace([Element(length_m, bend, bend)], start, heading)
    kind = one_of(rng, ("arc", "arc", "transition", "reverse"))
    if kind == "arc":
        return trace([Element(length_m, bend, bend)], start, heading)
    first, second = np.sort(rng.uniform(0.15, 0.85, 2)) * length_m
    if second - first < 12.0:
        first, second = 0.3 * length_m, 0.7 * length_m
    before = -bend * rng.uniform(0.3, 1.0) if kind == "reverse" else 0.0
    elements = [
        Element(first, before, before),
        Element(second - first, before, bend),
        Element(length_m - second, bend, bend),
    ]
    return trace(elements, start, heading)


def _through(
    rng: np.random.RandomState,
    family: str,
    layout: str,
    standard: RailStandard,
    curve: Curve,
    lefts: Sequence[float],
) -> list[Track]:
    """Draw heights and cant of parallel tracks; the one at 0 comes first."""
    gradient = rng.uniform(-0.035, 0.035) if maybe(rng, 0.6) else rng.uniform(-0.005, 0.005)
    wave_m, wave_length_m = rng.uniform(0.0, 0.015), rng.uniform(50.0, 120.0)
    phase = rng.uniform(0, 2 * np.pi)
    at = curve.chainage
    height = gradient * at + wave_m * np.sin(2 * np.pi * at / wave_length_m + phase)
    steepest = 0.18 if family in ("main line", "metro") else 0.10
    largest_m = 0.0 if family == "tram" and maybe(rng, 0.7) else rng.uniform(0.0, steepest)
    sharpest = float(np.abs(curve.curvature).max())
    largest_m *= spacing(standard) / 1.5 * min(CANTED_M * sharpest, 1.0)
    cant = canted(curve, 0.0 if layout in (CROSSOVER, LADDER) else largest_m)
    cant *= min(TWIST / max(float(np.abs(np.gradient(cant, curve.step_m)).max()), 1e-9), 1.0)
    inclination = one_of(rng, (0.0, 1 / 40, 1 / 40, 1 / 20, 1 / 20))
    tracks = []
    for left in sorted(lefts, key=abs):
        lift = 0.0 if left == 0 or layout != PLAIN or maybe(rng, 0.5) else rng.uniform(-0.08, 0.08)
        own = cant + (rng.uniform(-0.004, 0.004) if layout == PLAIN else 0.0)
        tracks.append(Track(curve, spacing(standard), height + lift, own, left, inclination))
    return tracks


def _third(rng: np.random.RandomState, track: Track, spacing_m: float) -> Track:
    """Lay a third rail for a narrower gauge between the rails of a track, in their plane."""
    side = one_of(rng, (1, -1))
    left_m, slope = -side * (track.spacing_m - spacing_m) / 2, np.asarray(track.cant_m) / track.spacing_m
    height_m, cant_m = track.height_m + left_m * slope, spacing_m * slope
    return replace(track, spacing_m=spacing_m, left_m=left_m, sides=(side,), height_m=height_m, cant_m=cant_m)


def _added(
    rng: np.random.RandomState, family: str, layout: str, standard: RailStandard, through: Sequence[Track]
) -> list[Track]:
    """Draw the tracks that leave the parallel ones, join or cross them."""
    if layout in (TURNOUT, LADDER, THREE_WAY):
        curves, own = _branches(rng, family, layout, through)
    elif layout == CROSSOVER:
        curves, own = _crossovers(rng, family, through)
    elif layout in (DIAMOND, SINGLE_SLIP, DOUBLE_SLIP):
        curves, own = _crossing(rng, layout, through)
    else:
        return []
    return [_on_plane(track, curve, standard) for track, curve in zip(own, curves) if curve.length_m > 5.0]


def _axis(track: Track) -> Curve:
    """Axis of a track as a curve of its own, with even steps."""
    if track.left_m == 0:
        return track.curve
    axis = shifted(track.curve, track.left_m)
    step = np.hypot(*np.diff(axis.xy, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(step)])
    at = np.arange(0.0, along[-1], track.curve.step_m)
    xy = np.column_stack([np.interp(at, along, column) for column in axis.xy.T])
    return Curve(xy, np.interp(at, along, axis.heading), np.interp(at, along, axis.curvature), track.curve.step_m)


def _on_plane(track: Track, curve: Curve, standard: RailStandard) -> Track:
    """Lay a track in the plane of the rails of another one, whose sleepers it shares."""
    sample, _, left = along_and_left(track.curve, curve.xy)
    slope = np.broadcast_to(track.cant_m, len(track.curve.xy))[sample] / track.spacing_m
    heights = np.broadcast_to(track.height_m, len(track.curve.xy))
    grade = np.gradient(heights, track.curve.step_m)[sample]
    turn = curve.heading - track.curve.heading[sample]
    height = heights[sample] + (left - track.left_m) * slope
    cant = spacing(standard) * (slope * np.cos(turn) - grade * np.sin(turn))
    return Track(curve, spacing(standard), height, cant, inclination=track.inclination)


def _form(rng: np.random.RandomState, family: str, length_m: float) -> TurnoutForm:
    """Draw a turnout that suits a railway and a length of track."""
    radii_m = FORM_RADII_M.get(family, (150.0, np.inf))
    return one_of(
        rng,
        [
            form
            for form in FORMS
            if form.switch_m + form.arc_m + 2 * FREE_M < length_m and radii_m[0] < form.radius_m < radii_m[1]
        ],
    )


def _branches(
    rng: np.random.RandomState, family: str, layout: str, through: Sequence[Track]
) -> tuple[list[Curve], list[Track]]:
    """Draw turnouts whose branches leave the outermost tracks to the outside, in one direction or the other."""
    outer = sorted(through, key=lambda track: track.left_m)
    hand = one_of(rng, (1, -1))
    track = outer[-1] if hand > 0 else outer[0]
    axis, facing = _axis(track), maybe(rng, 0.5)
    way, turn = (axis, hand) if facing else (axis.reversed(), -hand)
    form = _form(rng, family, axis.length_m)
    room_m = axis.length_m - form.switch_m - form.arc_m - FREE_M
    toe_m = rng.uniform(FREE_M, max(room_m, FREE_M + 0.1))
    starts = [(toe_m, form, turn)]
    if layout == LADDER:
        apart_m = rng.uniform(*LADDER_APART_M)
        first_m = min(toe_m, axis.length_m - FREE_M - form.arc_m - apart_m)
        if first_m >= FREE_M:
            starts = [(at, form, turn) for at in (first_m, first_m + apart_m)]
    if layout == THREE_WAY and len(through) == 1:
        starts.append((toe_m + one_of(rng, (0.0, 3.0, 6.0)), form, -turn))
    curves = [branch(way, at, one, side, axis.length_m - at - one.switch_m - one.arc_m) for at, one, side in starts]
    return [curve if facing else curve.reversed() for curve in curves], [track] * len(curves)


def _crossovers(rng: np.random.RandomState, family: str, through: Sequence[Track]) -> tuple[list[Curve], list[Track]]:
    """Draw a crossover between neighbouring tracks; none where it is too long."""
    pair = sorted(through, key=lambda track: track.left_m)
    first = rng.randint(len(pair) - 1)
    low, high = pair[first], pair[first + 1]
    apart_m, curve = high.left_m - low.left_m, low.curve
    form = _form(rng, family, curve.length_m)
    angle = min(form.angle, np.arccos(max(1 - 0.5 * apart_m / form.radius_m, -1.0)))
    arc = Element(form.radius_m * angle, 1 / form.radius_m, 1 / form.radius_m)
    middle_m = (apart_m - 2 * form.radius_m * (1 - np.cos(angle))) / np.sin(angle)
    middle = [Element(middle_m)] if middle_m > curve.step_m else []
    reach_m = 2 * form.radius_m * np.sin(angle) + max(middle_m, 0.0) * np.cos(angle)
    room_m = curve.length_m - reach_m - FREE_M
    if room_m <= FREE_M:
        return [], []
    elements = [arc, *middle, Element(arc.length_m, -arc.start, -arc.end)]
    local = trace(elements, (rng.uniform(FREE_M, room_m), low.left_m), 0.0, curve.step_m)
    if maybe(rng, 0.5):
        mirrored = np.column_stack([local.xy[:, 0], low.left_m + high.left_m - local.xy[:, 1]])
        local = Curve(mirrored, -local.heading, -local.curvature, local.step_m)
    return [bent(curve, local)], [low]


def _crossing(rng: np.random.RandomState, layout: str, through: Sequence[Track]) -> tuple[list[Curve], list[Track]]:
    """Draw a track that crosses the straight first one, with slip curves."""
    main = through[0].curve
    number = one_of(rng, (9.0, 9.0, 7.5, 6.6)) if layout != DIAMOND else one_of(rng, (9.0, 7.5, 5.0, 4.0, 3.0))
    hand, angle = one_of(rng, (1, -1)), float(np.arctan(1 / number))
    half_m, middle_m = 0.5 * main.length_m, 0.5 * main.length_m + rng.uniform(-8.0, 8.0)
    middle = main.xy[int(middle_m / main.step_m)]
    heading = float(main.heading[0])

    def along(turned: float, back_m: float) -> tuple[float, float]:
        way = heading + turned
        return float(middle[0] - back_m * np.cos(way)), float(middle[1] - back_m * np.sin(way))

    curves = [trace([Element(2 * half_m)], along(hand * angle, half_m), heading + hand * angle)]
    radius_m = 190.0 if number >= 9 else 120.0
    tangent_m, arc_m = radius_m * np.tan(angle / 2), radius_m * angle
    bend = hand / radius_m
    slips = {DIAMOND: 0, SINGLE_SLIP: 1, DOUBLE_SLIP: 2}[layout]
    ways = [(0.0, bend), (hand * angle, -bend)]
    for turned, curvature in ways[:slips]:
        curves.append(trace([Element(arc_m, curvature, curvature)], along(turned, tangent_m), heading + turned))
    return curves, [through[0]] * len(curves)


def _uneven(rng: np.random.RandomState, track: Track, size: float) -> Track:
    """Give the rails of a track the waves and welds of service."""
    wear = {side: size * uneven(rng, track.curve.chainage) for side in track.sides}
    return replace(track, wear=wear)
