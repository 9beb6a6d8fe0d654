"""Extract rails in worlds drawn at random, and print how many fail, why, and how many without a word.

Run `python benchmarks/worlds.py --from 1 --count 100 --jobs 2 [--kind raw]`. Each world appends a line of JSON to
`build/worlds/raw.jsonl` or `classified.jsonl`; worlds that are there already, made by the same code, are not run again.
`--seed 17` runs one world and writes its cloud, truth, lines and findings, and a picture of what went wrong. Seeds 1 to
2000 are for work; published figures come from seeds that nobody has looked at.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

from processes import processes
from rail_extract.laboratory.ruler.rates import Line, summary
from rail_extract.laboratory.ruler.worlds import Judged, run
from rail_extract.laboratory.worlds.world import CLOUDS, VERSION, World, make

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "build" / "worlds"

PARTS = ("core", "laboratory", "models")
"""Folders whose files decide what comes out of a world."""


def main() -> None:
    """Run worlds and print the summary, or run one and draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--from", type=int, default=1, dest="first", metavar="A", help="first seed (default 1)")
    parser.add_argument("--count", type=int, default=100, metavar="N", help="number of worlds (default 100)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="J", help="processes (default: cores)")
    parser.add_argument("--kind", choices=CLOUDS, action="append", help="kind of cloud (default: both)")
    parser.add_argument("--seed", type=int, metavar="S", help="run this world alone and write all there is of it")
    parser.add_argument("--into", type=Path, default=RESULTS, help="folder of the results (default: build/worlds)")
    arguments = parser.parse_args()
    arguments.into.mkdir(parents=True, exist_ok=True)
    for kind in arguments.kind or CLOUDS:
        if arguments.seed is not None:
            show(arguments.seed, kind, arguments.into)
        else:
            wanted = range(arguments.first, arguments.first + arguments.count)
            print(f"\n{kind} clouds", *summary(collect(wanted, kind, arguments.into, arguments.jobs)), sep="\n")


def collect(seeds: Sequence[int], kind: str, folder: Path, jobs: int) -> list[Line]:
    """Run the worlds that were not run by this code, append their lines to the file, and return all lines."""
    path, code = folder / f"{kind}.jsonl", fingerprint()
    known = {line["seed"]: line for line in written(path) if line["version"] == VERSION and line["code"] == code}
    missing = [seed for seed in seeds if seed not in known]
    with processes(max(jobs, 1)) as pool, path.open("a", encoding="utf-8") as file:
        tasks = [pool.submit(measured, seed, kind, code) for seed in missing]
        for number, task in enumerate(as_completed(tasks), start=1):
            line = task.result()
            known[line["seed"]] = line
            file.write(json.dumps(line) + "\n")
            file.flush()
            causes = "; ".join(fault["cause"] + " silently" * fault["silent"] for fault in line["faults"])
            print(f"{number} of {len(missing)}: world {line['seed']}: {causes or 'right'}", file=sys.stderr, flush=True)
    return [known[seed] for seed in seeds]


def written(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the lines of a file of results; one that a broken run left half written is left out."""
    if path.exists():
        for text in path.read_text("utf-8").splitlines():
            try:
                yield json.loads(text)
            except ValueError:
                continue


def fingerprint() -> str:
    """Return a name for the code that decides what comes out of a world."""
    total = hashlib.sha256()
    for part in PARTS:
        for path in sorted((ROOT / part).rglob("*")):
            if path.suffix in (".py", ".npz"):
                total.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return total.hexdigest()[:12]


def measured(seed: int, kind: str, code: str) -> dict[str, Any]:
    """Run one world; a task of a worker."""
    one_thread()
    world = make(seed, kind)
    return line_of(world, run(world), kind, code)


def one_thread() -> None:
    """Let OpenCV compute in one thread: several worlds run at a time."""
    import cv2

    cv2.setNumThreads(1)


def line_of(world: World, judged: Judged, kind: str, code: str) -> dict[str, Any]:
    """Return the line of JSON of a world."""
    faults = [
        {
            "cause": fault.cause,
            "figure": round(fault.figure, 4),
            "silent": fault.silent,
            "at": None if fault.xyz is None else [round(float(value), 2) for value in fault.xyz],
        }
        for fault in judged.faults
    ]
    head = {"seed": world.seed, "kind": kind, "version": VERSION, "code": code, "faults": faults}
    return {**head, **judged.figures, "world": world.describe()}


def show(seed: int, kind: str, folder: Path) -> None:
    """Run one world, and write its cloud, truth, lines and findings, and its picture."""
    from world_picture import draw

    world = make(seed, kind)
    judged = run(world)
    print(json.dumps(line_of(world, judged, kind, fingerprint()), indent=1))
    for path in draw(world, judged, folder / f"{kind}_{seed}"):
        print(path)


if __name__ == "__main__":
    main()
