"""Heads that stand just out of a rough bed, by what is higher than both of its sides over more than a metre.

The stones of a track that is filled with ballast scatter by as much as its heads stand out, but a line of some twenty
cells averages them. How much its mean differs from those beside it is therefore compared with what the cells scatter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter

from .cells import Candidates, Shown, Standing, as_wanted, density_at, fitting, on_lines, on_rails, with_pairs
from .labels import Near, label
from .lines import Lines, reach_at
from .pieces import pieces_of, with_partner
from .ridges import Ridges, above_sides, cells_beside, on_crests
from .settings import Settings
from .tops import EMPTY, MILLIMETRES, WINDOW_M, Grid

DOUBLINGS = 5
"""A line has 2 to this power of cells, 1.3 m: arcs of 25 m bend by 8 mm over it, and sleepers and stones alternate."""

DIRECTIONS = 24
"""Directions of lines, 7.5 degrees apart: one between two of them is half a head off at its ends."""

BESIDE_M = (0.11, 0.15, 0.19)
"""Distances of the lines on a side from the line between them: from beyond the head to the next head or its foot."""

LEAST_CELLS = 3
"""Cells with points that a line must have, and twice as many on each side: profiles of a scanner are up to 0.2 m
apart."""

SHADOW = 3
"""How many times as many cells are seen on one side of a head as in the shadow that it casts on the other. A head of
5 cm hides 0.8 m of the bed from a scanner that stands 1.7 m high 30 m away."""

SURFACE_M = (np.inf, 0.05, 0.03)
"""Distances from the surface within which cells count towards it, round by round: the scatter of ballast, and short of
a step at the ends of sleepers."""

CLIPPED_M = 0.04
"""Distance from the surface at which heights are cut off: steps and weeds would add to the scatter of the ballast."""

NOISE_M = 0.003
"""Least scatter of the cells of a line, the noise of a scanner: a few cells may be level by chance."""

CERTAIN = 4.5
"""Least rise of a line by its standard error: chance is a third of it over all directions, and rails twice of it."""

CREST_CELLS = 2
"""Cells to either side than which a crest is not lower: a head is as wide."""

ON_HEAD_M = 0.10
"""Distance from an axis up to which points show where its head is: half a head, the 3 cm by which axes of cells are
off, and as much of the ballast. Tripods see nothing nearer on the far side of a head, and what is further away may be
a check rail."""

HIGHEST_M = 0.10
"""Height above its surroundings below which points may be of a head that stands just out of its bed: those of wheels
and vehicles on it would lift its cross-section."""

RISE_M = 0.006
"""Least rise of a line: pavements wear to as much, and heads of less are in a pavement themselves."""


@dataclass(frozen=True)
class Low:
    """What lines through cells show, (rows, columns) arrays.

    `rise` is how far the line is above the higher one of its sides, metres, in the direction in which this is most
    certain, and `base` the height of this side above the bed; NaN where no line is seen. A side in shadow is lower.
    `crest` says which cells may be on a head: the line is certainly above its sides, and more so than those beside it.
    """

    rise: np.ndarray
    base: np.ndarray
    crest: np.ndarray


def on_low(shown: Shown, settings: Settings) -> Standing:
    """Find heads that stand just out of the ballast: lines above both sides, as wide as a head and with a partner."""
    grid, tolerances = shown.tops.grid, settings.tolerances(thin=False)
    low = find_low(grid, shown.mean_heights())
    rise = np.where(np.isfinite(low.rise), np.round(low.rise * MILLIMETRES), EMPTY).astype(np.int16)
    above_bed = shown.height
    above = (shown.height - np.nan_to_num(low.base).ravel()[shown.cell]).astype(np.float32)
    shown = replace(shown, height=above, tops=replace(shown.tops, top=rise))
    found = Candidates.of(shown, np.flatnonzero(low.crest))
    density = density_at(shown.bed.coarse, grid.middles(found.marks))
    kept = with_pairs(on_lines(found, reach_at(density), tolerances, settings), settings, tolerances)
    kept = on_rails(kept, np.ones(len(kept.cell), dtype=bool), settings, tolerances)
    kept = kept.of(with_partner(kept.pairs, kept.paired))
    if len(kept.cell):
        piece = pieces_of(len(kept.cell), kept.pairs)
        low_enough = shown.height < HIGHEST_M
        of_heads = shown.of(low_enough)
        width_m = Ridges.measure(of_heads.xy, of_heads.height, kept.lines, piece).width_m
        heads = ~(width_m >= settings.head_width_m + tolerances.wider_m)  # where one side is hidden, this is not known
        heads &= above_sides(of_heads.xy, above_bed[low_enough], kept.lines, piece) >= RISE_M
        kept = fitting(kept, piece, heads, settings, tolerances)
        kept = replace(kept, lines=_on_heads(of_heads, kept.lines, settings.head_width_m))
    cells = cells_beside(grid, kept.lines, (settings.head_width_m - grid.cell_m) / 2)
    chosen = label(shown.tops, cells, shown.cell, shown.height, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    return as_wanted(kept, np.ones(len(kept.cell), dtype=bool), chosen, beside, False, settings, tolerances)


def _on_heads(shown: Shown, lines: Lines, head_width_m: float) -> Lines:
    """Move axes to the middle of their heads: a cell that is half on the ballast is as high as one on the head.

    The ridge whose cross-section has the area of a head as high as it stands for the head.
    """
    return on_crests(shown.xy, shown.height, lines, head_width_m / float(np.sqrt(2 * np.pi)), ON_HEAD_M)


def find_low(grid: Grid, level: np.ndarray) -> Low:
    """Find the lines that stand out, given the mean height of each cell above the bed; NaN without points."""
    surface = _surface(level, grid)
    level = np.clip(level - surface, -CLIPPED_M, CLIPPED_M)
    certain, rise, base, direction = _most_certain(level, grid.cell_m)
    certain = np.where(np.isfinite(level), certain, 0.0)
    crest = (certain >= CERTAIN) & (np.nan_to_num(rise) >= RISE_M)
    return Low(rise, base + surface, crest & _are_crests(certain, direction))


def _surface(level: np.ndarray, grid: Grid) -> np.ndarray:
    """Mean height of the cells around each cell, without those that are far from it, (rows, columns)."""
    size = 2 * round(WINDOW_M / grid.cell_m) + 1
    surface = np.zeros(level.shape)
    for limit_m in SURFACE_M:
        near = np.abs(np.nan_to_num(level - surface, nan=np.inf)) < limit_m
        share, total = (
            uniform_filter(values, size, mode="constant") for values in (near.astype(float), np.where(near, level, 0.0))
        )
        surface = np.where(share * size**2 > 0.5, total / np.maximum(share, 0.5 / size**2), surface)
    return surface


def _most_certain(level: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Compare the line through each cell with those beside it, in the direction in which it is most certainly higher.

    Returns, (rows, columns) each, the rise by its standard error, the rise, the height of the higher side, and the
    number of the direction; 0, NaN, NaN and 0 where no line is seen.
    """
    seen = np.isfinite(level)
    value = np.where(seen, level, 0.0)
    images = np.stack([seen, value, value * value]).astype(np.float32)
    certain, direction = np.zeros(level.shape, dtype=np.float32), np.zeros(level.shape, dtype=np.int8)
    rise, base = np.full_like(certain, np.nan), np.full_like(certain, np.nan)
    for number in range(DIRECTIONS):
        down, right = _step(number)
        line = Sample(*_along(images, down, right))
        ways = [(side * right / cell_m, -side * down / cell_m) for side in (1, -1)]
        sides = [Sample(*_beside(line, *way)) for way in ways]
        hidden = [_hidden(side, other, way) for side, other, way in zip(sides, sides[::-1], ways)]
        above = [np.where(dark, np.inf, line.certainly_above(side)) for dark, side in zip(hidden, sides)]
        least = np.min(above, axis=0)
        better = least > certain
        certain[better], direction[better] = least[better], number
        base[better] = np.max([np.where(dark, -np.inf, side.mean) for dark, side in zip(hidden, sides)], axis=0)[better]
        rise[better] = line.mean[better] - base[better]
    return certain, rise, base, direction


