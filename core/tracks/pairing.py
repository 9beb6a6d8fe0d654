"""Pairing of rails into sections of track: the matching of Gribov and Chang, applied to offset curves.

Two polylines are matched by dynamic time warping (their section 9): a vertex of one paired with a segment of the other
is an edge of the lattice of vertex pairs (i, j); a match is a path along edges, each step advancing on one of the
polylines. See docs/method.md sections 8.2 to 8.4.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..errors import NoTrackError
from ..parameters import Parameters
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..rails import RailLine
from ..standards import closest_standard
from .parallels import MAX_SPACING_M, SAMPLE_STEP_M, Parallels, find_parallels, most_common_spacing

MIN_SECTION_M = 3.0
"""Shorter sections at gauge occur by chance in a switch."""

MAX_OVERLAP_M = 0.5
"""Length of a rail's side that two matches may both claim: the end of a match is not known more exactly."""

CHUNK_M = 1000.0
"""Longest section matched at once: limits the memory."""

MARGIN_M = 1.0
"""Length added to a section found at stations, so that the exact matching finds its ends."""

FINE_STEP_M = 0.025
"""Spacing of the stations where rails enter or leave the tolerance: the resolution of the ends of a match."""

MIN_BREAK_M = 5.0
"""Distance between stations along a rail from which a new section begins: about the length of the longest gap."""

MAX_LEVEL_M = 0.4
"""Maximum height difference of the rails of a track: cant makes at most 0.2 m, a bridge several metres."""

WANDER_STATIONS = 11
"""Stations, 5 m of them, over which the distance of two rails is compared with a steady change: gauge widening and cant
transitions are steady over this length."""

WANDER_WEIGHT = 3.0
"""Weight of the wander of a partner, in distance and in height, relative to its deviation from the gauge. Rails wander
by 1 mm and are up to 30 mm off where the gauge is widened; lids of a cable trough wander by 5 mm in both."""

CLEARLY_WORSE = 1.5
CLEARLY_WORSE_M = 0.01
"""A partner is worse than one on the other side of its rail if its misfit is larger by this factor and by this length:
two tracks that share a rail are alike to within what is measured."""

MAX_LOST_SHARE = 0.5
"""Share of a match that may be lost to better partners on the other side of its rails; see `_without_rivals`."""

LEFT, RIGHT = 1, -1
"""Sides of a rail."""

ADVANCE_SECOND, ADVANCE_FIRST = 0, 1
"""Kinds of edges: a vertex of the first with a segment of the second, (i, j) to (i, j + 1), and vice versa."""

TIE = 1e-9
"""Lengths that differ by less, relative to their size (or to 1), are sums of the same segments."""


