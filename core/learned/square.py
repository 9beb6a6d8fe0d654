"""One square labelled by a trained network: the counterpart of `classify.square.classify_square`.

Lines, partners and pieces are found as in `classify`. The network sees 4 m and does not know what continues beyond:
what is too short is left out, and what continues a rail is added.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..classify.bed import COARSE_M, Coarse
from ..classify.labels import Near
from ..classify.lines import REACH_M, Lines, Marks, find_lines, reach_at
from ..classify.partner import have_partners
from ..classify.pieces import links, long_enough, shares_of_length
from ..classify.settings import DENSE, THIN, Settings
from ..classify.square import Classified, beside_guide, classify_square
from ..classify.tops import Grid
from ..clouds.on_heads import GRADIENT
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from .blocks import RAIL_VOXEL_M, Thinned, cut, thin
from .model import Classifier

PROBABILITY, POSSIBLE = 0.5, 0.1
"""Probability from which a point is labelled, for which the training sets the bias of the output; and that from which
it is labelled if it continues a rail: where a rail leaves the block, plants or shadows leave less to see of it."""

NEAREST = 3
"""Thinned points whose probabilities, weighted by the inverse of their squared distances, give that of a point."""

NEAREST_M = 0.001
"""Smaller distances count as this one: a point that the network has seen keeps its probability."""

LEVEL_M = 1.0
"""Labelled points this far apart in height may be on one line: on the decks of bridges and below them they are not."""


def label_square(
    xyz: np.ndarray, settings: Settings, classifier: Classifier, progress: Progress = SILENT
) -> Classified:
    """Find the points on railheads in a square; see `classify.square.classify_square`.

    Rails in pavements are found by their shape, because the network does not see their grooves, and so are, beside what
    the network finds, blunted heads, of which it sees too little where they are low and wide.
    """
    by_shape = classify_square(xyz, settings)
    rail, figures = by_shape.flush.rail.copy(), by_shape.flush.figures
    if not len(xyz):
        return Classified(rail, figures)
    thinned = thin(xyz)
    blocks = cut(thinned, settings.side_m)
    if blocks:
        probability = _spread(thinned, classifier.probabilities(thinned, blocks, progress))
        if settings.blunt:
            probability[by_shape.rail[thinned.band]] = 1.0
        found = np.flatnonzero((probability >= POSSIBLE) & settings.own(xyz[thinned.band]))
        point, sure = thinned.band[found], probability[found] >= PROBABILITY
        kept, standing = rails_of(xyz[point], sure, settings, _reach_m(thinned.coarse, point[sure]))
        rail[point[kept]] = True
        figures += replace(standing, blunt_m=by_shape.figures.blunt_m, blur_m2=by_shape.figures.blur_m2)
    shown = {name: getattr(by_shape.figures, name) for name in ("sharp_m", "round_m", "unsure_m")}
    return Classified(rail, replace(figures, points=int(rail.sum()), squares=int(rail.any()), **shown))


def _reach_m(coarse: Coarse, point: np.ndarray) -> float:
    """Return the distance within which lines are looked for, from the density around labelled points, (n,) numbers."""
    if not len(point):
        return REACH_M[0]
    per_m2 = np.median(coarse.count[coarse.cell[point]]) / COARSE_M**2
    return reach_at(per_m2)


def _spread(thinned: Thinned, probability: np.ndarray) -> np.ndarray:
    """Probabilities of all points in the zone of railheads, (m,), from those of the thinned points, (n,)."""
    seen = np.flatnonzero(np.isfinite(probability))
    count = min(NEAREST, len(seen))
    tree = cKDTree(thinned.place[seen, :3])
    away, near = tree.query(thinned.band_place, k=np.arange(1, count + 1), distance_upper_bound=2 * RAIL_VOXEL_M)
    known = np.isfinite(away)
    weight = np.where(known, 1 / np.square(np.maximum(away, NEAREST_M)), 0.0)
    values = np.where(known, probability[seen][np.where(known, near, 0)], 0.0)
    total = weight.sum(axis=1)
    return np.divide((weight * values).sum(axis=1), total, out=np.zeros(len(total)), where=total > 0)


def rails_of(xyz: np.ndarray, sure: np.ndarray, settings: Settings, reach_m: float) -> tuple[np.ndarray, SearchFigures]:
    """Choose among points of a square, (n, 3) metres from its corner, that may be on rails, and sum up their rails.

    Those that the network labels are `sure`, (n,) bool; the others are kept if they lie on the axis of a rail of these.
    Cells are compared within `reach_m`. Returns which points are kept, (n,) bool.
    """
    if not sure.any():
        return sure, SearchFigures()
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], settings.cell_m)
    cells = np.unique(cell[sure])
    _, first = np.unique(grid.blocks(cells), return_index=True)
    marks = cells[np.sort(first)]
    highest = np.full(grid.shape[0] * grid.shape[1], -np.inf)
    np.maximum.at(highest, cell[sure], xyz[sure, 2])
    lines = find_lines(Marks(grid.middles(marks), highest[marks]), reach_m, LEVEL_M, THIN.beside_line_m)
    paired = have_partners(lines, settings.spacings_m, LEVEL_M)
    pairs = links(lines)
    wanted = _wanted(lines, paired, pairs, settings)
    kept = sure & wanted[cKDTree(grid.middles(marks)).query(xyz[:, :2])[1]]
    kept[~sure] = _continue(lines.of(wanted), xyz[~sure], settings.head_width_m)
    share_m = shares_of_length(lines, settings.head_width_m)
    along_m, across_m = beside_guide(lines, settings)
    figures = SearchFigures(
        points=int(kept.sum()),
        paired_m=float(share_m[wanted & paired].sum()),
        single_m=float(share_m[wanted & ~paired].sum()),
        cells=len(np.unique(cell[kept])),
        squares=int(kept.any()),
        along_m=float(along_m),
        across_m=float(across_m),
    )
    return kept, figures


def _continue(lines: Lines, xyz: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which points, (n, 3), lie on the heads of rails, (n,) bool."""
    near = Near.find(xyz[:, :2], lines)
    place = xyz[near.place]
    above = place[:, 2] - lines.height[near.cell]
    rise_m = GRADIENT * np.hypot(*(place[:, :2] - lines.axis[near.cell]).T)
    level = (above >= -DENSE.below_m - rise_m) & (above <= DENSE.above_m + rise_m)
    return near.on(head_width_m / 2 + DENSE.beside_m, level)


def _wanted(lines: Lines, paired: np.ndarray, pairs: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which cells belong to rails that are long enough and that the user wants, (n,) bool."""
    low, high = lines.reach_m / 2, settings.side_m - lines.reach_m / 2
    open_ended = np.any((lines.axis < low) | (lines.axis > high), axis=1)
    wanted = long_enough(lines, pairs, paired, open_ended, settings.keep_single)
    if settings.guide is not None:
        wanted &= settings.guide.keeps(lines, pairs, settings.spacings_m, LEVEL_M)
    return wanted