def _hidden(side: Sample, other: Sample, way: tuple[float, float]) -> np.ndarray:
    """Return where a side is in shadow, by the other one, (rows, columns) bool: not beyond the border of the raster.

    A metre to this side is as many rows down and columns to the right as `way` says.
    """
    inside = _moved(np.ones(side.count.shape, dtype=bool), BESIDE_M[-1] * way[0], BESIDE_M[-1] * way[1])
    return inside & (SHADOW * side.count < other.count)


def _step(number: int) -> tuple[float, float]:
    """Rows and columns from one cell of a line to the next one, in a direction."""
    angle = np.pi * number / DIRECTIONS
    return -float(np.sin(angle)), float(np.cos(angle))


@dataclass(frozen=True)
class Sample:
    """Cells with points around each cell: their count, the sum of their heights, and that of the squares of these."""

    count: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    @cached_property
    def mean(self) -> np.ndarray:
        """Mean height."""
        return self.total / np.maximum(self.count, 1)

    @cached_property
    def scatter(self) -> np.ndarray:
        """Sum of squares of the distances from the mean."""
        return np.maximum(self.squares - self.count * self.mean**2, 0)

    def certainly_above(self, side: Sample) -> np.ndarray:
        """How much higher the mean of a line is than that of its side, by standard errors; 0 if too little is seen."""
        freedom = np.maximum(self.count + side.count - 2, 1)
        variance = np.maximum((self.scatter + side.scatter) / freedom, NOISE_M**2)
        error = np.sqrt(variance * (1 / np.maximum(self.count, 1) + 1 / np.maximum(side.count, 1)))
        enough = (self.count > LEAST_CELLS - 0.5) & (side.count > 2 * LEAST_CELLS - 0.5)
        return np.where(enough, (self.mean - side.mean) / error, 0.0)


