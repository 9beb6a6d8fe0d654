"""The features of a layer of any kind, and where each counts along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import RailExtractError

FAR, NOWHERE = np.full(2, np.inf), np.full(2, np.nan)
"""Places of a feature that is not on any map, and of one without a geometry."""


@dataclass(frozen=True)
class Places:
    """Features of a layer in the plane of an axis.

    Attributes
    ----------
    ids : sequence of int
        Of the n features.
    xy : (n, 2) array
        Where each counts: half way along a line, inside a polygon, in the mean of points; else `FAR` or `NOWHERE`.
    vertices : (m, 2) array
        Of all features that are on the map.
    owner : (m,) int array
        Number of the feature of each vertex.
    are_points : bool
        Whether the layer has nothing but points.
    originals : object
        The features as the front end has read them, for a `Copy` with further fields.
    """

    ids: Sequence[int]
    xy: np.ndarray
    vertices: np.ndarray
    owner: np.ndarray
    are_points: bool
    originals: Any


def without_places(name: str) -> RailExtractError:
    """Return the refusal of a layer that is a table."""
    return RailExtractError(f"{name} is a table without places: give a layer of points, lines or polygons.")
