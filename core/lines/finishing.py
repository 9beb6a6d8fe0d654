"""Finish lines: join pieces into one, cut turns too sharp for a rail, and thin (docs/method.md sections 5.5 and 5.6).

All chords between vertices of a curve are inside it, on average by half the tolerance of thinning. The remaining
vertices are therefore moved so that the thinned line fits the whole one best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.linalg import solveh_banded
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ..parameters import Parameters
from ..polyline import Polyline, project, runs
from ..progress import Progress
from ..rails import Centerline, RailLine, Support

Line = TypeVar("Line", RailLine, Centerline)

SAME_RAIL_M = 0.03
"""Lines this close together are the same rail: two rails are at least a head apart, two copies of one a few
millimetres."""


def united(parts: Sequence[RailLine]) -> RailLine:
    """Join pieces, each of which begins where the previous one ends, into one line."""
    if len(parts) == 1:
        only = parts[0]
        return only if only.points == int(only.points) else _with_figures(parts, only.xyz)
    xyz = np.concatenate([parts[0].xyz[:1], *(part.xyz[1:] for part in parts)])
    return _with_figures(parts, xyz)


def _with_figures(parts: Sequence[RailLine], xyz: np.ndarray) -> RailLine:
    """Combine the figures of the pieces as if the line, with vertices `xyz`, had been measured as a whole."""
    lengths = [part.line.length_m for part in parts]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    points = np.array([part.points for part in parts], dtype=float)
    squares = np.array([part.resid_mm**2 for part in parts])
    supports = [part.support for part in parts if part.support is not None]
    support, sigma_mm, sigmaz_mm = None, parts[0].sigma_mm, parts[0].sigmaz_mm
    if len(supports) == len(parts):
        support = Support(
            np.concatenate([one.t + start for one, start in zip(supports, starts)]),
            np.concatenate([one.points for one in supports]),
            np.concatenate([one.sigma_m for one in supports]),
            np.concatenate([one.sigmaz_m for one in supports]),
            np.concatenate([one.strips for one in supports]),
        )
        if len(support.t):
            sigma_mm, sigmaz_mm = 1000 * support.rms_m, 1000 * support.rmsz_m
    gaps = _merged_gaps(np.concatenate([part.gaps + start for part, start in zip(parts, starts)]))
    return replace(
        parts[0],
        xyz=xyz,
        points=int(round(points.sum())),
        resid_mm=float(np.sqrt((points * squares).sum() / max(points.sum(), 1.0))),
        sigma_mm=sigma_mm,
        sigmaz_mm=sigmaz_mm,
        bridged_m=float(np.sum(gaps[:, 1] - gaps[:, 0])),
        gaps=gaps,
        support=support,
    )


def _merged_gaps(gaps: np.ndarray) -> np.ndarray:
    """Merge touching gaps, (k, 2) in order."""
    if len(gaps) < 2:
        return gaps
    apart = gaps[1:, 0] > gaps[:-1, 1] + SAME_RAIL_M
    return np.column_stack([gaps[np.append(True, apart), 0], gaps[np.append(apart, True), 1]])


TURN_M, MAX_TURN_DEG = 1.0, 10.0
"""A line that turns by more than this within this length is not a rail there: at the least radius, 20 m, a rail turns
by 3 degrees per metre. The rest is for jogs of a centimetre where lines were brought together in a node."""

STEP_M, ROUGH_STEP_M = 0.1, 0.5
"""Spacing of the stations between which directions are measured, and that on lines that are smoothed by less than
`SMOOTHED_M`: these still have the stairs of the raster, 2 cm high."""

SMOOTHED_M = 0.4
"""Sigma of PAEK from which stairs turn a line by less than a degree."""

ON_ITSELF_M, ON_ITSELF_SHARE = 0.1, 0.5
"""A part of a line that is this close to a longer part, over this share of its length, is the same rail drawn twice:
the line has turned back onto itself."""


def finished(lines: Sequence[Line], parameters: Parameters, progress: Progress) -> tuple[Line, ...]:
    """Split lines where they turn too sharply for rails, warn the user of it, and thin them."""
    kept: list[Line] = []
    turned: list[Line] = []
    step_m = STEP_M if parameters.smoothing_xy_m >= SMOOTHED_M else ROUGH_STEP_M
    for line in lines:
        parts = parts_without_turns(line.xyz[:, :2], parameters.min_length_m, step_m)
        whole = len(parts) == 1 and np.ptp(parts[0]) >= line.line.length_m
        kept += [line] if whole else [line.part(*part) for part in parts]
        turned += [] if whole else [line]
    if turned:
        what = "rail" if isinstance(turned[0], RailLine) else "centerline"
        count, was = (f"1 {what} bends", "it was") if len(turned) == 1 else (f"{len(turned)} {what}s bend", "they were")
        before_m, after_m = (sum(line.length_m for line in some) for some in (lines, kept))
        progress.warning(
            f"{count} by more than {MAX_TURN_DEG:g}° within a metre, which rails cannot; {was} split there and "
            f"{before_m - after_m:.1f} m dropped."
        )
    return thin(kept, parameters.simplify_xy_m, parameters.simplify_z_m)


def parts_without_turns(
    line: np.ndarray, min_length_m: float, step_m: float, max_turn_deg: float = MAX_TURN_DEG
) -> list[tuple[float, float]]:
    """Return the parts of a line, (n, 2), from chainage to chainage, between places where it turns too much for a rail.

    A line without such a place is a single part, however short. Parts shorter than `min_length_m` are left out, and so
    is a part that runs back over a longer one. Directions are measured between stations `step_m` apart.
    """
    stations = Polyline(line).resampled(step_m)
    t, sharp = stations.t, _turns(stations) > np.radians(max_turn_deg)
    bends = [(float(t[first]), float(t[last + 1])) for first, last in runs(sharp)]
    if not bends:
        return [(0.0, float(t[-1]))]
    borders = [0.0, *(border for bend in bends for border in bend), float(t[-1])]
    parts = [(start, end) for start, end in zip(borders[::2], borders[1::2]) if end - start >= min_length_m]
    drawn = {part: stations.xy[(t >= part[0]) & (t <= part[1])] for part in parts}
    kept: list[tuple[float, float]] = []
    for part in sorted(parts, key=lambda part: part[0] - part[1]):
        again = project([drawn[other] for other in kept], drawn[part], ON_ITSELF_M)
        if len(again.point) < ON_ITSELF_SHARE * len(drawn[part]):
            kept.append(part)
    return sorted(kept)


def _turns(stations: Polyline) -> np.ndarray:
    """Return the range of the directions within `TURN_M` of line around each section between stations, radians."""
    ahead = np.diff(stations.xy, axis=0)
    direction = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    sections = int(round(TURN_M / stations.t[1])) + 1
    return maximum_filter1d(direction, sections) - minimum_filter1d(direction, sections)


EXACT_M = 1e-9
"""Smallest effective tolerance: a vertex closer to the chord is dropped even at a tolerance of zero."""


def thin(lines: Sequence[Line], tolerance_xy_m: float, tolerance_z_m: float) -> tuple[Line, ...]:
    """Drop needless vertices of lines, but none in which another line ends, so that lines stay connected.

    The tolerances are the largest distances of a dropped vertex from the result, in plan and in height.
    """
    ends = np.unique([_as_complex(line.xyz[[0, -1]]) for line in lines])
    return tuple(replace(line, xyz=_thinned(line.xyz, ends, tolerance_xy_m, tolerance_z_m)) for line in lines)


def _as_complex(xyz: np.ndarray) -> np.ndarray:
    """Return places in plan, (n,), as single numbers, which can be looked up."""
    return xyz[:, 0] + 1j * xyz[:, 1]


def _thinned(xyz: np.ndarray, ends: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin the pieces between the vertices in which other lines end, (k, 3)."""
    inner = np.flatnonzero(np.isin(_as_complex(xyz[1:-1]), ends)) + 1
    knots = [0, *inner.tolist(), len(xyz) - 1]
    pieces = [xyz[first : last + 1] for first, last in zip(knots, knots[1:])]
    return np.concatenate([*(_fitted(piece, tolerance_xy_m, tolerance_z_m)[:-1] for piece in pieces), xyz[-1:]])


