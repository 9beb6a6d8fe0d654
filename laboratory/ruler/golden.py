"""The golden table: what comes out of every scene, by figure, and how far it may move before someone has to look.

`benchmarks/golden.json` holds it, `tests/benchmarks/test_golden.py` compares the quick part, and `benchmarks/golden.py`
writes it.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Union

import numpy as np

from ...core.parameters import Parameters
from ...core.pipeline import extract_rails
from ...core.rails import RailNetwork
from ..airborne.catalogue import FLOWN, FlownScene
from ..designs import TRACKS, TrackScene
from ..scenes.adversarial import ADVERSARIAL
from ..scenes.catalogue import SCENES
from ..scenes.gauges import GAUGES, GaugeScene
from ..scenes.layouts import LAYOUTS
from ..scenes.mixed import MIXED, RAW_MIXED
from ..scenes.raw import RawScene
from ..scenes.raw_catalogue import AIR, RAW_SCENES
from ..scenes.scene import Scene
from ..scenes.whole_rails import WHOLE
from .airborne import survey_figures
from .alignments import fit_figures
from .classification import score
from .clearance import clearance_figures
from .lines import Match, match
from .measuring import QUALITY_STEP_M, local_sigma

AnyScene = Union[Scene, RawScene, FlownScene, TrackScene, GaugeScene]

DRAWN: dict[str, Callable[..., Scene]] = {**SCENES, **ADVERSARIAL, **LAYOUTS, **WHOLE, **MIXED}
"""Scenes of classified points, by name."""

RAW, GUIDED, FITTED, SWEPT = "raw ", "guide ", "fit ", "gauge "
"""What the names of raw scenes begin with, of scenes that are flown, of tracks to which alignments are fitted, and of
scenes through which a profile is swept."""

SEEDED: dict[str, tuple[Callable[[int], AnyScene], int]] = {
    **{RAW + name: (make, 2026) for name, make in {**RAW_SCENES, **RAW_MIXED}.items()},
    **{GUIDED + name: (make, 3) for name, make in FLOWN.items()},
    **{FITTED + name: (make, 7) for name, make in TRACKS.items()},
    **{SWEPT + name: (make, 5) for name, make in GAUGES.items()},
}
"""Other scenes, by name, and their seeds."""

PLACES = (*DRAWN, *SEEDED)
"""Every scene of the table."""

QUICK = (
    *("straight", "tram", "turnout_7", "turnout_26", "crossover", "dual_gauge", "noisy", "sparse"),
    *("ballast", "platform", "gaps", "thin_points", "strips_meet", "double_slip", "three_way_apart", "side_30"),
    *("crossing", "standing_train", "grooved", "near_tracks", "flyover", "parked_train"),
    *("whole_tenth", "whole_side", "whole_turnout", "mixed_half_scanned"),
    *("raw turnout 1:9", "raw metro", "raw crossing", "raw air 80", "raw photo curve", "raw car park"),
    *(GUIDED + name for name in FLOWN),
    *(FITTED + name for name in TRACKS),
    *(SWEPT + name for name in GAUGES),
)
"""Scenes that a test runs: at least one for each kind of place."""

FORK_REACH_M = 5.0
"""A branch whose line begins further from where it truly begins counts as this far off."""

SAME_PLACE_M = 0.01
"""A true track that begins this close to another one branches off there."""

Figures = dict[str, float]


@dataclass(frozen=True)
class Variant:
    """One way in which every scene is run: a model, an engine, and the scenes that are run so.

    `seed_shift` is added to the seed of every scene; it is even, because odd seeds look from the other side in some.
    Every installation has OpenCV. `tolerances` replace those of the table.
    """

    name: str
    model: str = "fast"
    seed_shift: int = 0
    engine: str = "OPENCV"
    places: tuple[str, ...] = PLACES
    tolerances: Mapping[str, float] = field(default_factory=dict, hash=False)


PLAIN = Variant("as published")
TORCH = Variant("PyTorch", engine="TORCH", places=("throat",), tolerances={"bridged m": 0.7})
"""Engines round differently, and the cells of this scene differ by enough to draw other lines.

