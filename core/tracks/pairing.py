"""Which stretch of which rail makes a track with which: the paper's matching on offset curves."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import interpolate, left_normals, length_along, project
from ..progress import SILENT, Progress
from ..rails import RailLine
from .dtw import match_polylines
from .parallels import REACH_M, Parallels, find_parallels

MIN_LENGTH_M = 3.0
"""Shorter stretches at gauge are chance meetings in a switch."""

OVERLAP_M = 0.5
"""Two matches may both claim this much of a rail's side: where a match ends is no sharper than that."""

CHUNK_M = 1000.0
"""Longest stretch matched in one go: bounds the memory."""

MARGIN_M = 1.0
"""Length added to a stretch found at stations, so that the exact matching finds its ends."""

COARSE_M = 0.5
"""Spacing of the matched stations; on a tram's curve of 25 m their chords deviate by 1 mm."""

FINE_M = 0.025
"""Their spacing where rails come within the tolerance or leave it: where a match ends is known to this."""

SPLIT_M = 5.0
"""Stations abreast that lie further apart than this begin a new stretch: gaps in a rail are at most about as long."""

SAME_LEVEL_M = 0.4
"""Rails of a track differ in height by cant alone, 0.2 m at most; those of a bridge and those below it by metres."""

LEFT, RIGHT = 1, -1


@dataclass(frozen=True)
class RailPair:
    """A stretch of track: two rails at gauge, seen in a direction in which `left` lies on the left.

    Attributes
    ----------
    left, right : int
        Numbers of the rails in the sequence that was paired.
    left_span, right_span : tuple of float
        Plan chainage along each rail, in its own direction, at the start and at the end of the stretch; the second is
        the smaller where the rail runs against the stretch.
    """

    left: int
    right: int
    left_span: tuple[float, float]
    right_span: tuple[float, float]

    @property
    def length_m(self) -> float:
        """Mean plan length of both sides."""
        return 0.5 * (abs(np.subtract(*self.left_span)) + abs(np.subtract(*self.right_span)))

    def reversed(self) -> RailPair:
        """Look at the same stretch from its other end."""
        return RailPair(self.right, self.left, self.right_span[::-1], self.left_span[::-1])


def pair_rails(
    rails: Sequence[RailLine],
    gauge_m: float,
    head_width_m: float,
    tolerance_m: float = 0.05,
    other_gauges_m: Sequence[float] = (),
    progress: Progress = SILENT,
) -> tuple[RailPair, ...]:
    """Find the stretches along which two rails of one class lie a gauge apart (docs/method.md section 8.3).

    Each rail is moved half the spacing towards the other, and the moved curves are matched. Every rail has two sides;
    a stretch of a side serves one track, that of the longest match.

    Parameters
    ----------
    rails : sequence of RailLine
    gauge_m, head_width_m : float
        Their sum is the distance between the rail lines.
    tolerance_m : float
        Largest deviation from that distance.
    other_gauges_m : sequence of float
        Gauges that rails are paired by as well: a match that is nearer to one of them belongs to that.
    progress : Progress

    Returns
    -------
    tuple of RailPair
        The longest first. A stretch longer than CHUNK_M comes in pieces.
    """
    if len(rails) < 2:
        return ()
    spacing = gauge_m + head_width_m
    reach_m = max(REACH_M, spacing + 2 * tolerance_m)
    parallels = find_parallels(rails, reach_m, progress.span(0.0, 0.3))
    # Chords of stations and rails not quite abreast hide a little of the true distance, hence the doubled tolerance.
    at_gauge = parallels[np.abs(np.abs(parallels.left_m) - spacing) < 2 * tolerance_m]
    candidates = [stretch for group in at_gauge.groups() for stretch in _stretches(group)]
    others_m = [gauge + head_width_m for gauge in other_gauges_m]
    matches = []
    for stretch in progress.span(0.3, 1.0).follow(candidates):
        found = _match(rails, stretch, spacing, tolerance_m)
        matches.extend(match for match in found if _is_nearest(match, stretch, spacing, others_m))
    return tuple(match.pair() for match in _without_ghosts(_select(matches)))


@dataclass(frozen=True)
class _Match:
    """Chainages of rails a and b at the nodes of one match, in the direction of a; side as in `LEFT`, `RIGHT`."""

    a: int
    b: int
    t_a: np.ndarray
    t_b: np.ndarray
    side_a: int
    side_b: int
    mean_penalty: float

    @property
    def length_m(self) -> float:
        return min(abs(self.t_a[-1] - self.t_a[0]), abs(self.t_b[-1] - self.t_b[0]))

    def __getitem__(self, which: slice) -> _Match:
        t_a, t_b = self.t_a[which], self.t_b[which]
        return _Match(self.a, self.b, t_a, t_b, self.side_a, self.side_b, self.mean_penalty)

    def pair(self) -> RailPair:
        span_a, span_b = ((float(t[0]), float(t[-1])) for t in (self.t_a, self.t_b))
        if self.side_a == LEFT:  # the partner lies on the left of a
            return RailPair(self.b, self.a, span_b, span_a)
        return RailPair(self.a, self.b, span_a, span_b)


