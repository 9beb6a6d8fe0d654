"""Print the seconds of whole `qgis_process` calls, on the computer as it is and beside one and two busy programs.

Run `eval "$(make -s env)"`, then `python benchmarks/speed_calls.py [CALL ...]`. Each figure is the wall time of a call
and, in brackets, the processor time of all its processes; the shortest of the runs counts. The busy programs sort
arrays. Wall times hold for a computer without other load only; processor times hold on a shared one, too, except that
cores that share a part of the processor slow each other. This command writes the table of speed in the README.
`--clouds FOLDER --prepare` makes the clouds beforehand.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from rail_extract.core.polyline import Polyline
from rail_extract.laboratory.scenes.raw_catalogue import RAW_SCENES
from rail_extract.laboratory.scenes.write import write_raw
from scaling import lay_track
from speed import SAMPLE
from speed import STANDARD as SAMPLE_STANDARD

CRS, STANDARD = "EPSG:25832", "EN_60E1_1435"
SEED = 2026
"""Of the scanner in the raw scene."""

BUSY = "import numpy as np\nvalues = np.random.default_rng(0).random(2_000_000)\nwhile True: np.sort(values)"
"""A program that keeps one core busy, and takes what memory bandwidth it can get."""

LIMITING = ("OMP_", "OPENBLAS_", "MKL_", "OPENCV_FOR_", "RAYON_", "PYTHONDONTWRITEBYTECODE")
"""Beginnings of variables that would limit the threads of the calls from outside, or make each compile its modules."""

CPU_RATIO, WALL_RATIO = 1.15, 1.6
"""Most processor time, and most wall time on two cores, that a call may take beside one busy program, relative to the
call without: a core that is shared gives it a half, and the caches are shared, too."""


@dataclass(frozen=True)
class Call:
    """A whole call: its name in the table, its algorithm, its parameters in a folder, and the packages it needs."""

    name: str
    algorithm: str
    words: Callable[[Path], list[str]]
    needs: str = "numpy"


def _sample(engine: str) -> Callable[[Path], list[str]]:
    outputs = ("RAILS", "CENTERLINES")
    return lambda folder: [
        f"INPUT={SAMPLE}",
        f"STANDARD={SAMPLE_STANDARD}",
        f"ENGINE={engine}",
        *(f"{name}={folder / name.lower()}.gpkg" for name in outputs),
    ]


def _long(folder: Path) -> list[str]:
    tiles = folder / "tiles"
    if not tiles.exists():
        lay_track(tiles, 2.0)
    return [f"INPUT={tiles}", f"CRS={CRS}", f"STANDARD={STANDARD}", f"RAILS={folder / 'long.gpkg'}"]


def _raw(folder: Path) -> list[str]:
    cloud = folder / "raw.laz"
    if not cloud.exists():
        scene = RAW_SCENES["double"](SEED)
        write_raw(scene, cloud)
        (folder / "seeds.geojson").write_text(json.dumps(_seeds(scene)))
    return [f"INPUT={cloud}", f"CRS={CRS}", f"STANDARD={STANDARD}", f"OUTPUT={folder / 'classified.laz'}"]


def _seeds(scene) -> dict:
    """Return a layer with the middle of each rail of a scene."""
    middles = [line.resampled(line.length_m / 2).xyz[1] for line in map(Polyline, scene.rails)]
    places = scene.frame.to_crs(middles).tolist()
    features = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": place[:2]}}
        for place in places
    ]
    crs = {"type": "name", "properties": {"name": CRS}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}


CALLS = {
    "sample-torch": Call("sample, 960 m of rail, with PyTorch", "extractrails", _sample("TORCH"), "torch"),
    "sample-opencv": Call("sample, with OpenCV", "extractrails", _sample("OPENCV"), "cv2"),
    "long": Call("4 km of track, 1.0 million rail points", "extractrails", _long),
    "raw": Call("raw cloud, 1.3 million points, classified", "classifyrailpoints", _raw),
    "growing": Call(
        "the same, 4 rails grown", "growrailpoints", lambda folder: [*_raw(folder), f"SEEDS={folder / 'seeds.geojson'}"]
    ),
}


@dataclass(frozen=True)
class Spent:
    """Seconds of a call on the clock, and of all its processes on processors."""

    wall_s: float
    cpu_s: float


def main() -> None:
    """Print a row for each call, and whether it meets the limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("calls", nargs="*", metavar="CALL", help=f"of {', '.join(CALLS)} (default all)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each call, of which the shortest counts (3)")
    parser.add_argument("--busy", type=int, default=2, help="most busy programs beside a call (2)")
    text = "folder for the clouds, which stay there for the next time (default: a temporary one)"
    parser.add_argument("--clouds", type=Path, metavar="FOLDER", help=text)
    parser.add_argument("--prepare", action="store_true", help="make the clouds only, for a run with the same --clouds")
    arguments = parser.parse_args()
    if "QGIS_PROCESS" not in os.environ:
        sys.exit('QGIS_PROCESS is not set: run `eval "$(make -s env)"` to time whole calls.')
    unknown = set(arguments.calls) - set(CALLS)
    if unknown:
        sys.exit(f"There is no call {', '.join(sorted(unknown))}: choose from {', '.join(CALLS)}.")
    chosen = [call for name, call in CALLS.items() if name in (arguments.calls or CALLS) and find_spec(call.needs)]
    if arguments.prepare:
        if arguments.clouds is None:
            parser.error("--prepare needs --clouds")
        make_clouds(arguments.clouds, chosen)
        return
    print(f"{processor()}, {len(os.sched_getaffinity(0))} cores; seconds (processor seconds)\n", flush=True)
    for line in header(arguments.busy):
        print(line)
    with nullcontext(arguments.clouds.resolve()) if arguments.clouds else tempfile.TemporaryDirectory() as folder:
        make_clouds(Path(folder), chosen)
        for call in chosen:
            words = call.words(Path(folder))
            print(row(call.name, measured(call.algorithm, words, arguments.runs, arguments.busy)), flush=True)