bfloat16 rounds differently with the instructions that a processor has: 41.1 m of the 20 rails are bridged in float32
with each of five sets of instructions, and 41.6, 41.8, 42.0 and 42.3 m in bfloat16 with four. All other figures stay
within the table's tolerances.
"""

VARIANTS = (
    PLAIN,
    TORCH,
    Variant("base model", model="base", places=tuple(DRAWN)),
    *(Variant(f"seed {1 + number}", seed_shift=100 * (1 + number)) for number in range(3)),
)


@dataclass(frozen=True)
class Difference:
    """A figure that moved by more than its tolerance."""

    scene: str
    figure: str
    before: float
    now: float

    def __str__(self) -> str:
        """Write scene, figure, before and now."""
        return f"{self.scene:<24}{self.figure:<16}{self.before:>10.2f} -> {self.now:.2f}"


def build_scene(place: str, seed_shift: int = 0) -> AnyScene:
    """Build one scene of `PLACES`, from a seed other than its own if `seed_shift` is not 0."""
    if place in SEEDED:
        build, seed = SEEDED[place]
        return build(seed + seed_shift)
    make = DRAWN[place]
    return make(seed=inspect.signature(make).parameters["seed"].default + seed_shift)


def parameters_of(scene: Scene, variant: Variant = PLAIN) -> Parameters:
    """Return the parameters with which the scenes of the table are extracted."""
    standard = scene.standard
    return Parameters(
        standard.gauge_m,
        standard.head_width_m,
        other_gauges_m=scene.other_gauges_m,
        quality_step_m=QUALITY_STEP_M,
        model=variant.model,
        engine=variant.engine,
    )


def figures_of(place: str, scene: AnyScene, variant: Variant = PLAIN) -> Figures:
    """Run one scene of `PLACES` and measure what comes out."""
    if isinstance(scene, TrackScene):
        return fit_figures(scene)
    if isinstance(scene, FlownScene):
        return survey_figures(scene)
    if isinstance(scene, GaugeScene):
        return clearance_figures(scene)
    if isinstance(scene, RawScene):
        return _raw_figures(scene, wide=place[len(RAW) :] in AIR)
    return line_figures(scene, extract_rails([scene.rail_points()], parameters_of(scene, variant)))


def line_figures(scene: Scene, network: RailNetwork) -> Figures:
    """Measure the lines that were extracted from a scene.

    Shares are in per cent of lengths within 5 cm, errors in millimetres (rms); `wrong m` is the length of rails away
    from every true one, `fork m` the distance between the places where branches begin and where they truly begin (rms),
    `bridged m` the length of rails that was drawn without points, and `said` the number of warnings.
    """
    rails, tracks = (
        match([scene.frame.to_local(network.frame.to_crs(line.xyz)) for line in lines], truth)
        for lines, truth in ((network.rails, scene.rails), (network.centerlines, scene.centerlines))
    )
    sigma_m = local_sigma(network.rails, rails)
    ends = [scene.frame.to_local(network.frame.to_crs(line.xyz[[0, -1]])) for line in network.centerlines]
    return {
        **_shares_and_errors("", rails),
        "height mm": 1000 * rails.within(0.05).height_rmse_m,
        "in 1 s %": 100 * rails.share_within(sigma_m),
        "in 2 s %": 100 * rails.share_within(2 * sigma_m),
        "rails": len(network.rails),
        "bridged m": sum(rail.bridged_m for rail in network.rails),
        **_shares_and_errors("track ", tracks),
        "tracks": len(network.centerlines),
        "fork m": _fork_error(scene.centerlines, ends),
        "said": len(network.warnings),
    }


def _shares_and_errors(prefix: str, found: Match) -> Figures:
    near = found.within(0.05)
    return {
        f"{prefix}found %": 100 * near.completeness,
        f"{prefix}right %": 100 * near.correctness,
        f"{prefix}wrong m": found.wrong_m(),
        f"{prefix}across mm": 1000 * near.lateral_rmse_m,
    }


def _fork_error(truth: Sequence[np.ndarray], ends: Sequence[np.ndarray]) -> float:
    """Return by how much the beginnings of branches are off, metres rms; NaN without branches.

    A true centerline that begins or ends on another is a branch; `ends`, (2, 3) each, are those of the lines that were
    found.
    """
    forks = [
        tip[:2]
        for number, line in enumerate(truth)
        for tip in line[[0, -1]]
        if match([tip + [[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]]], [*truth[:number], *truth[number + 1 :]]).back.distance[0]
        < SAME_PLACE_M
    ]
    if not forks or not ends:
        return FORK_REACH_M if forks else np.nan
    found = np.concatenate(ends)[:, :2]
    off_m = [min(float(np.hypot(*(found - fork).T).min()), FORK_REACH_M) for fork in forks]
    return float(np.sqrt(np.mean(np.square(off_m))))


def _raw_figures(scene: RawScene, wide: bool) -> Figures:
    """Find the rail points of a raw scene, and measure them."""
    result, _ = score(scene, wide)
    return {
        "recall %": 100 * result.recall,
        "precision %": 100 * result.precision,
        "wrong": result.wrong,
        "paired m": result.figures.paired_m,
        "single m": result.figures.single_m,
    }


def differences(
    place: str, before: Mapping[str, float], now: Mapping[str, float], tolerances: Mapping[str, float]
) -> list[Difference]:
    """List the figures of a scene that moved by more than their tolerance, or that only one side has."""
    pairs = {figure: (before.get(figure, np.nan), now.get(figure, np.nan)) for figure in tolerances}
    return [
        Difference(place, figure, *pair)
        for figure, pair in pairs.items()
        if not (abs(pair[0] - pair[1]) <= tolerances[figure] or np.isnan(pair).all())
    ]


class Golden:
    """The table on disk: by how much each figure may move, and the figures by variant, scene and name."""

    def __init__(self, path: Path) -> None:
        """Read the table."""
        content = json.loads(path.read_text("utf-8"))
        self.path = path
        self.tolerances: dict[str, float] = content["tolerances"]
        self.figures: dict[str, dict[str, Figures]] = content["figures"]

    def differences(self, variant: Variant, place: str, now: Mapping[str, float]) -> list[Difference]:
        """Compare the figures of a scene with the table."""
        return differences(
            place, self.figures.get(variant.name, {}).get(place, {}), now, {**self.tolerances, **variant.tolerances}
        )

    def put(self, variant: Variant, place: str, now: Mapping[str, float]) -> None:
        """Replace the figures of a scene."""
        unknown = set(now) - set(self.tolerances)
        if unknown:
            raise ValueError(f"State a tolerance for {', '.join(sorted(unknown))} in {self.path}.")
        rounded = {figure: round(float(value), 3) for figure, value in now.items() if np.isfinite(value)}
        self.figures.setdefault(variant.name, {})[place] = rounded

    def save(self) -> None:
        """Write the table, one line for each scene."""
        order = {place: number for number, place in enumerate(PLACES)}
        parts = []
        for variant, scenes in self.figures.items():
            rows = sorted((place for place in scenes if place in order), key=lambda place: order[place])
            lines = ",\n".join(f"   {json.dumps(place)}: {json.dumps(scenes[place])}" for place in rows)
            parts.append(f"  {json.dumps(variant)}: {{\n{lines}\n  }}")
        body = ",\n".join(parts)
        self.path.write_text(
            f'{{\n "tolerances": {json.dumps(self.tolerances)},\n "figures": {{\n{body}\n }}\n}}\n', "utf-8"
        )
