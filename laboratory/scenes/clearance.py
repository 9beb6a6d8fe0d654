"""Scenes with exact truth about clearance: a canted curved double track, and what stands beside and over it.

Everything is placed in the frame of the track (s along, v to the left in the plane of the rail tops, w above it), and
put into the world along the exact curve, so that the truth is known to a tenth of a millimetre.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...core.clearance.frame import Course, course_of
from ...core.clouds.las import laspy
from ...core.rails import Centerline, RailLine
from ...core.standards import RAIL_CLASS
from ..curves import Curve, Element, trace

GAUGE_M, SPACING_M = 1.435, 1.507
"""Gauge, and distance of the middles of the heads of 72 mm."""

OBJECT, BED, PLATFORM, WIRE, BUSH, TRAIN = 6, 2, 6, 14, 4, 6
"""Classes of the points."""

SCALE_M = 0.0005
"""Resolution of the coordinates in the file: a tenth of the noise."""

VERTEX_M = 0.5
"""Distance of the vertices of the true lines: on R 300, chords of half a metre are within 0.1 mm of the curve."""


@dataclass(frozen=True)
class Way:
    """A track with exact position, cant and gradient; `curve` is sampled finely.

    `cant_m` returns the cant at chainages, left rail top minus right rail top; the `grade`, uphill, is constant.
    """

    curve: Curve
    cant_m: Callable[[np.ndarray], np.ndarray]
    grade: float
    base_m: float = 100.0

    def place(self, s: np.ndarray, v: np.ndarray | float, w: np.ndarray | float) -> np.ndarray:
        """Return the places of s, v and w, (n, 3) metres."""
        s, v, w = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (s, v, w)))
        at, heading = self.curve.chainage, np.interp(s, self.curve.chainage, self.curve.heading)
        roll = np.arcsin(self.cant_m(s) / SPACING_M)
        across, up = v * np.cos(roll) - w * np.sin(roll), v * np.sin(roll) + w * np.cos(roll)
        x, y = (np.interp(s, at, column) for column in self.curve.xy.T)
        height = self.base_m + self.grade * s + up * np.sqrt(1 + self.grade**2)
        return np.column_stack([x - np.sin(heading) * across, y + np.cos(heading) * across, height])

    def line(self, v: float = 0.0) -> np.ndarray:
        """Return the centerline, or the top of a rail at v, (n, 3)."""
        s = np.arange(0.0, self.curve.length_m + 1e-6, VERTEX_M)
        return self.place(s, v, 0.0)

    def reversed(self) -> Way:
        """Return the same track, run from its end."""
        length = self.curve.length_m
        return Way(
            self.curve.reversed(),
            lambda s: -self.cant_m(length - s),
            -self.grade,
            self.base_m + self.grade * length,
        )

    def beside(self, left_m: float, cant_m: Callable[[np.ndarray], np.ndarray] | None = None) -> Way:
        """Return a track at a distance to the left, whose chainages begin abreast; its height follows this one."""
        xy = self.curve.offset(left_m)
        length = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T)))
        step = self.curve.step_m
        s = np.arange(0.0, length[-1], step)
        columns = [np.interp(s, length, one) for one in (*xy.T, self.curve.heading, self.curve.curvature)]
        curvature = columns[3] / (1.0 - left_m * columns[3])
        curve = Curve(np.column_stack(columns[:2]), columns[2], curvature, step)
        return Way(curve, cant_m or self.cant_m, self.grade, self.base_m)


@dataclass
class Scene:
    """Points of a scene with the truth about it; the first of its `ways` carries all things."""

    ways: list[Way]
    per_m2: float
    noise_m: float
    rng: np.random.RandomState
    xyz: list[np.ndarray] = field(default_factory=list)
    code: list[np.ndarray] = field(default_factory=list)
    truth: list[Truth] = field(default_factory=list)
    wire: list[np.ndarray] = field(default_factory=list)

    def add(self, s: np.ndarray, v: np.ndarray, w: np.ndarray, code: int, way: int = 0) -> None:
        """Add points without noise in the frame of a track; noise is added to each coordinate."""
        places = self.ways[way].place(s, v, w)
        self.xyz.append(places + self.noise_m * self.rng.standard_normal(places.shape))
        self.code.append(np.full(len(places), code, dtype=np.uint8))

    def patch(self, along: tuple[float, float], up: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Draw places on a rectangle with the density of the scene, (n,) each."""
        area = (along[1] - along[0]) * (up[1] - up[0])
        count = self.rng.poisson(self.per_m2 * area)
        return self.rng.uniform(*along, count), self.rng.uniform(*up, count)

    @property
    def points(self) -> np.ndarray:
        """All points, (n, 3)."""
        return np.concatenate(self.xyz)

    @property
    def codes(self) -> np.ndarray:
        """Their classes, (n,)."""
        return np.concatenate(self.code)