def essential_vertices(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Mark the vertices, (n,) bool, needed to keep a line, (n, 3), within the tolerances (Douglas and Peucker, 1973).

    Plan and height are judged together, so that the line keeps both tolerances; without heights, NaN, the plan counts.
    """
    keep = np.zeros(len(xyz), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(xyz) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        beside, above = _deviation(xyz[first : last + 1])
        excess = np.fmax(beside / max(tolerance_xy_m, EXACT_M), above / max(tolerance_z_m, EXACT_M))
        worst = int(excess.argmax())
        if excess[worst] > 1:
            keep[first + 1 + worst] = True
            spans += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return keep


def _deviation(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure how far inner vertices are from the segment between the outer ones, in plan and height, (n - 2,) each."""
    chord, inner = xyz[-1] - xyz[0], xyz[1:-1] - xyz[0]
    length_squared = chord[0] ** 2 + chord[1] ** 2
    share = np.clip(inner[:, :2] @ chord[:2] / length_squared, 0, 1) if length_squared > 0 else np.zeros(len(inner))
    off = inner - share[:, None] * chord
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])


def _fitted(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin one piece and move its inner vertices so that the line through them fits all vertices best, (k, 3).

    Vertices whose move would take the line out of the tolerance stay.
    """
    kept = np.flatnonzero(essential_vertices(xyz, tolerance_xy_m, tolerance_z_m))
    if len(kept) < 3 or len(kept) == len(xyz):
        return xyz[kept]
    span = np.clip(np.searchsorted(kept, np.arange(len(xyz)), side="right") - 1, 0, len(kept) - 2)
    along = Polyline(xyz).t
    share = (along - along[kept][span]) / (along[kept][span + 1] - along[kept][span])
    missing = xyz - _between(xyz[kept], span, share)
    moves = _least_squares(missing, span, share, np.gradient(along))
    while True:
        left = missing - _between(moves, span, share)
        off = (np.hypot(left[:, 0], left[:, 1]) > tolerance_xy_m) | (np.abs(left[:, 2]) > tolerance_z_m)
        stay = np.unique([span[off], span[off] + 1])
        if not moves[stay].any():
            return xyz[kept] + moves
        moves[stay] = 0.0


def _between(vertices: np.ndarray, span: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Interpolate between vertices `span` and `span` + 1, (n, 3)."""
    return vertices[span] + share[:, None] * (vertices[span + 1] - vertices[span])


def _least_squares(values: np.ndarray, span: np.ndarray, share: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Fit a polyline that is 0 at both ends to (n, 3) values; returns its vertices."""
    count = int(span[-1]) + 2
    before, after = weight * (1 - share), weight * share
    diagonal = np.bincount(span, before * (1 - share), count) + np.bincount(span + 1, after * share, count)
    beside = np.bincount(span, before * share, count)
    right = [
        np.bincount(span, before * column, count) + np.bincount(span + 1, after * column, count)
        for column in np.nan_to_num(values).T
    ]
    sums, beside = np.stack(right, axis=1), np.concatenate([[0.0], beside[:-1]])
    diagonal[[0, -1]], beside[[1, -1]], sums[[0, -1]] = 1.0, 0.0, 0.0
    return solveh_banded(np.stack([beside, diagonal]), sums)
