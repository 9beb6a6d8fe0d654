"""Objects inside a profile: their parts in each section, how deep their surfaces reach, and the objects they make.

Of N points of a plane, the deepest lies two to three standard deviations of the noise too deep. See docs/clearance.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..polyline import POINTS_AT_ONCE
from ..progress import Progress
from .along import ARMS_M, LIVE_M, away
from .frame import Course
from .settings import AROUND_M, Settings

PLATFORM_WORDS, WIRE_WORDS, VEHICLE_WORDS = "platform", "contact wire", "vehicle on track {}"
"""What an object is, where that is known; such objects are named and not counted."""

SAME_SIGMAS, SURE_SIGMAS = 2.0, 2.0
"""Places whose depths differ by fewer standard errors are one surface; an object that is deeper is surely inside."""

FIT_FACTOR = 1.6
"""What the standard error of a fit is multiplied by: points of one surface share what the fit does not know, such as
the bend of a pole."""

OTHER, PLATFORM, WIRE = range(3)
"""What a point is of; parts are of one kind."""

TOGETHER, TOGETHER_M = 4, 0.10
"""This number of points within a distance makes a thing: dust, birds and rain are single points."""

CELL_M = 0.2
"""Cells of points inside that touch, with at most one cell between, are one object."""

WINDOW_M = 0.5
"""Side of the pieces of an object, along the track and in height, each of which gets a surface."""

HOPELESS_SIGMAS = 8.0
"""A piece whose third deepest point is this number of standard deviations of the noise less deep than that of the
deepest piece is not the deepest one."""

SEAM_M = 3 * CELL_M
"""Length on both sides of the border of two sections in which both name the cells of their parts."""

ALONG_M, UP_M, ACROSS_M = 0.15, 0.35, 0.13
"""Half the size of the part of an object that is fitted: small enough that a mast, a wall or a sign is a plane or a
cylinder there, and large enough for some dozens of points at 400 per square metre."""

DEEPEST = 6
"""The median of this number of points leads to the deepest part: a single one is noise."""

LEAST_POINTS = 8
"""Fewer points make no surface: four unknowns leave too little to judge them by."""

ENVELOPE_ROUNDS, BELOW_WEIGHT, PLAIN_ROUNDS = 12, 0.08, 4
"""Rounds of least squares that find the upper envelope, weight of the points below it in these, which are of what
stands behind, and rounds that find its middle."""

NEAR_SIGMAS, STRAY_SIGMAS = 3.0, 4.0
"""Points within the first number of standard deviations of the noise are of the surface; points further above than the
second deny it."""

STRAY_SHARE, STRAY_LEAST = 0.08, 3
"""Share and number of points above the surface from which the object is a bush and has none."""

DROP_M = 0.014
"""The last fit holds where the surface is at most this far behind its deepest line: there a parabola follows a pole of
11 cm within a millimetre. Places are chosen along the track, not by the noise of the points."""

SURE_SLOPE = 2.0
"""Standard errors from which a slope or a bend counts: an imagined slope would deepen the end of the surface."""

OWN_CELL_M, OWN_LENGTH_M, OWN_SHARE = 0.10, 50.0, 0.5
"""Cells across the track that are filled in more than this share of the metres of a section, and of such a length at
least, move along with the scanner."""

OWN_ASIDE_M, OWN_HEIGHT_M = 1.0, (0.3, 4.0)
"""Where such cells are of the own vehicle: nothing else stands there over such a length on a track on which trains
run."""

BOX_ASIDE_M, BOX_HEIGHT_M = 1.65, (0.3, 4.4)
"""The space of a vehicle on its track."""

LENGTH_M, TALL_M, SHARE = 6.0, 1.5, 0.6
"""A vehicle is longer and taller than this, and such a share of its points is in its space."""

INNER_M, INNER_SHARE = 1.0, 0.05
"""What is so near to the middle of a track is on it, and such a share of the points of a vehicle: roof and ends."""

NEAR_M = 3.0
"""How far from a track a point may be to be in the space of its vehicles."""


@dataclass(frozen=True)
class Intrusion:
    """An object inside the profile of a track; its attributes are the fields of the layer, lengths in their units.

    `course` is the number of the track among the courses, and `xyz`, (3,), the worst place, metres from the zero of the
    coordinate system. `lean` is v and w along the surface there.
    """

    course: int
    track_id: int
    from_m: float
    to_m: float
    chainage_m: float
    v_mm: float
    w_mm: float
    wmin_mm: float
    wmax_mm: float
    pen_mm: float
    raw_mm: float
    sigma_mm: float
    sure: int
    points: int
    class_code: int
    what: str
    xyz: np.ndarray
    lean: tuple[float, float]
    intrusion: int = 0
    km: float = np.nan
    km_text: str | None = None
    review: str = ""

    @property
    def side(self) -> str:
        """Side of the track."""
        return "left" if self.v_mm > 0 else "right"

    @property
    def counts(self) -> bool:
        """Whether it is surely inside and not known to be allowed there."""
        return bool(self.sure) and not self.what


def intrusions_of(courses: Sequence[Course], parts: Sequence[Sequence[Part]]) -> list[Intrusion]:
    """Join the parts in the profile of each track into objects, the deepest sure one first."""
    made = []
    for number, own in enumerate(parts):
        for group in _groups(own):
            surface = _deepest([one for at in group for one in own[at].surfaces])
            if surface.depth_m > 0:
                made.append(_object(number, courses[number], [own[at] for at in group], surface))
    made.sort(key=lambda one: (bool(one.what), -one.sure, -one.pen_mm, one.track_id, one.chainage_m))
    return [replace(one, intrusion=number) for number, one in enumerate(made, start=1)]


def _groups(parts: Sequence[Part]) -> list[np.ndarray]:
    """Return the numbers of the parts of each object: those that name the same cell are one."""
    first: dict[tuple[int, ...], int] = {}
    pairs = [(first.setdefault(cell, at), at) for at, part in enumerate(parts) for cell in part.seam]
    rows, columns = np.reshape(pairs, (-1, 2)).astype(np.int64).T
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(parts), len(parts)))
    count, labels = connected_components(graph, directed=False) if parts else (0, np.empty(0))
    return [np.flatnonzero(labels == one) for one in range(count)]


def _object(number: int, course: Course, parts: Sequence[Part], surface: Surface) -> Intrusion:
    """Return the object that parts make."""
    codes = sum((part.codes for part in parts), Counter())
    low, high = np.min([part.low for part in parts], axis=0), np.max([part.high for part in parts], axis=0)
    s, v, w = (np.array([value]) for value in (surface.s, surface.v, surface.w))
    sigma_m = float(np.hypot(surface.sigma_m, course.sigma_at(w, s)[0]))
    return Intrusion(
        course=number,
        track_id=course.track_id,
        from_m=float(low[0]),
        to_m=float(high[0]),
        chainage_m=surface.s,
        v_mm=1000 * surface.v,
        w_mm=1000 * surface.w,
        wmin_mm=1000 * float(low[2]),
        wmax_mm=1000 * float(high[2]),
        pen_mm=1000 * surface.depth_m,
        raw_mm=1000 * max(part.raw_m for part in parts),
        sigma_mm=1000 * sigma_m,
        sure=int(surface.is_sure and surface.depth_m > SURE_SIGMAS * sigma_m),
        points=sum(codes.values()),
        class_code=max(codes, key=lambda code: (codes[code], -code)),
        what=_what(course, parts, low, high),
        xyz=course.places(s, v, w)[0],
        lean=surface.lean,
    )


def _what(course: Course, parts: Sequence[Part], low: np.ndarray, high: np.ndarray) -> str:
    """Return what an object is, in words; empty if that is not known."""
    kind = parts[0].kind
    if kind == PLATFORM:
        return PLATFORM_WORDS
    if kind == WIRE or (low[2] > ARMS_M and any(part.is_live for part in parts)):
        return WIRE_WORDS
    in_spaces = sum((part.in_spaces for part in parts), Counter())
    count = sum(sum(part.codes.values()) for part in parts)
    length_m, _, height_m = (high - low).tolist()
    track = vehicle_on(in_spaces, count, course.track_id, length_m, height_m)
    return "" if track is None else VEHICLE_WORDS.format(track)


def _deepest(surfaces: Sequence[Surface]) -> Surface:
    """Return the deepest surface of an object, joined with those that agree with it: it alone is so deep by chance."""
    sure = [one for one in surfaces if one.is_sure] or surfaces
    best, *others = sorted(sure, key=lambda one: -one.depth_m)
    depth_m, weight = best.depth_m, 1.0 / best.sigma_m**2
    for one in others:
        if depth_m - one.depth_m > SAME_SIGMAS * np.sqrt(one.sigma_m**2 + 1.0 / weight):
            break
        own = 1.0 / one.sigma_m**2
        depth_m, weight = (depth_m * weight + one.depth_m * own) / (weight + own), weight + own
    return replace(best, depth_m=depth_m, sigma_m=FIT_FACTOR * max(weight**-0.5, best.sigma_m / 2))


@dataclass(frozen=True)
class Points:
    """Points of a section in the order of s: `place`, (n, 3), has s, v and w; the others are (n,).

    Depth is the penetration of the profile with margin and widening, and `kind` what a point is of, see `OTHER`. Points
    that are not the section's own are in its halo. `number` is how many points of the cloud each stands for.
    """

    place: np.ndarray
    depth: np.ndarray
    code: np.ndarray
    is_own: np.ndarray
    kind: np.ndarray
    number: np.ndarray

    def kept(self, which: np.ndarray) -> Points:
        """Return some of the points."""
        return Points(*(column[which] for column in vars(self).values()))


@dataclass(frozen=True)
class Part:
    """What a section shows of one object of a kind; lengths in metres.

    `low` and `high`, (3,), are the least and largest s, v and w of the points inside, and `raw_m` is the penetration of
    the deepest one. Points are counted by class, and by track in the spaces of vehicles. An object is live itself if a
    point is so near to the contact wire. `seam` has kind and numbers of the cells by which the object continues in
    another section.
    """

    kind: int
    low: np.ndarray
    high: np.ndarray
    raw_m: float
    codes: Counter[int]
    in_spaces: Counter[int]
    is_live: bool
    surfaces: tuple[Surface, ...]
    seam: frozenset[tuple[int, ...]]


def parts_of(
    points: Points,
    nodes: np.ndarray,
    courses: Sequence[Course],
    ends: tuple[float, float],
    settings: Settings,
    progress: Progress,
) -> list[Part]:
    """Return the parts of objects in a section, which ends at two chainages.

    Given are the places of the wire, the track, and those around it.
    """
    near = points.kept(points.depth > -AROUND_M)
    inside = np.flatnonzero(near.depth > 0)
    inside = _together(near.place, inside, progress)
    found = []
    for kind in np.unique(near.kind[inside]).tolist():
        mine = inside[near.kind[inside] == kind]
        cells = np.floor(near.place[mine] / CELL_M).astype(np.int64)
        labels = labelled(cells)
        at_seam = np.abs(near.place[mine, :1] - ends).min(axis=1) <= SEAM_M
        is_live = away(nodes, near.place[mine]) <= LIVE_M
        spaces = spaces_of(near.place[mine], courses)
        progress.check()
        for one in np.unique(labels[near.is_own[mine]]).tolist():
            which = (labels == one) & near.is_own[mine]
            own = near.kept(mine[which])
            found.append(
                Part(
                    kind=kind,
                    low=own.place.min(axis=0),
                    high=own.place.max(axis=0),
                    raw_m=float(own.depth.max()),
                    codes=Counter(dict(enumerate(np.bincount(own.code, own.number).astype(int).tolist()))),
                    in_spaces=Counter({track: int(own.number[inner[which]].sum()) for track, inner in spaces.items()}),
                    is_live=bool(is_live[which].any()),
                    surfaces=tuple(_surfaces(near, mine[which], courses[0], settings, progress)),
                    seam=frozenset((kind, *cell) for cell in cells[at_seam & (labels == one)].tolist()),
                )
            )
    return found


def _together(place: np.ndarray, inside: np.ndarray, progress: Progress) -> np.ndarray:
    """Return those of some points, given by their numbers, (k,), that have others of all, (n, 3), around them."""
    tree = cKDTree(place)
    found = [np.empty(0, dtype=np.int64)]
    for some in np.array_split(inside, len(inside) // POINTS_AT_ONCE + 1):
        progress.check()
        away, _ = tree.query(place[some], k=[TOGETHER], distance_upper_bound=TOGETHER_M)
        found.append(some[np.isfinite(away[:, 0])])
    return np.concatenate(found)


def labelled(cells: np.ndarray) -> np.ndarray:
    """Return the number of the object of each cell, (n, 3) int: those at most one cell apart are one."""
    low = cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) - low + 2, dtype=bool)
    for corner in np.ndindex(2, 2, 2):  # doubled cells touch where one cell is between
        grid[tuple((cells - low + corner).T)] = True
    found, _ = label(grid, np.ones((3, 3, 3)))
    return found[tuple((cells - low).T)]


def _surfaces(
    near: Points, own: np.ndarray, course: Course, settings: Settings, progress: Progress
) -> Iterator[Surface]:
    """Yield the surfaces of the pieces of a part that may be its deepest."""
    window = np.floor(near.place[own][:, [0, 2]] / WINDOW_M).astype(np.int64)
    order = np.lexsort((-near.depth[own], window[:, 1], window[:, 0]))
    borders = np.flatnonzero((np.diff(window[order], axis=0) != 0).any(axis=1)) + 1
    pieces = [own[some] for some in np.split(order, borders)]
    third = np.array([near.depth[some[min(2, len(some) - 1)]] for some in pieces])
    for some in (pieces[at] for at in np.flatnonzero(third >= third.max() - HOPELESS_SIGMAS * course.noise_m)):
        progress.check()
        centre = np.median(near.place[some[:DEEPEST]], axis=0)
        i, j = np.searchsorted(near.place[:, 0], (centre[0] - ALONG_M, centre[0] + ALONG_M))
        inward = settings.outline.inward(centre[1:])
        depth_at = partial(settings.depth, course)
        yield surface_of(near.place[i:j], near.depth[i:j], centre, inward, course.noise_m, depth_at)


@dataclass(frozen=True)
class Surface:
    """The deepest place of the surface of part of an object: penetration, its standard error by the fit, and place.

    `is_sure` where enough points make a surface or a bush. `lean` is v and w along the surface, 0 where there is none.
    """

    depth_m: float
    sigma_m: float
    s: float
    v: float
    w: float
    is_sure: bool
    lean: tuple[float, float] = (0.0, 0.0)


Depth = Callable[[np.ndarray], np.ndarray]
"""Returns the penetration of places, (n, 3): s, v and w."""


def surface_of(
    place: np.ndarray, depth: np.ndarray, centre: np.ndarray, inward: np.ndarray, noise_m: float, depth_at: Depth
) -> Surface:
    """Fit the deepest part of an object, and measure how deep the fitted surface is.

    The depth of points beside a corner of the profile bends where the surface does not, so that not the depth is
    fitted, but how far inwards the surface is, seen across the nearest edge. Given are s, v and w of the points around,
    (n, 3), also of those outside of the profile, and their penetration; where the deepest ones are, (3,); and the unit
    vector in v and w, (2,), perpendicular to the nearest edge of the profile.
    """
    off = place - centre
    s, t, h = off[:, 0], off[:, 1] * inward[1] - off[:, 2] * inward[0], off[:, 1:] @ inward
    near = (np.abs(s) <= ALONG_M) & (np.abs(t) <= UP_M) & (np.abs(h) <= ACROSS_M)
    place, depth, s, t, h = place[near], depth[near], s[near], t[near], h[near]
    deepest = np.argsort(-depth, kind="stable")
    if len(depth) < LEAST_POINTS:
        few = deepest[:3]
        middle = place[few].mean(axis=0) if len(few) else np.full(3, np.nan)
        return _at(middle, float(depth[few].mean()) if len(few) else -np.inf, noise_m, False)
    design = np.column_stack([np.ones(len(s)), t, s, s**2])
    chosen = _on_surface(design, h, noise_m)
    if chosen is None:
        third = deepest[2]
        return _at(place[third], float(depth[third]), 2 * noise_m, True)
    fitted, sigma, slope = _smoothed(design[chosen], h[chosen], noise_m)
    beside = np.array([inward[1], -inward[0]])
    places = centre + np.column_stack([s[chosen], np.outer(t[chosen], beside) + np.outer(fitted, inward)])
    depths = depth_at(places)
    at = int(np.argmax(depths))
    right, up = (beside + slope * inward).tolist()
    return replace(_at(places[at], float(depths[at]), float(sigma[at]), True), lean=(right, up))


def _at(place: np.ndarray, depth_m: float, sigma_m: float, is_sure: bool) -> Surface:
    s, v, w = place.tolist()
    return Surface(depth_m, sigma_m, s, v, w, is_sure)


def _on_surface(design: np.ndarray, h: np.ndarray, noise_m: float) -> np.ndarray | None:
    """Return which points, (n,) bool, are of the surface; None if too many points lie above one."""
    weights = np.ones(len(h))
    for _ in range(ENVELOPE_ROUNDS):
        c = _bulging(design, h, weights)
        weights = np.where(h > design @ c, 1.0, BELOW_WEIGHT)
    near = np.abs(h - design @ c) <= NEAR_SIGMAS * noise_m
    for _ in range(PLAIN_ROUNDS):
        if near.sum() < LEAST_POINTS:
            return None
        c = _bulging(design[near], h[near])
        bend = design[:, 2:] @ c[2:]
        on_top = bend >= bend[near].max() - DROP_M
        near = on_top & (np.abs(h - design @ c) <= NEAR_SIGMAS * noise_m)
    above = int((on_top & (h - design @ c > STRAY_SIGMAS * noise_m)).sum())
    return None if near.sum() < LEAST_POINTS or above >= max(STRAY_LEAST, STRAY_SHARE * len(h)) else near


def _smoothed(design: np.ndarray, h: np.ndarray, noise_m: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the surface at its points, a plane or cylinder whose slopes and bend are sure, errors, and its slope."""
    kept = [0, 1, 2, 3] if _solved(design, h)[3] < 0 else [0, 1, 2]
    while True:
        own = design[:, kept]
        c = _solved(own, h)
        off = h - own @ c
        scatter = max(float(np.sqrt(off @ off / max(len(off) - len(kept), 1))), 0.5 * noise_m)
        spread = scatter**2 * np.linalg.pinv(own.T @ own)
        sure = np.abs(c) / np.sqrt(np.maximum(np.diag(spread), 1e-18))
        weakest = int(np.argmin(np.where(np.arange(len(kept)) > 0, sure, np.inf)))
        if len(kept) == 1 or sure[weakest] >= SURE_SLOPE:
            errors = np.sqrt(np.einsum("ij,jk,ik->i", own, spread, own))
            return own @ c, errors, float(c[kept.index(1)]) if 1 in kept else 0.0
        del kept[weakest]


