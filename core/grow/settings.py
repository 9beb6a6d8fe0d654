"""What the growth is given: the track, the user's tolerances, and those that depend on how dense a cloud is."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..classify import settings as classify
from ..parameters import GrowParameters

HEAD_LEVEL_M = 0.20
"""Difference in height between windows on heads that the classification has found: it only has to tell the rail from
one on a bridge. Measured on blunt heads: up to 0.15 m off their course."""


@dataclass(frozen=True)
class Beam:
    """Tolerances across and in height, metres.

    Attributes
    ----------
    blur_m : float
        Width beside a head that mixed pixels fill.
    fringe_m : float
        Width beyond it that must be empty at the height of the top: less than the narrowest flangeway, 35 mm.
    clear : float
        Largest density of points there, as a share of that on the head.
    level_m : float
        Added to the user's tolerance in height for the points that are compared; noise.
    below_m, above_m : float
        Heights of rail points relative to the top.
    widen_m : float
        Added to either side of the user's envelope; the beam is as wide.
    sigma_m : float
        Accuracy across of a window.
    fit_m : float
        Length over which a course is fitted.
    steady_m : float
        Largest distance of the windows of a rail from their course, root mean square. Measured: up to 8 mm on dense
        rails and 15 mm on thin ones; undergrowth and rubble 12 to 63 mm.
    classified : bool
        Whether heads are looked for where the classification finds some; see `on_heads`.
    """

    blur_m: float
    fringe_m: float
    clear: float
    level_m: float
    below_m: float
    above_m: float
    widen_m: float
    sigma_m: float
    fit_m: float
    steady_m: float
    classified: bool = False

    def on_heads(self) -> Beam:
        """Return the tolerances for points that the classification has found on heads."""
        return replace(self, level_m=HEAD_LEVEL_M, classified=True)


DENSE = Beam(
    blur_m=0.004,
    fringe_m=0.030,
    clear=0.35,
    level_m=0.0,
    below_m=0.040,
    above_m=0.025,
    widen_m=0.0,
    sigma_m=0.005,
    fit_m=5.0,
    steady_m=0.010,
)
"""For scanners on vehicles: beams of a few millimetres, range noise up to 5 mm."""

THIN = Beam(
    blur_m=0.025,
    fringe_m=0.060,
    clear=0.5,
    level_m=0.015,
    below_m=0.055,
    above_m=0.040,
    widen_m=0.02,
    sigma_m=0.020,
    fit_m=10.0,
    steady_m=0.020,
)
"""For scanners in the air: a beam of 4 to 9 cm blends the head and the ballast."""

BLUNT = replace(THIN, below_m=classify.BLUNT.below_m, above_m=classify.BLUNT.above_m, steady_m=0.035)
"""For clouds that blur a head to a round ridge."""


@dataclass(frozen=True)
class GrowSettings:
    """What the user chooses.

    Attributes
    ----------
    gauge_m, head_width_m : float
    parameters : GrowParameters
    """

    gauge_m: float
    head_width_m: float
    parameters: GrowParameters = GrowParameters()

    @property
    def spacing_m(self) -> float:
        """Distance of the two heads of a track."""
        return self.gauge_m + self.head_width_m
