"""Random track layouts by family: what a railway lays, from a plain track to a yard.

Layouts are drawn with rail centres 1511.2 mm apart. Any other standard is the same picture at another scale
(docs/method.md section 2.1), except for the ratio of gauge to railhead. Gribov and Chang have two strategies: splits
along random alignments, of which most families are variations, and random points joined by clothoids, `connections`.
Like theirs, the layouts include many that no railway would build, so that they include all that railways do build.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..curves import Curve, Element, trace
from .alignments import (
    HALF_LENGTH_M,
    MIN_RADIUS_M,
    TRACK_SPACING_M,
    bend,
    random_alignment,
    random_radius,
    shifted,
    straight,
)
from .clothoids import Pose, random_joins
from .fittings import GUARD_LENGTH_M, OPENING_M, check_rail, crossing, frog, guard
from .paths import NO_TRACK, STEP_M, Layout, RailPath, TrackSize, beside, combine, track
from .turnouts import BLADE_LENGTH_M, FORMS, YARD_FORMS, branch, crossover, turnout, visible_from

CHECKED_RADIUS_M = 200.0
"""Radius below which a curve may have a check rail along its inner rail."""

YARD_SPACING_M = (4.5, 6.0)

CROSSING_ANGLES = (1 / 9, math.pi / 2)
"""Smallest and largest angle of diamond crossings, radians: the flattest with fixed frogs, and a right angle."""

GAUGE_PAIRS = ((0.914, 1.067), (1.000, 1.435), (1.067, 1.435), (1.435, 1.668), (1.435, 1.676))
"""Pairs of gauges that share a rail, metres; gauges closer to each other need four rails."""

SLIP_ANGLES = (1 / 10, 1 / 6)
"""Angles of crossings with slips, radians."""
SLIP_TANGENT_M = (8.0, 13.0)
"""Distance from the crossing of the axes to the toes of a slip."""

BLADE_OPENING_M = (0.10, 0.20)
"""Distance of an open blade's tip from where it lies when closed: room for a flange, from tramways to main lines."""

BUFFER_LENGTH_M = (1.8, 3.0)
BUFFER_AHEAD_M = (0.0, 0.6)
"""Distance from the beam of a buffer stop to the ends of the rails."""

AREA_M, POSES = 40.0, 14
"""Half the side of the square in which points to be joined are drawn, and their number; with this number, some pairs
can be joined."""


def random_layout(rng: np.random.Generator, size: TrackSize, family: str | None = None) -> Layout:
    """Draw a layout of a family; by default, one of `FAMILIES` is drawn by `WEIGHTS`."""
    if family is None:
        names = list(WEIGHTS)
        family = names[rng.choice(len(names), p=np.array(list(WEIGHTS.values())) / sum(WEIGHTS.values()))]
    return {**FAMILIES, **RARE_FAMILIES}[family](rng, size)


