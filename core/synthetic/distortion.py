"""What goes wrong between rail and raster, by one severity from 0 (clean) to 1 (hardly a track left).

The paper names the kinds of distortion (section 4.4); ALGORITHMS.md section 6.5 gives them numbers, and this module
applies them. A label follows its rail's own shift at wavelengths above `LABEL_WAVELENGTH_M`: the network is to smooth
noise, not to straighten track.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .drawing import Window, draw_label, scan_coverage, scan_profiles
from .layouts import NO_TRACK, STEP_M, Layout, RailPath

LABEL_WAVELENGTH_M = 5.0
LONGEST_WAVELENGTH_M = 20.0
SHORTEST_WAVELENGTH_M = 1.0
REGISTRATION_M = 0.010
"""Largest constant error of a whole rail, as between two passes of the scanner."""

LONGEST_GAP_M = 8.0
GAPPED_SHARE = 0.3
"""Largest share of a rail that is missing at full severity."""

DENSITY = (20.0, 400.0)
"""Points a metre of rail."""
PROFILE_M = (0.03, 0.10)
LONE_LINE_M = 5.0
"""Lines shorter than this beside the tracks are no rails."""
BALLAST_M = 1.5
"""Farthest scale on which ballast and feet beside a rail are taken for rail."""
BLOBS = 300.0
"""Patches on 1024 x 1024 cells at full severity, at most on average."""
SHADOW_SHARE = 0.25
"""Share of patches that hide rail instead of feigning it."""


@dataclass(frozen=True)
class Pair:
    """A corrupted raster and the ideal one, both (size, size) bool arrays."""

    observed: np.ndarray
    label: np.ndarray


def draw_pair(rng: np.random.Generator, layout: Layout, window: Window, head_width_m: float, severity: float) -> Pair:
    """Draw a layout twice: as a scanner of this severity shows it, and as it is.

    Parameters
    ----------
    rng : numpy Generator
    layout : Layout
    window : Window
    head_width_m : float
    severity : float
        0 to 1.
    """
    label = np.zeros((window.size, window.size), dtype=bool)
    observed = np.zeros_like(label)
    scanner = _random_scanner(rng, severity)
    shared_gaps: dict[int, list[tuple[float, float]]] = {}
    for rail in layout.rails:
        rail = _crop(rail, window)
        if len(rail.xy) < 2:
            continue
        wave = _shift(rng, len(rail.xy), severity)
        if rail.track not in shared_gaps:
            shared_gaps[rail.track] = _gaps(rng, len(rail.xy) * STEP_M, 0.5 * severity)
        draw_label(label, window, rail.xy + wave.long[:, None] * rail.normal, rail.normal, head_width_m)
        points = _scan(rng, rail, wave.long + wave.short, head_width_m, severity, scanner, shared_gaps[rail.track])
        observed[window.cells_of(points)] = True
    for line in layout.distractors:
        line = _crop(line, window)
        points = _scan(rng, line, np.zeros(len(line.xy)), head_width_m, severity, scanner, [])
        observed[window.cells_of(points)] = True
    for line in _lone_lines(rng, window, severity):
        points = _scan(rng, line, np.zeros(len(line.xy)), head_width_m, severity, scanner, [])
        observed[window.cells_of(points)] = True
    observed = _flip(rng, observed, label, severity, window.cell_m)
    return Pair(_blobs(rng, observed, severity), label)


@dataclass(frozen=True)
class _Scanner:
    """How the points of one raster were taken; `density` None stands for complete coverage."""

    density: float | None
    profile_m: float
    noise_m: float


def _random_scanner(rng: np.random.Generator, severity: float) -> _Scanner:
    density = None
    if rng.random() < 0.7:
        thinnest = DENSITY[1] * (DENSITY[0] / DENSITY[1]) ** severity
        density = math.exp(rng.uniform(math.log(thinnest), math.log(DENSITY[1])))
    return _Scanner(density, rng.uniform(*PROFILE_M), severity * rng.uniform(0.0, 0.012))


def _crop(rail: RailPath, window: Window) -> RailPath:
    """Keep the samples from the first to the last near the window."""
    near = np.flatnonzero(window.near(rail.xy, 1.0))
    kept = slice(near[0], near[-1] + 1) if len(near) else slice(0)
    return RailPath(rail.xy[kept], rail.normal[kept], rail.track)


@dataclass(frozen=True)
class _Shift:
    long: np.ndarray
    short: np.ndarray


def _shift(rng: np.random.Generator, count: int, severity: float) -> _Shift:
    """Lateral shift of a rail: a part long enough to be the track's own, and a part that is noise; (n,) metres."""
    amplitude = abs(rng.normal(0.0, 0.005 + 0.025 * severity))
    long = amplitude * _waves(rng, count, LABEL_WAVELENGTH_M, LONGEST_WAVELENGTH_M)
    long += rng.uniform(-1, 1) * REGISTRATION_M * severity
    short = 0.5 * amplitude * _waves(rng, count, SHORTEST_WAVELENGTH_M, LABEL_WAVELENGTH_M)
    return _Shift(long, short)


