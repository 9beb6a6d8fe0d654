"""The rails that grow from a seed, and the points on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..classify.flush import BESIDE_M, HEAD_LEVEL_M
from ..polyline import length_along, project, runs
from ..progress import SILENT, Progress
from .course import smoothed
from .follow import Reason, Window, follow, turned
from .on_heads import OnHeads
from .points import Points
from .settings import DENSE, Beam, GrowSettings
from .start import Start, find_start

SMOOTH_M = {True: 1.5, False: 3.0}
"""Half the length over which the axis is smoothed, by whether the cloud is dense."""

MIN_SEEN = 0.8
"""Least share of the windows of a rail in which it, or the other one, was seen. Measured on rails: 0.99."""

PAIR_M, SINGLE_M = 3.0, 5.0
"""Shortest rails with the other one of the track and without it, as lone rails of a classification."""


@dataclass(frozen=True)
class Rail:
    """A rail that was followed.

    Attributes
    ----------
    xyz : (k, 3) array
        Its axis on the top of the head, a place for each window from the first one in which it was seen to the last.
    seen, flush : (k,) bool arrays
        Windows in which it was seen, and in which it is in a pavement.
    beam : Beam
    """

    xyz: np.ndarray
    seen: np.ndarray
    flush: np.ndarray
    beam: Beam

    @property
    def length_m(self) -> float:
        """Length in plan."""
        return float(length_along(self.xyz[:, :2])[-1])


@dataclass(frozen=True)
class Stop:
    """Where a rail is not followed further.

    Attributes
    ----------
    xyz : (3,) array
    reason : Reason
    """

    xyz: np.ndarray
    reason: Reason


@dataclass(frozen=True)
class Growth:
    """What grew from a seed.

    Attributes
    ----------
    rails : tuple of Rail
        The rail of the seed and, if it was found and asked for, the other one of its track.
    stops : tuple of Stop
        Both ends of the rail of the seed.
    """

    rails: tuple[Rail, ...]
    stops: tuple[Stop, ...]


def grow(
    points: Points,
    seed: np.ndarray,
    settings: GrowSettings,
    progress: Progress = SILENT,
    heads: OnHeads | None = None,
) -> Growth | None:
    """Follow the rail at a seed to both sides.

    Parameters
    ----------
    points : Points
    seed : (2,) array
        Metres.
    settings : GrowSettings
    progress : Progress
    heads : OnHeads, optional
        Of the same points and settings: with one object for all seeds, no square is classified twice.

    Returns
    -------
    Growth or None
        None if the seed is not on a rail.
    """
    start = find_start(points, seed, settings, heads)
    if start is None:
        return None
    ahead, back = progress.split(2)
    onwards, last = follow(points, start, start.xyz, settings, ahead)
    # The way back begins beyond the seed, so that both rails are measured there.
    backwards, first = follow(points, turned(start), _beyond(start, onwards, settings), settings, back)
    windows = [*backwards[::-1], *onwards]
    if not _is_rail(windows, start, (first, last), settings):
        return None
    kinds = (False, True) if settings.parameters.both and start.side else (False,)
    rails = tuple(filter(None, (_rail(windows, is_other, start, settings) for is_other in kinds)))
    stops = Stop(windows[0].xyz, first), Stop(windows[-1].xyz, last)
    return Growth(rails, stops) if rails else None


def _is_rail(windows: Sequence[Window], start: Start, ends: tuple[Reason, Reason], settings: GrowSettings) -> bool:
    """Return whether what was followed is a rail: seen almost everywhere, steady, and of some length.

    The length does not count where the user has limited it.
    """
    heads = [window.head for window in windows if window.head is not None]
    if not heads or np.mean([window.is_seen for window in windows]) < MIN_SEEN:
        return False
    if np.sqrt(np.mean([head.across_m**2 for head in heads])) > start.beam.steady_m:
        return False
    paired = np.mean([window.other is not None for window in windows]) >= MIN_SEEN
    length_m = len(windows) * settings.parameters.window_m
    return Reason.LENGTH in ends or length_m >= (PAIR_M if paired else SINGLE_M)


def _beyond(start: Start, onwards: Sequence[Window], settings: GrowSettings) -> np.ndarray:
    """Return the places in front of the way back, in its order."""
    count = int(start.beam.fit_m / settings.parameters.window_m)
    if len(onwards) >= count:
        return np.array([window.xyz for window in onwards[:count][::-1]])
    step = np.append(settings.parameters.window_m * start.heading, 0.0)
    return start.xyz[-1] + np.arange(count, 0, -1)[:, None] * step


def _rail(windows: Sequence[Window], is_other: bool, start: Start, settings: GrowSettings) -> Rail | None:
    """Make one of the rails of a track, from the first window in which it was seen to the last."""
    heads = [window.other if is_other else window.head for window in windows]
    own = np.flatnonzero([head is not None for head in heads])
    if len(own) < 2:
        return None
    chosen = slice(int(own[0]), int(own[-1]) + 1)
    xyz = np.array([window.other_xyz if is_other else window.xyz for window in windows[chosen]])
    flush = np.array([head is not None and head.flush for head in heads[chosen]])
    is_seen = np.array([head is not None for head in heads[chosen]])
    along_m = length_along(xyz[:, :2])
    smooth = smoothed(xyz, along_m, SMOOTH_M[start.beam is DENSE], is_seen)
    return Rail(smooth, _bridged(is_seen, settings.parameters.max_outliers), flush, start.beam)


def _bridged(seen: np.ndarray, most: int) -> np.ndarray:
    """Count runs of up to `most` windows in which a rail was not seen as seen."""
    result = seen.copy()
    for first, last in runs(~seen):
        result[first : last + 1] = last - first < most
    return result


def on_rails(rails: Sequence[Rail], xyz: np.ndarray, settings: GrowSettings) -> np.ndarray:
    """Return which points, (n, 3) metres, are on the heads of rails, (n,) bool."""
    found = np.zeros(len(xyz), dtype=bool)
    for rail in rails:
        widest_m = settings.parameters.thickness_m / 2 + rail.beam.widen_m
        feet = project([rail.xyz[:, :2]], xyz[:, :2], widest_m)
        along_m = length_along(rail.xyz[:, :2])
        above = xyz[feet.point, 2] - np.interp(feet.t, along_m, rail.xyz[:, 2])
        window = np.searchsorted((along_m[1:] + along_m[:-1]) / 2, feet.t)
        on = (above >= -rail.beam.below_m) & (above <= rail.beam.above_m)
        level = (np.abs(above) <= HEAD_LEVEL_M) & (np.abs(feet.across) <= settings.head_width_m / 2 + BESIDE_M)
        on &= rail.seen[window] & (level | ~rail.flush[window])
        found[feet.point[on]] = True
    return found