def make_clouds(folder: Path, calls: Sequence[Call]) -> None:
    """Make the clouds of calls that are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for call in calls:
        call.words(folder)


def measured(algorithm: str, words: list[str], runs: int, most_busy: int) -> list[Spent]:
    """Time a call beside none, one and more busy programs in turns, so that a change of other load meets all alike."""
    found: list[list[Spent]] = [[] for _ in range(most_busy + 1)]
    for _ in range(runs):
        for count, spent in enumerate(found):
            with busy_programs(count):
                spent.append(timed(algorithm, words))
    return [Spent(min(one.wall_s for one in spent), min(one.cpu_s for one in spent)) for spent in found]


@contextmanager
def busy_programs(count: int) -> Iterator[None]:
    """Keep a number of cores busy."""
    with ExitStack() as ends:
        for _ in range(count):
            process = subprocess.Popen([sys.executable, "-c", BUSY])
            ends.callback(process.wait)
            ends.callback(process.kill)
        yield


def timed(algorithm: str, words: list[str]) -> Spent:
    """Run a call from start to end, as a user does: nothing limits it from outside."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(LIMITING)}
    command = [os.environ["QGIS_PROCESS"], "run", f"railextract:{algorithm}", "--", *words]
    start = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(command, env=environment, stdout=said, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            said.seek(0)
            sys.exit(f"qgis_process ended with {process.returncode}:\n{said.read().decode()}")
    return Spent(time.perf_counter() - start, usage.ru_utime + usage.ru_stime)


def header(most_busy: int) -> list[str]:
    """Return the head of the table."""
    loads = ["idle", "beside one busy program", *(f"beside {count}" for count in range(2, most_busy + 1))]
    names = ["call", *loads[: most_busy + 1], "one busy : idle"]
    return [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]


def row(name: str, spent: list[Spent]) -> str:
    """Format the row of a call; the last column compares it beside one busy program with the limits."""
    cells = [f"{one.wall_s:.1f} ({one.cpu_s:.1f})" for one in spent]
    return f"| {' | '.join([name, *cells, verdict(spent)])} |"


def verdict(spent: list[Spent]) -> str:
    """State the ratios of the times beside one busy program and without, and whether they are within the limits."""
    if len(spent) < 2:
        return ""
    wall, cpu = spent[1].wall_s / spent[0].wall_s, spent[1].cpu_s / spent[0].cpu_s
    above = "" if cpu <= CPU_RATIO and wall <= WALL_RATIO else f", above {WALL_RATIO} ({CPU_RATIO})"
    return f"{wall:.2f} ({cpu:.2f}){above}"


def processor() -> str:
    """Name the processor."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text().splitlines() if about.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
