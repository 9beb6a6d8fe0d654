"""Print the time of each step on the sample, and the speed and exactness of the shortcuts in the network.

Run `eval "$(make -s env)"`, then `python benchmarks/speed.py`. Times depend on the machine and its load: compare rows
of one run only. On a shared machine, `--clock cpu` counts the processor time of this process.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

START = time.perf_counter()

from rail_extract.core import pipeline  # noqa: E402
from rail_extract.core.clouds.points import read_rail_points  # noqa: E402
from rail_extract.core.frpdf import ENGINES  # noqa: E402
from rail_extract.core.frpdf.models import NAMES, choose  # noqa: E402
from rail_extract.core.frpdf.weights import load_arrays  # noqa: E402
from rail_extract.core.squares import steps  # noqa: E402
from rail_extract.core.standards import resolve  # noqa: E402
from speed_network import CLOCKS, Cut, cells_table, changes_table, speed_table  # noqa: E402

IMPORT_SECONDS = time.perf_counter() - START

SAMPLE = Path(__file__).resolve().parent.parent / "resources" / "sample" / "sample.laz"
STANDARD = "IN_75R_1000"
CUT = (578_204.0, 2_494_295.0, 578_228.0, 2_494_309.5)
"""About 24 m of the southern track of the sample."""
STEPS = (
    "load_arrays",
    "make_engine",
    "rasterize",
    "clean",
    "vectorize",
    "smooth_network",
    "refine",
    "elevate",
    "finished",
)
PARTS = ("stages", "network", "changes", "calls")


def main() -> None:
    """Print the chosen parts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help=f"of {', '.join(PARTS)} (default all)")
    parser.add_argument(
        "--runs", type=int, default=3, help="number of whole calls and rounds of the network (default 3)"
    )
    parser.add_argument("--model", choices=NAMES, default=pipeline.Parameters.model, help="weights of the network")
    parser.add_argument("--engine", choices=ENGINES, default=pipeline.Parameters.engine, help="engine of the steps")
    parser.add_argument("--clock", choices=CLOCKS, default="wall", help="clock for steps and network")
    arguments = parser.parse_args()
    parts, clock = arguments.parts or PARTS, CLOCKS[arguments.clock]
    spent = 0.0
    if "stages" in parts:
        spent = print_stages(clock, arguments.model, arguments.engine)
    if "network" in parts:
        print(*speed_table(sample_cut(arguments.model), arguments.runs, clock), "", *cells_table(), "", sep="\n")
    if "changes" in parts:
        print(*changes_table(sample_cut(arguments.model)), "", sep="\n")
    if "calls" in parts:
        print_calls(arguments.runs, spent, arguments.model, arguments.engine)


def print_stages(clock, model: str, engine: str) -> float:
    """Print the seconds of each step, imports included, and return their sum."""
    seconds, description = stages(clock, model, engine)
    seconds = {"import": IMPORT_SECONDS, **seconds}
    print(f"Steps on the sample, with {description}")
    for name, spent in seconds.items():
        print(f"  {name:20}{spent:7.2f} s")
    print(f"  {'sum':20}{sum(seconds.values()):7.2f} s")
    print(f"Peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB\n")
    return sum(seconds.values())


def print_calls(runs: int, walk_s: float, model: str, engine: str) -> None:
    """Print the seconds of whole calls, and the part of them outside the extraction."""
    if "QGIS_PROCESS" not in os.environ:
        sys.exit('QGIS_PROCESS is not set: run `eval "$(make -s env)"` to time whole calls.')
    starts = sorted(_call("help", "railextract:extractrails") for _ in range(runs))
    whole = sorted(whole_call(model, engine) for _ in range(runs))
    print(f"Whole qgis_process calls: {', '.join(f'{spent:.1f}' for spent in whole)} s")
    print(f"  start of QGIS and the plugin: {starts[0]:.1f} s")
    if walk_s:
        print(f"  reading parameters and writing: {whole[0] - starts[0] - walk_s:.1f} s")


def stages(clock, model: str, engine: str) -> tuple[dict[str, float], str]:
    """Extract the sample with a clock on each step; return seconds by step and the engine."""
    spent: Counter[str] = Counter()

    def timed(name, function):
        def run(*arguments, **options):
            start = clock()
            try:
                return function(*arguments, **options)
            finally:
                spent[name] += clock() - start

        return run

    standard = resolve(STANDARD)
    clouds = timed("read_rail_points", read_rail_points)(SAMPLE, [10])
    for name in STEPS:
        setattr(steps, name, timed(name, getattr(steps, name)))
    pipeline.tracks_of = timed("tracks_of", pipeline.tracks_of)
    parameters = pipeline.Parameters(standard.gauge_m, standard.head_width_m, model=model, engine=engine)
    network = timed("whole walk", pipeline.extract_rails)(clouds, parameters)
    named = sum(spent[name] for name in (*STEPS, "tracks_of"))
    spent["joining and all else"] = spent.pop("whole walk") - named
    return dict(spent), network.engine


def sample_cut(model: str) -> Cut:
    """Read the section of the sample on which the network is measured."""
    standard = resolve(STANDARD)
    parameters = pipeline.Parameters(standard.gauge_m, standard.head_width_m, simplify_xy_m=0.0, simplify_z_m=0.0)
    arrays = load_arrays(choose(standard.gauge_m, standard.head_width_m, model).path)
    return Cut(read_rail_points(SAMPLE, [10], extent=CUT)[0], parameters, arrays)


def whole_call(model: str, engine: str) -> float:
    """Run Extract Rails in QGIS, from start to end, and return the seconds."""
    with tempfile.TemporaryDirectory() as folder:
        outputs = [f"{name}={Path(folder) / name.lower()}.gpkg" for name in ("RAILS", "CENTERLINES")]
        words = [f"INPUT={SAMPLE}", f"STANDARD={STANDARD}", f"MODEL={model}", f"ENGINE={engine}", *outputs]
        return _call("run", "railextract:extractrails", "--", *words)


def _call(*words: str) -> float:
    """Run `qgis_process` and return the seconds."""
    start = time.perf_counter()
    run = subprocess.run([os.environ["QGIS_PROCESS"], *words], capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"qgis_process ended with {run.returncode}:\n{run.stdout}\n{run.stderr}")
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
