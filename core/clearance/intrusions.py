"""Objects inside a profile: their parts joined across sections, with depth, standard error and place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .frame import Course
from .parts import PLATFORM, WIRE, Part
from .surface import Surface
from .vehicles import vehicle_on
from .wires import ARMS_M

PLATFORM_WORDS, WIRE_WORDS, VEHICLE_WORDS = "platform", "contact wire", "vehicle on track {}"
"""What an object is, where that is known; such objects are named and not counted."""

SAME_SIGMAS, SURE_SIGMAS = 2.0, 2.0
"""Places whose depths differ by fewer standard errors are one surface; an object that is deeper is surely inside."""

FIT_FACTOR = 1.6
"""What the standard error of a fit is multiplied by: points of one surface share what the fit does not know, such as
the bend of a pole."""


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
