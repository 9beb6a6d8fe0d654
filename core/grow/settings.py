"""What the growth is given: the track, the user's tolerances, and those that depend on the cloud."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..classify import settings as classify
from ..parameters import GrowParameters


@dataclass(frozen=True)
class Beam:
    """Tolerances across and in height, metres.

    Attributes
    ----------
    gap_m : float
        Distance across between points of two heads; those of one are closer. A flangeway is 35 mm wide and more.
    beside_m : float
        Distance beyond the side of a head up to which the classification labels its points.
    below_m, above_m : float
        Heights of rail points relative to the top.
    widen_m : float
        Added to either side of the user's strip; the beam is as wide.
    level_m : float
        Added to the user's tolerance in height between windows.
    sigma_m : float
        Accuracy across of a window.
    fit_m, smooth_m : float
        Length over which a course is fitted, and half the length over which the axis is smoothed.
    """

    gap_m: float
    beside_m: float
    below_m: float
    above_m: float
    widen_m: float
    level_m: float
    sigma_m: float
    fit_m: float
    smooth_m: float


DENSE = Beam(
    gap_m=0.025,
    beside_m=0.008,
    below_m=0.040,
    above_m=0.025,
    widen_m=0.0,
    level_m=0.0,
    sigma_m=0.005,
    fit_m=5.0,
    smooth_m=1.5,
)
"""For scanners on vehicles: beams of a few millimetres, range noise up to 5 mm."""

THIN = Beam(
    gap_m=0.10,
    beside_m=0.06,
    below_m=0.055,
    above_m=0.040,
    widen_m=0.02,
    level_m=0.20,
    sigma_m=0.020,
    fit_m=10.0,
    smooth_m=3.0,
)
"""For scanners in the air: a beam of 4 to 9 cm blends the head and the ballast. Height only has to tell a rail from one
on a bridge: measured on blunt heads, tops are up to 0.15 m off their course."""

BLUNT = replace(THIN, below_m=classify.BLUNT.below_m, above_m=classify.BLUNT.above_m)
"""For clouds that blur a head to a round ridge."""


@dataclass(frozen=True)
class GrowSettings:
    """What the user chooses."""

    gauge_m: float
    head_width_m: float
    parameters: GrowParameters = GrowParameters()

    @property
    def spacing_m(self) -> float:
        """Distance of the two heads of a track."""
        return self.gauge_m + self.head_width_m

    @property
    def classification(self) -> classify.Settings:
        """Settings of the classification whose points are followed."""
        return classify.Settings((self.gauge_m,), self.head_width_m, low_m=self.parameters.min_height_m)
