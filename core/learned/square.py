"""One square labelled by a trained network: the counterpart of `classify.square.classify_square`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..classify.bed import COARSE_M, Coarse
from ..classify.flush import flush_rails
from ..classify.pieces import shares_of_length
from ..classify.settings import Settings
from ..classify.square import REACH_M, REACH_POINTS_PER_M, Classified, beside_guide, classify_square
from ..classify.tops import HIGH_M, Grid
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from .blocks import RAIL_VOXEL_M, Thinned, cut, thin
from .model import Classifier
from .rails import rails_of

PROBABILITY, POSSIBLE = 0.5, 0.1
"""Probability from which a point is labelled, for which the training sets the bias of the output; and that from which
it is labelled if it continues a rail: where a rail leaves the block, plants or shadows leave less to see of it."""

NEAREST = 3
"""Thinned points whose probabilities, weighted by the inverse of their squared distances, give that of a point."""

NEAREST_M = 0.001
"""Smaller distances count as this one: a point that the network has seen keeps its probability."""


def label_square(
    xyz: np.ndarray, settings: Settings, classifier: Classifier, progress: Progress = SILENT
) -> Classified:
    """Find the points on railheads in a square.

    Parameters
    ----------
    xyz : (n, 3) array
        See `classify.square.classify_square`.
    settings : Settings
    classifier : Classifier
    progress : Progress
    """
    rail = np.zeros(len(xyz), dtype=bool)
    if not len(xyz):
        return Classified(rail, SearchFigures())
    thinned = thin(xyz)
    blocks = cut(thinned, settings.side_m)
    flush, figures = _flush(xyz, thinned, settings)
    rail[flush] = True
    if blocks:
        probability = _spread(thinned, classifier.probabilities(thinned, blocks, progress))
        blunt = _blunt(xyz, settings)
        probability[blunt.rail[thinned.band]] = 1.0
        found = np.flatnonzero((probability >= POSSIBLE) & settings.own(xyz[thinned.band]))
        point, sure = thinned.band[found], probability[found] >= PROBABILITY
        kept, standing = rails_of(xyz[point], sure, settings, _reach_m(thinned.coarse, point[sure]))
        rail[point[kept]] = True
        figures += replace(standing, blunt_m=blunt.figures.blunt_m, blur_m2=blunt.figures.blur_m2)
    return Classified(rail, replace(figures, points=int(rail.sum()), squares=int(rail.any())))


def _blunt(xyz: np.ndarray, settings: Settings) -> Classified:
    """Find rails by geometry if their heads are blunted: the network sees too little of those that are low and wide.

    Returns
    -------
    Classified
        Nothing if heads are sharp.
    """
    found = classify_square(xyz, settings)
    if found.figures.blunt_m:
        return found
    return Classified(np.zeros(len(xyz), dtype=bool), SearchFigures())


def _flush(xyz: np.ndarray, thinned: Thinned, settings: Settings) -> tuple[np.ndarray, SearchFigures]:
    """Find the points of rails in pavements, (k,) int numbers, by their grooves, which the network does not see."""
    near = np.flatnonzero(thinned.height <= HIGH_M)
    if not len(near):
        return near, SearchFigures()
    grid, cell = Grid.around(xyz[near, 0], xyz[near, 1], settings.cell_m)
    found = flush_rails(thinned.coarse, near, xyz[near, :2], thinned.height[near], grid, cell, settings)
    own = found.points[settings.own(xyz[near[found.points]])]
    length_m = shares_of_length(found.lines, settings.head_width_m)[settings.own(found.lines.axis)].sum()
    along_m, across_m = beside_guide(found.rails, settings)
    cells = len(np.unique(cell[own]))
    figures = SearchFigures(
        paired_m=float(length_m), cells=cells, paved=int(length_m > 0), along_m=float(along_m), across_m=float(across_m)
    )
    return near[own], figures


def _reach_m(coarse: Coarse, point: np.ndarray) -> float:
    """Return the distance within which lines are looked for, from the density around labelled points, (n,) numbers."""
    if not len(point):
        return REACH_M[0]
    per_m2 = np.median(coarse.count[coarse.cell[point]]) / COARSE_M**2
    return float(np.clip(REACH_POINTS_PER_M / per_m2, *REACH_M))


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
