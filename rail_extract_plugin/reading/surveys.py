"""The lines of two surveys, in one local frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from qgis.core import QgsProcessingFeatureSource

from ...core.comparison.tracks import Survey
from ...core.frame import LocalFrame
from ...core.progress import Progress
from .area_points import check_same_plane
from .line_layers import read_rails, read_surveyed


@dataclass(frozen=True)
class Surveys:
    """Two surveys in the frame of the reference."""

    reference: Survey
    other: Survey
    frame: LocalFrame


def read_surveys(
    sources: Mapping[str, QgsProcessingFeatureSource],
    names: Mapping[str, tuple[str, str]],
    sigma_mm: Mapping[str, float | None],
    progress: Progress,
) -> Surveys:
    """Read the lines of both surveys, and their rails if there are any.

    Parameters
    ----------
    sources : mapping of str to QgsProcessingFeatureSource
        Layers by the names of their parameters.
    names : mapping of str to tuple of str
        Names of the rails, by those of the lines: the reference first.
    sigma_mm : mapping of str to float or None
        Stated standard errors, by the names of the lines.
    progress : Progress

    Raises
    ------
    CrsError
        The coordinate systems differ, or are in degrees.
    RailExtractError
        A layer has no line.
    """
    reference, other = (partial(_read, sources, name, rails, sigma_mm[name]) for name, (rails, _) in names.items())
    shares = progress.split(2)
    earlier, frame = reference(None, shares[0])
    later, _ = other(frame, shares[1])
    return Surveys(earlier, later, frame)


def _read(
    sources: Mapping[str, QgsProcessingFeatureSource],
    name: str,
    rails: str,
    sigma_mm: float | None,
    frame: LocalFrame | None,
    progress: Progress,
) -> tuple[Survey, LocalFrame]:
    """Read one survey in a frame; without one, in its own, which is returned as well."""
    surveyed, own = read_surveyed(sources[name], progress, name)
    frame, way = frame or own, _way(own, frame or own, name)
    lines = [replace(line, xyz=line.xyz + way) for line in surveyed]
    made = Survey(lines, sigma_m=np.nan if sigma_mm is None else sigma_mm / 1000)
    if rails not in sources:
        return made, frame
    found, theirs = read_rails(sources[rails], progress, rails)
    way = _way(theirs, frame, rails)
    return replace(made, rails=[replace(rail, xyz=rail.xyz + way) for rail in found]), frame


def _way(own: LocalFrame, frame: LocalFrame, name: str) -> np.ndarray:
    """Return the vector, (3,) metres, from a layer's own frame to that of the reference."""
    check_same_plane(name, own.crs_wkt, "REFERENCE", frame)
    check_same_plane("REFERENCE", frame.crs_wkt, name, own)
    return own.shift_to(frame)
