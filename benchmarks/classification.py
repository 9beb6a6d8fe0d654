"""Print how well rail points are found in raw clouds, what lines they give, and how long a large cloud takes.

Run `python benchmarks/classification.py [--seed N] [--lines] [SCENE ...]`. Thresholds were chosen on seeds 1 to 9; the
published tables are those of the default seed. `--large 50` classifies tiles of 50 million points in all with the
command `classify`, by one process and by two; `--stages 4` prints the processor time of each stage of it. Compare rows
of the same run only.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from processes import processes
from rail_extract.__main__ import main as main_of_commands
from rail_extract.core.classify import bars, cells, square
from rail_extract.core.clouds.las import laspy
from rail_extract.core.frpdf.models import NAMES
from rail_extract.core.labelling import files, finding
from rail_extract.core.parameters import Parameters
from rail_extract.laboratory.ruler.classification import Score, hectares, lines_from, score
from rail_extract.laboratory.ruler.lines import Match
from rail_extract.laboratory.scenes.raw_catalogue import AIR, RAW_SCENES
from stopwatch import Stopwatch

SEED = 2026

HEADER = (
    "Points on railheads (recall) and labelled points on them or right beside (precision); wrong: labelled points "
    "elsewhere.\nLines: share of the true length found, and of the lines' length right, within 5 cm; errors in mm; "
    "metres of lines\nelsewhere, per hectare. Heights of surveys by images (photo) are compared with the blunted ridge."
)


def main() -> None:
    """Print a row for each scene named on the command line, or for all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(RAW_SCENES)}")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the scenes (default {SEED})")
    parser.add_argument("--lines", action="store_true", help="extract lines from the labelled points as well")
    parser.add_argument("--model", choices=NAMES, default=Parameters.model, help="weights that draw the lines")
    parser.add_argument("--large", type=float, metavar="MIO", help="million points of a large cloud to measure instead")
    parser.add_argument("--stages", type=float, metavar="MIO", help="million points whose stages to measure instead")
    arguments = parser.parse_args()
    if arguments.large:
        measure_large(arguments.large, arguments.seed)
        return
    if arguments.stages:
        measure_stages(arguments.stages, arguments.seed)
        return
    print(HEADER)
    print(
        f"{'scene':<22}{'Mio':>6}{'recall':>8}{'prec.':>8}{'wrong':>7}{'s/Mio':>7}{'MiB':>6}{'cells/m':>8}"
        f"{'found %':>10}{'right %':>9}{'across':>8}{'height':>8}{'lines':>8}{'m/ha':>7}"
    )
    for name in arguments.scenes or RAW_SCENES:
        with processes(1) as pool:
            result = pool.submit(measured, name, arguments.seed, arguments.model if arguments.lines else None).result()
            print(row(name, *result), flush=True)


TILES = 10
"""Files of the large cloud."""

APART_M = 82.0
"""Distance between the copies of the scene in the large cloud."""


def measure_large(millions: float, seed: int) -> None:
    """Write a large cloud and print the run times and the memory of the command `classify`."""
    with tempfile.TemporaryDirectory() as folder:
        raw, new = Path(folder) / "raw", Path(folder) / "new.vpc"
        raw.mkdir()
        count = _write_tiles(raw, millions, seed)
        print(f"{'workers':<10}{'Mio':>6}{'s':>8}{'CPU s':>8}{'CPU s/Mio':>10}{'MiB of one process':>20}")
        for workers in (1, 2):
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            command = [sys.executable, "-m", "rail_extract", "classify", raw, "--output", new, "--workers", workers]
            subprocess.run([str(word) for word in command], check=True, capture_output=True)
            seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            print(
                f"{workers:<10}{count / 1e6:>6.1f}{seconds:>8.0f}{cpu_s:>8.0f}{cpu_s / count * 1e6:>10.2f}"
                f"{after.ru_maxrss / 1024:>20.0f}",
                flush=True,
            )
            shutil.rmtree(new.with_suffix(""))


