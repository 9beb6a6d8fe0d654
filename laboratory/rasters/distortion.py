"""Pairs of rasters of a layout: as a scanner shows it at a severity from 0 to 1, and as it is.

Gribov and Chang, section 4.3, name the kinds of distortion; docs/synthetic.md has the principles, and the effect of
each severity. A label follows the shift of its rail at wavelengths above
`LABEL_WAVELENGTH_M`: the network is to smooth noise, not to straighten track.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .drawing import Window, draw_label, scan_coverage, scan_profiles
from .noise import flip, lone_lines, scatter_patches, shadows, worst_share
from .paths import STEP_M, Layout, RailPath

LABEL_WAVELENGTH_M = 5.0
MAX_WAVELENGTH_M = 20.0
MIN_WAVELENGTH_M = 1.0
REGISTRATION_M = 0.010
"""Largest shift of a whole rail."""

MAX_GAP_M = 8.0
MIN_GAP_M = 0.2
"""Shorter sections without points do not count as gaps: they cannot be distinguished from sparse scanning."""
GAPPED_SHARE = 0.3
"""Largest share of a rail without points at full severity."""

COVERED_SHARE = 0.3
"""Share of rasters that are drawn from complete coverage instead of the points of a scanner."""
DENSITY = (20.0, 400.0)
"""Points per metre of rail."""
WORST_DENSITY = 0.3
"""Factor of the densest scan at the top of the scale."""
THIN_DENSITY = (4.0, 24.0)
"""Points per metre of rail in thin clouds: 3 to 20 cells per metre, with those that are lost."""
PROFILE_M = (0.03, 0.10)
NOISE_M, WORST_NOISE_M = 0.012, 0.008
"""Largest scatter of points in plan, and what is added at the top of the scale."""
TWO_SCANS_M = 0.03
"""Scatter of half the offset between two scans at full severity: each rail then appears twice."""

FASTENING_SPACING_M = 0.6
FASTENING_REACH_M = 0.09
"""Greatest distance of rail foot and fastenings from the edge of the head."""
FASTENING_LENGTH_M = 0.15


@dataclass(frozen=True)
class Pair:
    """A corrupted raster, the ideal one, and what was done to it; (size, size) arrays.

    `distractor` has the cells of the observed raster that guard rails and lone lines set, without those of the label,
    and `gap` the number of the gap of each cell of the label that is in one, from 1; 0 elsewhere.
    """

    observed: np.ndarray
    label: np.ndarray
    distractor: np.ndarray
    gap: np.ndarray
    gap_lengths_m: tuple[float, ...]


def draw_pair(
    rng: np.random.Generator, layout: Layout, window: Window, head_width_m: float, severity: float, thin: bool = False
) -> Pair:
    """Draw a layout as a scanner shows it and as it is, with a severity from 0 to 1.

    Thin rails have only as many points as `THIN_DENSITY` states.
    """
    observed, label, distractor = np.zeros((3, window.size, window.size), dtype=bool)
    gap, lengths = np.zeros((window.size, window.size), dtype=np.int16), []
    scanner = _random_scanner(rng, severity, thin)
    hidden = shadows(rng, window, severity)
    shared_gaps: dict[int, list[tuple[float, float]]] = {}
    for rail in layout.rails:
        rail = _crop(rail, window)
        if len(rail.xy) < 2:
            continue
        length_m = STEP_M * len(rail.xy)
        gaps = shared_gaps.setdefault(rail.track, _random_gaps(rng, length_m, 0.5 * severity))
        wave = _shift(rng, len(rail.xy), severity)
        seen = _seen(rail, window, hidden, gaps + _random_gaps(rng, length_m, severity))
        ideal = replace(rail, xy=rail.xy + wave.long[:, None] * rail.normal)
        draw_label(label, window, ideal.xy, ideal.normal, head_width_m)
        for first, last in _runs(~seen):
            lengths.append(STEP_M * (last - first))
            draw_label(gap, window, ideal.xy[first:last], ideal.normal[first:last], head_width_m, len(lengths))
        for centre, opening_m in layout.openings:
            seen &= np.linalg.norm(rail.xy - centre, axis=1) > 0.5 * opening_m
        shown = replace(ideal, xy=ideal.xy + wave.short[:, None] * rail.normal)
        observed[window.cells_of(_scan(rng, shown, seen, head_width_m, severity, scanner))] = True
    for line in [*layout.distractors, *lone_lines(rng, window, severity)]:
        line = _crop(line, window)
        seen = _seen(line, window, hidden, _random_gaps(rng, STEP_M * len(line.xy), severity))
        distractor[window.cells_of(_scan(rng, line, seen, head_width_m, severity, scanner))] = True
    noisy = scatter_patches(rng, flip(rng, observed | distractor, label, severity, window.cell_m), severity) & ~hidden
    return Pair(noisy, label, distractor & noisy & ~label, gap, tuple(lengths))


@dataclass(frozen=True)
class _Scanner:
    """How the points of one raster were scanned.

    `density` is the number of points per metre of rail, None for complete coverage, `profile_m` the distance of
    profiles, `noise_m` the scatter of points, `offset_m` half of the offset between two scans, zero where there is only
    one, and `fastenings` the mean number of points on each fastening that are classified as rail.
    """

    density: float | None
    profile_m: float
    noise_m: float
    offset_m: np.ndarray
    fastenings: float


def _random_scanner(rng: np.random.Generator, severity: float, thin: bool) -> _Scanner:
    density = None
    if thin:
        density = math.exp(rng.uniform(*np.log(THIN_DENSITY)))
    elif rng.random() >= COVERED_SHARE:
        thinnest = DENSITY[1] * (DENSITY[0] / DENSITY[1]) ** severity
        densest = DENSITY[1] * WORST_DENSITY ** worst_share(severity)
        density = math.exp(rng.uniform(math.log(thinnest), math.log(densest)))
    twice = rng.random() < severity**2
    return _Scanner(
        density,
        rng.uniform(*PROFILE_M),
        rng.random() * (NOISE_M * severity + WORST_NOISE_M * worst_share(severity)),
        twice * rng.normal(0.0, TWO_SCANS_M * severity, size=2),
        rng.random() ** 2 * 6.0 * severity**2,
    )


def _crop(rail: RailPath, window: Window) -> RailPath:
    """Keep the samples from the first to the last one near the window."""
    near = np.flatnonzero(window.near(rail.xy, 1.0))
    kept = slice(near[0], near[-1] + 1) if len(near) else slice(0)
    return replace(rail, xy=rail.xy[kept], normal=rail.normal[kept])


@dataclass(frozen=True)
class _Shift:
    long: np.ndarray
    short: np.ndarray


def _shift(rng: np.random.Generator, count: int, severity: float) -> _Shift:
    """Draw the shift of a rail, (n,) m: long waves, which belong to the track, and short ones, which are noise."""
    amplitude = abs(rng.normal(0.0, 0.005 + 0.025 * severity))
    long = amplitude * _waves(rng, count, LABEL_WAVELENGTH_M, MAX_WAVELENGTH_M)
    long += rng.uniform(-1, 1) * REGISTRATION_M * severity
    short = 0.5 * amplitude * _waves(rng, count, MIN_WAVELENGTH_M, LABEL_WAVELENGTH_M)
    return _Shift(long, short)


def _waves(rng: np.random.Generator, count: int, shortest_m: float, longest_m: float) -> np.ndarray:
    """Draw a smooth function with a standard deviation of 1 over all drawings, (n,)."""
    waves = 6
    wavelength = np.exp(rng.uniform(math.log(shortest_m), math.log(longest_m), size=(waves, 1)))
    phase = rng.uniform(0, 2 * math.pi, size=(waves, 1))
    weight = rng.normal(size=(waves, 1)) / math.sqrt(waves / 2)
    return (weight * np.cos(2 * math.pi * STEP_M * np.arange(count) / wavelength + phase)).sum(axis=0)


def _random_gaps(rng: np.random.Generator, length_m: float, severity: float) -> list[tuple[float, float]]:
    """Draw sections without points, lognormal in length, as (from, to) in metres along the rail."""
    missing = GAPPED_SHARE * severity * rng.random() * length_m
    gaps = []
    while missing > 0:
        gap = min(rng.lognormal(math.log(0.8), 0.9), MAX_GAP_M)
        start = rng.uniform(-gap, length_m)
        gaps.append((start, start + gap))
        missing -= gap
    return gaps


def _seen(rail: RailPath, window: Window, hidden: np.ndarray, gaps: list[tuple[float, float]]) -> np.ndarray:
    """Return which samples are neither in a gap nor in a shadow, (n,) bool; there is no shadow outside the window."""
    position = STEP_M * np.arange(len(rail.xy))
    seen = np.ones(len(rail.xy), dtype=bool)
    for start, end in gaps:
        seen &= (position < start) | (position > end)
    inside = np.flatnonzero(window.near(rail.xy, 0.0))
    seen[inside] &= ~hidden[window.cells_of(rail.xy[inside])]
    return seen


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Find runs of true flags as (first, last + 1); they are at least `MIN_GAP_M` long and end within the array."""
    borders = np.flatnonzero(np.diff(flags)) + 1
    starts, ends = borders[flags[borders - 1] == 0], borders[flags[borders - 1] == 1]
    ends = ends[ends > starts[0]] if len(starts) else ends[:0]
    return [(a, b) for a, b in zip(starts.tolist(), ends.tolist()) if STEP_M * (b - a) >= MIN_GAP_M]


