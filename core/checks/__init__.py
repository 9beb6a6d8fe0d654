"""Checks: what the user is told about points and lines that do not look like a railway, in one ordered pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..parameters import Parameters
from ..progress import Progress
from ..rails import RailNetwork
from ..tiles.grid import SortedPoints, drawn_from
from .doubts import doubting_jumps, doubting_scatter, gauge_scatter, warn_of_strips
from .standard import head_widths
from .warnings import (
    warn_of_airborne,
    warn_of_blunt_lines,
    warn_of_rails,
    warn_of_split_classes,
    warn_of_unexplained,
    with_tracks,
)


def of(
    network: RailNetwork, points: SortedPoints, parameters: Parameters, progress: Progress
) -> tuple[RailNetwork, Mapping[int, float]]:
    """Check rails and centerlines in this order, warn the user, and add what is in doubt to the standard errors.

    Returns the network, without lines that cannot be rails, and what `gauge_scatter` found.
    """
    for source in points.classes:
        own = [rail for rail in network.rails if drawn_from(rail, source)]
        if source.fills:
            warn_of_blunt_lines(own, progress)
            continue
        warn_of_rails(own, source.class_code, parameters, progress, points.search is not None)
        if own:
            warn_of_unexplained(source, own, progress)
            warn_of_airborne(source, own, progress)
    tracks = network.centerlines
    rails = with_tracks(network.rails, tracks, progress)
    warn_of_split_classes(rails, parameters, progress)
    warn_of_strips(rails, parameters, progress)
    rails = doubting_jumps(rails, tracks, progress)
    first = points.classes[0]
    own = [rail for rail in rails if not rail.fills]
    heads = head_widths(first, parameters.gauges, progress, own) if rails else None
    blunt = {rail.rail_id for rail in rails if rail.fills or (heads is not None and heads.blunt)}
    beyond_m: dict[int, float] = {}
    if blunt:
        scatter = gauge_scatter(rails, tracks, parameters.gauges_m)
        beyond_m = {one: more_m for one, more_m in scatter.items() if one in blunt}
        kept = [rail.track_ids or rail.rail_id not in blunt or not points.only_pairs for rail in rails]
        rails = [rail for rail, is_kept in zip(doubting_scatter(rails, beyond_m), kept) if is_kept]
    return replace(network, rails=tuple(rails), heads=heads), beyond_m