@dataclass(frozen=True)
class Truth:
    """An object: its kind, where it is, and its surface without noise in the frame of the track, (n, 3)."""

    kind: str
    s: float
    side: int
    surface: np.ndarray


def double_track(
    seed: int,
    per_m2: float = 800.0,
    elements: Sequence[Element] | None = None,
    cant_m: float = 0.120,
    grade: float = 0.012,
    noise_m: float = 0.005,
    apart_m: float = 4.0,
) -> Scene:
    """Return an empty scene: a straight, a clothoid and an arc of R 300 to the left with cant on a gradient."""
    given = elements or (Element(60.0), Element(60.0, 0.0, 1 / 300), Element(140.0, 1 / 300, 1 / 300))
    curve = trace(given, (500.0, 800.0), 0.3, 0.02)
    peak = max(np.abs(curve.curvature).max(), 1e-12)

    def cant(s: np.ndarray) -> np.ndarray:
        # A curve to the left has its right rail higher.
        return -cant_m * np.interp(s, curve.chainage, curve.curvature) / peak if peak > 1e-9 else np.zeros(np.shape(s))

    first = Way(curve, cant, grade)
    ways = [first, first.beside(apart_m)] if apart_m else [first]
    return Scene(ways, per_m2, noise_m, np.random.RandomState(seed))


def plate(scene: Scene, s: float, side: int, aside_m: float, up: tuple[float, float], length_m: float = 0.5) -> None:
    """Add an upright plate parallel to the track, as of a cabinet or a sign, `aside_m` from the middle."""
    along = (s - length_m / 2, s + length_m / 2)
    at, w = scene.patch(along, up)
    scene.add(at, np.full(len(at), side * aside_m), w, OBJECT)
    grid = np.stack(np.meshgrid(np.linspace(*along, 9), np.linspace(*up, 60)), axis=-1).reshape(-1, 2)
    _truth(scene, "plate", s, side, np.column_stack([grid[:, 0], np.full(len(grid), side * aside_m), grid[:, 1]]))


def pole(scene: Scene, s: float, side: int, aside_m: float, up: tuple[float, float], across_m: float = 0.11) -> None:
    """Add an upright pole whose nearest line is `aside_m` from the middle; the half towards the track is seen."""
    radius = across_m / 2
    angle, w = scene.patch((0.0, np.pi * radius), up)
    turn = angle / radius - np.pi / 2
    scene.add(s + radius * np.sin(turn), side * (aside_m + radius * (1 - np.cos(turn))), w, OBJECT)
    line = np.linspace(*up, 200)
    _truth(scene, "pole", s, side, np.column_stack([np.full(200, s), np.full(200, side * aside_m), line]))


def beam(scene: Scene, s: float, height_m: float, length_m: float = 0.6, half_m: float = 2.2) -> None:
    """Add a beam over the track, whose underside is seen."""
    at, v = scene.patch((s - length_m / 2, s + length_m / 2), (-half_m, half_m))
    scene.add(at, v, np.full(len(at), height_m), OBJECT)
    line = np.linspace(-half_m, half_m, 400)
    _truth(scene, "beam", s, 0, np.column_stack([np.full(400, s), line, np.full(400, height_m)]))


