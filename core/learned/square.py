"""One square labelled by a trained network: the counterpart of `classify.square.classify_square`."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..classify.settings import Settings
from ..classify.square import Classified
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from .blocks import RAIL_VOXEL_M, Thinned, cut, thin
from .model import Classifier
from .rails import rails_of

PROBABILITY = 0.5
"""Probability from which a point is labelled; the training sets the bias of the output accordingly."""

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
    thinned = thin(xyz) if len(xyz) else None
    blocks = cut(thinned, settings.side_m) if thinned else []
    if thinned is None or not blocks:
        return Classified(rail, SearchFigures())
    probability = _spread(thinned, classifier.probabilities(thinned, blocks, progress))
    found = thinned.band[probability >= PROBABILITY]
    found = found[settings.own(xyz[found])]
    kept, figures = rails_of(xyz[found], settings)
    rail[found[kept]] = True
    return Classified(rail, figures)


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
