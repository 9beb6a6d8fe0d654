"""Kilometre lines from lines with M values, with a first kilometre or with posts, and the places beside them.

A place has a foot, an offset and a side, and the kilometre there. See docs/stationing.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..design_numbers import KM, LENGTH, NUMBER, checked, number_in, quoted
from ..design_places import are_places, check_places
from ..errors import RailExtractError
from ..frame import LocalFrame
from ..polyline import Chords, Polyline, cross
from ..progress import SILENT, Progress
from ..rails import Kilometres, TrackGeometry
from .stationing import Jump, Stationing, stationing_of
from .text import read_km, write_km

POST_OFFSET_M = 50.0
"""Posts further than this from the axis are left out, metres: they belong to another line."""

ONE_POST_M = 10.0
"""Posts of the same kilometre this close along the axis are one post, metres: there may be one on either side."""

JOINED_M = 0.05
"""Largest distance between the end of a line and the start of the next one of the same axis, metres."""

UNIT_OFF = 0.2
"""Largest share by which M values may differ from metres or kilometres along the line."""

PIECE_M = 10.0
"""Longest part of a segment of the axis among which the nearest is sought, metres."""

CANDIDATES = 8
"""Parts with the nearest middles, of which one has the foot: of parts of 10 m, middles are at most 5 m off it."""

SAMPLE_M = 5.0
"""Spacing of the places at which a second foot is sought, metres; chords of this length are within 6 mm of R 500 m."""

APART_M, CLEARLY = 50.0, 1.2
"""A second foot makes a place ambiguous if it is at least this far along the axis from the first, metres, and less than
this many times as far from the place: the inside of a curve, or a place between two lines."""

BEYOND_M = 1.0
"""Places up to this far beyond an end of the axis have the kilometre of its end, metres; others have none."""

ON_AXIS_M = 0.0005
"""Places closer to the axis are on neither side of it: less than the last decimal of the offset, metres."""

PLACES_AT_ONCE = 5_000
"""Places whose feet are computed at once: between two checks for cancellation."""


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


@dataclass(frozen=True)
class AxisFeet:
    """Feet of places on an axis; (n,) arrays, metres.

    `s` is the plan distance of the foot from the first vertex, `left_m` that of the place from its foot, positive to
    the left, and `beyond_m` how far the place lies beyond the nearer end, 0 between the ends.
    """

    s: np.ndarray
    left_m: np.ndarray
    beyond_m: np.ndarray

    @property
    def distance_m(self) -> np.ndarray:
        """Distance of the place from the axis, (n,)."""
        return np.hypot(self.left_m, self.beyond_m)


@dataclass(frozen=True)
class KilometreLine:
    """A line, `xy` (n, 2) metres, that carries the kilometres of a railway, directed with them.

    No two successive vertices are equal.
    """

    name: str
    xy: np.ndarray
    stationing: Stationing

    @cached_property
    def line(self) -> Polyline:
        """Chainages, and normals at the vertices."""
        return Polyline(self.xy)

    @cached_property
    def _parts(self) -> tuple[Chords, np.ndarray]:
        """Parts of segments, and the segment of each."""
        counts = np.ceil(np.diff(self.line.t) / PIECE_M).astype(int)
        segment = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[segment]
        xy = np.concatenate([self._place(segment, share), self.xy[-1:]])
        return Chords.joined([Polyline(xy)]), segment

    @cached_property
    def _samples(self) -> tuple[cKDTree, np.ndarray]:
        """Places at equal distances, and their `s`."""
        samples = self.line.resampled(SAMPLE_M)
        return cKDTree(samples.xy), samples.t

    def feet(self, xy: np.ndarray) -> AxisFeet:
        """Find the feet of places, (k, 2) metres.

        The foot is on the normal through the place. Normals turn evenly from the bisector at one vertex to that at the
        next, so that feet move steadily along the axis on both sides of a bend. Where normals cross on the inside of a
        bend, the foot is that of the plain perpendicular.
        """
        parts, of_part = self._parts
        segment, last = of_part[parts.nearest(xy, CANDIDATES)[1]], len(self.xy) - 2
        plain, length = self._perpendicular(segment, xy)
        past = np.maximum(np.where(segment == 0, -plain, 0.0), np.where(segment == last, plain - 1, 0.0))
        beyond = length * np.maximum(past, 0.0)
        around = np.clip(segment + np.array([[-1], [0], [1]]), 0, last)
        shares = np.stack([self._fan(one, xy) for one in around])
        away = np.stack([self._away(one, share, xy) for one, share in zip(around, shares)])
        away[~((shares >= 0) & (shares <= 1))] = np.inf
        best, places = np.argmin(away, axis=0), np.arange(len(xy))
        on_fan = np.isfinite(away[best, places]) & (beyond <= 0)
        segment = np.where(on_fan, around[best, places], segment)
        share = np.where(on_fan, shares[best, places], np.clip(plain, 0.0, 1.0))
        side = np.sign(cross(self._steps[segment], xy - self._place(segment, share)))
        across = np.sqrt(np.maximum(self._away(segment, share, xy) ** 2 - beyond**2, 0.0))
        return AxisFeet(self.line.t[segment] + share * np.diff(self.line.t)[segment], side * across, beyond)

    @cached_property
    def _steps(self) -> np.ndarray:
        """Vectors of the segments, (n - 1, 2)."""
        return np.diff(self.xy, axis=0)

    def _perpendicular(self, segment: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the share of segments at which the perpendicular meets places, (k,), and the segments' lengths."""
        step = self._steps[segment]
        length = np.hypot(*step.T)
        return np.einsum("ij,ij->i", xy - self.xy[segment], step) / length**2, length

    def _fan(self, segment: np.ndarray, xy: np.ndarray) -> np.ndarray:
        """Return the share of segments at which the normal passes through places, (k,); NaN where none does.

        The place P is on the normal at the share u if (P - A - u d) x (a + u e) = 0, with the segment's start A and
        vector d, its normal a at the start, and the change e of the normal: a quadratic equation, of which the root
        that stays where e vanishes is the foot.
        """
        away, step = xy - self.xy[segment], self._steps[segment]
        normal = self.line.normals[segment]
        turn = self.line.normals[segment + 1] - normal
        constant, square = cross(away, normal), -cross(step, turn)
        linear = cross(away, turn) - cross(step, normal)
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(linear**2 - 4 * square * constant)
            return -2 * constant / (linear + np.sign(linear) * root)

    def _place(self, segment: np.ndarray, share: np.ndarray) -> np.ndarray:
        return self.xy[segment] + share[:, None] * self._steps[segment]

    def _away(self, segment: np.ndarray, share: np.ndarray, xy: np.ndarray) -> np.ndarray:
        return np.linalg.norm(xy - self._place(segment, share), axis=1)

    @cached_property
    def _box(self) -> np.ndarray:
        """Smallest and largest coordinates, (2, 2)."""
        return np.array([self.xy.min(axis=0), self.xy.max(axis=0)])

    def farther_than(self, xy: np.ndarray) -> np.ndarray:
        """Return the distance of places, (k, 2), from the bounding box, (k,): the axis is not closer."""
        return np.hypot(*np.maximum(np.maximum(self._box[0] - xy, xy - self._box[1]), 0.0).T)

    def ambiguous(self, xy: np.ndarray, s: np.ndarray, distance_m: np.ndarray) -> np.ndarray:
        """Return whether places, (k, 2), have a second foot that may as well be meant as those at `s`, (k,) bool."""
        tree, _ = self._samples
        reach = CLEARLY * distance_m
        near = tree.query_ball_point(xy, np.hypot(reach, SAMPLE_M / 2), return_sorted=True)
        places = zip(xy, s, reach, near)
        return np.array([self._has_second(place, foot, at, np.array(ids)) for place, foot, at, ids in places], bool)

    def _has_second(self, place: np.ndarray, foot: float, reach_m: float, ids: np.ndarray) -> bool:
        """Return whether a place has another foot within reach among samples, ascending."""
        tree, s = self._samples
        if not len(ids) or (np.abs(s[ids] - foot) < APART_M).all():
            return False
        distance = np.linalg.norm(tree.data[ids] - place, axis=1)
        follows = np.diff(ids) == 1
        before = np.where(np.append(False, follows), np.append(np.inf, distance[:-1]), np.inf)
        after = np.where(np.append(follows, False), np.append(distance[1:], np.inf), np.inf)
        feet = ids[(distance <= before) & (distance <= after) & (np.abs(s[ids] - foot) >= APART_M)]
        around = (Chords.joined([Polyline(tree.data[max(at - 1, 0) : at + 2])]) for at in feet)
        return any(np.linalg.norm(chords.nearest(place[None])[0] - place) < reach_m for chords in around)