@dataclass(frozen=True)
class RailPair:
    """A section of track: two rails at gauge, by number, in the direction in which `left` is on the left.

    The spans are the plan chainages along each rail at the start and at the end of the section; the second is the
    smaller one if the rail runs against the direction of the section.
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
        """Return the same section in the opposite direction."""
        return RailPair(self.right, self.left, self.right_span[::-1], self.left_span[::-1])


def pair_rails(
    rails: Sequence[RailLine],
    parameters: Parameters,
    other_spacings_m: Sequence[float] = (),
    progress: Progress = SILENT,
) -> tuple[RailPair, ...]:
    """Find the sections along which two rails of one class are at gauge (docs/method.md section 8.3), longest first.

    Each rail is moved half the spacing, gauge plus width of the heads, towards the other, and the moved curves are
    matched. Every rail has two sides, and each section of a side belongs to one track, that of the longest match. A
    match that is closer to one of `other_spacings_m`, the distances of the rails of other gauges, is left to it. A
    section longer than CHUNK_M is returned in parts.
    """
    if len(rails) < 2:
        return ()
    spacing, tolerance_m = parameters.gauge_m + parameters.head_width_m, parameters.centerline_tolerance_m
    parallels = find_parallels(rails, max(MAX_SPACING_M, spacing + 2 * tolerance_m), progress.span(0.0, 0.3))
    matches: list[_Match] = []
    # Chords between stations, and stations that are not exactly abreast, distort the distance a little.
    near = parallels[np.abs(np.abs(parallels.left_m) - spacing) < 2 * tolerance_m]
    sections = [section for group in near.groups() for section in _sections(group)]
    for section in progress.span(0.3, 1.0).follow(sections):
        found = _match(rails, section, spacing, tolerance_m)
        matches.extend(match for match in found if _is_nearest(match, section, spacing, other_spacings_m))
    # What wanders goes first: it would make the track next to it look like a ghost.
    selected = _select(matches)
    steady = _without_rivals(selected, [_misfit_m(rails, match, spacing)[1] for match in selected])
    sure = _without_ghosts(steady)
    return tuple(match.pair() for match in _without_rivals(sure, [sum(_misfit_m(rails, m, spacing)) for m in sure]))


@dataclass(frozen=True)
class _Match:
    """Chainages of rails a and b at the nodes of one match, in the direction of a; sides are `LEFT` or `RIGHT`."""

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
        if self.side_a == LEFT:  # b is on the left of a
            return RailPair(self.b, self.a, span_b, span_a)
        return RailPair(self.a, self.b, span_a, span_b)


def _sections(group: Parallels) -> Iterator[Parallels]:
    """Divide the stations of two rails, sorted by t_a, at gaps and into chunks."""
    gap = np.diff(group.t_a) > MIN_BREAK_M
    run = np.concatenate([[0], np.cumsum(gap)])
    starts = group.t_a[np.concatenate([[True], gap])][run]
    piece = ((group.t_a - starts) / CHUNK_M).astype(int)
    borders = np.flatnonzero((np.diff(run) != 0) | (np.diff(piece) != 0)) + 1
    for mine in np.split(np.arange(len(run)), borders):
        yield group[mine]


def _match(rails: Sequence[RailLine], section: Parallels, spacing: float, tolerance_m: float) -> Iterator[_Match]:
    """Match the offset curves of two rails along one section."""
    a, b, same = int(section.a[0]), int(section.b[0]), bool(section.same[0])
    side_a = LEFT if section.left_m[0] > 0 else RIGHT
    side_b = -side_a if same else side_a
    sense = 1 if same else -1
    curve_a = _offset_curve(rails[a].line, section.t_a, side_a * spacing / 2)
    curve_b = _offset_curve(rails[b].line, section.t_b, side_b * spacing / 2)
    curve_b = Polyline(curve_b.xyz[::sense], sense * curve_b.t[::sense])
    for t_a, t_b in _abreast(curve_a, curve_b, tolerance_m):
        for found in match_polylines(curve_a.at(t_a), curve_b.at(t_b), tolerance_m):
            own = t_a[found.first], sense * t_b[found.second]
            match = _Match(a, b, *own, side_a, side_b, found.penalty / found.length)
            if match.length_m >= MIN_SECTION_M and _on_one_level(rails[a], rails[b], *own):
                yield match


def _is_nearest(match: _Match, section: Parallels, spacing: float, others_m: Sequence[float]) -> bool:
    """Return whether no other spacing is closer to that of a match found along a section."""
    first, last = np.sort(match.t_a[[0, -1]])
    inside = (section.t_a >= first) & (section.t_a <= last)
    apart_m = np.abs(section.left_m[inside]).mean()
    return all(abs(apart_m - spacing) <= abs(apart_m - other) for other in others_m)


def _on_one_level(a: RailLine, b: RailLine, t_a: np.ndarray, t_b: np.ndarray) -> bool:
    """Return whether two rails are on one level at chainages; unknown heights count as equal."""
    z_a, z_b = a.line.at(t_a)[:, 2], b.line.at(t_b)[:, 2]
    apart = np.abs(z_a - z_b)[np.isfinite(z_a - z_b)]
    return not len(apart) or bool(np.median(apart) <= MAX_LEVEL_M)


def _offset_curve(rail: Polyline, t: np.ndarray, left_m: float) -> Polyline:
    """Move the part of a rail around the chainages `t` to the left by `left_m`; it keeps the chainages of the rail."""
    part = rail.resampled(SAMPLE_STEP_M, t.min() - MARGIN_M, t.max() + MARGIN_M)
    return Polyline(part.xy + left_m * part.normals, part.t)


def _abreast(a: Polyline, b: Polyline, tolerance_m: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Place stations abreast of each other where two curves are within the tolerance; yields chainages along both.

    With vertices abreast of each other no segment, however long, is without a neighbour, so their spacing depends only
    on the shape of the curves. It is finer only where a section may end.
    """
    near = np.zeros(len(a.t), dtype=bool)
    near[b.feet(a.xy, tolerance_m).point] = True
    changes = np.flatnonzero(np.diff(near))
    share = np.arange(FINE_STEP_M / SAMPLE_STEP_M, 1.0, FINE_STEP_M / SAMPLE_STEP_M)
    stations = np.sort(np.append(a.t, a.t[changes, None] + share * np.diff(a.t)[changes, None]))
    feet = b.feet(a.at(stations), tolerance_m)
    order = np.argsort(feet.point)
    point, t = feet.point[order], feet.t[order]
    # The start of a closed rail may be in the middle of the section.
    apart = (np.diff(point) > 1) | (np.abs(np.diff(t)) > MIN_BREAK_M)
    for run in np.split(np.arange(len(point)), np.flatnonzero(apart) + 1):
        if len(run) > 1:
            yield stations[point[run]], t[run]