def _scan(
    rng: np.random.Generator, rail: RailPath, seen: np.ndarray, width_m: float, severity: float, scanner: _Scanner
) -> np.ndarray:
    """Draw the points of one rail, (m, 2): the head varies in width, may lack a side, and may show its foot."""
    count = len(rail.xy)
    half = 0.5 * width_m * np.clip(1 + 0.35 * severity * _waves(rng, count, 0.5, 5.0), 0.5, 1.7)
    left, right = half.copy(), -half
    if rng.random() < 0.5 * severity:
        lost = np.clip(_waves(rng, count, 2.0, 10.0), 0, 1) * width_m * 0.6
        if rng.random() < 0.5:
            left -= lost
        else:
            right += lost
    seen = seen & (left > right)
    if scanner.density is None:
        points = scan_coverage(rail.xy[seen], rail.normal[seen], right[seen], left[seen])
    else:
        density = scanner.density * rng.uniform(0.5, 1.0)
        points = scan_profiles(rng, rail.xy, rail.normal, right, left, seen, density, scanner.profile_m)
    points = np.concatenate([points, _fastenings(rng, rail, seen, width_m, scanner.fastenings)])
    offset = rng.choice([-1.0, 1.0], size=(len(points), 1)) * scanner.offset_m
    return points + offset + rng.normal(0.0, 1.0, size=points.shape) * scanner.noise_m


def _fastenings(
    rng: np.random.Generator, rail: RailPath, seen: np.ndarray, width_m: float, points: float
) -> np.ndarray:
    """Draw points next to the head at every sleeper, on foot, clips and bolts, (m, 2)."""
    stride = int(FASTENING_SPACING_M / STEP_M)
    sleepers = np.arange(rng.integers(stride), len(rail.xy), stride)
    sleepers = np.repeat(sleepers, rng.poisson(points, size=len(sleepers)))
    reach = int(0.5 * FASTENING_LENGTH_M / STEP_M)
    sleepers = np.clip(sleepers + rng.integers(-reach, reach + 1, size=len(sleepers)), 0, len(rail.xy) - 1)
    sleepers = sleepers[seen[sleepers]]
    across = rng.choice([-1.0, 1.0], size=len(sleepers)) * (
        0.5 * width_m + rng.uniform(0.0, FASTENING_REACH_M, size=len(sleepers))
    )
    return rail.xy[sleepers] + across[:, None] * rail.normal[sleepers]
