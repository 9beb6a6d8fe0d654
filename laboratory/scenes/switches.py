"""Scenes of tracks with switches: turnouts, a crossover, a diamond and the throat of a yard."""

from __future__ import annotations

import numpy as np

from ...core.standards import STANDARDS
from ..curves import Curve, Element, trace
from ..rasters.turnouts import FORMS, branch
from .plain import random_gaps, spacing
from .scanner import Scanner
from .scene import Clutter, Plan, Scene, build
from .tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]
SCANNER = Scanner(noise_m=0.004)
TRACK_CENTRES_M = 4.5
FREE_M = 30.0
"""Length of plain track before the toe and behind the arc of the branch."""


def turnout(name: str, form: str, hand: int, heading: float, seed: int, curvature: float = 0.0) -> Scene:
    """Build a turnout of one of `turnouts.FORMS` in plain track.

    The branch leaves to the left with a `hand` of 1 and to the right with -1. The heading of the main track is in
    radians, its curvature in 1/m.
    """
    rng = np.random.RandomState(seed)
    shape = next(candidate for candidate in FORMS if candidate.name == form)
    main = trace([Element(2 * FREE_M + shape.arc_m, curvature, curvature)], heading=heading)
    side = branch(main, FREE_M, shape, hand, FREE_M)
    return _build(name, [main, side], rng, gaps=2)


def crossover(seed: int = 20) -> Scene:
    """Build two parallel tracks with a crossover of two 300-1:9 turnouts."""
    rng = np.random.RandomState(seed)
    main = trace([Element(120)], heading=0.5)
    second = Curve(main.offset(TRACK_CENTRES_M), main.heading, main.curvature, main.step_m)
    return _build("crossover", [main, second, _link(main, 25.0, 300.0, np.arctan(1 / 9))], rng, gaps=3)


def diamond(seed: int = 21) -> Scene:
    """Build two straight tracks that cross at 1:9 without a switch."""
    rng = np.random.RandomState(seed)
    half_m, angle = 45.0, np.arctan(1 / 9)
    tracks = [
        trace([Element(2 * half_m)], (-half_m * np.cos(heading), -half_m * np.sin(heading)), heading)
        for heading in (0.8, 0.8 + angle)
    ]
    return _build("diamond", tracks, rng, gaps=2)


def throat(seed: int = 22) -> Scene:
    """Build the throat of a yard: two ladders of 190-1:7.5 turnouts from one track to ten."""
    rng = np.random.RandomState(seed)
    form = next(candidate for candidate in FORMS if candidate.name == "190-1:7.5")
    turn = form.arc_m / form.radius_m
    apart_m = TRACK_CENTRES_M / np.sin(turn)
    main = trace([Element(270.0)], heading=-0.2)
    curves = [main]
    for hand, toe_m, count in ((1, 10.0, 5), (-1, 40.0, 4)):
        # The first yard track departs from the ladder where both arcs together are offset by one track spacing.
        first_m = form.arc_m + apart_m - 2 * form.radius_m * np.tan(turn / 2)
        ladder = branch(main, toe_m, form, hand, first_m + (count - 2) * apart_m)
        ladder = _turned_back(ladder, form.arc_m, first_m + (count - 1) * apart_m, hand / form.radius_m, main)
        curves.append(ladder)
        for number in range(count - 1):
            leg_m = main.length_m - toe_m - first_m - number * apart_m - form.arc_m
            curves.append(branch(ladder, first_m + number * apart_m, form, -hand, leg_m))
    return _build("throat", curves, rng, gaps=1, scanner=Scanner(noise_m=0.004, half_range_m=30.0, ray_step_rad=0.0015))


