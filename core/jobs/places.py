"""The features of a layer of any kind, and where each counts along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..clouds.crs import unit_in_plan
from ..design_places import are_places
from ..progress import Progress
from .declaration import POINT
from .features import Feature, Source

FAR, NOWHERE = np.full(2, np.inf), np.full(2, np.nan)
"""Places of a feature that is not on any map, and of one without a geometry."""


@dataclass(frozen=True)
class Places:
    """Features of a layer in the plane of an axis.

    `xy`, (n, 2), is where each counts: half way along a line, inside a polygon, in the mean of points; else `FAR` or
    `NOWHERE`. `vertices`, (m, 2), are those of all features, of a polygon those of its outer ring, and `owner`, (m,),
    the number of the feature of each. `originals` is for a `Copy` with further fields.
    """

    ids: Sequence[int]
    xy: np.ndarray
    vertices: np.ndarray
    owner: np.ndarray
    are_points: bool
    originals: Source


def places_of(source: Source, plane: str | None, progress: Progress) -> Places:
    """Read where the features of a layer count in the plane of axes."""
    for notice in source.notices:
        progress.warning(notice)
    features, unit_m = list(progress.follow(source.features(plane), source.count)), unit_in_plan(plane)
    shapes = [np.concatenate([np.empty((0, 4)), *(part for _, part in one.parts)])[:, :2] for one in features]
    xy = [_place(feature, shape, unit_m) for feature, shape in zip(features, shapes)]
    return Places(
        [feature.number for feature in features],
        np.reshape(xy, (-1, 2)),
        np.concatenate([np.empty((0, 2)), *shapes]),
        np.repeat(np.arange(len(shapes)), list(map(len, shapes))),
        source.kinds == {POINT},
        source,
    )


def _place(feature: Feature, shape: np.ndarray, unit_m: float) -> np.ndarray:
    """Return where a feature with these vertices, (n, 2), counts."""
    if feature.is_lost or not are_places(shape, unit_m).all():
        return FAR
    return feature.middle() if len(shape) else NOWHERE