def _bulging(design: np.ndarray, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the coefficients, of which the bend is not hollow: a mast is round, and hollow ends would be noise."""
    c = _solved(design, values, weights)
    return c if c[3] <= 0 else np.append(_solved(design[:, :3], values, weights), 0.0)


def _solved(design: np.ndarray, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the coefficients of weighted least squares; the smallest ones where the points do not tell them."""
    weighted = design if weights is None else design * weights[:, None]
    return np.linalg.lstsq(weighted.T @ design, weighted.T @ values, rcond=1e-10)[0]


def own_vehicle(place: np.ndarray) -> np.ndarray:
    """Return which points of a section, (n, 3), are of the vehicle that carried the scanner."""
    s, v, w = place.T
    metre = np.floor(s).astype(np.int64)
    may = np.flatnonzero((np.abs(v) < OWN_ASIDE_M) & (w > OWN_HEIGHT_M[0]) & (w < OWN_HEIGHT_M[1]))
    filled, cell = np.unique(np.floor(place[may, 1:] / OWN_CELL_M), axis=0, return_inverse=True)
    both = np.unique(np.column_stack([cell.ravel(), metre[may]]), axis=0)
    least = OWN_SHARE * max(len(np.unique(metre)), OWN_LENGTH_M)
    is_own = np.bincount(both[:, 0], minlength=len(filled)) > least
    found = np.zeros(len(s), dtype=bool)
    found[may[is_own[cell.ravel()]]] = True
    return found


def spaces_of(place: np.ndarray, courses: Sequence[Course]) -> dict[int, np.ndarray]:
    """Return which points, (n, 3) in the frame of the first track, are where vehicles of each track stand, by id."""
    own, *others = courses
    found = {own.track_id: _is_within(place[:, 1], place[:, 2], INNER_M)}
    xyz = own.places(*place.T)
    for other in others:
        near, station = other.near(xyz[:, :2], NEAR_M)
        _, v, w = other.located(xyz[near], station)
        found[other.track_id] = np.zeros(len(place), dtype=bool)
        found[other.track_id][near] = _is_within(v, w, BOX_ASIDE_M)
    return found


def _is_within(v: np.ndarray, w: np.ndarray, aside_m: float) -> np.ndarray:
    return (np.abs(v) < aside_m) & (w > BOX_HEIGHT_M[0]) & (w < BOX_HEIGHT_M[1])


def vehicle_on(inside: Counter[int], count: int, track_id: int, length_m: float, height_m: float) -> int | None:
    """Return the track on which an object in the profile of a track is a vehicle; None if it is none.

    Given are its points in the spaces of vehicles, by track, and all of its points.
    """
    if length_m <= LENGTH_M or height_m <= TALL_M:
        return None
    if inside[track_id] >= INNER_SHARE * count:
        return track_id
    return next((number for number, own in inside.most_common() if number != track_id and own >= SHARE * count), None)
