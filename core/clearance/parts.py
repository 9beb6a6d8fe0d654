"""Parts of objects inside a profile, as one section shows them; `intrusions` joins them across sections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from ..polyline import POINTS_AT_ONCE
from ..progress import Progress
from .frame import Course
from .settings import AROUND_M, Settings
from .surface import ALONG_M, DEEPEST, Surface, surface_of
from .vehicles import spaces_of
from .wires import LIVE_M, away

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