def _stretches(group: Parallels) -> Iterator[Parallels]:
    """Cut the stations of two rails, sorted by t_a, where they leave a gap, and into chunks."""
    gap = np.diff(group.t_a) > SPLIT_M
    run = np.concatenate([[0], np.cumsum(gap)])
    starts = group.t_a[np.concatenate([[True], gap])][run]
    piece = ((group.t_a - starts) / CHUNK_M).astype(int)
    borders = np.flatnonzero((np.diff(run) != 0) | (np.diff(piece) != 0)) + 1
    for mine in np.split(np.arange(len(run)), borders):
        yield group[mine]


def _match(rails: Sequence[RailLine], stretch: Parallels, spacing: float, tolerance_m: float) -> Iterator[_Match]:
    """Match the offset curves of two rails along one stretch."""
    a, b, same = int(stretch.a[0]), int(stretch.b[0]), bool(stretch.same[0])
    side_a = LEFT if stretch.left_m[0] > 0 else RIGHT
    side_b = -side_a if same else side_a
    curve_a = _OffsetCurve.along(rails[a].xyz[:, :2], stretch.t_a, side_a * spacing / 2)
    curve_b = _OffsetCurve.along(rails[b].xyz[:, :2], stretch.t_b, side_b * spacing / 2)
    if not same:
        curve_b = curve_b.reversed()
    for s_a, s_b in _abreast(curve_a, curve_b, tolerance_m):
        for found in match_polylines(curve_a.at(s_a), curve_b.at(s_b), tolerance_m):
            t_a, t_b = curve_a.t_at(s_a[found.first]), curve_b.t_at(s_b[found.second])
            match = _Match(a, b, t_a, t_b, side_a, side_b, found.penalty / found.length)
            if match.length_m >= MIN_LENGTH_M and _on_one_level(rails[a].xyz, t_a, rails[b].xyz, t_b):
                yield match


def _is_nearest(match: _Match, stretch: Parallels, spacing: float, others_m: Sequence[float]) -> bool:
    """Tell whether the rails of a match, found along a stretch, lie no nearer to another spacing."""
    first, last = np.sort(match.t_a[[0, -1]])
    inside = (stretch.t_a >= first) & (stretch.t_a <= last)
    apart_m = np.abs(stretch.left_m[inside]).mean()
    return all(abs(apart_m - spacing) <= abs(apart_m - other) for other in others_m)


def _on_one_level(a: np.ndarray, t_a: np.ndarray, b: np.ndarray, t_b: np.ndarray) -> bool:
    """Tell whether two rails, (n, 3) and (m, 3), lie on one level abreast of each other; unknown heights do."""
    z_a, z_b = (np.interp(t, length_along(line[:, :2]), line[:, 2]) for line, t in ((a, t_a), (b, t_b)))
    apart = np.abs(z_a - z_b)[np.isfinite(z_a - z_b)]
    return not len(apart) or bool(np.median(apart) <= SAME_LEVEL_M)


@dataclass(frozen=True)
class _OffsetCurve:
    """A stretch of a rail moved to its left: vertices, (m, 2), chainage along itself and along the rail, (m,) each."""

    xy: np.ndarray
    s: np.ndarray
    t: np.ndarray

    @classmethod
    def along(cls, rail: np.ndarray, t: np.ndarray, left_m: float) -> _OffsetCurve:
        """Move the stretch around the chainages `t` of a rail, (n, 2)."""
        along = length_along(rail)
        start, end = max(t.min() - MARGIN_M, 0.0), min(t.max() + MARGIN_M, along[-1])
        stations = np.linspace(start, end, int(np.ceil((end - start) / COARSE_M)) + 1)
        curve = interpolate(rail, along, stations)
        curve = curve + left_m * left_normals(curve)
        return cls(curve, length_along(curve), stations)

    def reversed(self) -> _OffsetCurve:
        """Run along the same curve the other way."""
        return _OffsetCurve(self.xy[::-1], self.s[-1] - self.s[::-1], self.t[::-1])

    def at(self, s: np.ndarray) -> np.ndarray:
        """Places at chainages along the curve, (n, 2)."""
        return interpolate(self.xy, self.s, s)

    def t_at(self, s: np.ndarray) -> np.ndarray:
        """Chainages along the rail at chainages along the curve, (n,)."""
        return np.interp(s, self.s, self.t)