def _waves(rng: np.random.Generator, count: int, shortest_m: float, longest_m: float) -> np.ndarray:
    """Random smooth function with unit standard deviation over the ensemble, (n,)."""
    waves = 6
    wavelength = np.exp(rng.uniform(math.log(shortest_m), math.log(longest_m), size=(waves, 1)))
    phase = rng.uniform(0, 2 * math.pi, size=(waves, 1))
    weight = rng.normal(size=(waves, 1)) / math.sqrt(waves / 2)
    return (weight * np.cos(2 * math.pi * STEP_M * np.arange(count) / wavelength + phase)).sum(axis=0)


def _gaps(rng: np.random.Generator, length_m: float, severity: float) -> list[tuple[float, float]]:
    """Missing stretches, lognormal in length, as (from, to) in metres along the rail."""
    missing = GAPPED_SHARE * severity * rng.random() * length_m
    gaps = []
    while missing > 0:
        gap = min(rng.lognormal(math.log(0.8), 0.9), LONGEST_GAP_M)
        start = rng.uniform(-gap, length_m)
        gaps.append((start, start + gap))
        missing -= gap
    return gaps


def _scan(
    rng: np.random.Generator,
    rail: RailPath,
    shift_m: np.ndarray,
    width_m: float,
    severity: float,
    scanner: _Scanner,
    shared_gaps: list[tuple[float, float]],
) -> np.ndarray:
    """Points found on one rail: its head thicker or thinner, one side lost at times, stretches missing; (m, 2)."""
    count = len(rail.xy)
    position = STEP_M * np.arange(count)
    seen = np.ones(count, dtype=bool)
    for start, end in shared_gaps + _gaps(rng, count * STEP_M, severity):
        seen &= (position < start) | (position > end)
    half = 0.5 * width_m * np.clip(1 + 0.35 * severity * _waves(rng, count, 0.5, 5.0), 0.5, 1.7)
    left, right = half.copy(), -half
    if rng.random() < 0.5 * severity:
        lost = np.clip(_waves(rng, count, 2.0, 10.0), 0, 1) * width_m * 0.6
        if rng.random() < 0.5:
            left -= lost
        else:
            right += lost
    seen &= left > right
    xy = rail.xy + shift_m[:, None] * rail.normal
    if scanner.density is None:
        points = scan_coverage(xy[seen], rail.normal[seen], right[seen], left[seen])
    else:
        density = scanner.density * rng.uniform(0.5, 1.0)
        points = scan_profiles(rng, xy, rail.normal, right, left, seen, density, scanner.profile_m)
    return points + rng.normal(0.0, 1.0, size=points.shape) * scanner.noise_m


def _lone_lines(rng: np.random.Generator, window: Window, severity: float) -> list[RailPath]:
    """Short straight lines that belong to no track: cables, sleepers' ends, edges of platforms."""
    lines = []
    for _ in range(rng.poisson(1.5 * severity)):
        heading = rng.uniform(-math.pi, math.pi)
        direction = np.array([math.cos(heading), math.sin(heading)])
        extent = window.size * window.cell_m
        middle = np.array([window.x0, window.y0]) + rng.random(2) * [extent, -extent]
        along = np.arange(0.0, rng.uniform(0.5, LONE_LINE_M), STEP_M)
        xy = middle + along[:, None] * direction
        lines.append(RailPath(xy, np.tile([-direction[1], direction[0]], (len(xy), 1)), NO_TRACK))
    return lines


def _flip(
    rng: np.random.Generator, observed: np.ndarray, label: np.ndarray, severity: float, cell_m: float
) -> np.ndarray:
    """Lose set cells, and set empty ones, more of them near the tracks where ballast is taken for rail."""
    lost = rng.random() * 0.4 * severity
    spread = rng.random() ** 3 * 0.02 * severity
    beside = rng.random() ** 2 * 0.06 * severity
    kept = observed & (rng.random(observed.shape) >= lost)
    chance = np.full(observed.shape, spread)
    if beside > 0 and label.any():
        distance = ndimage.distance_transform_edt(~label) * cell_m
        chance += beside * np.exp(-distance / rng.uniform(0.1, BALLAST_M))
    return kept | (rng.random(observed.shape) < chance)


def _blobs(rng: np.random.Generator, observed: np.ndarray, severity: float) -> np.ndarray:
    """Scatter elliptic patches, their number after `BLOBS`.

    Most are vegetation taken for rail and set cells; some are shadows and clear them.
    """
    size = len(observed)
    result = observed.copy()
    for _ in range(rng.poisson(BLOBS * severity * rng.random() * (size / 1024) ** 2)):
        axes = np.exp(rng.uniform(0.0, math.log(12.0), size=2))
        tilt = rng.uniform(0, math.pi)
        row, column = rng.integers(0, size, size=2)
        reach = int(axes.max()) + 1
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, size))
        columns = np.arange(max(column - reach, 0), min(column + reach + 1, size))
        down, right = rows[:, None] - row, columns[None, :] - column
        u = (right * math.cos(tilt) + down * math.sin(tilt)) / axes[0]
        v = (down * math.cos(tilt) - right * math.sin(tilt)) / axes[1]
        patch = u**2 + v**2 <= rng.uniform(0.5, 1.0, size=u.shape)
        area = result[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        if rng.random() < SHADOW_SHARE:
            area &= ~patch
        else:
            area |= patch & (rng.random(u.shape) < rng.uniform(0.3, 1.0))
    return result
