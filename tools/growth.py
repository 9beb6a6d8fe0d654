"""Run Extract Rails many times in one process, as a long QGIS session does, and print the memory that it holds.

`. build/environment.sh; .venv/bin/python tools/growth.py 200` runs it two hundred times on 20 m of track, with all
outputs, and exits with 1 if the memory grew by more than `MAX_GROWTH_MB` after the first tenth of the runs.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from fuzzing.layers import Listener, qgis
from qgis.core import QgsProcessingContext
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.plain import spacing
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.scene import Plan, build
from rail_extract.laboratory.scenes.tracks import Track
from rail_extract.laboratory.scenes.write import write_cloud

MAX_GROWTH_MB = 10.0
"""Growth that the allocator alone may cause: a leak of one layer or raster per run is more in two hundred runs."""

LENGTH_M = 20.0
"""Length of the track."""


def resident_mb() -> float:
    """Return the memory that this process holds, in megabytes, without what is free and could be given back."""
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def write_track(path: Path) -> None:
    """Write a cloud of a short track."""
    standard, curve = STANDARDS["EN_60E1_1435"], trace([Element(LENGTH_M)], heading=0.05)
    plan = Plan([Track(curve, spacing(standard), np.zeros(len(curve.xy)))], standard, Scanner(profile_step_m=0.08))
    write_cloud(build("short", plan, np.random.RandomState(4)), path)


def run_once(cloud: Path, folder: Path) -> None:
    """Extract rails, tracks, stations, findings, report and cleaned raster into files.

    Raises RuntimeError if the run failed, or found no rails.
    """
    algorithm = qgis().processingRegistry().createAlgorithmById("railextract:extractrails")
    suffixes = {"REPORT": "html", "CLEANED": "tif"}
    outputs = ("RAILS", "CENTERLINES", "QUALITY", "FINDINGS", *suffixes)
    parameters = {name: str(folder / f"{name}.{suffixes.get(name, 'gpkg')}") for name in outputs}
    context, listener = QgsProcessingContext(), Listener()
    results, done = algorithm.run({"INPUT": str(cloud), **parameters}, context, listener)
    if not done or not results["RAIL_COUNT"]:
        raise RuntimeError("\n".join(listener.errors))


def main() -> int:
    """Run, print the memory, and return 1 if it grew."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=200, help="number of runs (default: 200)")
    times = parser.parse_args().times
    held = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_track(folder / "cloud.laz")
        start = time.monotonic()
        print(f"{'runs':>5} {'MB held':>8} {'seconds':>8}")
        for number in range(1, times + 1):
            run_once(folder / "cloud.laz", folder)
            gc.collect()
            held.append(resident_mb())
            if number == 1 or number % 20 == 0:
                print(f"{number:5} {held[-1]:8.1f} {time.monotonic() - start:8.0f}", flush=True)
    grown = held[-1] - held[len(held) // 10]
    print(f"Growth from run {len(held) // 10 + 1} to run {times}: {grown:.1f} MB")
    return int(grown > MAX_GROWTH_MB)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # without QGIS's own end, which needs the interpreter