def _select(matches: Sequence[_Match]) -> list[_Match]:
    """Assign every section of a rail's side to the longest match that claims it."""
    used = _PairedSides()
    selected = []
    for match in sorted(matches, key=lambda match: (-match.length_m, match.mean_penalty)):
        for part in _free_runs(match, used.same_side(match)):
            used.add(part)
            selected.append(part)
    return selected


def _without_ghosts(matches: Sequence[_Match]) -> list[_Match]:
    """Drop matches between two tracks whose inner rails are at gauge by chance, as with tram tracks 3 m apart.

    A rail with a single partner certainly belongs to its track. A match that takes a rail from such a track, and whose
    other rail has a partner on its far side too, is due to chance. Matches are dropped in rounds, so that of many
    tracks side by side every second match stays.
    """
    while True:
        partners = _PairedSides(matches)
        doubtful = [np.all(partners.far_side(match), axis=0) for match in matches]
        sure = _PairedSides(part for match, out in zip(matches, doubtful) for part in _free_runs(match, out))
        ghosts = [out & np.any(sure.far_side(match), axis=0) for match, out in zip(matches, doubtful)]
        if not any(ghost.any() for ghost in ghosts):
            return list(matches)
        matches = [part for match, ghost in zip(matches, ghosts) for part in _free_runs(match, ghost)]


def _misfit_m(rails: Sequence[RailLine], match: _Match, spacing: float) -> tuple[float, float]:
    """Return how unlike two rails of a track the rails of a match are: off the gauge, and wandering (weighted)."""
    a, b = rails[match.a].line, rails[match.b].line
    start, end = np.sort(match.t_a[[0, -1]]).tolist()
    t = np.arange(start, end, SAMPLE_STEP_M)
    places = a.at(t)
    # Of a long rail only the part of this match: many matches of one rail must not cost the square of its length.
    first, after = np.searchsorted(b.t, [match.t_b.min() - MARGIN_M, match.t_b.max() + MARGIN_M])
    near = slice(max(first - 1, 0), after + 1)
    feet = Polyline(b.xyz[near], b.t[near]).feet(places[:, :2], 2 * spacing)
    order = np.argsort(feet.point)
    apart = np.abs(feet.across[order])
    heights = b.at(feet.t[order])[:, 2]
    level = np.nan_to_num(places[feet.point[order], 2] - heights)
    off = float(np.sqrt(np.mean((apart - spacing) ** 2)))
    return off, WANDER_WEIGHT * (_wander(apart) + _wander(level))


