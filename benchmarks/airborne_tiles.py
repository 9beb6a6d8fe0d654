"""Print memory and time of `python -m rail_extract airborne` on folders of tiles of 1 km², each with all its points.

A double track runs along each row of eight tiles. Memory is that of the largest process, core-seconds are those of all
processes, reading included.

Usage: python benchmarks/airborne_tiles.py [--tiles 16 64] [--density 10] [--copc] [--workers 1]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pyogrio
from processes import processes
from rail_extract.laboratory.airborne.tiles import lay_tiles


def measured(folder: Path, guides: Path, workers: int) -> tuple[float, float, float, float, float]:
    """Run the command on a folder; return km of guides, share seen, core-seconds, seconds, and MiB of memory."""
    out = folder.with_suffix(".gpkg")
    words = [str(folder), "--guide", str(guides), "--centerlines", str(out), "--stations", str(out)]
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-m", "rail_extract", "airborne", *words, "--workers", str(workers)])
    _, status, used = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status:
        raise SystemExit("The command failed.")
    seen = pyogrio.raw.read(out, layer="stations", columns=["seen"])[3][0]
    return len(seen) / 100, seen.mean(), used.ru_utime + used.ru_stime, seconds, used.ru_maxrss / 1024


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiles", type=int, nargs="+", default=[16, 64], help="numbers of tiles (default: 16 64)")
    parser.add_argument("--density", type=float, default=10.0, help="points per square metre (default: 10)")
    parser.add_argument("--copc", action="store_true", help="COPC files instead of LAZ")
    parser.add_argument("--workers", type=int, default=1, help="processes (default: 1)")
    args = parser.parse_args()
    print("| tiles | points | track | seen | core-seconds per km | seconds per km | largest process |")
    print("|---|---|---|---|---|---|---|")
    for count in args.tiles:
        with tempfile.TemporaryDirectory() as folder:
            with processes(1) as other:  # a child begins with its parent's memory
                guides = other.submit(lay_tiles, Path(folder) / "tiles", count, args.density, args.copc).result()
            km, seen, core_s, seconds, mib = measured(Path(folder) / "tiles", guides, args.workers)
        points = f"{count * args.density:.0f} million"
        figures = f"{100 * seen:.1f} % | {core_s / km:.1f} | {seconds / km:.1f} | {mib:.0f} MiB"
        print(f"| {count} | {points} | {km:.0f} km | {figures} |", flush=True)


if __name__ == "__main__":
    main()
