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
    """The dimensions of a track in plan.

    Attributes
    ----------
    spacing_m : float
        Distance between the two railhead centres.
    """

    spacing_m: float
    head_width_m: float


@dataclass(frozen=True)
class RailPath:
    """A rail in plan, sampled about every `STEP_M`.

    Attributes
    ----------
    xy : (n, 2) array
        Metres.
    normal : (n, 2) array
        Unit vectors to the left.
    track : int
        Number of its track; some distortions apply to all rails of a track.
    """

    xy: np.ndarray
    normal: np.ndarray
    track: int = NO_TRACK


@dataclass(frozen=True)
class Layout:
    """Rails to keep, lines to remove, and places to show.

    Attributes
    ----------
    rails : tuple of RailPath
        Running rails.
    distractors : tuple of RailPath
        Guard, check and wing rails and other lines that are not running rails.
    openings : tuple of ((2,) array, float)
        Centres and widths, metres, of the gaps for wheel flanges where rails cross.
    spots : tuple of (2,) array
        Places that a raster should show, metres.
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
    """Lay a rail parallel to a curve, offset along the exact normal.

    Parameters
    ----------
    left_m : float or (n,) array
        Offset to the left.
    track : int
        Number of the track.
    """
    return RailPath(curve.offset(left_m), curve.left_normal, track)


def track(axis: Curve, size: TrackSize, spot: bool = False) -> Layout:
    """Lay the two rails of a track.

    Parameters
    ----------
    spot : bool
        Whether the middle of the track is a place that a raster should show.
    """
    rails = beside(axis, size.spacing_m / 2, 0), beside(axis, -size.spacing_m / 2, 0)
    return Layout(rails, spots=(axis.xy[len(axis.xy) // 2],) if spot else ())
