"""Raw clouds with labels: everything that a scanner on a train or in the air sees, not only rails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from ...core.frame import LocalFrame
from ...core.polyline import Polyline, length_along
from ...core.standards import RailStandard
from ..curves import Curve
from .raw_photogrammetry import CELL_M, GROUND_CLASS, Photogrammetry, Surface, misplaced, survey
from .raw_scanner import RawScanner, cast
from .raw_world import HEAD, SLEEPER_STEP_M, Bedding, World, along_and_left, ways_of
from .tracks import Track

BALLAST = Bedding()

BLENDED = 4.0
"""Distance between the axes of two rails, in standard deviations of the blur, from which each has its own ridge."""

BESIDE_M, PAVED_M = 0.3, 0.02
"""Distance beside the axis of a rail that shows what is around its head, and how far below its top that is, at most, in
a pavement."""

BEYOND_M = 2 * SLEEPER_STEP_M
"""Distance from a pavement within which the mean over two sleepers and the blur contain it."""

STEADY_M = 8.0
"""Length of rail over which the median of what a surface shows is that of the rail: weeds and crossings take 2 m."""

Thing = Callable[[World], None]


@dataclass(frozen=True)
class RawScene:
    """A raw cloud and the truth about it.

    Attributes
    ----------
    xyz : (n, 3) array
        Local metres.
    kind : (n,) uint8 array
        What each point lies on; see `raw_world`.
    rails : tuple of (k, 3) array
        Tops of the heads on their own axes.
    centerlines : tuple of (k, 3) array
    crests : tuple of (k, 3) array or None
        Rails as a blunted surface shows them, lower than the tops; None where the cloud shows the tops.
    classification : (n,) uint8 array or None
        Classes of a ground filter, of a survey by images.
    passes : (n,) uint8 array or None
        Number of the scanner or camera of each point, from 0.
    strips : (n,) uint16 array or None
        Source id of each point; None if the file states none.
    times : (n,) array or None
        Seconds; None for the times of one pass.
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
    passes: np.ndarray | None = None
    strips: np.ndarray | None = None
    times: np.ndarray | None = None

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
        shear = 0.0 if isinstance(scanner, Photogrammetry) else scanner.turned
        ways = ways_of(line, station, tracks, shear)
        world = World(line, station, ways, standard.head_width_m, bedding, rng, half_width_m, shear=shear)
        for thing in things:
            thing(world)
        if isinstance(scanner, Photogrammetry):
            own = np.random.RandomState([seed, scanner.epoch])
            found = survey(world, scanner, own)
            xyz = placed(line, found.station, found.left, found.height)
            clouds.append(misplaced(xyz, scanner, own))
            kinds.append(found.kind)
            classes.append(found.classification)
            crests = tuple(rail + scanner.shift_m for rail in crests_of(rails, line, found.surface, scanner.blur_m))
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
        passes=np.repeat(np.arange(len(kinds), dtype=np.uint8), [len(one) for one in kinds]),
    )


def _scanned(world: World, scanner: RawScanner) -> tuple[np.ndarray, np.ndarray]:
    """Points of a profile scanner, (n, 3), and what they lie on, (n,)."""
    top = world.ways[0].top_m if world.ways else np.zeros(len(world.station))
    source = np.column_stack([np.full(len(top), scanner.left_m), top + scanner.height_m])
    hits = cast(world.segments(), source, scanner, world.rng)
    kept = np.abs(hits.place[:, 0]) < world.half_width_m
    if scanner.stand_m is not None:
        ahead_m = world.station[hits.profile] - scanner.stand_m
        reach_m = np.hypot(*(hits.place - source[hits.profile]).T)
        kept &= world.rng.random_sample(len(kept)) < scanner.share_kept(ahead_m, reach_m)
    profile, place = hits.profile[kept], hits.place[kept]
    jitter = scanner.profile_step_m * (world.rng.random_sample(len(profile)) - 0.5) if scanner.wide else 0.0
    station = world.station[profile] + jitter + scanner.turned * place[:, 0]
    # Beyond the ends of the line, the left or the right end of turned profiles would be laid on them.
    inside = np.ones(len(station), dtype=bool)
    if scanner.turned:
        inside = (station > 0) & (station < world.reference.length_m)
    return placed(world.reference, station[inside], place[inside, 0], place[inside, 1]), hits.kind[kept][inside]


def placed(line: Curve, station: np.ndarray, left: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Local metres, (n, 3), of places along and to the left of a line."""
    xy, normal = (
        np.column_stack([np.interp(station, line.chainage, column) for column in values.T])
        for values in (line.xy, line.left_normal)
    )
    return np.column_stack([xy + left[:, None] * normal, height])


def crests_of(rails: tuple[np.ndarray, ...], line: Curve, surface: Surface, blur_m: float) -> tuple[np.ndarray, ...]:
    """Lay rails, (k, 3) each, as far below their tops as the blur of a surface lowers them.

    Where another rail is within `BLENDED` of the blur, in a switch, the surface is one ridge of both, higher than
    either would be alone; and in a level crossing nothing lowers it. As no rail rises by centimetres there, what it
    shows on both sides of such a place is interpolated. Nor does one where plants raise the surface, or fall where the
    throat of a crossing or the end of the cloud lowers it: over `STEADY_M`, the median counts.
    """
    reach_m = BLENDED * blur_m
    lowered = []
    for number, rail in enumerate(rails):
        others = [Polyline(other[:, :2]).resampled(CELL_M).xy for other in rails[:number] + rails[number + 1 :]]
        alone = cKDTree(np.concatenate(others)).query(rail[:, :2])[0] > reach_m
        along = length_along(rail[:, :2])
        paved = along[_is_paved(rail, line, surface), None]
        ridge = alone & (cKDTree(paved).query(along[:, None])[0] > BEYOND_M)
        ridge = ridge if ridge.any() else alone
        shown = crest(rail, line, surface)
        if ridge.any():
            size = 2 * int(0.5 * STEADY_M / np.median(np.diff(along))) + 1
            shown[:, 2] = rail[:, 2] + np.interp(along, along[ridge], median_filter((shown - rail)[ridge, 2], size))
        lowered.append(shown)
    return tuple(lowered)


def _is_paved(rail: np.ndarray, line: Curve, surface: Surface) -> np.ndarray:
    """Return where a surface is less than `PAVED_M` below a rail, (k, 3), on at least one of its sides, (k,) bool."""
    _, chainage, left = along_and_left(line, rail[:, :2])
    beside = np.max([surface.at(chainage, left + side) for side in (-BESIDE_M, BESIDE_M)], axis=0)
    return rail[:, 2] - beside < PAVED_M


def crest(rail: np.ndarray, line: Curve, surface: Surface) -> np.ndarray:
    """Lay a rail at the height of a surface, (k, 3), as the mean over the distance of two sleepers along the rail."""
    course = Polyline(rail[:, :2])
    around = (course.t + np.linspace(-SLEEPER_STEP_M, SLEEPER_STEP_M, 9)[:, None]).clip(0, course.length_m)
    _, chainage, left = along_and_left(line, course.at(around.ravel()))
    height = surface.at(chainage, left).reshape(around.shape)
    return np.column_stack([rail[:, :2], height.mean(axis=0)])
