"""Scenes for each rule of *Measure clearance*, by name: what is swept, with which settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..curves import Element
from . import clearance as scenes
from .clearance import Scene

HALF_M = 1.645
"""Half width of EBO_G1 above 1.17 m."""

STRAIGHT = (Element(60.0),)
CURVE = (Element(60.0, 1 / 300, 1 / 300),)
RAMP = (Element(20.0), Element(20.0, 0.0, 1 / 600), Element(30.0, 1 / 600, 1 / 600))


@dataclass(frozen=True)
class GaugeScene:
    """A scene with the name of a profile, further settings by name, and whether the rails are given."""

    scene: Scene
    profile: str = "EBO_G1"
    settings: Mapping[str, Any] = field(default_factory=dict)
    with_rails: bool = True


def _plates(scene: Scene) -> Scene:
    """Add plates inside and outside of the profile, a mast, a thin pole and a beam."""
    for number, depth in enumerate((0.030, -0.030, 0.008, -0.015, 0.150, -0.150)):
        scenes.plate(scene, 5.0 + 6.0 * number, (1, -1)[number % 2], HALF_M - depth, (1.5, 2.5))
    scenes.pole(scene, 42.0, -1, HALF_M - 0.020, (0.2, 3.0), 0.30)
    scenes.pole(scene, 48.0, 1, HALF_M - 0.040, (0.2, 3.0))
    scenes.beam(scene, 54.0, 4.31 - 0.025, 0.6, 0.5)
    return scene


def _empty(seed: int, elements: tuple[Element, ...] = STRAIGHT, cant_m: float = 0.0, apart_m: float = 0.0) -> Scene:
    scene = scenes.double_track(seed, 500.0, elements, cant_m, 0.012, apart_m=apart_m)
    scenes.bed(scene, 2.0)
    return scene


def _with(add: Callable[[Scene], Any], scene: Scene) -> Scene:
    add(scene)
    return scene


def _plate(scene: Scene) -> None:
    scenes.plate(scene, 30.0, 1, HALF_M - 0.050, (1.5, 2.5))


def _own_vehicle(scene: Scene) -> None:
    s = np.repeat(np.arange(0.5, 60.0, 0.25), 12)
    scene.add(s, scene.rng.uniform(0.62, 0.68, len(s)), scene.rng.uniform(2.92, 2.98, len(s)), 1)
    _plate(scene)


GAUGES: dict[str, Callable[[int], GaugeScene]] = {
    "objects on a straight": lambda seed: GaugeScene(_plates(_empty(seed))),
    "objects in a canted curve": lambda seed: GaugeScene(_plates(_empty(seed, CURVE, 0.12))),
    "margin": lambda seed: GaugeScene(_plates(_empty(seed)), settings={"margin_m": 0.1}),
    "widening": lambda seed: GaugeScene(_with(_plate, _empty(seed, CURVE)), settings={"widening": "EBO"}),
    "canted curve without rails": lambda seed: GaugeScene(_plates(_empty(seed, CURVE, 0.12)), with_rails=False),
    "long wall": lambda seed: GaugeScene(
        _with(lambda one: scenes.wall(one, (5.0, 115.0), -1, HALF_M - 0.020, (1.3, 2.3)), _empty(seed, 2 * STRAIGHT))
    ),
    "bush": lambda seed: GaugeScene(_with(lambda one: scenes.bush(one, 30.0, 1, 1.5), _empty(seed))),
    "stray points": lambda seed: GaugeScene(_with(lambda one: scenes.stray(one, 25), _empty(seed))),
    "vehicle of the scanner": lambda seed: GaugeScene(_with(_own_vehicle, _empty(seed))),
    "wagon on the next track": lambda seed: GaugeScene(
        _with(lambda one: scenes.wagon(one, (15.0, 40.0), half_m=1.5), _empty(seed, apart_m=3.8)), "EBO_MAIN"
    ),
    "tracks too near": lambda seed: GaugeScene(_empty(seed, CURVE, 0.12, 3.9)),
    "platform with a face": lambda seed: GaugeScene(
        _with(lambda one: scenes.platform(one, (10.0, 60.0), 1, 1.60, 0.76), _empty(seed, RAMP, 0.05))
    ),
    "platform from above": lambda seed: GaugeScene(
        _with(lambda one: scenes.platform(one, (10.0, 50.0), -1, 1.70, 0.55, face=False), _empty(seed))
    ),
    "contact wire": lambda seed: GaugeScene(
        _with(lambda one: scenes.catenary(one, 5.1), _empty(seed, 2 * STRAIGHT)), "EBO_MAIN_15KV"
    ),
    "tunnel": lambda seed: GaugeScene(_with(lambda one: scenes.tunnel(one, (5.0, 55.0)), _empty(seed))),
}
"""Scenes, by name, each made from a seed."""
