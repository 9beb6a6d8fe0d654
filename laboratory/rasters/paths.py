"""Rails in plan, and layouts: running rails that the network is to keep, and other lines that it is to remove."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..curves import Curve

STEP_M = 0.02
"""Distance between samples of a rail: half a cell."""

NO_TRACK = -1
"""Track number of lines that belong to no track."""


@dataclass(frozen=True)
class TrackSize:
    """The dimensions of a track in plan; the spacing is the distance between the two railhead centres."""

    spacing_m: float
    head_width_m: float


@dataclass(frozen=True)
class RailPath:
    """A rail in plan, (n, 2) metres about every `STEP_M`, with unit normals to the left.

    Some distortions apply to all rails of a track, whose number it has.
    """

    xy: np.ndarray
    normal: np.ndarray
    track: int = NO_TRACK


@dataclass(frozen=True)
class Layout:
    """Running rails, distractors, which are other rails and lines, and places to show.

    Openings are centres and widths, metres, of the gaps for wheel flanges where rails cross; spots are places that a
    raster should show.
    """

    rails: tuple[RailPath, ...] = ()
    distractors: tuple[RailPath, ...] = ()
    openings: tuple[tuple[np.ndarray, float], ...] = ()
    spots: tuple[np.ndarray, ...] = ()


def combine(layouts: Iterable[Layout]) -> Layout:
    """Join layouts into one and renumber their tracks."""
    rails: list[RailPath] = []
    distractors: list[RailPath] = []
    openings: list[tuple[np.ndarray, float]] = []
    spots: list[np.ndarray] = []
    for layout in layouts:
        first = 1 + max((rail.track for rail in rails), default=-1)
        rails += [replace(rail, track=rail.track + first) for rail in layout.rails]
        distractors += layout.distractors
        openings += layout.openings
        spots += layout.spots
    return Layout(tuple(rails), tuple(distractors), tuple(openings), tuple(spots))


def beside(curve: Curve, left_m: float | np.ndarray, track: int = NO_TRACK) -> RailPath:
    """Lay a rail parallel to a curve, offset to the left along the exact normal."""
    return RailPath(curve.offset(left_m), curve.left_normal, track)


def track(axis: Curve, size: TrackSize, spot: bool = False) -> Layout:
    """Lay the two rails of a track; with `spot`, a raster should show its middle."""
    rails = beside(axis, size.spacing_m / 2, 0), beside(axis, -size.spacing_m / 2, 0)
    return Layout(rails, spots=(axis.xy[len(axis.xy) // 2],) if spot else ())
