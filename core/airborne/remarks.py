"""What a run says of its cloud and its guides: too dense, too sparse, another footprint, another gauge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import CloudError
from ..parameters import AirborneParameters
from ..standards import STANDARDS
from .fitting import SEEN, Fitted
from .ridges import Shape
from .survey import Guide

MOBILE_DENSITY = 500.0
"""Points per square metre above which single railheads show, and Extract Rails is better: clouds from aeroplanes have
up to 100, lidar from drones up to 400."""

SPARSE_DENSITY, WIDE_FOOTPRINT_M = 5.0, 0.4
"""Below this density, a footprint this wide hides the rails in too many sections."""

FLIGHT = (
    "The standard errors are those of the fit. They leave out the error of the flight itself against its datum, often "
    "3 to 10 cm: compare with control points."
)

WIDE_RIDGES = 1.6
"""Ridges this much wider than the footprint makes them are warned of."""

KNOWN_M = 0.045
"""A gauge that the points show means the nearest one of a rail standard, if it is this close."""

FEW_GUIDES = 5
"""A sentence names no more guides than this."""


def refuse_mobile(density: float) -> None:
    """Raise `CloudError` for a cloud in whose points per square metre single railheads show."""
    if density > MOBILE_DENSITY:
        raise CloudError(
            f"The cloud has {density:.0f} points per square metre, as mobile lidar and dense drone surveys have: use "
            "Extract Rails, which finds the single railheads and is more accurate there."
        )


def are_hints(density: float, parameters: AirborneParameters) -> bool:
    """Return whether lines in a cloud with this many points per square metre are only hints."""
    return density < SPARSE_DENSITY and parameters.footprint_m > WIDE_FOOTPRINT_M


def on_density(density: float, parameters: AirborneParameters) -> list[str]:
    """Warn of a cloud that is too sparse for its footprint."""
    if not are_hints(density, parameters):
        return []
    return [
        f"The cloud has {density:.1f} points per square metre, too few for a footprint of "
        f"{parameters.footprint_m:g} m: take the lines as hints."
    ]


def on_shapes(found: Sequence[Fitted], parameters: AirborneParameters, spacings_m: Sequence[float]) -> list[str]:
    """Warn of ridges that do not fit the footprint."""
    shapes = [one.shape for one in found if one.shape is not None and (one.stations.reason == SEEN).any()]
    if not shapes:
        return []
    width_m = float(np.median([shape.width_m for shape in shapes]))
    expected_m = Shape.expected(spacings_m[0], parameters.footprint_m).width_m
    if width_m < WIDE_RIDGES * expected_m:
        return []
    return [
        f"The rails show as ridges with a standard deviation of {1000 * width_m:.0f} mm, wider than a footprint of "
        f"{parameters.footprint_m:g} m makes them: set the footprint of the scanner."
    ]


def on_gauges(guides: Sequence[Guide], fitted: Sequence[Sequence[Fitted]], parameters: AirborneParameters) -> list[str]:
    """Warn of guides along which rails at another gauge show, one sentence for those that share both gauges."""
    wrong: dict[tuple[int, int, bool], list[int]] = {}
    for guide, parts in zip(guides, fitted):
        shown = [one.shown_m for one in parts if np.isfinite(one.shown_m)]
        if 2 * len(shown) > len(parts):
            stated_mm = round(1000 * (guide.gauge_m or parameters.gauge_m))
            shown_mm = _nearest_gauge(float(np.median(shown)) - parameters.head_width_m)
            if shown_mm != stated_mm:
                wrong.setdefault((shown_mm, stated_mm, guide.gauge_m is not None), []).append(guide.guide_id)
    return [
        f"Along {_guides(ids)}, rails with a gauge of about {shown_mm} mm show, not {stated_mm} mm as "
        + ("its field gauge states: correct it." if own else "the rail standard states: choose another.")
        for (shown_mm, stated_mm, own), ids in wrong.items()
    ]


def _nearest_gauge(gauge_m: float) -> int:
    """Return the gauge of a rail standard next to a measured one, millimetres, or this one rounded."""
    known_m = min((one.gauge_m for one in STANDARDS.values()), key=lambda one: abs(one - gauge_m))
    return round(1000 * known_m) if abs(known_m - gauge_m) < KNOWN_M else 10 * round(100 * gauge_m)


def _guides(ids: Sequence[int]) -> str:
    ids = list(dict.fromkeys(ids))
    if len(ids) == 1:
        return f"guide {ids[0]}"
    if len(ids) > FEW_GUIDES:
        return f"{len(ids)} guides, such as guide {ids[0]}"
    return f"guides {', '.join(map(str, ids[:-1]))} and {ids[-1]}"
