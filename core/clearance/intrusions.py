"""Objects inside a profile: their parts joined across sections, with depth, standard error and place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .frame import Course
from .parts import PLATFORM, WIRE, Part, Parts
from .surface import Surface
from .vehicles import vehicle_on
from .wires import ARMS_M

PLATFORM_WORDS, WIRE_WORDS, VEHICLE_WORDS = "platform", "contact wire", "vehicle on track {}"
"""What an object is, where that is known; such objects are named and not counted."""

SAME_SIGMAS = 2.0
"""Places whose depths differ by fewer standard errors are one surface."""

SURE_SIGMAS = 2.0
"""An object is inside for sure if its depth exceeds this number of standard errors."""

FIT_FACTOR = 1.6
"""What the standard error of a fit is multiplied by: points of one surface share what the fit does not know, such as
the bend of a pole."""


@dataclass(frozen=True)
class Intrusion:
    """An object inside the profile of a track; its attributes are the fields of the layer, lengths in their units.

    Attributes
    ----------
    course : int
        Number of the track among the courses.
    xyz : (3,) array
        The worst place, metres from the zero of the coordinate system.
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


def intrusions_of(courses: Sequence[Course], found: Mapping[tuple[int, int], Parts]) -> list[Intrusion]:
    """Join the parts of all sections, by track and section, into objects, the deepest sure one first."""
    made = [one for number, course in enumerate(courses) for one in _of_course(number, course, found)]
    made.sort(key=lambda one: (bool(one.what), -one.sure, -one.pen_mm, one.track_id, one.chainage_m))
    return [replace(one, intrusion=number) for number, one in enumerate(made, start=1)]


def _of_course(number: int, course: Course, found: Mapping[tuple[int, int], Parts]) -> Iterator[Intrusion]:
    """Yield the objects in the profile of one track."""
    mine = {section: parts for (track, section), parts in sorted(found.items()) if track == number}
    parts = [one for own in mine.values() for one in own.parts]
    for group in _groups(mine):
        one = _object(number, course, [parts[at] for at in group])
        if one is not None:
            yield one


def _groups(sections: Mapping[int, Parts]) -> list[list[int]]:
    """Return the numbers of the parts of each object: those of two sections that name the same cell are one."""
    first, total = {}, 0
    for section, own in sections.items():
        first[section], total = total, total + len(own.parts)
    pairs = []
    for section, own in sections.items():
        ahead = dict(sections[section + 1].seams) if section + 1 in sections else {}
        pairs += [(first[section] + at, first[section + 1] + ahead[cell]) for cell, at in own.seams if cell in ahead]
    if not total:
        return []
    rows, columns = np.reshape(pairs, (-1, 2)).astype(np.int64).T
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(total, total))
    count, labels = connected_components(graph, directed=False)
    return [np.flatnonzero(labels == one).tolist() for one in range(count)]


def _object(number: int, course: Course, parts: Sequence[Part]) -> Intrusion | None:
    """Return the object that parts make; None if its surface is not inside."""
    surface = _deepest([one for part in parts for one in part.surfaces])
    if surface is None or surface.depth_m <= 0:
        return None
    codes = sum((part.codes for part in parts), Counter())
    s, w = ((min(getattr(p, n)[0] for p in parts), max(getattr(p, n)[1] for p in parts)) for n in ("s", "w"))
    line_m = float(course.sigma_at(np.array([surface.w]), np.array([surface.s]))[0])
    sigma_m = float(np.hypot(surface.sigma_m, line_m))
    place = [np.array([value]) for value in (surface.s, surface.v, surface.w)]
    return Intrusion(
        course=number,
        track_id=course.track_id,
        from_m=s[0],
        to_m=s[1],
        chainage_m=surface.s,
        v_mm=1000 * surface.v,
        w_mm=1000 * surface.w,
        wmin_mm=1000 * w[0],
        wmax_mm=1000 * w[1],
        pen_mm=1000 * surface.depth_m,
        raw_mm=1000 * max(part.raw_m for part in parts),
        sigma_mm=1000 * sigma_m,
        sure=int(surface.is_sure and surface.depth_m > SURE_SIGMAS * sigma_m),
        points=sum(part.points for part in parts),
        class_code=max(codes, key=lambda code: (codes[code], -code)),
        what=_what(course, parts, s, w),
        xyz=course.places(*place)[0],
    )


def _what(course: Course, parts: Sequence[Part], s: tuple[float, float], w: tuple[float, float]) -> str:
    """Return what an object is, in words; empty if that is not known."""
    kind = parts[0].kind
    if kind == PLATFORM:
        return PLATFORM_WORDS
    if kind == WIRE or (w[0] > ARMS_M and any(part.live for part in parts)):
        return WIRE_WORDS
    boxes = sum((part.boxes for part in parts), Counter())
    track = vehicle_on(boxes, course.track_id, s[1] - s[0], w[1] - w[0])
    return "" if track is None else VEHICLE_WORDS.format(track)


def _deepest(surfaces: Sequence[Surface]) -> Surface | None:
    """Return the deepest surface of an object.

    The deepest of many places that are equally deep is so by chance. Places are therefore joined from the deepest on,
    as long as the next one agrees with the mean of those before.
    """
    sure = [one for one in surfaces if one.is_sure] or list(surfaces)
    if not sure:
        return None
    best, *others = sorted(sure, key=lambda one: -one.depth_m)
    depth_m, weight = best.depth_m, 1.0 / best.sigma_m**2
    for one in others:
        if depth_m - one.depth_m > SAME_SIGMAS * np.sqrt(one.sigma_m**2 + 1.0 / weight):
            break
        own = 1.0 / one.sigma_m**2
        depth_m, weight = (depth_m * weight + one.depth_m * own) / (weight + own), weight + own
    return replace(best, depth_m=depth_m, sigma_m=FIT_FACTOR * max(weight**-0.5, best.sigma_m / 2))
