"""Print how long the sample takes: the whole `qgis_process` call, and the stages of the walk inside it.

Run `make -s env` and set what it prints, then `python benchmarks/speed.py`. Times are of this machine at this moment:
compare rows of one run, not of two.
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

from rail_extract.core import pipeline
from rail_extract.core.points import read_rail_points
from rail_extract.core.standards import resolve

SAMPLE = Path(__file__).resolve().parent.parent / "resources" / "sample" / "sample.laz"
STANDARD = "IN_75R_1000"
STAGES = (
    "load_arrays",
    "make_engine",
    "rasterize",
    "clean",
    "vectorize",
    "smooth_network",
    "refine",
    "elevate",
    "thin",
)
STAGES += ("build_centerlines",)


def main() -> None:
    """Time the stages, then whole calls."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="whole calls (default 3)")
    runs = parser.parse_args().runs
    seconds, description = stages()
    print(f"Stages on the sample, with {description}")
    for name, spent in seconds.items():
        print(f"  {name:20}{spent:7.2f} s")
    print(f"  {'sum':20}{sum(seconds.values()):7.2f} s")
    print(f"Peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")
    if "QGIS_PROCESS" not in os.environ:
        sys.exit("QGIS_PROCESS is not set: run `make -s env` and set what it prints to time whole calls.")
    whole = sorted(whole_call() for _ in range(runs))
    print(f"Whole qgis_process calls: {', '.join(f'{spent:.1f}' for spent in whole)} s")


def stages() -> tuple[dict[str, float], str]:
    """Run the walk with a clock on each of its steps; give seconds by step and what ran the network."""
    spent: Counter[str] = Counter()

    def timed(name, function):
        def run(*arguments, **options):
            start = time.perf_counter()
            try:
                return function(*arguments, **options)
            finally:
                spent[name] += time.perf_counter() - start

        return run

    standard = resolve(STANDARD)
    clouds = timed("read_rail_points", read_rail_points)(SAMPLE, [10])
    for name in STAGES:
        setattr(pipeline, name, timed(name, getattr(pipeline, name)))
    network = pipeline.extract_rails(clouds, pipeline.Parameters(standard.gauge_m, standard.head_width_m))
    return dict(spent), network.engine


def whole_call() -> float:
    """Run Extract Rails in real QGIS, from its start to its end; give seconds."""
    with tempfile.TemporaryDirectory() as folder:
        outputs = [f"{name}={Path(folder) / name.lower()}.gpkg" for name in ("RAILS", "CENTERLINES")]
        words = [f"INPUT={SAMPLE}", f"STANDARD={STANDARD}", *outputs]
        start = time.perf_counter()
        run = subprocess.run(
            [os.environ["QGIS_PROCESS"], "run", "railextract:extractrails", "--", *words],
            capture_output=True,
            text=True,
        )
        if run.returncode:
            sys.exit(f"qgis_process ended with {run.returncode}:\n{run.stdout}\n{run.stderr}")
        return time.perf_counter() - start


if __name__ == "__main__":
    main()
