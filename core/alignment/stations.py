"""Axes from lines with M values, from lines with a first kilometre, or from lines with posts.

See docs/stationing.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..design_numbers import KM, LENGTH, NUMBER, checked
from ..design_places import check_places
from ..errors import RailExtractError
from ..polyline import Polyline
from .axis import Axis, nearest
from .stationing import Jump, Stationing, stationing_of

POST_OFFSET_M = 50.0
"""Posts further than this from the axis are left out, metres: they belong to another line."""

ONE_POST_M = 10.0
"""Posts of the same kilometre this close along the axis are one post, metres: there may be one on either side."""

JOINED_M = 0.05
"""Largest distance between the end of a line and the start of the next one of the same axis, metres."""

UNIT_OFF = 0.2
"""Largest share by which M values may differ from metres or kilometres along the line."""


@dataclass(frozen=True)
class AxisLine:
    """A line of an axis as it is stored.

    Attributes
    ----------
    name : str
        Of its axis.
    xy : (n, 2) array
        Metres.
    m : (n,) array
        M values, NaN where there is none.
    """

    name: str
    xy: np.ndarray
    m: np.ndarray


@dataclass(frozen=True)
class Post:
    """A post beside an axis: its place, (2,) metres, and its kilometre."""

    xy: np.ndarray
    km: float


@dataclass(frozen=True)
class Start:
    """The kilometre at the first vertex of a line, and whether kilometres decrease along it."""

    km: float
    decreasing: bool = False


@dataclass(frozen=True)
class Axes:
    """Axes in one plane.

    Attributes
    ----------
    axes : tuple of Axis
    notices : tuple of str
        What the user is told of them.
    """

    axes: tuple[Axis, ...]
    notices: tuple[str, ...]


def make_axes(
    lines: Sequence[AxisLine], start: Start | None = None, posts: Sequence[Post] = (), jumps: Sequence[Jump] = ()
) -> Axes:
    """Give lines their kilometres by posts, else by a first kilometre, else by their M values.

    Parameters
    ----------
    lines : sequence of AxisLine
        At least one; those of one name that follow each other are joined.
    start : Start, optional
    posts : sequence of Post
    jumps : sequence of Jump
        Stated jumps; M values contain theirs.

    Raises
    ------
    RailExtractError
        Nothing states kilometres, or what does contradicts itself or is on no railway.
    """
    _check(lines, start, posts)
    joined = [replace(line, name=line.name or str(number)) for number, line in enumerate(_joined(lines), start=1)]
    if (jumps or (start is not None and not posts)) and len(joined) > 1:
        what = "START_KM is" if start is not None and not posts else "JUMPS are"
        raise RailExtractError(
            f"AXIS has {len(joined)} lines that do not follow each other, but {what} for one: choose a single line, or "
            "give M values."
        )
    if posts:
        return _by_posts(joined, posts, jumps)
    if start is not None:
        (line,) = joined
        turned = _directed(line, start.decreasing)
        length_m = Polyline(turned.xy).length_m
        numbered = stationing_of(length_m, [length_m if start.decreasing else 0.0], [start.km], jumps)
        return _told([Axis(line.name, turned.xy, numbered)])
    if jumps:
        raise RailExtractError("JUMPS need START_KM or POSTS: M values of AXIS contain their jumps.")
    return _told([_by_measures(line) for line in joined])


def _check(lines: Sequence[AxisLine], start: Start | None, posts: Sequence[Post]) -> None:
    """Refuse lines, a start and posts that are on no railway; where they are read, kilometres are checked."""
    for number, line in enumerate(lines, start=1):
        where = f"The line {line.name or number} of AXIS"
        check_places(line.xy, where)
        for m in line.m[~(np.isnan(line.m) | (np.abs(line.m) <= NUMBER.high))][:1]:
            checked(float(m), NUMBER, where, "M value")
        checked(Polyline(line.xy).length_m, LENGTH, where, "length")
    if start is not None:
        checked(start.km, KM, "AXIS", "START_KM")
    for post in posts:
        check_places(post.xy[None], f"The post of km {post.km:g} in POSTS")


def _told(axes: Sequence[Axis], more: Sequence[str] = ()) -> Axes:
    """Return axes with the sentences about them."""
    notices = [*more, *(notice for axis in axes for notice in axis.stationing.notices)]
    return Axes(tuple(axes), tuple(notices))


def _joined(lines: Sequence[AxisLine]) -> list[AxisLine]:
    """Join lines of one name where one ends at the start of exactly one other."""
    follower = _followers(lines)
    led, chains = set(follower.values()), []
    left = dict.fromkeys(sorted(range(len(lines)), key=lambda number: number in led))  # beginnings first, rings last
    while left:
        chain = [next(iter(left))]
        while chain[-1] in left:
            del left[chain[-1]]
            if follower.get(chain[-1]) in left:
                chain.append(follower[chain[-1]])
        chains.append([lines[number] for number in chain])
    return [
        AxisLine(chain[0].name, np.concatenate([one.xy for one in chain]), np.concatenate([one.m for one in chain]))
        for chain in chains
    ]


def _followers(lines: Sequence[AxisLine]) -> dict[int, int]:
    """Return the number of the line that follows each line, where it is the only one and follows no other."""
    starts, ends = (np.array([line.xy[at] for line in lines]) for at in (0, -1))
    near = cKDTree(starts).query_ball_point(ends, JOINED_M)
    pairs = [
        (one, other)
        for one, others in enumerate(near)
        for other in others
        if other != one and lines[one].name == lines[other].name
    ]
    leaving, arriving = Counter(one for one, _ in pairs), Counter(other for _, other in pairs)
    return {one: other for one, other in pairs if leaving[one] == arriving[other] == 1}


def _directed(line: AxisLine, backwards: bool) -> AxisLine:
    """Return a line with the kilometres, without vertices that repeat the one before."""
    xy = line.xy[::-1] if backwards else line.xy
    moves = np.append(True, np.any(np.diff(xy, axis=0) != 0, axis=1))
    return replace(line, xy=xy[moves], m=(line.m[::-1] if backwards else line.m)[moves])


def _by_measures(line: AxisLine) -> Axis:
    """Give a line its kilometres by its M values; a repeated vertex with another value is a jump."""
    known = np.isfinite(line.m)
    s, m = Polyline(line.xy).t[known], line.m[known]
    rise, way = np.abs(np.diff(m)), np.diff(s)
    if known.sum() < 2 or not (way > 0).any():
        raise RailExtractError(
            "AXIS has no M values: fill in START_KM, or give POSTS or an axis whose vertices have kilometres as M."
        )
    per_metre = float(np.median(rise[way > 0] / way[way > 0]))
    unit_km = next((unit for unit in (1.0, 0.001) if abs(per_metre * 1000 * unit - 1) <= UNIT_OFF), None)
    if unit_km is None:
        raise RailExtractError(
            f"AXIS has M values that change by {per_metre:.3g} per metre, so they are neither metres nor kilometres: "
            "fill in START_KM, or correct them."
        )
    backwards = bool(np.sum(np.sign(np.diff(m))) < 0)
    length_m = Polyline(line.xy).length_m
    if backwards:
        s, m = length_m - s[::-1], m[::-1]
    return Axis(line.name, _directed(line, backwards).xy, stationing_of(length_m, s.tolist(), (unit_km * m).tolist()))


def _by_posts(lines: Sequence[AxisLine], posts: Sequence[Post], jumps: Sequence[Jump]) -> Axes:
    """Give lines their kilometres by the posts that are nearest to each."""
    km, xy = np.array([post.km for post in posts]), np.array([post.xy for post in posts])
    plain = [Axis(line.name, _directed(line, False).xy, Stationing(*np.zeros((3, 1)))) for line in lines]
    near = nearest(plain, xy, np.inf)
    far = near.distance_m > POST_OFFSET_M
    made = []
    for number, axis in enumerate(plain):
        mine = np.flatnonzero((near.axis == number) & ~far)
        if not len(mine):
            raise RailExtractError(
                f"No post is within {POST_OFFSET_M:g} m of the axis {axis.name}: check POSTS and their "
                "coordinate system."
            )
        made.append(_numbered(axis, near.s[mine], km[mine], jumps))
    count = int(far.sum())
    left_out = f"{count} of {len(posts)} posts are more than {POST_OFFSET_M:g} m from AXIS: left out."
    return _told(made, [left_out] if count else [])


def _numbered(axis: Axis, s: np.ndarray, km: np.ndarray, jumps: Sequence[Jump]) -> Axis:
    """Give an axis its kilometres by the feet of its posts, in whichever direction they increase."""
    s, km = _distinct(s, km)
    if len(s) < 2:
        raise RailExtractError(
            f"The axis {axis.name} has one post, which does not show where kilometres increase: give a second one."
        )
    backwards = bool(np.sum(np.sign(np.diff(km))) < 0)
    length_m = axis.line.length_m
    if backwards:
        s, km = length_m - s[::-1], km[::-1]
    xy = axis.xy[::-1] if backwards else axis.xy
    return Axis(axis.name, xy, stationing_of(length_m, s.tolist(), km.tolist(), jumps))


def _distinct(s: np.ndarray, km: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort posts along the axis; those of one kilometre next to each other are one, in their middle."""
    order = np.lexsort((s, km))
    s, km = s[order], km[order]
    new = np.append(True, (np.diff(km) != 0) | (np.diff(s) > ONE_POST_M))
    group = np.cumsum(new) - 1
    s, km = np.bincount(group, s) / np.bincount(group), km[new]
    order = np.argsort(s, kind="stable")
    return s[order], km[order]