def wall(scene: Scene, along: tuple[float, float], side: int, aside_m: float, up: tuple[float, float]) -> None:
    """Add a wall parallel to the track."""
    at, w = scene.patch(along, up)
    scene.add(at, np.full(len(at), side * aside_m), w, OBJECT)
    line = np.linspace(*up, 200)
    middle = sum(along) / 2
    _truth(scene, "wall", middle, side, np.column_stack([np.full(200, middle), np.full(200, side * aside_m), line]))


def bush(scene: Scene, s: float, side: int, aside_m: float, middle_m: float = 1.5, radius_m: float = 0.5) -> None:
    """Add a bush, a cloud of leaves whose nearest are `aside_m` from the middle."""
    direction = scene.rng.standard_normal((400, 3))
    direction *= radius_m * scene.rng.uniform(0, 1, (400, 1)) ** (1 / 3) / np.linalg.norm(direction, axis=1)[:, None]
    v = side * (aside_m + radius_m + direction[:, 1])
    scene.add(s + direction[:, 0], v, middle_m + direction[:, 2], BUSH)
    _truth(scene, "bush", s, side, np.column_stack([s + direction[:, 0], v, middle_m + direction[:, 2]]))


def platform(
    scene: Scene, along: tuple[float, float], side: int, offset_m: float, height_m: float, face: bool = True
) -> None:
    """Add a platform 3 m wide, with its vertical face unless it is seen from above only."""
    at, v = scene.patch(along, (offset_m, offset_m + 3.0))
    scene.add(at, side * v, np.full(len(at), height_m), PLATFORM)
    if face:
        at, w = scene.patch(along, (0.0, height_m))
        scene.add(at, np.full(len(at), side * offset_m), w, PLATFORM)


def bed(scene: Scene, half_m: float = 6.0, depth_m: float = 0.25) -> None:
    """Add ballast below the rail tops."""
    at, v = scene.patch((0.0, scene.ways[0].curve.length_m), (-half_m, half_m))
    scene.add(at, v, -depth_m + 0.03 * scene.rng.standard_normal(len(at)), BED)


def stray(scene: Scene, count: int) -> None:
    """Add single points inside the profile, far from each other."""
    s = np.linspace(3.0, scene.ways[0].curve.length_m - 3.0, count)
    scene.add(s, scene.rng.uniform(-1.2, 1.2, count), scene.rng.uniform(0.8, 3.5, count), OBJECT)


def wagon(scene: Scene, along: tuple[float, float], way: int = 1, half_m: float = 1.45, top_m: float = 4.0) -> None:
    """Add a wagon on a track: both sides and the roof, and its ends."""
    for side in (-1, 1):
        at, w = scene.patch(along, (0.9, top_m))
        scene.add(at, np.full(len(at), side * half_m), w, TRAIN, way)
    at, v = scene.patch(along, (-half_m, half_m))
    scene.add(at, v, np.full(len(at), top_m), TRAIN, way)
    for end in along:
        v, w = scene.patch((-half_m, half_m), (0.9, top_m))
        scene.add(np.full(len(v), end), v, w, TRAIN, way)


def tunnel(scene: Scene, along: tuple[float, float], radius_m: float = 3.0, middle_m: float = 2.6) -> None:
    """Add the lining of a tunnel, part of a cylinder about a line over the track."""
    at, turned = scene.patch(along, (-0.3 * radius_m, (np.pi + 0.3) * radius_m))
    turn = turned / radius_m
    scene.add(at, radius_m * np.cos(turn), middle_m + radius_m * np.sin(turn), OBJECT)


