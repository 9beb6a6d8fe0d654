"""Every scene by its name, for tests, benchmarks and the sample in the plugin."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from . import plain as plain_scenes
from . import switches as switch_scenes
from .scene import Scene

SCENES: dict[str, Callable[..., Scene]] = {
    "straight": plain_scenes.straight,
    "curved": plain_scenes.curved,
    "main_line": plain_scenes.main_line,
    "paper_like": plain_scenes.paper_like,
    "tram": plain_scenes.tram,
    "turnout_7": partial(switch_scenes.turnout, "turnout_7", "190-1:7.5", 1, 0.3, seed=10),
    "turnout_9": partial(switch_scenes.turnout, "turnout_9", "300-1:9", -1, 1.9, seed=11),
    "turnout_10": partial(switch_scenes.turnout, "turnout_10", "#10", 1, -0.9, seed=12, curvature=-1 / 700),
    "turnout_12": partial(switch_scenes.turnout, "turnout_12", "500-1:12", 1, 2.7, seed=13),
    "turnout_18": partial(switch_scenes.turnout, "turnout_18", "1200-1:18.5", -1, 0.1, seed=14),
    "turnout_26": partial(switch_scenes.turnout, "turnout_26", "2500-1:26.5", 1, -0.4, seed=15),
    "crossover": switch_scenes.crossover,
    "diamond": switch_scenes.diamond,
    "throat": switch_scenes.throat,
    "dual_gauge": plain_scenes.dual_gauge,
    "noisy": plain_scenes.noisy,
    "sparse": plain_scenes.sparse,
    "feet": plain_scenes.feet,
}
