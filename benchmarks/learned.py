"""Compare rail points found by geometry and by a trained network, scene by scene.

Run `python benchmarks/learned.py labelled FOLDER` to write the labelled tiles of the published training, train with
`python -m rail_extract train-classifier FOLDER --weights rails.npz --card rails.html --epochs 6`, and then run
`python benchmarks/learned.py compare rails.npz [SCENE ...]`. The tiles are scenes of the kinds in `LEARNED`, `IMAGES`
and `AIR`, and places without rails, with other seeds than those of the comparison.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rail_extract.core.frame import LocalFrame
from rail_extract.core.standards import RAIL_CLASS
from rail_extract.laboratory.ruler.classification import Score, score, truth
from rail_extract.laboratory.scenes.raw import RawScene
from rail_extract.laboratory.scenes.raw_catalogue import AIR, RAW_SCENES, TRAIN, double_track, turnout
from rail_extract.laboratory.scenes.raw_scanner import RawScanner
from rail_extract.laboratory.scenes.scene import Scene
from rail_extract.laboratory.scenes.write import write_cloud

SEED, SEEDS, EMPTY_SEEDS = 2026, (11, 12), (11,)
"""Seed of the comparison, and seeds of the training, with rails and without."""

LEARNED = (
    *("double", "two passes", "fast", "station", "turnout 1:9", "turnout 1:18.5", "yard", "metro", "viaduct"),
    "far track",
)
"""Scenes with rails that the training has seen with other seeds."""

EMPTY = ("forest", "street", "car park", "quarry")
"""Scenes without rails that the training has seen."""

IMAGES = ("photo straight", "photo curve", "photo curve blunt", "photo turnout", "photo station")
EMPTY_IMAGES = ("photo street", "photo quarry", "photo motorway", "photo kerbs", "photo farmland")
"""Surveys by images that the training has seen, with rails and without."""

APART_M, COLUMNS = 200.0, 6
"""Distance between the labelled tiles, and tiles in a row."""

NOISY = replace(TRAIN, noise_m=0.010)
SPARSE = replace(TRAIN, profile_step_m=0.15, ray_step_rad=0.0066)

ROADSIDE = RawScanner(profile_step_m=0.05, ray_step_rad=0.0024, left_m=-6.5, height_m=1.6, noise_m=0.006)
"""A car on a road that runs along the tracks: rails are seen from the side, those behind at a grazing angle."""

OTHERS: dict[str, Callable[[int], RawScene]] = {
    "double, noise 10 mm": lambda seed: double_track(seed, NOISY, None, "noisy"),
    "double, a ninth of the points": lambda seed: double_track(seed, SPARSE, None, "sparse"),
    "turnout, noise 10 mm": lambda seed: turnout(seed, scanner=NOISY),
}
"""Scenes of the scanner of the training with another noise and spacing."""

BESIDE = {"double, from a road beside": lambda seed: double_track(seed, ROADSIDE, None, "roadside")}

SCENES = {**RAW_SCENES, **OTHERS, **BESIDE}

COMPARED = {
    "seen in training, other seed": ("double", "station", "turnout 1:9", "yard", "viaduct", "far track"),
    "surveys by images, other seed": IMAGES,
    "from the air, other seed": tuple(AIR),
    "other track": ("narrow", "dual gauge", "crossing", "tram"),
    "other noise or spacing": tuple(OTHERS),
    "other scanner, on a road": tuple(BESIDE),
    "no rails": (
        *("car park", "street from the air", "quarry"),
        *("photo street", "photo motorway", "photo kerbs", "photo building site", "photo farmland"),
    ),
}
"""Scenes of the published comparison, by what the training has not seen of them."""


def main() -> None:
    """Write the labelled tiles, or print a row for each scene and method."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("task", choices=("labelled", "compare"))
    parser.add_argument("path", type=Path, help="folder for the tiles, or weights")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="to compare; default: those published")
    arguments = parser.parse_args()
    if arguments.task == "labelled":
        write_labelled(arguments.path)
    else:
        compare(arguments.path, arguments.scenes)


def write_labelled(folder: Path) -> None:
    """Write the scenes of the training as tiles beside each other, with their rail points classified."""
    folder.mkdir(parents=True, exist_ok=True)
    rails, empty = (*LEARNED, *IMAGES, *AIR), EMPTY + EMPTY_IMAGES
    jobs = [(name, seed) for seed in SEEDS for name in rails] + [(name, seed) for seed in EMPTY_SEEDS for name in empty]
    for number, (name, seed) in enumerate(jobs):
        raw = RAW_SCENES[name](seed)
        head, _ = truth(raw, np.zeros(len(raw.xyz), dtype=bool), False)
        row, column = divmod(number, COLUMNS)
        origin = np.array([500_000 + APART_M * column, 5_000_000 + APART_M * row, 100.0])
        labels = np.where(head, RAIL_CLASS, 1).astype(np.uint8)
        scene = Scene(name, raw.xyz, labels, (), (), raw.standard, LocalFrame(origin))
        write_cloud(scene, folder / f"{name.replace(' ', '_').replace(':', '-')}_{seed}.laz")


def compare(weights: Path, names: list[str]) -> None:
    """Print recall, precision and seconds of both methods."""
    groups = {"chosen": tuple(names)} if names else COMPARED
    print(f"{'scene':<32}{'Mio':>6}{'recall':>9}{'':>9}{'precision':>11}{'':>9}{'wrong':>8}{'':>8}{'s/Mio':>7}")
    print(
        f"{'':<38}{'geom.':>9}{'learned':>9}{'geom.':>11}{'learned':>9}{'geom.':>8}{'learned':>8}{'geom.':>7}{'learned':>9}"
    )
    for group, members in groups.items():
        print(group)
        for name in members:
            scene = SCENES[name](SEED)
            both = [score(scene, name in AIR, chosen)[0] for chosen in (None, weights)]
            print(row(name, *both), flush=True)


def row(name: str, geometry: Score, learned: Score) -> str:
    """Format a scene."""
    millions = geometry.points / 1e6
    figures = [
        *(f"{number(one.recall):>9}" for one in (geometry, learned)),
        f"{number(geometry.precision):>11}{number(learned.precision):>9}",
        *(f"{one.wrong:>8}" for one in (geometry, learned)),
        f"{geometry.seconds / millions:>7.1f}{learned.seconds / millions:>9.1f}",
    ]
    return f"  {name:<30}{millions:>6.2f}" + "".join(figures)


def number(value: float) -> str:
    """Format a share; a dash where there is none."""
    return f"{value:.3f}" if np.isfinite(value) else "-"


if __name__ == "__main__":
    main()