def locate(axes: Sequence[KilometreLine], xy: np.ndarray, notation: str, progress: Progress = SILENT) -> Kilometres:
    """Find kilometre, offset and side of places, (n, 2) metres, along the nearest of several axes.

    Those further than `BEYOND_M` beyond the ends of all axes have none. The notation is one of `text.NOTATIONS`.
    """
    parts = range(0, len(xy), PLACES_AT_ONCE)
    found = [_locate(axes, xy[start : start + PLACES_AT_ONCE], progress) for start in progress.follow(parts)]
    if not found:
        return Kilometres.empty(0)
    axis, s, left_m, ambiguous = (np.concatenate(column) for column in zip(*found))
    made = Kilometres.empty(len(xy))
    for number, mine in _groups(axis):
        one = axes[number]
        piece, km = one.stationing.at(s[mine])
        counts_from = one.stationing.counts_from()[piece]
        made.axis[mine], made.piece[mine], made.km[mine] = one.name, piece + 1, km
        made.km_text[mine] = [write_km(value, notation, again) for value, again in zip(np.round(km, 6), counts_from)]
        made.offset_m[mine], made.ambiguous[mine] = left_m[mine], ambiguous[mine]
        made.side[mine] = np.select([left_m[mine] > ON_AXIS_M, left_m[mine] < -ON_AXIS_M], ["left", "right"], "on")
    return made