def _along(images: np.ndarray, down: float, right: float) -> np.ndarray:
    """Sum images, (k, rows, columns), along a line through each cell: sums of 1, 2, 4 … cells add up."""
    total, length = images, 1
    for _ in range(DOUBLINGS):
        total = total + _moved(total, length * down, length * right)
        length *= 2
    return _moved(total, -(length - 1) / 2 * down, -(length - 1) / 2 * right)


def _beside(line: Sample, down: float, right: float) -> list[np.ndarray]:
    """Sum the lines on one side of each cell, a metre of which is as many rows down and columns to the right."""
    return [
        np.sum([_moved(values, beside_m * down, beside_m * right) for beside_m in BESIDE_M], axis=0)
        for values in (line.count, line.total, line.squares)
    ]


def _moved(image: np.ndarray, down: float, right: float) -> np.ndarray:
    """Put at each cell the value of the one `down` rows below and `right` columns to the right; 0 beyond the border."""
    (rows, columns), (row, column) = image.shape[-2:], (round(down), round(right))
    moved = np.zeros_like(image)
    if abs(row) < rows and abs(column) < columns:
        moved[..., max(-row, 0) : rows - max(row, 0), max(-column, 0) : columns - max(column, 0)] = image[
            ..., max(row, 0) : rows - max(-row, 0), max(column, 0) : columns - max(-column, 0)
        ]
    return moved


def _are_crests(certain: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return which cells are more certainly above their sides than those within `CREST_CELLS` across, bool."""
    crests = np.ones(certain.shape, dtype=bool)
    for number in range(DIRECTIONS):
        down, right = _step(number)
        chosen = direction == number
        for cells in range(1, CREST_CELLS + 1):
            for side in (cells, -cells):
                crests &= ~chosen | (certain >= _moved(certain, side * right, -side * down))
    return crests