def _abreast(a: _OffsetCurve, b: _OffsetCurve, tolerance_m: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Place stations abreast of each other along stretches of two curves within the tolerance; chainages along both.

    Vertices that lie abreast leave no segment without a neighbour, however long it is, and thus need not lie denser
    than the shape of the curves asks for. Only where a stretch may end they do.
    """
    near = np.zeros(len(a.s), dtype=bool)
    near[project([b.xy], a.xy, tolerance_m).point] = True
    changes = np.flatnonzero(np.diff(near))
    share = np.arange(FINE_M / COARSE_M, 1.0, FINE_M / COARSE_M)
    s = np.sort(np.append(a.s, a.s[changes, None] + share * np.diff(a.s)[changes, None]))
    feet = project([b.xy], a.at(s), tolerance_m)
    order = np.argsort(feet.point)
    point, t = feet.point[order], feet.t[order]
    # A closed rail that begins elsewhere than its partner begins anew within the stretch.
    apart = (np.diff(point) > 1) | (np.abs(np.diff(t)) > SPLIT_M)
    for run in np.split(np.arange(len(point)), np.flatnonzero(apart) + 1):
        if len(run) > 1:
            yield s[point[run]], t[run]


def _select(matches: Sequence[_Match]) -> list[_Match]:
    """Give every stretch of a rail's side to the longest match that claims it."""
    used = _Sides()
    selected = []
    for match in sorted(matches, key=lambda match: (-match.length_m, match.mean_penalty)):
        for part in _free_runs(match, used.on_a(match) | used.on_b(match)):
            used.add(part)
            selected.append(part)
    return selected


def _without_ghosts(matches: Sequence[_Match]) -> list[_Match]:
    """Drop what lies between two tracks whose inner rails happen to be at gauge too, as of trams 3 m apart.

    A rail that has a single partner belongs to its track for sure. Where a match takes a rail away from such a track,
    and the other one has a partner on its far side as well, nothing but chance speaks for it; one after the other, so
    that of many tracks in a row every second match stays.
    """
    while True:
        partners = _Sides(matches)
        doubtful = [partners.beyond_a(match) & partners.beyond_b(match) for match in matches]
        sure = _Sides(part for match, out in zip(matches, doubtful) for part in _free_runs(match, out))
        ghosts = [out & (sure.beyond_a(match) | sure.beyond_b(match)) for match, out in zip(matches, doubtful)]
        if not any(ghost.any() for ghost in ghosts):
            return list(matches)
        matches = [part for match, ghost in zip(matches, ghosts) for part in _free_runs(match, ghost)]


class _Sides:
    """Which stretches of the sides of rails have partners."""

    def __init__(self, matches: Iterable[_Match] = ()) -> None:
        self._used: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
        for match in matches:
            self.add(match)

    def add(self, match: _Match) -> None:
        """Take note of a match."""
        self._used[match.a, match.side_a].append(tuple(np.sort(match.t_a[[0, -1]])))
        self._used[match.b, match.side_b].append(tuple(np.sort(match.t_b[[0, -1]])))

    def on_a(self, match: _Match) -> np.ndarray:
        """Tell at which nodes of a match its first rail has a partner on this side, (n,) bool."""
        return _inside(match.t_a, self._used[match.a, match.side_a])

    def on_b(self, match: _Match) -> np.ndarray:
        """Tell the same of its second rail."""
        return _inside(match.t_b, self._used[match.b, match.side_b])

    def beyond_a(self, match: _Match) -> np.ndarray:
        """Tell at which nodes its first rail has a partner on the other side, (n,) bool."""
        return _inside(match.t_a, self._used[match.a, -match.side_a])

    def beyond_b(self, match: _Match) -> np.ndarray:
        """Tell the same of its second rail."""
        return _inside(match.t_b, self._used[match.b, -match.side_b])


def _inside(t: np.ndarray, intervals: Sequence[tuple[float, float]]) -> np.ndarray:
    """Tell which chainages lie within the intervals by more than the tolerated overlap, (n,) bool."""
    inside = np.zeros(len(t), dtype=bool)
    for start, end in intervals:
        inside |= (t > start + OVERLAP_M) & (t < end - OVERLAP_M)
    return inside


def _free_runs(match: _Match, taken: np.ndarray) -> Iterator[_Match]:
    """Split a match into the parts between taken nodes that are long enough."""
    borders = np.flatnonzero(np.diff(taken)) + 1
    for run in np.split(np.arange(len(taken)), borders):
        part = match[run[0] : run[-1] + 1]
        if not taken[run[0]] and part.length_m >= MIN_LENGTH_M:
            yield part