def _locate(axes: Sequence[KilometreLine], xy: np.ndarray, progress: Progress) -> tuple[np.ndarray, ...]:
    """Return the number of the nearest axis (-1 without one), `s`, the offset and whether they are ambiguous."""
    near = nearest(axes, xy, BEYOND_M, progress)
    ambiguous = near.second_m < CLEARLY * near.distance_m
    for number, mine in _groups(np.where(ambiguous, -1, near.axis)):
        progress.check()
        ambiguous[mine] = axes[number].ambiguous(xy[mine], near.s[mine], near.distance_m[mine])
    return near.axis, near.s, near.left_m, ambiguous


def _groups(axis: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the number of each axis that places have, and the numbers of these places; -1 is none."""
    order = np.argsort(axis, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(axis[order])) + 1):
        if len(mine) and axis[mine[0]] >= 0:
            yield int(axis[mine[0]]), mine


@dataclass(frozen=True)
class Nearest:
    """The nearest axis of places, -1 without one, and their feet on it as in `AxisFeet`; (n,) arrays.

    `second_m` is the distance of the axis that is the nearest but one; infinity without one, or where it is clearly
    farther away.
    """

    axis: np.ndarray
    s: np.ndarray
    left_m: np.ndarray
    distance_m: np.ndarray
    second_m: np.ndarray

    def put(self, number: int, mine: np.ndarray, feet: AxisFeet, beyond_m: float) -> None:
        """Take note of the feet of some places on an axis."""
        distance_m, known_m = np.where(feet.beyond_m <= beyond_m, feet.distance_m, np.inf), self.distance_m[mine]
        closer = distance_m < known_m
        self.second_m[mine] = np.where(closer, known_m, np.minimum(self.second_m[mine], distance_m))
        own = mine[closer]
        self.axis[own] = number
        self.s[own], self.left_m[own], self.distance_m[own] = feet.s[closer], feet.left_m[closer], distance_m[closer]


def nearest(axes: Sequence[KilometreLine], xy: np.ndarray, beyond_m: float, progress: Progress = SILENT) -> Nearest:
    """Find the nearest axis of places, (n, 2) metres, of those beyond whose ends they are by less than `beyond_m`.

    Of many axes, only those are looked at whose bounding box is not clearly farther away than an axis.
    """
    infinite = np.full(len(xy), np.inf)
    found = Nearest(np.full(len(xy), -1), np.zeros(len(xy)), np.zeros(len(xy)), infinite, infinite.copy())
    first, closest_m = np.zeros(len(xy), dtype=int), infinite.copy()
    for number, axis in enumerate(axes):
        bound_m = axis.farther_than(xy)
        first[bound_m < closest_m] = number
        closest_m = np.minimum(closest_m, bound_m)
    for number, mine in _groups(first):
        progress.check()
        found.put(number, mine, axes[number].feet(xy[mine]), beyond_m)
    for number, axis in enumerate(axes):
        progress.check()
        mine = np.flatnonzero((first != number) & (axis.farther_than(xy) <= CLEARLY * found.distance_m))
        if len(mine):
            found.put(number, mine, axis.feet(xy[mine]), beyond_m)
    return found
