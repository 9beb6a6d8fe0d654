"""The parameters of an extraction and their defaults: the only place where a default is written down.

This module imports neither numpy nor anything that needs it, so that dialogs open before the packages are installed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

AS_THEY_ARE, ALIGNED = "AS_THEY_ARE", "ALIGNED"
STRIPS = (AS_THEY_ARE, ALIGNED)
"""What happens to strips, the passes of a scanner, that differ: nothing, or they are moved onto their mean."""

OVERLAP, SYNTHETIC = "OVERLAP", "SYNTHETIC"
LEAVE_OUT = (OVERLAP, SYNTHETIC)
"""Points that can be left out by their flag: of overlapping strips, or computed and not measured."""

DEFAULT_STEP_M = 1.0
"""Distance between the stations of the track geometry, once it is asked for."""

DEFAULT_GUIDE_DISTANCE_M = 4.0
"""Distance from a guide within which rails are searched: its own track, and as much as a map is off."""

GEOMETRY, LEARNED = "GEOMETRY", "LEARNED"
METHODS = (GEOMETRY, LEARNED)
"""What finds rail points in raw clouds: their geometry, or a network that was trained on labelled clouds."""

JUMPS, CLOTHOIDS = "JUMPS", "CLOTHOIDS"
TRANSITIONS = (JUMPS, CLOTHOIDS)
"""Whether the curvature may jump, as in turnouts and sidings, or a clothoid is between any two radii."""

AIRBORNE_CLASSES = (1, 2)
"""Classes of an airborne cloud in which tracks are looked for: unclassified and ground."""

DEFAULT_WORKERS, MAX_WORKERS = 0, 1000
"""Processes that compute at a time: 0 is one per core, as far as memory allows; the most is a guard against typing
errors."""

DEFAULT_EPOCHS = 10
"""How many times a rail classifier learns from each block with rails."""


@dataclass(frozen=True)
class Parameters:
    """What an extraction can be told; lengths in metres.

    Attributes
    ----------
    gauge_m, head_width_m : float
        Distance between the inner faces of the two railheads, and width of a railhead.
    passes : int
        Passes of the network; 0 runs until the result is stable.
    model : str
        Name of a model, see `frpdf.models`.
    smoothing_xy_m : float
        Sigma of PAEK in plan.
    smoothing_z_m : float or None
        Sigma of PAEK in height; None smooths heights by a spline, as much as the points show.
    tolerance_xy_m, tolerance_z_m : float
        A point gives height if it is at most this far from the line in plan and this far below the top surface.
    crown_radius_m : float
        Radius of the disc that is rolled along the top of the rail.
    max_gap_m : float
        Longest gap that is closed.
    gap_angle_deg : float
        Largest bend across a closed gap, in degrees.
    simplify_xy_m, simplify_z_m : float
        Vertices are removed while the line moves by no more than this.
    min_length_m : float
        Shorter lines are dropped.
    other_gauges_m : tuple of float
        Further gauges to pair, for mixed and dual gauge.
    other_heads_m : tuple of float
        Width of the railheads on each of them; empty if all are `head_width_m` wide.
    centerline_tolerance_m : float
        Largest deviation from the gauge at which two rails make a track.
    quality_step_m : float or None
        Distance between the stations at which track geometry is measured; None skips the measurement.
    square_tiles : int
        Side of the squares that are processed one at a time, in raster tiles. With 50 tiles (half a kilometre) the
        overlap is a sixth of the side, and the widest yard fits into memory. The lines depend on it by less than a
        millimetre.
    keep_cleaned : bool
        Whether the result includes the rasters that the network cleaned.
    strips : str
        One of `STRIPS`.
    """

    gauge_m: float
    head_width_m: float
    passes: int = 2
    engine: str = "AUTO"
    device: str = "AUTO"
    model: str = "AUTO"
    smoothing_xy_m: float = 0.8
    smoothing_z_m: float | None = None
    tolerance_xy_m: float = 0.10
    tolerance_z_m: float = 0.03
    crown_radius_m: float = 20.0
    max_gap_m: float = 5.0
    gap_angle_deg: float = 10.0
    simplify_xy_m: float = 0.001
    simplify_z_m: float = 0.0005
    min_length_m: float = 1.0
    other_gauges_m: tuple[float, ...] = ()
    other_heads_m: tuple[float, ...] = ()
    centerline_tolerance_m: float = 0.05
    quality_step_m: float | None = None
    square_tiles: int = 50
    keep_cleaned: bool = False
    strips: str = AS_THEY_ARE

    @property
    def gauges(self) -> tuple[tuple[float, float], ...]:
        """Gauges that tracks may have, each with the width of its railheads; the first one is that of the standard."""
        heads_m = self.other_heads_m or (self.head_width_m,) * len(self.other_gauges_m)
        return ((self.gauge_m, self.head_width_m), *zip(self.other_gauges_m, heads_m))

    @property
    def gauges_m(self) -> tuple[float, ...]:
        """Gauges that tracks may have; the first one is that of the standard."""
        return self.gauge_m, *self.other_gauges_m

    @property
    def spacings_m(self) -> list[float]:
        """Distances between the axes of the rails of a track, by gauge."""
        return [sum(gauge) for gauge in self.gauges]

    def with_gauges(self, others: Sequence[tuple[float, float]]) -> Parameters:
        """Return the parameters with further gauges, given with the width of their railheads."""
        gauges_m, heads_m = (tuple(one[part] for one in others) for part in range(2))
        return replace(self, other_gauges_m=gauges_m, other_heads_m=heads_m)


@dataclass(frozen=True)
class GrowParameters:
    """How rails are followed from seeds; lengths in metres.

    Attributes
    ----------
    both : bool
        Whether the other rail of the track is followed, too.
    search_m : float
        Largest distance of a seed from its rail, and of a rail from where its course leads.
    thickness_m : float
        Width of the strip along the axis in which points belong to the rail: a head, and mixed pixels beside it.
    window_m : float
        Length of rail that is looked at as one.
    min_height_m : float
        Least height of the rail above the bed beside it; less only in pavements, beside a groove.
    tolerance_z_m : float
        Largest difference in height between the points of a head, and between its windows.
    max_outliers : int
        Windows in a row in which the rail may not be seen.
    max_length_m : float
        Length that is followed to either side of a seed.
    """

    both: bool = True
    search_m: float = 0.25
    thickness_m: float = 0.10
    window_m: float = 0.5
    min_height_m: float = 0.05
    tolerance_z_m: float = 0.02
    max_outliers: int = 5
    max_length_m: float = 200.0


@dataclass(frozen=True)
class FitParameters:
    """How design elements are fitted to tracks; lengths in metres.

    `tolerance_m` is how far the track may be off its design: the largest standard deviation of misalignment that is
    told from design. `min_length_m` is the least length of an element, `transitions` one of `TRANSITIONS`, and
    `rounded` says whether round radii are proposed.
    """

    tolerance_m: float = 0.005
    min_length_m: float = 5.0
    transitions: str = JUMPS
    rounded: bool = True


@dataclass(frozen=True)
class AirborneParameters:
    """What the search for tracks in airborne clouds can be told; lengths in metres.

    Gauge and head are as in `Parameters`; a guide may state its own gauge. `reach_m` is the largest distance of a track
    from its guide, `footprint_m` the diameter of the laser beam on the ground, and `rail_height_m` that of the tops of
    the rails above the bed between them.
    """

    gauge_m: float
    head_width_m: float
    reach_m: float = 3.0
    footprint_m: float = 0.3
    rail_height_m: float = 0.17

    def spacing_of(self, gauge_m: float | None = None) -> float:
        """Return the distance between the middles of the railheads, on this gauge or that of the run."""
        return (gauge_m or self.gauge_m) + self.head_width_m


@dataclass(frozen=True)
class ComparisonParameters:
    """How the lines of two surveys are compared.

    `reach_m` is the largest distance at which two lines are the same: more than a track moves between two surveys, and
    less than that of the rails of the narrowest gauge. `step_m` is the distance between stations. With `ignore_shift`,
    a constant shift does not count as a movement.
    """

    reach_m: float = 0.5
    step_m: float = 1.0
    ignore_shift: bool = True
