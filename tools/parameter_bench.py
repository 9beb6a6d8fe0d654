"""Short synthetic scenes for pictures of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rail_extract.core.frpdf import DEFAULT_PASSES
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import Centerline, RailLine
from rail_extract.core.raster import RailRaster, cell_size, rasterize
from rail_extract.core.squares.steps import engine_for, lines_of
from rail_extract.core.standards import STANDARDS
from rail_extract.core.tracks.centerlines import tracks_of
from rail_extract.laboratory.curves import Curve, Element, trace
from rail_extract.laboratory.scenes.plain import spacing
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.scene import Clutter, Gaps, Plan, Scene, build
from rail_extract.laboratory.scenes.tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]
SCANNER = Scanner()
HEADING = 0.3
"""Direction of the tracks, so that none is parallel to the rows of the raster."""


class Bench:
    """A scene with variable parameters; the network runs once for all of them."""

    def __init__(self, scene: Scene) -> None:
        standard = scene.standard
        self.scene, self.points = scene, scene.rail_points()
        self.defaults = Parameters(standard.gauge_m, standard.head_width_m)
        self.raster = rasterize(self.points.xyz, cell_size(standard.gauge_m, standard.head_width_m))
        self._cleaned: dict[int, RailRaster] = {}

    def cleaned(self, passes: int = DEFAULT_PASSES) -> RailRaster:
        """Return the cleaned raster."""
        if passes not in self._cleaned:
            self._cleaned[passes] = clean(self.raster, engine_for(self.defaults), passes)
        return self._cleaned[passes]

    def rails(self, **changes: object) -> list[RailLine]:
        """Return the rails with the default parameters and some changes."""
        return lines_of(self.cleaned(), 10, self.points, replace(self.defaults, **changes))

    def tracks(self, rails: Sequence[RailLine], **changes: object) -> list[Centerline]:
        """Return the centerlines with the default parameters and some changes."""
        return tracks_of(rails, replace(self.defaults, **changes))


def bench(
    curve: Curve, heights: np.ndarray | float = 0.0, gaps: Gaps = (), scanner: Scanner = SCANNER, **clutter: int
) -> Bench:
    """Build a scene of one track along a curve, with gaps in both rails and with clutter."""
    plan = Plan(
        [Track(curve, spacing(STANDARD), heights)],
        STANDARD,
        scanner,
        gaps={(0, 1): gaps, (0, -1): gaps},
        clutter=Clutter(**clutter),
    )
    return Bench(build("bench", plan, np.random.RandomState(3)))


def bend(length_m: float, curvature: float = 0.0) -> Curve:
    """Return an arc, or a straight where the curvature is 0."""
    return trace([Element(length_m, curvature, curvature)], heading=HEADING)
