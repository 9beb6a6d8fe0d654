"""Turnouts: the forms railways build, and the rails they lay (ALGORITHMS.md section 6.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .curves import Curve, Element, trace

FOOT_M = 0.3048


@dataclass(frozen=True)
class TurnoutForm:
    """A turnout by its branch: an arc that leaves the main track tangentially, then the leg behind it.

    Attributes
    ----------
    name : str
    radius_m : float
        Radius of the branch's arc, measured at its centerline.
    arc_m : float
        Length of the arc from the toe.
    """

    name: str
    radius_m: float
    arc_m: float


def _european(radius_m: float, number: float) -> TurnoutForm:
    return TurnoutForm(f"{radius_m:.0f}-1:{number:g}", radius_m, radius_m * math.atan(1 / number))


def _american(number: int, radius_ft: float) -> TurnoutForm:
    radius_m = radius_ft * FOOT_M
    return TurnoutForm(f"#{number}", radius_m, radius_m * 2 * math.atan(1 / (2 * number)))


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
    _american(6, 258.57),
    _american(8, 487.28),
    _american(10, 779.39),
    _american(12, 1104.63),
    _american(15, 1720.77),
    _american(20, 3289.29),
)


def branch(main: Curve, toe_m: float, form: TurnoutForm, hand: int, leg_m: float) -> Curve:
    """Lay the branch centerline of a turnout into a track.

    Parameters
    ----------
    main : Curve
        The through track, run in facing direction.
    toe_m : float
        Chainage of the toe.
    form : TurnoutForm
    hand : int
        1: the branch leaves to the left; -1: to the right.
    leg_m : float
        Length behind the arc, along which the branch keeps the curvature of the main track.

    Returns
    -------
    Curve
        From the toe on. A turnout in a curve is bent: the main track's curvature is added to the form's.
    """
    toe = int(round(toe_m / main.step_m))
    inherited = float(main.curvature[min(toe, len(main.curvature) - 1)])
    elements = [Element(form.arc_m, *(inherited + hand / form.radius_m,) * 2), Element(leg_m, inherited, inherited)]
    return trace(elements, tuple(main.xy[toe]), float(main.heading[toe]), main.step_m)


def separation(main: Curve, side: Curve, toe_m: float) -> np.ndarray:
    """Distance between two tracks at equal distances behind the toe, (n,) metres, as long as both last."""
    toe = int(round(toe_m / main.step_m))
    count = min(len(main.xy) - toe, len(side.xy))
    return np.linalg.norm(main.xy[toe : toe + count] - side.xy[:count], axis=1)
