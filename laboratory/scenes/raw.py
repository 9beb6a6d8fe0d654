"""Raw clouds with labels: everything that a scanner on a train or in the air sees, not only rails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.frame import LocalFrame
from ...core.standards import RailStandard
from ..curves import Curve
from .raw_photogrammetry import GROUND_CLASS, Photogrammetry, Surface, misplaced, survey
from .raw_scanner import RawScanner, cast
from .raw_world import HEAD, SLEEPER_STEP_M, Bedding, World, along_and_left, ways_of
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
    crests : tuple of (k, 3) array or None
        Rails as a blunted surface shows them, lower than the tops; None where the cloud shows the tops.
    classification : (n,) uint8 array or None
        Classes of a ground filter, of a survey by images.
    """

    name: str
    xyz: np.ndarray
    kind: np.ndarray
    rails: tuple[np.ndarray, ...]
    centerlines: tuple[np.ndarray, ...]
    standard: RailStandard
    frame: LocalFrame = LocalFrame(np.zeros(3))
    other_gauges_m: tuple[float, ...] = ()
    crests: tuple[np.ndarray, ...] | None = None
    classification: np.ndarray | None = None

    @property
    def head(self) -> np.ndarray:
        """Points on heads of running rails, (n,) bool."""
        return self.kind == HEAD

    @property
    def shown(self) -> tuple[np.ndarray, ...]:
        """Rails at the heights at which the cloud shows them."""
        return self.rails if self.crests is None else self.crests


def scan_world(
    name: str,
    tracks: Sequence[Track],
    standard: RailStandard,
    scanners: Sequence[RawScanner | Photogrammetry],
    things: Sequence[Thing],
    seed: int,
    bedding: Bedding = BALLAST,
    reference: Curve | None = None,
    other_gauges_m: tuple[float, ...] = (),
    half_width_m: float = 14.0,
) -> RawScene:
    """Build cross-sections along the first track, or a reference line, and scan them once per scanner or camera."""
    rng = np.random.RandomState(seed)
    line = reference or tracks[0].curve
    rails = tuple(rail for track in tracks for rail in track.rails())
    centerlines = tuple(track.thinned(track.centerline) for track in tracks)
    clouds, kinds, classes, crests = [], [], [], None
    for scanner in scanners:
        station = scanner.stations(line.length_m)
        world = World(line, station, ways_of(line, station, tracks), standard.head_width_m, bedding, rng, half_width_m)
        for thing in things:
            thing(world)
        if isinstance(scanner, Photogrammetry):
            own = np.random.RandomState([seed, scanner.epoch])
            found = survey(world, scanner, own)
            xyz = placed(line, found.station, found.left, found.height)
            clouds.append(misplaced(xyz, scanner, own))
            kinds.append(found.kind)
            classes.append(found.classification)
            crests = tuple(crest(rail, line, found.surface) + scanner.shift_m for rail in rails)
        else:
            xyz, kind = _scanned(world, scanner)
            clouds.append(xyz)
            kinds.append(kind)
            classes.append(np.full(len(kind), GROUND_CLASS, dtype=np.uint8))
    return RawScene(
        name,
        np.concatenate(clouds),
        np.concatenate(kinds),
        rails,
        centerlines,
        standard,
        other_gauges_m=other_gauges_m,
        crests=crests,
        classification=None if crests is None else np.concatenate(classes),
    )


def _scanned(world: World, scanner: RawScanner) -> tuple[np.ndarray, np.ndarray]:
    """Points of a profile scanner, (n, 3), and what they lie on, (n,)."""
    top = world.ways[0].top_m if world.ways else np.zeros(len(world.station))
    source = np.column_stack([np.full(len(top), scanner.left_m), top + scanner.height_m])
    hits = cast(world.segments(), source, scanner, world.rng)
    kept = np.abs(hits.place[:, 0]) < world.half_width_m
    profile, place = hits.profile[kept], hits.place[kept]
    jitter = scanner.profile_step_m * (world.rng.random_sample(len(profile)) - 0.5) if scanner.wide else 0.0
    return placed(world.reference, world.station[profile] + jitter, place[:, 0], place[:, 1]), hits.kind[kept]


def placed(line: Curve, station: np.ndarray, left: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Local metres, (n, 3), of places along and to the left of a line."""
    xy, normal = (
        np.column_stack([np.interp(station, line.chainage, column) for column in values.T])
        for values in (line.xy, line.left_normal)
    )
    return np.column_stack([xy + left[:, None] * normal, height])


def crest(rail: np.ndarray, line: Curve, surface: Surface) -> np.ndarray:
    """Lay a rail at the height of a surface, (k, 3), as the mean over the distance of two sleepers."""
    _, chainage, left = along_and_left(line, rail[:, :2])
    around = chainage + np.linspace(-SLEEPER_STEP_M, SLEEPER_STEP_M, 9)[:, None]
    around = around.clip(0, line.length_m)
    height = surface.at(around.ravel(), np.broadcast_to(left, around.shape).ravel()).reshape(around.shape)
    return np.column_stack([rail[:, :2], height.mean(axis=0)])
