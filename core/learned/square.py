"""One square labelled by a trained network: the counterpart of `classify.square.classify_square`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..classify.bed import COARSE_M, Coarse
from ..classify.lines import REACH_M, reach_at
from ..classify.settings import Settings
from ..classify.square import Classified, classify_square
from ..progress import SILENT, Progress
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

    Rails in pavements are found by their shape, because the network does not see their grooves, and so are, beside what
    the network finds, blunted heads, of which it sees too little where they are low and wide.

    Parameters
    ----------
    xyz : (n, 3) array
        See `classify.square.classify_square`.
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
    shown = {name: getattr(by_shape.figures, name) for name in ("sharp_m", "round_m")}
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