def _wander(values: np.ndarray) -> float:
    """Return the median RMS deviation of values at stations, (n,), from a steady change over `WANDER_STATIONS`."""
    count = min(WANDER_STATIONS, len(values))
    if count < 3:
        return 0.0
    windows = np.lib.stride_tricks.sliding_window_view(values, count)
    steady = np.column_stack([np.ones(count), np.arange(count)])
    unsteady = np.eye(count) - steady @ np.linalg.pinv(steady)
    return float(np.median(np.sqrt(np.mean((windows @ unsteady) ** 2, axis=1))))


def _without_rivals(matches: Sequence[_Match], misfits_m: Sequence[float]) -> list[_Match]:
    """Drop matches with a rail that has a clearly better partner on its other side, as the edge of a cable trough.

    A match that loses over more than `MAX_LOST_SHARE` of its length is dropped, so that a wrong partner does not stay
    where the right one is interrupted.
    """
    kept: list[_Match] = []
    for match, misfit_m in zip(matches, misfits_m):
        better = _PairedSides(
            other
            for other, other_m in zip(matches, misfits_m)
            if misfit_m > CLEARLY_WORSE * other_m and misfit_m > other_m + CLEARLY_WORSE_M
        )
        lost = np.any(better.far_side(match), axis=0)
        if np.mean(lost) <= MAX_LOST_SHARE:
            kept += _free_runs(match, lost)
    return kept


class _PairedSides:
    """The sections of the sides of rails that have partners."""

    def __init__(self, matches: Iterable[_Match] = ()) -> None:
        self._used: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
        for match in matches:
            self.add(match)

    def add(self, match: _Match) -> None:
        """Add the rails of a match."""
        self._used[match.a, match.side_a].append(tuple(np.sort(match.t_a[[0, -1]])))
        self._used[match.b, match.side_b].append(tuple(np.sort(match.t_b[[0, -1]])))

    def same_side(self, match: _Match) -> np.ndarray:
        """Return the nodes of a match at which one of its rails has a partner on the side of the match, (n,) bool."""
        return np.any(self._of(match, 1), axis=0)

    def far_side(self, match: _Match) -> np.ndarray:
        """Return the nodes of a match at which its first and its second rail has one on the other side, (2, n) bool."""
        return self._of(match, -1)

    def _of(self, match: _Match, sense: int) -> np.ndarray:
        sides = ((match.t_a, match.a, match.side_a), (match.t_b, match.b, match.side_b))
        return np.array([_inside(t, self._used[rail, sense * side]) for t, rail, side in sides])


