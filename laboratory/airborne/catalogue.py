"""Flown railways with their guides, each for a kind of place or cloud: the golden table surveys them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .designs import Design, canted_curve, curved_line, drawn_together, yard
from .flight import AirborneCloud, Flight, fly
from .landscapes import countryside

LENGTH_M = 200.0
"""Length of a scene that has no reason for another one: 20 stations on each track."""

WIDTH_M = 35.0
"""Distance from the middle of a landscape up to which it is flown: its nearest things lie within."""

OFF_M = 0.5
"""Distance of the guides from their tracks, beside what they wander."""


@dataclass(frozen=True)
class FlownScene:
    """A cloud and the guides, (k, 2) each, along which tracks are looked for; `meant` is the track of each, or None."""

    design: Design
    flight: Flight
    cloud: AirborneCloud
    guides: list[np.ndarray]
    meant: Sequence[int | None]


def flown(design: Design, flight: Flight, seed: int, missing: int = 0) -> FlownScene:
    """Fly over a design, and draw guides for its tracks but for the last `missing`."""
    tracks = design.tracks[: len(design.tracks) - missing]
    cloud = fly(design.world, design.where, design.width_m, flight, seed)
    return FlownScene(design, flight, cloud, drawn_together(tracks, seed, OFF_M), range(len(tracks)))


def line(seed: int, flight: Flight, tracks: int = 2) -> FlownScene:
    """Return a line with a canted curve, and what lies beside one."""
    return flown(curved_line(seed, LENGTH_M, tracks), flight, seed)


def curve(seed: int) -> FlownScene:
    """Return a double track with 150 mm of cant."""
    return flown(canted_curve(seed), Flight(10.0, 0.5), seed)


def station(seed: int) -> FlownScene:
    """Return main tracks and sidings with their turnouts."""
    return flown(yard(seed), Flight(), seed)


def train(seed: int) -> FlownScene:
    """Return a double track, one of which a train hides from end to end of half the line."""
    while not (design := curved_line(seed, LENGTH_M)).parked:
        seed += 2
    return flown(design, Flight(), seed)


def no_guide(seed: int) -> FlownScene:
    """Return three tracks, one of them without a guide."""
    return flown(curved_line(seed, LENGTH_M, 3), Flight(), seed, missing=1)


def twins(seed: int) -> FlownScene:
    """Return a single track with two guides, one of which means a second track that is not there."""
    scene = line(seed, Flight(), tracks=1)
    way = np.gradient(scene.guides[0], axis=0)
    left = np.column_stack([-way[:, 1], way[:, 0]]) / np.hypot(*way.T)[:, None]
    return replace(scene, guides=[scene.guides[0], scene.guides[0] + 3.0 * left], meant=(0, None))


def misleading(seed: int) -> FlownScene:
    """Return a landscape without a track, and guides along three things in it."""
    design = replace(countryside(seed), width_m=WIDTH_M)
    cloud = fly(design.world, design.where, design.width_m, Flight(), seed)
    guides = [band.axis.xyz[::160, :2] for band in design.world.bands[:3]]
    return FlownScene(design, Flight(), cloud, guides, (None,) * len(guides))


FLOWN: dict[str, Callable[[int], FlownScene]] = {
    "line": lambda seed: line(seed, Flight()),
    "wide beam": lambda seed: line(seed, Flight(20.0, 0.5)),
    "sparse": lambda seed: line(seed, Flight(4.0)),
    "strips apart": lambda seed: line(seed, Flight(strips=3, strip_up_m=0.2, strip_across_m=0.15)),
    "four tracks": lambda seed: line(seed, Flight(), tracks=4),
    "curve": curve,
    "station": station,
    "train": train,
    "no guide": no_guide,
    "twins": twins,
    "no track": misleading,
}
"""Scenes by name, made from a seed."""
