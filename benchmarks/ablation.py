"""Switch rules off, one at a time, and print which figures of the golden table need each.

Run `python benchmarks/ablation.py [RULE ...] [--scenes SCENE ...] [--variant 'seed 1']`. A rule may be a part of a
name, as `tracks.`. In a scene in which a rule returns what its replacement returns, whenever it is called, it has no
effect and is not run again. `ablation_of_worlds.py` asks worlds drawn at random instead.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import defaultdict
from collections.abc import Sequence
from unittest.mock import patch

import numpy as np
from golden import TABLE
from processes import processes
from rail_extract.core.pipeline import drawing
from rail_extract.laboratory.ruler.golden import (
    PLACES,
    PLAIN,
    VARIANTS,
    Difference,
    Golden,
    build_scene,
    differences,
    figures_of,
)
from rules import SWITCHES, chosen_by, remembering, watched, without

SHOWN = 3
"""Differences printed for each rule: the largest, by their tolerances."""


def main() -> None:
    """Print a row for each rule."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rules", nargs="*", help="parts of the names of rules; default: all")
    parser.add_argument("--scenes", nargs="+", choices=PLACES, metavar="SCENE", default=PLACES)
    parser.add_argument("--variant", choices=[one.name for one in VARIANTS], default=PLAIN.name, help="model or seed")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (default: one per core)")
    arguments = parser.parse_args()
    chosen = [switch.name for switch in chosen_by(arguments.rules)]
    acts: dict[str, int] = defaultdict(int)
    needs: dict[str, list[Difference]] = defaultdict(list)
    with processes(arguments.workers) as pool:
        tasks = [(place, chosen, arguments.variant) for place in arguments.scenes]
        for (place, *_), found in zip(tasks, pool.map(ablate, tasks)):
            print(place, file=sys.stderr, flush=True)
            for name, moved in found.items():
                acts[name] += 1
                needs[name] += moved
                print(f"    {name}", *moved, sep="\n        ", file=sys.stderr, flush=True)
    print("| rule | acts in | figures that move without it |\n|---|---|---|")
    for name in chosen:
        print(f"| `{name}` | {acts[name]} of {len(tasks)} scenes | {_largest(needs[name])} |")


def _largest(moved: Sequence[Difference]) -> str:
    """Write the largest differences, and the number of scenes."""
    tolerances = Golden(TABLE).tolerances
    ordered = sorted(
        moved, key=lambda one: -abs(np.nan_to_num(one.now - one.before, nan=1e6)) / (tolerances[one.figure] or 0.01)
    )
    shown = "; ".join(f"{one.scene}: {one.figure} {one.before:.4g} → {one.now:.4g}" for one in ordered[:SHOWN])
    more = len({one.scene for one in moved}) - len({one.scene for one in ordered[:SHOWN]})
    return (shown or "none") + (f"; {more} more scenes" if more > 0 else "")


def ablate(task: tuple[str, Sequence[str], str]) -> dict[str, list[Difference]]:
    """Run a scene with all rules and without each; returns the figures that moved, by the rules that have an effect."""
    place, names, name = task
    variant = next(one for one in VARIANTS if one.name == name)
    scene = build_scene(place, variant.seed_shift)
    chosen = [switch for switch in SWITCHES if switch.name in names]
    effective: set[str] = set()
    tolerances = Golden(TABLE).tolerances
    with patch.object(drawing, "clean_square", remembering(drawing.clean_square)):
        with watched(chosen, effective):
            before = figures_of(place, scene, variant)
        found = {}
        for switch in (switch for switch in chosen if switch.name in effective):
            with without(switch):
                try:
                    now = figures_of(place, scene, variant)
                except Exception as error:  # noqa: BLE001 - whatever happens without a rule is its effect
                    print(f"{place} without {switch.name}: {error}", file=sys.stderr)
                    now = {}
            found[switch.name] = differences(place, before, now, tolerances)
    return found


if __name__ == "__main__":
    main()
