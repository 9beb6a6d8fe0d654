"""Kilometre lines from lines with M values, with a first kilometre or with posts, and places located along them.

See docs/stationing.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..design_numbers import KM, LENGTH, NUMBER, checked, number_in, quoted
from ..design_places import are_places, check_places
from ..errors import RailExtractError
from ..frame import LocalFrame
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..rails import Kilometres, TrackGeometry
from .line import KilometreLine, locate, nearest
from .stationing import Jump, Stationing, stationing_of
from .text import read_km

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
    """A line as it is stored: name of its axis, `xy`, (n, 2) metres, and M values, (n,), NaN where there is none."""

    name: str
    xy: np.ndarray
    m: np.ndarray


@dataclass(frozen=True)
class Post:
    """A post beside an axis: its place, (2,) metres, and its kilometre."""

    xy: np.ndarray
    km: float


@dataclass(frozen=True)
class AxisStart:
    """The kilometre at the first vertex of a line, and whether kilometres decrease along it."""

    km: float
    decreasing: bool = False


@dataclass(frozen=True)
class Axes:
    """Axes in one plane, and what the user is told of them."""

    axes: tuple[KilometreLine, ...]
    notices: tuple[str, ...]


def make_axes(
    lines: Sequence[AxisLine], start: AxisStart | None = None, posts: Sequence[Post] = (), jumps: Sequence[Jump] = ()
) -> Axes:
    """Give lines their kilometres by posts, else by a first kilometre, else by their M values.

    Lines of one name that follow each other are joined. `jumps` are those that are stated; M values contain theirs.
    Raises RailExtractError if nothing states kilometres, or what does contradicts itself or is on no railway.
    """
    lines = [replace(line, name=" ".join(line.name.split())) for line in lines]  # for messages, which have one line
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
        return _told([KilometreLine(line.name, turned.xy, numbered)])
    if jumps:
        raise RailExtractError("JUMPS need START_KM or POSTS: M values of AXIS contain their jumps.")
    return _told([_by_measures(line) for line in joined])


def _check(lines: Sequence[AxisLine], start: AxisStart | None, posts: Sequence[Post]) -> None:
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


def _told(axes: Sequence[KilometreLine], more: Sequence[str] = ()) -> Axes:
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


def _by_measures(line: AxisLine) -> KilometreLine:
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
    stationing = stationing_of(length_m, s.tolist(), (unit_km * m).tolist())
    return KilometreLine(line.name, _directed(line, backwards).xy, stationing)


def _by_posts(lines: Sequence[AxisLine], posts: Sequence[Post], jumps: Sequence[Jump]) -> Axes:
    """Give lines their kilometres by the posts that are nearest to each."""
    km, xy = np.array([post.km for post in posts]), np.array([post.xy for post in posts])
    plain = [KilometreLine(line.name, _directed(line, False).xy, Stationing(*np.zeros((3, 1)))) for line in lines]
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


def _numbered(axis: KilometreLine, s: np.ndarray, km: np.ndarray, jumps: Sequence[Jump]) -> KilometreLine:
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
    return KilometreLine(axis.name, xy, stationing_of(length_m, s.tolist(), km.tolist(), jumps))


def _distinct(s: np.ndarray, km: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort posts along the axis; those of one kilometre next to each other are one, in their middle."""
    order = np.lexsort((s, km))
    s, km = s[order], km[order]
    new = np.append(True, (np.diff(km) != 0) | (np.diff(s) > ONE_POST_M))
    group = np.cumsum(new) - 1
    s, km = np.bincount(group, s) / np.bincount(group), km[new]
    order = np.argsort(s, kind="stable")
    return s[order], km[order]


NAME_FIELDS = ("axis", "name", "ref")
"""Fields of an axis layer that name an axis, the first one that exists."""

KM_FIELDS = ("km", "kilometre", "kilometer", "km_text", "station")
"""Fields of a post layer with the kilometre, the first one that exists, if none is chosen."""

BACK, AHEAD = "km_back", "km_ahead"
"""Fields of the table of jumps."""


