"""Run every scene and compare its figures with `golden.json`, or write them there.

Run `python benchmarks/golden.py [SCENE ...] [--all] [--write]`. `--all` adds the base model and three other seeds.
Scenes with PyTorch are run where it is installed.
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib.util import find_spec
from pathlib import Path

from processes import processes
from rail_extract.laboratory.ruler.golden import (
    PLACES,
    PLAIN,
    TORCH,
    VARIANTS,
    Figures,
    Golden,
    Variant,
    build_scene,
    figures_of,
)

TABLE = Path(__file__).with_name("golden.json")

Key = tuple[Variant, str]


def main() -> None:
    """Compare or write; the exit status is 1 if a figure moved by more than its tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*PLACES, []], metavar="SCENE", help="default: all")
    parser.add_argument("--all", action="store_true", help="with the base model and with three other seeds, too")
    parser.add_argument("--write", action="store_true", help="replace the figures in the table")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (default: one per core)")
    arguments = parser.parse_args()
    golden = Golden(TABLE)
    keys = [
        (variant, place)
        for variant in (VARIANTS if arguments.all else (PLAIN, TORCH))
        for place in variant.places
        if place in (arguments.scenes or PLACES) and (variant.engine != TORCH.engine or find_spec("torch"))
    ]
    different = 0
    with processes(arguments.workers) as pool:
        for (variant, place), now in zip(keys, pool.map(_run, keys)):
            for difference in golden.differences(variant, place, now):
                print(f"{variant.name:<14}{difference}", flush=True)
                different += 1
            print(f"{variant.name}, {place}", file=sys.stderr, flush=True)
            if arguments.write:
                golden.put(variant, place, now)
                golden.save()
    print(f"{len(keys)} scenes, {different} figures differ{' and were written' if arguments.write else ''}.")
    sys.exit(bool(different) and not arguments.write)


def _run(key: Key) -> Figures:
    """Run one scene; a task of a worker."""
    variant, place = key
    return figures_of(place, build_scene(place, variant.seed_shift), variant)


if __name__ == "__main__":
    main()