STAGES = (
    (finding, "read_stored", "reading and decompressing"),
    (finding, "_sort_file", "sorting into squares on disk"),
    (finding, "read_stored", "reading the squares"),
    (finding, "search_square", "joining the steps of the search"),
    (square.Bed, "under", "1 bed"),
    (square.Grid, "around", "2 tops"),
    (square, "tops_of", "2 tops"),
    (cells.Candidates, "find", "2 tops"),
    (cells, "on_lines", "3 lines"),
    (square, "free_standing", "4 sides"),
    (cells, "with_pairs", "5 partner"),
    (cells, "on_rails", "6 pieces"),
    (cells, "runs_inside", "5 partner"),
    (square, "on_bars", "7 labels"),
    (bars, "_with_kept_partners", "6 pieces"),
    (square, "on_ridges", "blunt heads"),
    (square, "on_low", "low heads"),
    (square, "flush_rails", "8 flush rails"),
    (square, "_standing_figures", "figures"),
    (square, "_flush_figures", "figures"),
    (files, "rewrite", "reading again, compressing and writing"),
)
"""Functions and the stages of docs/classification.md that they belong to."""


def measure_stages(millions: float, seed: int) -> None:
    """Write a large cloud, classify it in this process, and print the processor time of each stage."""
    watch = Stopwatch()
    for owner, function, stage in STAGES:
        watch.time(owner, function, stage)
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder) / "raw"
        raw.mkdir()
        count = _write_tiles(raw, millions, seed)
        with watch.stage("all else"):
            main_of_commands(["classify", str(raw), "--output", str(Path(folder) / "new.vpc"), "--workers", "1"])
    del watch.spent_s[""]
    names = list(dict.fromkeys([*(stage for *_, stage in STAGES), "all else"]))
    print("| stage | CPU s per million points |\n|---|---|")
    for name in names:
        print(f"| {name} | {watch.spent_s[name] / count * 1e6:.3f} |")
    print(f"| sum | {sum(watch.spent_s.values()) / count * 1e6:.3f} |")


def _write_tiles(folder: Path, millions: float, seed: int) -> int:
    """Write copies of a double track beside each other to tiles, and return the number of points."""
    xyz = RAW_SCENES["double"](seed).xyz
    copies = max(round(millions * 1e6 / len(xyz)), 1)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.001, 0.001, 0.001]
    for number, part in enumerate(np.array_split(np.arange(copies), min(TILES, copies))):
        with laspy.open(folder / f"{number}.laz", "w", header=header) as writer:
            for copy in part:
                points = laspy.ScaleAwarePointRecord.zeros(len(xyz), header=header)
                points.x, points.y, points.z = (xyz + [0.0, APART_M * copy, 0.0]).T
                writer.write_points(points)
    return copies * len(xyz)


def measured(name: str, seed: int, model: str | None) -> tuple[Score, Match | None, float]:
    """Measure one scene, its lines if a model is to draw them, and its hectares."""
    scene = RAW_SCENES[name](seed)
    result, rail = score(scene, wide=name in AIR)
    return result, None if model is None else lines_from(scene, rail, model), hectares(scene)


def row(name: str, result: Score, found: Match | None, area_ha: float) -> str:
    """Format the row of one scene."""
    millions = result.points / 1e6
    text = (
        f"{name:<22}{millions:>6.2f}{number(result.recall, 4):>8}{number(result.precision, 4):>8}{result.wrong:>7}"
        f"{result.seconds / millions:>7.2f}{result.peak_mib:>6.0f}{result.figures.cells_per_m:>8.1f}"
    )
    if found is None:
        return text
    near = found.within(0.05)
    return text + (
        f"{number(100 * near.completeness, 2):>10}{number(100 * near.correctness, 2):>9}"
        f"{number(1000 * near.lateral_rmse_m, 1):>8}{number(1000 * near.height_rmse_m, 1):>8}"
        f"{f'{near.line_count}:{near.truth_count}':>8}{found.wrong_m() / area_ha:>7.1f}"
    )


def number(value: float, digits: int) -> str:
    """Format a number; a dash where there is none."""
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


if __name__ == "__main__":
    main()
