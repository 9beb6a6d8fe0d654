"""Heads that stand just out of a rough bed, by what is higher than both of its sides over more than a metre.

The stones of a track that is filled with ballast scatter by as much as its heads stand out, but a line of tens
of cells averages them. How much its mean differs from those beside it is compared with what the cells scatter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter

from .cells import (
    Candidates,
    Shown,
    Standing,
    as_wanted,
    density_at,
    fitting,
    on_lines,
    on_rails,
    with_pairs,
)
from .labels import Near, label
from .lines import Lines, reach_at
from .pieces import SHOWN_SHARE, pieces_of, with_partner
from .ridges import Ridges, above_sides, cells_beside, on_crests
from .settings import Settings
from .tops import EMPTY, MILLIMETRES, WINDOW_M, Grid

DOUBLINGS = (5, 6)
"""Lines have 2 to these powers of cells: 1.3 and 2.6 m. The shorter one counts if it is certain, because rails bend and
part: arcs of 25 m bend by 8 mm over it. Where a head stands out by 3 cm, and stones by half as much, or where profiles
of a scanner are far apart, only the longer one is certain; over 5.2 m, furrows are as well."""

DIRECTIONS_PER_CELL = 0.75
"""Directions of lines, by their cells: one between two of them is half a head off at its ends."""

MARGIN = 2 ** max(DOUBLINGS)
"""Cells around a raster: half of the longest line and its sides take fewer."""

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

CERTAIN, HINT = 4.5, 1.5
"""Least rise of a line by its standard error: chance is a third of it over all directions, and rails twice of it. From
the second number on, a line that is twice as long may be certain."""

CREST_CELLS = 3
"""Cells to either side that are not more certain than a crest: lines beside a head cross it at small angles."""

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
    kept = on_lines(found, reach_at(density), tolerances, settings)
    kept = with_pairs(kept.on_ground(shown.tops, kept.slopes(shown.bed)), settings, tolerances)
    kept = on_rails(kept, np.ones(len(kept.cell), dtype=bool), settings, tolerances)
    kept = kept.of(with_partner(kept.pairs, kept.paired))
    if len(kept.cell):
        piece = pieces_of(len(kept.cell), kept.pairs)
        low_enough = shown.height < HIGHEST_M
        of_heads = shown.of(low_enough)
        width_m = Ridges.measure(of_heads.xy, of_heads.height, kept.lines, piece, SHOWN_SHARE).width_m
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
    rises = Rises.of(np.clip(level - surface, -CLIPPED_M, CLIPPED_M), grid.cell_m)
    rise, base, crest = np.full(level.shape, np.nan), np.full(level.shape, np.nan), np.zeros(level.shape, dtype=bool)
    rise.flat[rises.cells], base.flat[rises.cells] = rises.found[1:3]
    crest.flat[rises.cells] = rises.are_crests(level.shape)
    return Low(rise, base + surface, crest)


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


@dataclass(frozen=True)
class Rises:
    """The line through each of some `cells`, (k,) numbers, that is most certainly above both of its sides.

    `found`, (4, k), has its rise by the standard error of this, 0 where no line is seen, its rise and its base, see
    `Low`, and its direction, radians.
    """

    cells: np.ndarray
    found: np.ndarray

    @classmethod
    def of(cls, level: np.ndarray, cell_m: float) -> Rises:
        """Compare the line through each cell that has a height, (rows, columns) metres, with those beside it."""
        padded, cells = Padded.around(level, cell_m), np.flatnonzero(np.isfinite(level))
        found, undecided = np.zeros((4, len(cells))), np.arange(len(cells))
        for doublings in DOUBLINGS:
            found[:, undecided] = padded.most_certain(cells[undecided], doublings)
            certain = found[0, undecided]
            undecided = undecided[(certain >= HINT) & (certain < CERTAIN)]
        return cls(cells, found)

    def are_crests(self, shape: tuple[int, int]) -> np.ndarray:
        """Return which cells of a raster are certain, and more so than those within `CREST_CELLS` across, (k,) bool."""
        certain, rise, _, angle = self.found
        around = np.pad(np.zeros(shape), CREST_CELLS)
        row, column = (one + CREST_CELLS for one in np.divmod(self.cells, shape[1]))
        around[row, column] = certain
        crests = (certain >= CERTAIN) & (rise >= RISE_M)
        for across in (*range(-CREST_CELLS, 0), *range(1, CREST_CELLS + 1)):
            down, right = (np.round(across * way).astype(np.int64) for way in (np.cos(angle), np.sin(angle)))
            crests &= certain >= around[row + down, column + right]
        return crests


@dataclass(frozen=True)
class Padded:
    """A raster in a margin in which nothing is seen, row after row: a step to another cell is a number of cells.

    `images`, (3, n), are 1, height and its square where a cell has a height, and 0 elsewhere; `inside`, (n,) bool, is
    the raster without its margin. A row has `columns` cells in the raster, and `width` with the margin.
    """

    images: np.ndarray
    inside: np.ndarray
    columns: int
    width: int
    cell_m: float

    @classmethod
    def around(cls, level: np.ndarray, cell_m: float) -> Padded:
        """Put a margin around heights, (rows, columns) metres."""
        seen = np.isfinite(level)
        value = np.where(seen, level, 0.0)
        images = np.stack([seen, value, value * value, np.ones(level.shape)]).astype(np.float32)
        padded = np.pad(images, ((0, 0), (MARGIN, MARGIN), (0, MARGIN)))
        flat = padded.reshape(len(images), -1)
        return cls(flat[:3], flat[3] > 0, level.shape[1], padded.shape[2], cell_m)

    def most_certain(self, cells: np.ndarray, doublings: int) -> np.ndarray:
        """Find the most certain of the lines of 2 to the power of `doublings` cells through some cells, (k,).

        Returns (4, k), see `Rises`.
        """
        row, column = np.divmod(cells, self.columns)
        places, best = (row + MARGIN) * self.width + column, np.full((4, len(cells)), np.nan)
        best[[0, 3]] = 0.0
        directions = round(DIRECTIONS_PER_CELL * 2**doublings)
        spare = np.zeros_like(self.images), np.zeros_like(self.images)
        for angle in np.pi * np.arange(directions) / directions:
            down, right = -float(np.sin(angle)), float(np.cos(angle))
            sums, start = self._along(down, right, doublings, spare)
            certain, rise, base = self._compared(sums, start, places, down, right)
            better = certain > best[0]
            best[:3, better] = certain[better], rise[better], base[better]
            best[3, better] = angle
        return best

    def _along(
        self, down: float, right: float, doublings: int, spare: tuple[np.ndarray, np.ndarray]
    ) -> tuple[np.ndarray, int]:
        """Sum images along lines in a direction: sums of 1, 2, 4 … cells add up.

        Sums are where a line begins; also returns the step to there from its middle. `spare` gets two of the sums.
        """
        sums, length = self.images, 1
        for number in range(doublings):
            step, further = self._step(length * down, length * right), spare[number % 2]
            here, ahead = slice(max(-step, 0), min(-step, 0) or None), slice(max(step, 0), min(step, 0) or None)
            np.add(sums[:, here], sums[:, ahead], out=further[:, here])
            sums, length = further, 2 * length
        return sums, self._step(-(length - 1) / 2 * down, -(length - 1) / 2 * right)

    def _compared(
        self, sums: np.ndarray, start: int, places: np.ndarray, down: float, right: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compare the lines through some places, (k,), with those beside them; see `Rises`."""
        line = self._sample(sums, places + start)
        cells = [beside_m / self.cell_m for beside_m in BESIDE_M]
        steps = [[self._step(way * far * right, -way * far * down) for far in cells] for way in (1, -1)]
        sides = [self._sample(sums, *(places + start + step for step in ways)) for ways in steps]
        # What is beyond the border of the raster is not in shadow.
        hidden = [
            self.inside[places + ways[-1]] & (SHADOW * side.count < other.count)
            for ways, side, other in zip(steps, sides, sides[::-1])
        ]
        certain = np.min(
            [np.where(dark, np.inf, line.certainly_above(side)) for dark, side in zip(hidden, sides)], axis=0
        )
        base = np.max([np.where(dark, -np.inf, side.mean) for dark, side in zip(hidden, sides)], axis=0)
        return certain, line.mean - base, base

    def _sample(self, sums: np.ndarray, *starts: np.ndarray) -> Sample:
        """Take the lines that begin at places, (k,) each, together; those that begin outside show nothing."""
        return Sample(*np.sum([np.where(self.inside[start], sums[:, start], 0.0) for start in starts], axis=0))

    def _step(self, down: float, right: float) -> int:
        """Return the step to a cell, by the rows that it is below and the columns that it is to the right."""
        return round(down) * self.width + round(right)


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
