"""The rails that grow from a seed, and the points on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Polyline, runs
from ..progress import SILENT, Progress
from .course import smoothed
from .follow import Reason, Window, follow, turned
from .heads import OnHeads, Rail
from .settings import GrowSettings
from .start import Start, find_start


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


def grow(points: OnHeads, seed: np.ndarray, settings: GrowSettings, progress: Progress = SILENT) -> Growth | None:
    """Follow the rail at a seed to both sides.

    Parameters
    ----------
    points : OnHeads
        With one object for all seeds, no square is classified twice.
    seed : (2,) array
        Metres.
    settings : GrowSettings
    progress : Progress

    Returns
    -------
    Growth or None
        None if the seed is not on a rail.
    """
    start = find_start(points, seed, settings)
    return None if start is None else grow_from(points, start, settings, progress)


def grow_from(points: OnHeads, start: Start, settings: GrowSettings, progress: Progress = SILENT) -> Growth | None:
    """Follow a rail that was found at a seed to both sides; see `grow`."""
    ahead, back = progress.split(2)
    onwards, last = follow(points, start, start.xyz, settings, ahead)
    # The way back begins beyond the seed, so that both rails are measured there.
    backwards, first = follow(points, turned(start), _beyond(start, onwards, settings), settings, back)
    windows = [*backwards[::-1], *onwards]
    if not windows:
        return None
    kinds = (False, True) if settings.parameters.both and start.side else (False,)
    rails = tuple(filter(None, (_rail(windows, is_other, start, settings) for is_other in kinds)))
    stops = Stop(windows[0].xyz, first), Stop(windows[-1].xyz, last)
    return Growth(rails, stops) if rails else None


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
    is_seen = np.array([head is not None for head in heads[chosen]])
    along_m = Polyline(xyz).t
    smooth = smoothed(xyz, along_m, start.beam.smooth_m, is_seen)
    return Rail(smooth, _bridged(is_seen, settings.parameters.max_outliers), start.beam)


def _bridged(seen: np.ndarray, most: int) -> np.ndarray:
    """Count runs of up to `most` windows in which a rail was not seen as seen."""
    result = seen.copy()
    for first, last in runs(~seen):
        result[first : last + 1] = last - first < most
    return result