@dataclass(frozen=True)
class PlacedAxes:
    """Axes in the plane of a coordinate system, in metres from its zero; `notation` is one of `text.NOTATIONS`.

    `unit_m` is the length of the unit of its coordinates.
    """

    axes: Axes
    unit_m: float
    notation: str

    def locate(self, xy: np.ndarray, progress: Progress = SILENT) -> Kilometres:
        """Find the kilometres of places, (n, 2) in coordinates of the system, and say what is in doubt."""
        for notice in self.axes.notices:
            progress.warning(notice)
        found = self.kilometres(xy, progress)
        beyond, ambiguous = int(np.isnan(found.km).sum()), sum(map(bool, found.ambiguous))
        if beyond:
            progress.warning(f"{beyond} of {len(xy)} places are beyond the ends of AXIS: their kilometres are empty.")
        if ambiguous:
            progress.warning(
                f"{ambiguous} of {len(xy)} places are nearly as close to another place of AXIS: check the kilometres "
                "of those whose field ambiguous is 1."
            )
        return found

    def on_map(self, xy: np.ndarray, ids: Sequence[int], progress: Progress) -> np.ndarray:
        """Return which places are on the map, (n,) bool, and warn of others; a feature without a place has NaN."""
        known = are_places(xy, self.unit_m)
        lost = np.flatnonzero(~known & ~np.isnan(xy).any(axis=1))
        if len(lost):
            progress.warning(
                f"{len(lost)} of {len(xy)} features have coordinates outside of any map, such as feature "
                f"{ids[lost[0]]}: their kilometres are empty. Repair or delete them."
            )
        return known

    def along(
        self, tracks: Sequence[TrackGeometry], frame: LocalFrame, progress: Progress = SILENT
    ) -> tuple[TrackGeometry, ...]:
        """Return measured tracks with the kilometres of their stations, and say what is in doubt."""
        places = [frame.to_crs(track.xyz)[:, :2] for track in tracks]
        found = self.locate(np.concatenate([np.empty((0, 2)), *places]), progress)
        ends = np.cumsum([len(one) for one in places], dtype=int)
        own = (found.part(end - len(one), end) for one, end in zip(places, ends))
        return tuple(replace(track, kilometres=kilometres) for track, kilometres in zip(tracks, own))

    def kilometres(self, xy: np.ndarray, progress: Progress = SILENT) -> Kilometres:
        """Find the same, without a word."""
        return locate(self.axes.axes, xy * self.unit_m, self.notation, progress)


def first_post_field(names: Collection[str]) -> str:
    """Return the field of a post layer with the kilometre; raise RailExtractError if it has none of the usual ones."""
    found = next((one for one in KM_FIELDS if one in names), "")
    if not found:
        raise RailExtractError(
            f"POSTS has no field {', '.join(KM_FIELDS)}: choose the field with the kilometre in POST_FIELD."
        )
    return found


AXIS_IN_DEGREES = (
    "AXIS and INPUT are in degrees, where lengths can't be measured: reproject AXIS, for example to the UTM zone of "
    "the place."
)
"""Message where no plane is known."""


def check_jumps(names: Collection[str]) -> None:
    """Check that a table of jumps has its fields; raise a `RailExtractError` if one is missing."""
    for name in (BACK, AHEAD):
        if name not in names:
            raise RailExtractError(
                f"JUMPS has no field {name}: give a table with {BACK}, the kilometre before each jump, and {AHEAD}, "
                "the one behind it."
            )


def km_of(value: object, field: str, name: str, feature: int) -> float:
    """Return the kilometre in a field of a layer's feature, a number or a text such as 12.3+45."""
    km = read_km(value) if isinstance(value, str) else number_in(value)
    if km is not None and KM.holds(km):
        return km
    what = "is empty" if value is None else f"is {quoted(value)} and no kilometre"
    raise RailExtractError(
        f"{name} has a row (feature {feature}) whose field {field} {what}: correct it, or delete the row."
    )