def _inside(t: np.ndarray, intervals: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return the chainages that are within the intervals by more than the tolerated overlap, (n,) bool."""
    inside = np.zeros(len(t), dtype=bool)
    for start, end in intervals:
        inside |= (t > start + MAX_OVERLAP_M) & (t < end - MAX_OVERLAP_M)
    return inside


def _free_runs(match: _Match, taken: np.ndarray) -> Iterator[_Match]:
    """Return the parts of a match between the nodes marked in `taken` that are long enough."""
    borders = np.flatnonzero(np.diff(taken)) + 1
    for run in np.split(np.arange(len(taken)), borders):
        part = match[run[0] : run[-1] + 1]
        if not taken[run[0]] and part.length_m >= MIN_SECTION_M:
            yield part


def refuse_other_spacing(rails: Sequence[RailLine], parameters: Parameters) -> None:
    """Raise NoTrackError if the spacing of the rails clearly differs from the one given."""
    gauge_m, head_width_m = parameters.gauge_m, parameters.head_width_m
    spacing = most_common_spacing(rails, MIN_SECTION_M)
    if spacing is None or abs(spacing - gauge_m - head_width_m) < parameters.centerline_tolerance_m:
        return
    message = f"No track of {1000 * gauge_m:.0f} mm gauge found: rails are {1000 * spacing:.0f} mm apart"
    likely = closest_standard(spacing, head_width_m)
    if likely is not None and abs(likely.gauge_m - gauge_m) > 1e-9:
        raise NoTrackError(f"{message}, is the gauge {1000 * likely.gauge_m:.0f} mm?")
    raise NoTrackError(f"{message}.")


@dataclass(frozen=True)
class Match:
    """A section of one polyline and the section of another that it matches.

    `first` and `second`, (k,), are successive vertices: from one entry to the next, exactly one of the two advances by
    one. `length` is the sum of the lengths of both sections, `penalty` the squared distance between vertices and their
    segments, integrated over the segments.
    """

    first: np.ndarray
    second: np.ndarray
    length: float
    penalty: float


@dataclass(frozen=True)
class LatticeEdges:
    """Valid pairs of a vertex and a segment as edges of the lattice, (n,) each, sorted by first, second and kind.

    An edge starts at the node (`first`, `second`); its `kind` is ADVANCE_SECOND or ADVANCE_FIRST, and its `length` that
    of the segment.
    """

    first: np.ndarray
    second: np.ndarray
    kind: np.ndarray
    length: np.ndarray
    penalty: np.ndarray


def match_polylines(first: np.ndarray, second: np.ndarray, tolerance: float) -> list[Match]:
    """Find the matches of two polylines, (m, 2) and (n, 2), in their given directions; the longest comes first.

    Vertices are abreast of each other, or else at steps of at most half the tolerance: the middle of a longer segment
    may be too far from any vertex. `tolerance` is the maximum distance between a vertex and a segment, exclusive.

    The longest path wins, and of equally long ones the one with the lowest penalty. Paths that share or continue an
    edge form a cluster, and each cluster gives one match. The paper says that a pair does not "follow" one further
    along; any order works in which pairs precede their continuations, and that of the lattice nodes is used here.
    """
    edges = lattice_edges(first, second, tolerance)
    if not len(edges.first):
        return []
    begin, end, node_count = _lattice_nodes(edges)
    cluster = _clusters(begin, end, node_count)
    best_length, best_penalty, arrival = _best_arrivals(edges, begin, end, node_count)
    length, penalty = best_length[begin] + edges.length, best_penalty[begin] + edges.penalty
    predecessor = arrival[begin]
    order = _longest_then_cheapest(length, penalty)
    _, best = np.unique(cluster[order], return_index=True)
    return [_trace(edges, predecessor, edge, length[edge], penalty[edge]) for edge in order[np.sort(best)].tolist()]


def lattice_edges(first: np.ndarray, second: np.ndarray, tolerance: float) -> LatticeEdges:
    """Pair every vertex with every segment of the other polyline that is closer than the tolerance."""
    ahead, turned = _near_pairs(first, second, tolerance), _near_pairs(second, first, tolerance)
    turned = (turned[1], turned[0], *turned[2:])
    kind = np.repeat([ADVANCE_SECOND, ADVANCE_FIRST], [len(ahead[0]), len(turned[0])])
    i, j, length, penalty = (np.concatenate(columns) for columns in zip(ahead, turned))
    order = np.lexsort((kind, j, i))
    return LatticeEdges(i[order], j[order], kind[order], length[order], penalty[order])


def _near_pairs(points: np.ndarray, line: np.ndarray, tolerance: float) -> tuple[np.ndarray, ...]:
    """Return the vertices of `points` and segments of `line` that are close: both numbers, segment length, penalty."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    reach = tolerance + 0.5 * steps.max(initial=0.0)  # a close segment has an end within this distance
    near = cKDTree(points).sparse_distance_matrix(cKDTree(line), reach, output_type="ndarray")
    vertex = np.concatenate([near["i"], near["i"]])
    segment = np.concatenate([near["j"], near["j"] - 1])
    inside = (segment >= 0) & (segment < len(line) - 1)
    vertex, segment = np.divmod(np.unique(vertex[inside] * len(line) + segment[inside]), len(line))
    p, q = line[segment] - points[vertex], line[segment + 1] - points[vertex]
    close = distance_to_segment(p, q) < tolerance
    return vertex[close], segment[close], steps[segment[close]], squared_distance_integral(p[close], q[close])


def distance_to_segment(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the distance of the segments from p to q, (n, 2) each, from the origin, (n,)."""
    along = q - p
    squared = np.einsum("ij,ij->i", along, along)
    share = np.clip(-np.einsum("ij,ij->i", p, along) / np.maximum(squared, np.finfo(float).tiny), 0.0, 1.0)
    return np.linalg.norm(p + share[:, None] * along, axis=1)


def squared_distance_integral(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Integrate the squared distance from the origin along the segments from p to q, (n, 2) each; returns (n,).

    Gribov and Chang, appendix.
    """
    length = np.linalg.norm(q - p, axis=1)
    return length / 3 * np.einsum("ij,ij->i", p, p + q) + length / 3 * np.einsum("ij,ij->i", q, q)


def _lattice_nodes(edges: LatticeEdges) -> tuple[np.ndarray, np.ndarray, int]:
    """Find the lattice nodes, numbered from 0, where edges start, (n,), and end, (n,), and the number of nodes."""
    width = int(edges.second.max()) + 2
    begin = edges.first * width + edges.second
    end = begin + np.where(edges.kind == ADVANCE_FIRST, width, 1)
    used, number = np.unique(np.concatenate([begin, end]), return_inverse=True)
    begin, end = number.reshape(2, -1)
    return begin, end, len(used)


def _clusters(begin: np.ndarray, end: np.ndarray, node_count: int) -> np.ndarray:
    """Return the number of each edge's cluster, (n,): edges are linked where one continues another.

    A node links its edges only if some end and some start there.
    """
    continued = np.zeros((2, node_count), dtype=bool)
    continued[0, end] = continued[1, begin] = True
    through = continued[0] & continued[1]
    arriving, leaving = np.flatnonzero(through[end]), np.flatnonzero(through[begin])
    edge = np.concatenate([arriving, leaving])
    node = len(begin) + np.concatenate([end[arriving], begin[leaving]])
    size = len(begin) + node_count
    links = coo_matrix((np.ones(len(edge), dtype=bool), (edge, node)), shape=(size, size))
    return connected_components(links, directed=False)[1][: len(begin)]


def _best_arrivals(edges: LatticeEdges, begin: np.ndarray, end: np.ndarray, node_count: int) -> tuple[np.ndarray, ...]:
    """Return length and penalty of the best path to each node and its last edge, -1 if there is none; (k,) each.

    Plain lists are used because the edges must be taken one by one, for which numpy is ten times slower.
    """
    best_length, best_penalty, arrival = [0.0] * node_count, [0.0] * node_count, [-1] * node_count
    steps = zip(begin.tolist(), end.tolist(), edges.length.tolist(), edges.penalty.tolist())
    for edge, (here, there, length, penalty) in enumerate(steps):
        length += best_length[here]
        penalty += best_penalty[here]
        gain = length - best_length[there]
        tie = TIE * length if length > 1.0 else TIE
        if gain > tie or (gain >= -tie and penalty < best_penalty[there]):
            best_length[there], best_penalty[there], arrival[there] = length, penalty, edge
    return np.array(best_length), np.array(best_penalty), np.array(arrival)


def _longest_then_cheapest(length: np.ndarray, penalty: np.ndarray) -> np.ndarray:
    """Return the order, (n,), by descending length and, for equal lengths, by ascending penalty."""
    falling = np.argsort(-length, kind="stable")
    shorter = -np.diff(length[falling]) > TIE * np.maximum(length[falling][1:], 1.0)
    rank = np.concatenate([[0], np.cumsum(shorter)])
    return falling[np.lexsort((penalty[falling], rank))]


def _trace(edges: LatticeEdges, predecessor: np.ndarray, last: int, length: float, penalty: float) -> Match:
    """Follow the predecessors from a path's last edge to its first."""
    backwards = [last]
    while predecessor[backwards[-1]] >= 0:
        backwards.append(int(predecessor[backwards[-1]]))
    path = np.array(backwards[::-1])
    first = np.append(edges.first[path], edges.first[last] + (edges.kind[last] == ADVANCE_FIRST))
    second = np.append(edges.second[path], edges.second[last] + (edges.kind[last] == ADVANCE_SECOND))
    return Match(first, second, float(length), float(penalty))