def plain(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one track, straight or nearly straight."""
    axis = straight(rng) if rng.random() < 0.5 else bend(rng, random_radius(rng, 1500.0), (int(rng.choice([-1, 1])),))
    return track(axis, size, spot=True)


def curve(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one track in a curve of at least 25 m radius or in a reverse curve; sharp ones may have a check rail."""
    turn, radius_m = int(rng.choice([-1, 1])), random_radius(rng, MIN_RADIUS_M, 1500.0)
    axis = bend(rng, radius_m, (turn,) if rng.random() < 0.6 else (turn, -turn))
    checked = radius_m < CHECKED_RADIUS_M and rng.random() < 0.3
    lines = (check_rail(rng, axis, turn, size),) if checked else ()
    return combine([track(axis, size, spot=True), Layout(distractors=lines)])


def parallel(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay two to four parallel tracks along a random alignment."""
    return _tracks(_parallels(rng, int(rng.choice([2, 3, 4], p=[0.6, 0.3, 0.1])))[1], size)


def split(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one or two tracks with one or two turnouts of any form (the first strategy of Gribov and Chang)."""
    _, axes, _ = _parallels(rng, int(rng.choice([1, 2], p=[0.7, 0.3])))
    parts = []
    for _ in range(int(rng.choice([1, 2], p=[0.7, 0.3]))):
        main = axes[rng.integers(len(axes))]
        main = main.reversed() if rng.random() < 0.5 else main
        toe_m = rng.uniform(0.3, 0.6) * main.length_m
        form, hand = FORMS[rng.integers(len(FORMS))], int(rng.choice([-1, 1]))
        inherited = main.curvature[int(toe_m / main.step_m)]
        if abs(inherited + hand / form.radius_m) > 1 / MIN_RADIUS_M:
            hand = -hand
        parts.append(turnout(rng, main, toe_m, form, hand, size))
    return combine([*(track(axis, size) for axis in axes), *parts])


def crossed_over(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay two parallel tracks with one crossover, or with two that cross each other."""
    axis, axes, (first, second) = _parallels(rng, 2, min_radius_m=150.0)
    form = YARD_FORMS[rng.integers(2, len(YARD_FORMS))]
    ways = [(first, second)] if rng.random() < 0.7 else [(first, second), (second, first)]
    parts = [crossover(rng, axis, way, HALF_LENGTH_M, form, size) for way in ways]
    return combine([*(track(one, size) for one in axes), *parts])


def diamond(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay two tracks that cross, in most cases with guard rails through the middle."""
    axis = straight(rng) if rng.random() < 0.6 else bend(rng, random_radius(rng, 190.0), (1,))
    angle = rng.choice([-1, 1]) * math.exp(rng.uniform(*np.log(CROSSING_ANGLES)))
    return _crossed(rng, axis, angle, size)


def _crossed(rng: np.random.Generator, axis: Curve, angle: float, size: TrackSize) -> Layout:
    """Lay a track and a straight one that crosses its middle at an angle, radians; see `diamond`."""
    middle = len(axis.xy) // 2
    other = straight(rng)
    cosine, sine = (f(axis.heading[middle] + angle - other.heading[0]) for f in (math.cos, math.sin))
    turned = other.xy @ np.array([[cosine, sine], [-sine, cosine]]) + axis.xy[middle]
    other = Curve(turned, np.full(len(turned), axis.heading[middle] + angle), other.curvature, other.step_m)
    parts = [track(axis, size, spot=True), track(other, size)]
    places = [crossing(first.xy, second.xy) for first in parts[0].rails for second in parts[1].rails]
    openings = tuple((parts[0].rails[n // 2].xy[at[0]], rng.uniform(*OPENING_M)) for n, at in enumerate(places) if at)
    guards = []
    if rng.random() < 0.7:
        for one in (axis, other):
            centre = int(np.linalg.norm(one.xy - axis.xy[middle], axis=1).argmin())
            guards += [guard(rng, one, centre, side, size, GUARD_LENGTH_M) for side in (1, -1)]
    return combine([*parts, Layout((), tuple(guards), openings, tuple(spot for spot, _ in openings))])


def ladder(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay turnouts of one form in a row, with parallel branches."""
    form, hand = YARD_FORMS[rng.integers(1, len(YARD_FORMS))], int(rng.choice([-1, 1]))
    main = straight(rng)
    spacing_m = rng.uniform(*YARD_SPACING_M) / math.sin(form.angle)
    toes = np.arange(rng.uniform(0.1, 0.3) * main.length_m, 0.8 * main.length_m, spacing_m)
    return combine([track(main, size), *(turnout(rng, main, toe_m, form, hand, size) for toe_m in toes.tolist())])


def yard(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay four to seven parallel tracks; some end at buffer stops, some are connected by crossovers."""
    axis, axes, offsets = _parallels(rng, int(rng.integers(4, 8)), YARD_SPACING_M, min_radius_m=150.0)
    parts = []
    for one in axes:
        ends = rng.random() < 0.3
        parts.append(_buffered(rng, one, size) if ends else track(one, size, spot=True))
    for _ in range(int(rng.integers(1, 3))):
        first = int(rng.integers(len(axes) - 1))
        form = YARD_FORMS[rng.integers(1, len(YARD_FORMS))]
        there, back = (offsets[first], offsets[first + 1]), (offsets[first + 1], offsets[first])
        way = there if rng.choice([-1, 1]) == 1 else back
        parts.append(crossover(rng, axis, way, rng.uniform(0.4, 0.6) * axis.length_m, form, size))
    return combine(parts)


def dual_gauge(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one track with a third rail for a second gauge; either gauge may be the one of `size`."""
    axis = random_alignment(rng, 2 * MIN_RADIUS_M)
    third = beside(axis, _third_rail_offset(rng, size), 0)
    both = track(axis, size, spot=True)
    return Layout((*both.rails, third), spots=both.spots)


def _third_rail_offset(rng: np.random.Generator, size: TrackSize) -> float:
    """Draw a pair of gauges and return the offset of the third rail to the left of the axis, metres."""
    narrow, wide = GAUGE_PAIRS[rng.integers(len(GAUGE_PAIRS))]
    asked = narrow if rng.random() < 0.5 else wide
    third_m = (wide - narrow) / asked * (size.spacing_m - size.head_width_m)
    outside = 1 if asked == narrow else -1
    side = rng.choice([-1, 1])
    return side * (0.5 * size.spacing_m + outside * third_m)


def buffer_end(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one track that ends at a buffer stop, in some cases next to one that continues."""
    _, axes, _ = _parallels(rng, int(rng.choice([1, 2])))
    ending = axes[0].reversed() if rng.random() < 0.5 else axes[0]
    return combine([_buffered(rng, ending, size), *(track(one, size) for one in axes[1:])])


def connections(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Join random points with random directions by clothoids (the second strategy of Gribov and Chang)."""
    tracks: list[Layout] = []
    while not tracks:
        poses = [_random_pose(rng) for _ in range(POSES)]
        joins = random_joins(rng, poses, int(rng.integers(2, 7)), MIN_RADIUS_M)
        axes = [trace(elements, (start.x, start.y), start.heading, STEP_M) for start, elements in joins]
        tracks = [track(axis, size, spot=True) for axis in axes]
    return combine(tracks)


def third_rail_end(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay one track with a third rail that ends near the middle."""
    axis = random_alignment(rng, 2 * MIN_RADIUS_M)
    axis = axis.reversed() if rng.random() < 0.5 else axis
    ending = axis.piece(0.0, rng.uniform(0.4, 0.6) * axis.length_m)
    third = beside(ending, _third_rail_offset(rng, size), 0)
    return Layout((*track(axis, size).rails, third), spots=(third.xy[-1],))


def slip(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay two tracks that cross at a small angle, with a single or a double slip between them."""
    axis = straight(rng)
    angle = int(rng.choice([-1, 1])) * rng.uniform(*SLIP_ANGLES)
    tangent_m, middle, heading = rng.uniform(*SLIP_TANGENT_M), axis.xy[len(axis.xy) // 2], float(axis.heading[0])
    curvature = math.tan(0.5 * abs(angle)) / tangent_m
    parts = [_crossed(rng, axis, angle, size)]
    for start, turn in ((heading, angle), (heading + angle, -angle))[: int(rng.integers(1, 3))]:
        toe = middle - tangent_m * np.array([math.cos(start), math.sin(start)])
        arc = Element(abs(turn) / curvature, *(math.copysign(curvature, turn),) * 2)
        parts.append(track(trace([arc], tuple(toe.tolist()), start, STEP_M), size, spot=True))
    return combine(parts)


def open_blade(rng: np.random.Generator, size: TrackSize) -> Layout:
    """Lay a turnout with one blade away from its stock rail, as wide as a wheel needs, up to its tip."""
    main = straight(rng) if rng.random() < 0.5 else bend(rng, random_radius(rng, 500.0), (1,))
    toe_m, hand = rng.uniform(0.3, 0.6) * main.length_m, int(rng.choice([-1, 1]))
    side = branch(main, toe_m, FORMS[rng.integers(2, len(FORMS))], hand, rng.uniform(15.0, 45.0))
    ahead, half_m = main.piece(toe_m, main.length_m), 0.5 * size.spacing_m
    opening_m, blade_m = rng.uniform(*BLADE_OPENING_M), rng.uniform(*BLADE_LENGTH_M)

    def bent_m(curve: Curve) -> np.ndarray:
        return opening_m * np.clip(1 - STEP_M * np.arange(len(curve.xy)) / blade_m, 0, 1) ** 2

    rails = [beside(main, -hand * half_m, 0), beside(side, hand * half_m, 0)]
    if rng.random() < 0.5:  # set for the main track
        rails += [beside(main, hand * half_m, 0), beside(side, hand * (bent_m(side) - half_m), 0)]
    else:
        closed = side.piece(visible_from(rng), side.length_m)
        rails += [beside(main.piece(0.0, toe_m), hand * half_m, 0), beside(closed, -hand * half_m, 0)]
        rails += [beside(ahead, hand * (half_m - bent_m(ahead)), 0)]
    fittings, _ = frog(rng, ahead, side, hand, size)
    return combine([Layout(tuple(rails), spots=(ahead.xy[int(2.0 / STEP_M)],)), fittings])


FAMILIES: dict[str, Callable[[np.random.Generator, TrackSize], Layout]] = {
    "plain": plain,
    "curve": curve,
    "parallel": parallel,
    "turnout": split,
    "crossover": crossed_over,
    "diamond": diamond,
    "ladder": ladder,
    "yard": yard,
    "dual gauge": dual_gauge,
    "buffer end": buffer_end,
    "connections": connections,
}

WEIGHTS = {
    "plain": 1.0,
    "curve": 2.0,
    "parallel": 2.0,
    "turnout": 3.0,
    "crossover": 1.5,
    "diamond": 1.0,
    "ladder": 1.0,
    "yard": 1.5,
    "dual gauge": 1.0,
    "buffer end": 0.5,
    "connections": 2.5,
}
"""Frequency of each family in training: common and difficult ones are drawn more often."""

RARE_FAMILIES: dict[str, Callable[[np.random.Generator, TrackSize], Layout]] = {
    "third rail end": third_rail_end,
    "slip": slip,
    "open blade": open_blade,
}
"""Families that only training draws, equally often; the benchmark has `FAMILIES`."""


def _parallels(
    rng: np.random.Generator,
    count: int,
    spacing_m: tuple[float, float] = TRACK_SPACING_M,
    min_radius_m: float = MIN_RADIUS_M,
) -> tuple[Curve, list[Curve], tuple[float, ...]]:
    """Draw an alignment, axes parallel to it, and their offsets to its left; the middle axis is at the origin."""
    offsets = np.concatenate([[0.0], np.cumsum(rng.uniform(*spacing_m, size=count - 1))])
    offsets -= offsets[count // 2]
    axis = random_alignment(rng, min_radius_m + np.abs(offsets).max())
    return axis, [shifted(axis, offset) for offset in offsets.tolist()], tuple(offsets.tolist())


def _random_pose(rng: np.random.Generator) -> Pose:
    x, y = rng.uniform(-AREA_M, AREA_M, size=2).tolist()
    return Pose(x, y, rng.uniform(-math.pi, math.pi))


def _tracks(axes: list[Curve], size: TrackSize) -> Layout:
    return combine(track(axis, size, spot=True) for axis in axes)


def _buffered(rng: np.random.Generator, axis: Curve, size: TrackSize) -> Layout:
    """Lay a track that ends near its middle, with the beam of a buffer stop, which is not a rail."""
    axis = axis.piece(0.0, rng.uniform(0.4, 0.6) * axis.length_m)
    end, normal = axis.xy[-1], axis.left_normal[-1]
    forward = np.array([normal[1], -normal[0]])
    along = np.arange(-0.5, 0.5, STEP_M / BUFFER_LENGTH_M[1]) * rng.uniform(*BUFFER_LENGTH_M)
    beam = end - rng.uniform(*BUFFER_AHEAD_M) * forward + along[:, None] * normal
    line = RailPath(beam, np.tile(forward, (len(beam), 1)), NO_TRACK)
    ended = track(axis, size)
    return Layout(ended.rails, (line,), spots=(end,))
