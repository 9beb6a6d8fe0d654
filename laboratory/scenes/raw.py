"""Raw clouds with labels: everything that a scanner on a train or in the air sees, not only rails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.frame import LocalFrame
from ...core.standards import RailStandard
from ..curves import Curve
from .raw_scanner import RawScanner, cast
from .raw_world import HEAD, Bedding, World, ways_of
from .tracks import Track

BALLAST = Bedding()

Thing = Callable[[World], None]


@dataclass(frozen=True)
class RawScene:
    """A raw cloud and the truth about it.

    Attributes
    ----------
    name : str
    xyz : (n, 3) array
        Local metres.
    kind : (n,) uint8 array
        What each point lies on; see `raw_world`.
    rails : tuple of (k, 3) array
        Tops of the heads on their own axes.
    centerlines : tuple of (k, 3) array
    standard : RailStandard
    frame : LocalFrame
    other_gauges_m : tuple of float
    """

    name: str
    xyz: np.ndarray
    kind: np.ndarray
    rails: tuple[np.ndarray, ...]
    centerlines: tuple[np.ndarray, ...]
    standard: RailStandard
    frame: LocalFrame = LocalFrame(np.zeros(3))
    other_gauges_m: tuple[float, ...] = ()

    @property
    def head(self) -> np.ndarray:
        """Points on heads of running rails, (n,) bool."""
        return self.kind == HEAD


def scan_world(
    name: str,
    tracks: Sequence[Track],
    standard: RailStandard,
    scanners: Sequence[RawScanner],
    things: Sequence[Thing],
    seed: int,
    bedding: Bedding = BALLAST,
    reference: Curve | None = None,
    other_gauges_m: tuple[float, ...] = (),
    half_width_m: float = 14.0,
) -> RawScene:
    """Build cross-sections along the first track, or a reference line, and scan them in one pass per scanner."""
    rng = np.random.RandomState(seed)
    line = reference or tracks[0].curve
    clouds, kinds = [], []
    for scanner in scanners:
        swing = 1 + 0.15 * np.sin(
            np.arange(int(line.length_m / scanner.profile_step_m * 1.2)) * scanner.profile_step_m / 10
        )
        station = np.cumsum(scanner.profile_step_m * swing)
        station = station[station < line.length_m]
        world = World(line, station, ways_of(line, station, tracks), standard.head_width_m, bedding, rng, half_width_m)
        for thing in things:
            thing(world)
        top = world.ways[0].top_m if world.ways else np.zeros(len(station))
        source = np.column_stack([np.full(len(station), scanner.left_m), top + scanner.height_m])
        hits = cast(world.segments(), source, scanner, rng)
        kept = np.abs(hits.place[:, 0]) < half_width_m
        profile, place = hits.profile[kept], hits.place[kept]
        jitter = scanner.profile_step_m * (rng.random_sample(len(profile)) - 0.5) if scanner.wide else 0.0
        sample = station[profile] + jitter
        xy = [np.interp(sample, line.chainage, column) for column in line.xy.T]
        normal = [np.interp(sample, line.chainage, column) for column in line.left_normal.T]
        clouds.append(np.column_stack([xy[0] + place[:, 0] * normal[0], xy[1] + place[:, 0] * normal[1], place[:, 1]]))
        kinds.append(hits.kind[kept])
    rails = tuple(rail for track in tracks for rail in track.rails())
    centerlines = tuple(track.thinned(track.centerline) for track in tracks)
    return RawScene(
        name, np.concatenate(clouds), np.concatenate(kinds), rails, centerlines, standard, other_gauges_m=other_gauges_m
    )
