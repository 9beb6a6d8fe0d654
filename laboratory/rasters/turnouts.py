"""Turnouts and crossovers: the forms that railways build, and their rails (docs/synthetic.md)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..curves import Curve, Element, trace
from .alignments import bent, shifted
from .fittings import frog
from .paths import Layout, TrackSize, beside, combine

FOOT_M = 0.3048
HEEL_SPREAD_M = 6.0 / 12 * FOOT_M
"""Divergence of an American switch rail over its length."""

BLADE_START = (0.2, 0.4)
"""Share of a switch blade's length after which it is a rail of its own; before, it is thinner than the noise."""
BLADE_LENGTH_M = (5.0, 12.0)


@dataclass(frozen=True)
class TurnoutForm:
    """A turnout, described by its branch: an optional straight switch, an arc, then the leg behind it.

    The radius is that of the branch's axis. The angle of the straight switch is in radians; switch and angle are 0
    where the arc begins at the toe, tangent to the main track.
    """

    name: str
    radius_m: float
    arc_m: float
    switch_m: float = 0.0
    switch_angle: float = 0.0

    @property
    def angle(self) -> float:
        """Angle between the two tracks behind the arc, radians."""
        return self.switch_angle + self.arc_m / self.radius_m


def _european(radius_m: float, number: float) -> TurnoutForm:
    return TurnoutForm(f"{radius_m:.0f}-1:{number:g}", radius_m, radius_m * math.atan(1 / number))


def _american(number: int, radius_ft: float, switch_ft: float) -> TurnoutForm:
    radius_m, switch_m = radius_ft * FOOT_M, switch_ft * FOOT_M
    switch_angle = math.asin(HEEL_SPREAD_M / switch_m)
    arc_m = radius_m * (2 * math.atan(1 / (2 * number)) - switch_angle)
    return TurnoutForm(f"#{number}", radius_m, arc_m, switch_m, switch_angle)


FORMS = (
    TurnoutForm("tram 25", 25.0, 12.0),
    TurnoutForm("tram 50", 50.0, 14.0),
    _european(190, 7.5),
    _european(190, 9),
    _european(300, 9),
    _european(500, 12),
    _european(760, 14),
    _european(1200, 18.5),
    _european(2500, 26.5),
    _american(6, 258.57, 11.0),
    _american(8, 487.28, 16.5),
    _american(10, 779.39, 16.5),
    _american(12, 1104.63, 22.0),
    _american(15, 1720.77, 30.0),
    _american(20, 3289.29, 39.0),
)

YARD_FORMS = tuple(form for form in FORMS if form.radius_m < 310)
"""Forms for the ladders and crossovers of yards; longer turnouts would not fit between their tracks."""


def branch(main: Curve, toe_m: float, form: TurnoutForm, hand: int, leg_m: float) -> Curve:
    """Compute the axis of a turnout's branch from the toe, at chainage `toe_m` of the main track in facing direction.

    `hand` is 1 where the branch leaves to the left, -1 to the right. A turnout in a curve is bent: the curvature of the
    main track is added to that of the form, and the `leg_m` behind the arc have it alone.
    """
    toe = int(round(toe_m / main.step_m))
    inherited = float(main.curvature[min(toe, len(main.curvature) - 1)])
    switch = [Element(form.switch_m, inherited, inherited)] if form.switch_m else []
    elements = [*switch, Element(form.arc_m, *(inherited + hand / form.radius_m,) * 2)]
    elements.append(Element(leg_m, inherited, inherited))
    return trace(elements, tuple(main.xy[toe]), float(main.heading[toe]) + hand * form.switch_angle, main.step_m)


def turnout(
    rng: np.random.Generator, main: Curve, toe_m: float, form: TurnoutForm, hand: int, size: TrackSize
) -> Layout:
    """Lay the rails of a turnout's branch, with its guard rails and wing rails.

    The outer rail of the branch is the bent stock rail and begins at the toe. The inner one is a switch blade, then a
    closure rail that crosses a rail of the main track at the frog. The other blade is a rail of the main track. Spots
    are the frog and a place between it and the toe. `hand` is that of `branch`.
    """
    side = branch(main, toe_m, form, hand, rng.uniform(15.0, 45.0))
    ahead = main.piece(toe_m, main.length_m)
    fittings, at = frog(rng, ahead, side, hand, size)
    blade = side.piece(visible_from(rng), side.length_m)
    rails = beside(side, 0.5 * hand * size.spacing_m, 0), beside(blade, -0.5 * hand * size.spacing_m, 0)
    return combine([Layout(rails, spots=(ahead.xy[int(rng.uniform(0.0, 0.9) * at)],)), fittings])


def visible_from(rng: np.random.Generator) -> float:
    """Draw the distance from the toe at which a blade begins to show, metres."""
    return rng.uniform(*BLADE_START) * rng.uniform(*BLADE_LENGTH_M)


def crossover(
    rng: np.random.Generator, axis: Curve, offsets: tuple[float, float], at_m: float, form: TurnoutForm, size: TrackSize
) -> Layout:
    """Lay a crossover between two parallel tracks: two turnouts of one form that share their branch.

    `offsets` are those of the first and of the second track to the left of the axis, `at_m` the chainage of the middle.
    The arc of the form is shortened where the tracks are close together; a straight switch is left out.
    """
    apart = abs(offsets[1] - offsets[0])
    hand = 1 if offsets[1] > offsets[0] else -1
    angle = min(form.angle, math.acos(max(1 - 0.5 * apart / form.radius_m, -1.0)))
    arc = Element(form.radius_m * angle, *(hand / form.radius_m,) * 2)
    middle_m = (apart - 2 * form.radius_m * (1 - math.cos(angle))) / math.sin(angle)
    back = Element(arc.length_m, -arc.start, -arc.end)
    elements = [arc, Element(middle_m), back] if middle_m > axis.step_m else [arc, back]
    reach_m = 2 * form.radius_m * math.sin(angle) + max(middle_m, 0.0) * math.cos(angle)
    local = trace(elements, (at_m - 0.5 * reach_m, offsets[0]), 0.0, axis.step_m)
    side = bent(axis, local)
    tracks = [shifted(axis, offset) for offset in offsets]
    start_m, end_m = at_m - 0.5 * reach_m, at_m + 0.5 * reach_m
    backward = tracks[1].reversed()
    first, _ = frog(rng, tracks[0].piece(start_m, axis.length_m), side, hand, size)
    second, _ = frog(rng, backward.piece(axis.length_m - end_m, axis.length_m), side.reversed(), hand, size)
    rails = (
        beside(side.piece(0.0, side.length_m - visible_from(rng)), 0.5 * hand * size.spacing_m, 0),
        beside(side.piece(visible_from(rng), side.length_m), -0.5 * hand * size.spacing_m, 0),
    )
    return combine([Layout(rails, spots=(side.xy[len(side.xy) // 2],)), first, second])