def catenary(
    scene: Scene, height_m: float = 5.5, span_m: float = 30.0, stagger_m: float = 0.2, per_m: float = 60.0
) -> None:
    """Add a contact wire with messenger, droppers and steady arms; it is straight between its supports."""
    way = scene.ways[0]
    supports = np.arange(5.0, way.curve.length_m - 2.0, span_m)
    sides = stagger_m * np.where(np.arange(len(supports)) % 2, 1.0, -1.0)
    ends = way.place(supports, sides, height_m)
    for low, high in zip(ends, ends[1:]):
        for lift, density in ((0.0, per_m), (1.0, per_m)):  # the wire, and the messenger over it
            share = scene.rng.uniform(0, 1, scene.rng.poisson(density * span_m))
            sag = lift * 0.5 * 4 * share * (1 - share)
            places = low + share[:, None] * (high - low) + np.column_stack([0 * share, 0 * share, lift - sag])
            _put(scene, places, WIRE)
        scene.wire.append(np.array([low, high]))
        for share in np.linspace(0.1, 0.9, 6):
            up = scene.rng.uniform(0.02, 1.0 - 0.5 * 4 * share * (1 - share), 30)
            places = low + share * (high - low) + np.column_stack([0 * up, 0 * up, up])
            _put(scene, places, WIRE)
    for at, side in zip(supports, sides):
        along = scene.rng.uniform(0.0, 1.0, 90)  # an arm rises by a fifth of its length towards its mast
        pull = -np.sign(side)
        scene.add(np.full(90, at), side + pull * along, height_m + 0.03 + 0.2 * along, WIRE)


def _put(scene: Scene, places: np.ndarray, code: int) -> None:
    """Add points that are in the world already."""
    scene.xyz.append(places + scene.noise_m * scene.rng.standard_normal(places.shape))
    scene.code.append(np.full(len(places), code, dtype=np.uint8))


def _truth(scene: Scene, kind: str, s: float, side: int, surface: np.ndarray) -> None:
    scene.truth.append(Truth(kind, s, side, surface))


def lines_of(scene: Scene) -> tuple[list[Centerline], list[RailLine]]:
    """Return the true centerlines and rails of a scene, as *Extract rails* writes them."""
    tracks, rails = [], []
    for number, way in enumerate(scene.ways, start=1):
        ids = (2 * number, 2 * number - 1)
        cant = way.cant_m(np.arange(0.0, way.curve.length_m, 1.0))
        most = float(cant[np.argmax(np.abs(cant))])
        for side, one in zip((1, -1), ids):
            rails.append(RailLine(way.line(side * SPACING_M / 2), one, RAIL_CLASS, 1000, 5.0, 1.0, 0.0, sigmaz_mm=0.6))
        tracks.append(
            Centerline(
                way.line(),
                number,
                RAIL_CLASS,
                ids[:1],
                ids[1:],
                1000 * GAUGE_M,
                0.5,
                1000 * cant.mean(),
                1000 * most,
                0.0,
            )
        )
    return tracks, rails


def offsets() -> Iterator[float]:
    """Yield how far inside the objects of a scene are, metres."""
    for size in (0.005, 0.008, 0.015, 0.030, 0.080, 0.150):
        yield from (size, -size)


SHORT = Element(30.0), Element(20.0, 0.0, 1 / 300), Element(40.0, 1 / 300, 1 / 300)
"""A straight, a clothoid and an arc to the left, for tests."""


def courses_of(scene: Scene, with_rails: bool = True) -> list[Course]:
    """Return the tracks of a scene as the sweep needs them."""
    tracks, rails = lines_of(scene)
    own = [[one for one in rails if one.rail_id in (*track.left_ids, *track.right_ids)] for track in tracks]
    return [course_of(track, some if with_rails else []) for track, some in zip(tracks, own)]


def write_points(path: Path, xyz: np.ndarray, code: np.ndarray) -> None:
    """Write points, (n, 3), with classes, (n,), without a coordinate system."""
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, SCALE_M)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = xyz.T
    cloud.classification = code
    cloud.write(str(path))
