"""Checks: what the user is told about points and lines that do not look like a railway, in one ordered pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..parameters import Parameters
from ..progress import Progress
from ..rails import RailNetwork
from ..tiles.grid import SortedPoints
from .doubts import doubting_jumps, doubting_scatter, gauge_scatter, warn_of_strips
from .lines import warn_of_rails, warn_of_split_classes, with_tracks
from .points import warn_of_airborne, warn_of_unexplained
from .standard import head_widths


def of(
    network: RailNetwork, points: SortedPoints, parameters: Parameters, progress: Progress
) -> tuple[RailNetwork, Mapping[int, float]]:
    """Check rails and centerlines in this order, warn the user, and add what is in doubt to the standard errors.

    Returns the network, without lines that cannot be rails, and what `gauge_scatter` found.
    """
    for source in points.classes:
        own = [rail for rail in network.rails if rail.class_code == source.class_code]
        warn_of_rails(own, source.class_code, parameters, progress, points.search is not None)
        if own:
            warn_of_unexplained(source, own, progress)
            warn_of_airborne(source, own, progress)
    tracks = network.centerlines
    rails = with_tracks(network.rails, tracks, progress)
    warn_of_split_classes(rails, parameters, progress)
    warn_of_strips(rails, parameters, progress)
    rails = doubting_jumps(rails, tracks, progress)
    heads = head_widths(points.classes[0], parameters.gauges, progress, rails) if rails else None
    beyond_m: dict[int, float] = {}
    if heads is not None and heads.blunt:
        beyond_m = gauge_scatter(rails, tracks, parameters.gauges_m)
        rails = [rail for rail in doubting_scatter(rails, beyond_m) if rail.track_ids or not points.only_pairs]
    return replace(network, rails=tuple(rails), heads=heads), beyond_m