def double_slip(seed: int = 23, number: float = 9.0, radius_m: float = 190.0, heading: float = 0.8) -> Scene:
    """Build two straight tracks that cross at 1:9, with a slip curve of 190 m on either side of their crossing.

    Each slip curve is tangent to both tracks and lies between the acute frogs, as in a double slip 190-1:9.
    """
    rng = np.random.RandomState(seed)
    half_m, angle = 45.0, float(np.arctan(1 / number))
    tracks = [
        trace([Element(2 * half_m)], (-half_m * np.cos(way), -half_m * np.sin(way)), way)
        for way in (heading, heading + angle)
    ]
    tangent_m = radius_m * np.tan(angle / 2)
    slips = [
        trace(
            [Element(radius_m * angle, hand / radius_m, hand / radius_m)],
            (-tangent_m * np.cos(way), -tangent_m * np.sin(way)),
            way,
        )
        for way, hand in ((heading, 1), (heading + angle, -1))
    ]
    return _build("double_slip", [*tracks, *slips], rng, gaps=0)


def three_way(seed: int = 24, apart_m: float = 0.0, heading: float = -0.5, name: str = "three_way") -> Scene:
    """Build a straight track that two branches 190-1:9 leave, one to either side, the second one `apart_m` later."""
    rng = np.random.RandomState(seed)
    form = next(candidate for candidate in FORMS if candidate.name == "190-1:9")
    main = trace([Element(2 * FREE_M + form.arc_m + apart_m)], heading=heading)
    sides = [branch(main, FREE_M + back_m, form, hand, FREE_M) for hand, back_m in ((1, 0.0), (-1, apart_m))]
    return _build(name, [main, *sides], rng, gaps=0)


def _turned_back(ladder: Curve, arc_m: float, end_m: float, curvature: float, main: Curve) -> Curve:
    """Return a ladder that ends parallel to the main track, as the last yard track."""
    toe_m = float(main.step_m * np.argmin(np.linalg.norm(main.xy - ladder.xy[0], axis=1)))
    elements = [
        Element(arc_m, curvature, curvature),
        Element(end_m - arc_m),
        Element(arc_m, -curvature, -curvature),
        Element(main.length_m - toe_m - end_m - arc_m),
    ]
    return trace(elements, tuple(ladder.xy[0]), float(ladder.heading[0]))


def _link(main: Curve, toe_m: float, radius_m: float, angle: float) -> Curve:
    """Compute the axis from a straight track to its left neighbour: arc, straight, arc."""
    toe = int(round(toe_m / main.step_m))
    straight_m = (TRACK_CENTRES_M - 2 * radius_m * (1 - np.cos(angle))) / np.sin(angle)
    elements = [
        Element(radius_m * angle, 1 / radius_m, 1 / radius_m),
        Element(straight_m),
        Element(radius_m * angle, -1 / radius_m, -1 / radius_m),
    ]
    return trace(elements, tuple(main.xy[toe]), float(main.heading[toe]))


def _build(name: str, curves: list[Curve], rng: np.random.RandomState, gaps: int, scanner: Scanner = SCANNER) -> Scene:
    """Build 60E1 tracks on curves, with gaps, at heights with a gradient and waves; the scanner rides on the first."""
    tracks = [Track(curve, spacing(STANDARD), _ground(curve)) for curve in curves]
    length_m = sum(curve.length_m for curve in curves)
    plan = Plan(
        tracks,
        STANDARD,
        scanner,
        gaps={
            key: places
            for number, curve in enumerate(curves if gaps else [])
            for key, places in random_gaps(rng, number, curve.length_m, gaps, longest_m=1.5).items()
        },
        clutter=Clutter(
            weeds_near=int(0.12 * length_m), weeds_between=int(0.15 * length_m), stones=int(1.5 * length_m)
        ),
    )
    return build(name, plan, rng)


def _ground(curve: Curve) -> np.ndarray:
    """Return heights that depend on the position, so that tracks that meet have the same height."""
    x = curve.xy[:, 0]
    return 0.004 * x + 0.01 * np.sin(2 * np.pi * x / 80.0)
