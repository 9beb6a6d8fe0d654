"""What the classification is given: gauges, railhead, and tolerances that depend on how dense a cloud is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from ..raster import cell_size
from .guide import Guide
from .pieces import LEAST_M
from .tops import LOW_M, Band

SQUARE_CELLS = 1024
"""Side of the squares that are classified one after another, in cells: 41 m at 1435 mm, images of 2 to 4 MB."""

MARGIN_M = 3.0
"""Points around a square that are read with it: the largest reach of a rail's direction (2 m) and the window of the
mean height of its top."""


@dataclass(frozen=True)
class Tolerances:
    """Tolerances in height and across, metres.

    Attributes
    ----------
    along_m : float
        Difference in height above the bed between two cells of one rail.
    spread_m : float
        Depth below the top of a neighbouring cell down to which a cell still belongs to the same head.
    beside_line_m : float
        Distance from a line within which a cell is on it: half a head, half a cell's diagonal and noise.
    partner_m : float
        Difference in height above the bed between the two rails of a track: beside a shoulder or a platform, their
        beds differ by up to 6 cm.
    worse_m : float
        How much worse the distance of something fits two heads than that of the rails of a track beside it: a kerb or
        the shoulder of the ballast may be at gauge from the near one. Axes of cells are known as well. Measured: 7 to
        20 mm beside sharp heads, 35 mm beside low ones.
    below_m, above_m : float
        Heights of rail points relative to the mean top: half a head downwards, and noise with the waves of the bed
        upwards.
    below_share : float
        Part of the height above the bed down to which they are at most: where the bed reaches up to the heads, its
        stones stand as high as the other half, and would widen the heads.
    beside_m : float
        Distance beyond the side of the head within which a point is still on it: the axis is known to a centimetre, and
        the beam is as wide.
    least_m : float
        Shortest piece of a rail that has its partner.
    band : Band
        Tops that may be those of rails.
    wider_m, wider_single_m : float
        Width beyond that of a head up to which the top of a piece may be one, with a partner and without. Measured
        with a partner: up to 17 mm, 26 mm in two passes of a scanner 3 cm apart, 34 mm from four tripods, and 41 mm on
        thin clouds; kerbs of 150 mm 62 mm, on thin clouds 59 mm.
    """

    along_m: float
    spread_m: float
    beside_line_m: float
    partner_m: float
    worse_m: float
    below_m: float
    above_m: float
    below_share: float
    beside_m: float
    least_m: float
    band: Band
    wider_m: float
    wider_single_m: float


HEADS = Band(low_m=LOW_M, depth_share=1.0, slab_m=0.025)
BURIED = Band(low_m=0.04, depth_share=0.4, slab_m=0.012, shadows=False)
"""Tops of rails, and those of rails that are buried up to the head. A smooth surface shows these, too; a rough one has
as much relief anywhere."""

DENSE = Tolerances(
    along_m=0.035,
    spread_m=0.045,
    beside_line_m=0.050,
    partner_m=0.08,
    worse_m=0.005,
    below_m=0.040,
    above_m=0.025,
    below_share=0.5,
    beside_m=0.02,
    least_m=LEAST_M,
    band=HEADS,
    wider_m=0.036,
    wider_single_m=0.012,
)
"""For scanners on vehicles: beams of a few millimetres, range noise up to 5 mm."""

THIN = Tolerances(
    along_m=0.060,
    spread_m=0.060,
    beside_line_m=0.065,
    partner_m=0.07,
    worse_m=0.015,
    below_m=0.045,
    above_m=0.065,
    below_share=0.5,
    beside_m=0.035,
    least_m=2 * LEAST_M,
    band=HEADS,
    wider_m=0.05,
    wider_single_m=0.04,
)
"""For scanners in the air: a beam of 4 to 9 cm blends the head and the ballast."""

BLUNT = replace(
    DENSE, band=BURIED, least_m=5.0, partner_m=0.05, worse_m=0.03, below_m=0.12, below_share=3.0, above_m=0.06
)
"""For clouds that blur a head to a round ridge. Any mound of its width is as round, and up to 4 m of one are opposite
something else by chance. Beside its crest, the ridge falls by up to 5 cm; noise and a bed that slopes add as much. A
limit that cut the lower side off would move the line, and one near the mean of the tops would lower it."""


FILLED = replace(DENSE, least_m=BLUNT.least_m, beside_m=0.01, wider_m=0.025)
"""For heads just above the ballast that a track is filled with: as in blunt clouds, up to 4 m of something are at gauge
from something else by chance. Boards are hardly wider than heads that passes show apart. Stones beside a head are as
high as its faces and would draw its axis: points are on it up to the error of the axis alone."""


class Way(Enum):
    """How a cloud is searched, one way for all of it: see `ways`."""

    SHARP = "sharp"
    BLUNT = "blunt"
    FILLED = "filled"


@dataclass(frozen=True)
class Settings:
    """What the user chooses.

    Attributes
    ----------
    gauges_m : tuple of float
        Gauges to pair rails by; the first one sets the size of the cells.
    keep_single : bool
        Whether straight rails of some length without a partner are kept.
    guide : Guide, optional
        Where to search; in metres from the zero of the coordinate system, or from the corner of the square.
    weights : Path, optional
        Weights of a network that was trained on labelled clouds and replaces the geometry; see `learned`.
    low_m : float
        Least height of a rail above the bed in a sharp cloud, unless it is in a pavement.
    way : Way
        What the cloud shows: sharp heads, round ridges, or heads just above the ballast.
    """

    gauges_m: tuple[float, ...]
    head_width_m: float
    keep_single: bool = True
    guide: Guide | None = None
    weights: Path | None = None
    low_m: float = LOW_M
    way: Way = Way.SHARP

    @property
    def blunt(self) -> bool:
        """Whether the cloud blurs heads to round ridges."""
        return self.way is Way.BLUNT

    def tolerances(self, thin: bool) -> Tolerances:
        """Return the tolerances for a square that is thin or dense."""
        if self.way is Way.BLUNT:
            return BLUNT
        if self.way is Way.FILLED:
            return FILLED
        chosen = THIN if thin else DENSE
        return replace(chosen, band=replace(chosen.band, low_m=self.low_m))

    @property
    def cell_m(self) -> float:
        """Side of a cell, metres; the one of the rasters that FRPDF cleans."""
        return cell_size(self.gauges_m[0], self.head_width_m)

    @property
    def side_m(self) -> float:
        """Side of a square, metres."""
        return SQUARE_CELLS * self.cell_m

    @property
    def spacings_m(self) -> list[float]:
        """Distances of the two heads of a track, metres, by gauge."""
        return [gauge_m + self.head_width_m for gauge_m in self.gauges_m]

    def at(self, key: tuple[int, int]) -> Settings:
        """Return the settings for the square in this column and row."""
        if self.guide is None:
            return self
        return replace(self, guide=self.guide.around(np.multiply(key, self.side_m), self.side_m))

    def own(self, xy: np.ndarray) -> np.ndarray:
        """Return which of (n, 2) or (n, 3) places, in metres from a square's corner, are in the square, (n,) bool."""
        return np.all((xy[:, :2] >= 0) & (xy[:, :2] < self.side_m), axis=1)
