"""Parts of objects inside a profile, as one section shows them; `intrusions` joins them across sections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from .frame import Course
from .outline import Outline
from .surface import ALONG_M, DEEPEST, Depth, Surface, surface_of
from .vehicles import in_boxes

OTHER, PLATFORM, WIRE = range(3)
"""What a point is of; parts are of one kind."""

AROUND_M = 0.20
"""Points up to this distance outside of the profile count for the surface of an object, so that its mean is not cut off
at zero."""

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

Cell = tuple[int, int, int, int]


@dataclass
class Part:
    """What a section shows of one object; lengths in metres.

    Attributes
    ----------
    kind : int
    s, w : tuple of float
        Least and largest of the points inside.
    points : int
        Points inside.
    raw : tuple of float
        Penetration of the deepest point.
    codes : Counter
        Points by class.
    boxes : Counter
        Points in the space of a vehicle on a track, by the number of the track; and all that were looked at, by -1.
    live : bool
        Whether a point is so near to the contact wire that the object is live itself.
    surfaces : list of Surface
    """

    kind: int
    s: tuple[float, float]
    w: tuple[float, float]
    points: int
    raw_m: float
    codes: Counter[int] = field(default_factory=Counter)
    boxes: Counter[int] = field(default_factory=Counter)
    live: bool = False
    surfaces: list[Surface] = field(default_factory=list)


@dataclass(frozen=True)
class Parts:
    """The parts of objects in a section, and the cells by which they continue in the next ones."""

    parts: tuple[Part, ...] = ()
    seams: tuple[tuple[Cell, int], ...] = ()


@dataclass(frozen=True)
class Inside:
    """Points near the profile; see `section.Points`."""

    place: np.ndarray
    depth: np.ndarray
    code: np.ndarray
    kind: np.ndarray
    is_own: np.ndarray
    away_m: np.ndarray


def parts_of(
    near: Inside, courses: Sequence[Course], ends: tuple[float, float], outline: Outline, depth_at: Depth
) -> Parts:
    """Return the parts of objects in a section.

    Parameters
    ----------
    near : Inside
        Points at most `AROUND_M` outside of the profile, in the order of s.
    courses : sequence of Course
        The track first, then those around it.
    ends : tuple of float
        Chainages at which the section begins and ends.
    """
    inside = np.flatnonzero(near.depth > 0)
    if not len(inside):
        return Parts()
    reach, _ = cKDTree(near.place).query(near.place[inside], k=[TOGETHER], distance_upper_bound=TOGETHER_M)
    inside = inside[np.isfinite(reach[:, 0])]
    parts: list[Part] = []
    seams: list[tuple[Cell, int]] = []
    for kind in np.unique(near.kind[inside]).tolist():
        mine = inside[near.kind[inside] == kind]
        cells = np.floor(near.place[mine] / CELL_M).astype(np.int64)
        labels = labelled(cells)
        at_seam = np.abs(near.place[mine, :1] - ends).min(axis=1) <= SEAM_M
        numbers: dict[int, int] = {}
        for one in np.unique(labels).tolist():
            chosen = mine[labels == one]
            own = chosen[near.is_own[chosen]]
            if len(own):
                numbers[one] = len(parts)
                parts.append(_part(near, own, kind, courses, outline, depth_at))
        named = np.unique(np.column_stack([cells, labels])[at_seam], axis=0)
        seams += [((kind, *row[:3]), numbers[row[3]]) for row in named.tolist() if row[3] in numbers]
    return Parts(tuple(parts), tuple(seams))


def labelled(cells: np.ndarray) -> np.ndarray:
    """Return the number of the object of each cell, (n, 3) int: those at most one cell apart are one."""
    low = cells.min(axis=0)
    grid = np.zeros(cells.max(axis=0) - low + 2, dtype=bool)
    for corner in np.ndindex(2, 2, 2):  # doubled cells touch where one cell is between
        grid[tuple((cells - low + corner).T)] = True
    found, _ = label(grid, np.ones((3, 3, 3)))
    return found[tuple((cells - low).T)]


def _part(
    near: Inside, own: np.ndarray, kind: int, courses: Sequence[Course], outline: Outline, depth_at: Depth
) -> Part:
    """Return the part that some points inside make."""
    s, w = near.place[own, 0], near.place[own, 2]
    return Part(
        kind,
        (float(s.min()), float(s.max())),
        (float(w.min()), float(w.max())),
        len(own),
        float(near.depth[own].max()),
        Counter(dict(zip(*(one.tolist() for one in np.unique(near.code[own], return_counts=True))))),
        in_boxes(near.place[own], courses),
        bool((near.away_m[own]).min() <= 0.0),
        list(_surfaces(near, own, courses[0].noise_m, outline, depth_at)),
    )


def _surfaces(near: Inside, own: np.ndarray, noise_m: float, outline: Outline, depth_at: Depth) -> Iterator[Surface]:
    """Yield the surfaces of the pieces of a part that may be its deepest."""
    window = np.floor(near.place[own][:, [0, 2]] / WINDOW_M).astype(np.int64)
    order = np.lexsort((-near.depth[own], window[:, 1], window[:, 0]))
    borders = np.flatnonzero((np.diff(window[order], axis=0) != 0).any(axis=1)) + 1
    pieces = [own[some] for some in np.split(order, borders)]
    third = np.array([near.depth[some[min(2, len(some) - 1)]] for some in pieces])
    for some in (pieces[at] for at in np.flatnonzero(third >= third.max() - HOPELESS_SIGMAS * noise_m)):
        centre = np.median(near.place[some[:DEEPEST]], axis=0)
        i, j = np.searchsorted(near.place[:, 0], (centre[0] - ALONG_M, centre[0] + ALONG_M))
        inward = outline.inward(centre[1:])
        yield surface_of(near.place[i:j], near.depth[i:j], centre, inward, noise_m, depth_at)
