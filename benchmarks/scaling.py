"""Print how time and memory grow with length, the gain from a second worker, and the cost of a national network.

`python benchmarks/scaling.py` measures a synthetic double track of 1 km and of 10 km, each in a separate process, and
one worker against two on the longer one, with one thread each. `--km 0.6` is faster; half a kilometre cannot be
divided. `--memory 500` measures 500 km alone, to see what grows with length: network and drawing are left out, and each
square has the true lines, so only reading and joining are measured. `--cores 2` measures 2 km alone, with one process,
with two, as QGIS starts them, and with two threads, and prints what more processes would gain. Compare rows of the same
run only.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
from rail_extract.core.clouds.las import laspy
from rail_extract.core.clouds.points import ask
from rail_extract.core.kernels import blas, one_thread
from rail_extract.core.pipeline import Parameters, drawing, extract_files, extract_rails
from rail_extract.core.pipeline.sources import Classified
from rail_extract.core.progress import SILENT, Progress
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.run import processes
from rail_extract.core.run.cluster import Cluster, started
from rail_extract.core.run.tasks import Answer, Context, Once, Runner, Task, next_of
from rail_extract.core.squares.kept import KeptResults
from rail_extract.core.squares.seams import SquareRails, trim
from rail_extract.core.squares.steps import engine_for, square_side
from rail_extract.core.standards import STANDARDS
from rail_extract.core.tiles.grid import HALO_M, Square
from rail_extract.core.tiles.store import SpooledPoints, spool
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.plain import spacing
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.scene import RAIL, Plan, build
from rail_extract.laboratory.scenes.tracks import Track

STANDARD = STANDARDS["EN_60E1_1435"]
PIECE_M = 100.0
"""Length of the straight piece that is scanned once and repeated end to end, with one file per repetition."""

HEADING = 0.35
"""Direction at an angle to the squares, so that borders are crossed in both directions."""

POINTS_PER_M = 500
"""Rail points per metre of double track: 50 million on 100 km."""

FEW_POINTS_PER_M = 100
"""The same where points only decide which squares there are."""

TRACKS_AT_M = (0.0, 4.5)
"""Distances of the two tracks to the left of the first one."""

VERTEX_M, STATION_M = 0.09, 0.25
"""Spacing of the vertices and of the stations of the lines that a square's drawing returns."""

NETWORK_KM = 70_000
"""Length of track of a large national network; a kilometre of double track has two kilometres of track."""

WORKERS = (2, 16, 64, 256)

PROCESSES = (2, 4, 8, 16)

DRAWN, LAID = "drawn", "laid"
"""Whether lines are drawn from the points, or laid where they truly are."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--km", type=float, default=1.0, help="shorter of the two lengths (default 1)")
    parser.add_argument("--times", type=int, default=10, help="ratio of the two lengths (default 10)")
    parser.add_argument(
        "--memory", type=float, metavar="KM", help="measure only what grows with length, over this length"
    )
    parser.add_argument("--cores", type=float, metavar="KM", help="measure only processes of this computer on KM")
    parser.add_argument("--skip-workers", action="store_true", help="leave the workers out")
    parser.add_argument("--measure", nargs=2, metavar=("FOLDER", "LINES"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.measure:
        print(json.dumps(measure(Path(args.measure[0]), args.measure[1] == DRAWN)))
        return
    with tempfile.TemporaryDirectory() as folder:
        if args.cores:
            lay_track(Path(folder) / "cores", args.cores)
            compare_processes(Path(folder) / "cores")
            return
        if args.memory:
            lay_track(Path(folder) / "memory", args.memory, FEW_POINTS_PER_M)
            show(f"{args.memory:g} km, lines laid", in_own_process(Path(folder) / "memory", LAID))
            return
        long = compare_lengths(Path(folder), args.km, args.times)
        if not args.skip_workers:
            compare_workers(Path(folder) / "long", Path(folder))
        print_costs(long, args.km * args.times)


def compare_lengths(folder: Path, km: float, times: int) -> dict:
    """Run tracks of `km` and `times` as much, each in a separate process, and return the figures of the long one."""
    lay_track(folder / "short", km)
    lay_track(folder / "long", km * times)
    short = show(f"{km:g} km", in_own_process(folder / "short", DRAWN))
    long = show(f"{km * times:g} km", in_own_process(folder / "long", DRAWN))
    seconds, memory = long["seconds"] / short["seconds"], long["peak_mib"] / short["peak_mib"]
    print(f"{times} times the length: {seconds:.2f} times the time, {memory:.2f} times the memory")
    return long


def compare_workers(tiles: Path, folder: Path) -> None:
    """Run one worker with one thread, then two."""
    seconds = []
    for workers in (1, 2):
        with started(workers) as client:
            client.wait_for_workers(workers)
            client.run(engine_of_worker)
            start = time.perf_counter()
            work = folder / f"work{workers}"
            runner = Runner(Cluster(client), KeptResults(work), tolerant=True)
            found = extract_files(Classified(ask([tiles], [RAIL])), work, parameters(), runner)
            seconds.append(time.perf_counter() - start)
        print(f"{workers} worker(s) with one thread: {seconds[-1]:.1f} s, {len(found.rails)} rails")
    print(f"Two workers are {seconds[0] / seconds[1]:.2f} times as fast as one")


def compare_processes(tiles: Path) -> None:
    """Run one process, two, and two threads, and print what more processes would gain.

    Work that is not shared takes as long as with one.
    """
    engine_for(parameters())  # loads the packages, which happens only once
    runners = {
        "1 process": lambda: processes.workers(1),
        "2 processes": lambda: processes.workers(2),
        "2 threads": lambda: nullcontext(Runner(Threads(2))),
    }
    spent = {name: processor_seconds(tiles, runner()) for name, runner in runners.items()}
    for name, (wall_s, own_s, others_s) in spent.items():
        print(f"{name}: {wall_s:.1f} s; {own_s:.1f} processor seconds here, {others_s:.1f} in workers")
    _, alone_s, _ = spent["1 process"]
    _, serial_s, shared_s = spent["2 processes"]
    print(f"Not shared: {100 * serial_s / alone_s:.1f} %; sharing costs {shared_s + serial_s - alone_s:.1f} s")
    for count in PROCESSES:
        print(f"  {count} cores: {alone_s / (serial_s + shared_s / count):.1f} times as fast, by processor time")


class Threads:
    """Executes tasks on threads of this process, to compare with processes: Python runs one of them at a time."""

    def __init__(self, places: int) -> None:
        self.places = places
        self._pool, self._idle = ThreadPoolExecutor(places), [Once() for _ in range(places)]
        self._answers: SimpleQueue = SimpleQueue()

    def ready_for(self, tasks: Mapping[Any, Task], progress: Progress) -> Threads:
        """Return this executor."""
        return self

    def start(self, name: Any, task: Task, inputs: Mapping[Any, Any]) -> None:
        """Give a task to a thread."""

        def execute() -> None:
            once = self._idle.pop()
            result = task.function(*task.arguments, Context(inputs, once, SILENT))
            self._idle.append(once)
            self._answers.put((name, Answer(result)))

        self._pool.submit(execute)

    def wait(self, progress: Progress, advance: Callable[[Any, float], None]) -> tuple[Any, Answer]:
        """Wait until a task has ended."""
        return next_of(self._answers, progress)

    def opened(self, result: Any) -> Any:
        """Return the result as it is."""
        return result

    def end(self) -> None:
        """Forget what has not been started."""
        self._pool.shutdown(cancel_futures=True)


def processor_seconds(tiles: Path, runners: AbstractContextManager[Runner]) -> tuple[float, float, float]:
    """Extract with a runner; return seconds, and processor seconds of this process and of the others."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    own = time.process_time()
    with tempfile.TemporaryDirectory() as work, one_thread(*blas()), runners as runner:
        extract_files(Classified(ask([tiles], [RAIL])), Path(work), parameters(), runner)
    after, own = resource.getrusage(resource.RUSAGE_CHILDREN), time.process_time() - own
    others = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, own, others


def engine_of_worker() -> None:
    """Load the engine, which a long run does only once."""
    engine_for(parameters())


def print_costs(figures: dict, km: float) -> None:
    """Print the cost of a kilometre and of a national network on cores like these."""
    track_km = 2 * km
    print("Per kilometre of track, times in core-seconds:")
    for name in ("reading_s", "squares_s", "joining_s"):
        print(f"  {name[:-2]:12}{figures[name] / track_km:10.2f} s")
    for name in ("cloud_bytes", "spool_bytes", "lines_bytes"):
        print(f"  {name[:-6]:12}{figures[name] / track_km / 1e6:10.2f} MB")
    parallel = (figures["reading_s"] + figures["squares_s"]) / track_km * NETWORK_KM / 3600
    serial = figures["joining_s"] / track_km * NETWORK_KM / 3600
    print(f"{NETWORK_KM} km of track, workers with one core each: hours of workers + hours of joining")
    for workers in WORKERS:
        print(f"  {workers:4} workers {parallel / workers:8.1f} + {serial:.1f} h")


def lay_track(folder: Path, km: float, points_per_m: float = POINTS_PER_M) -> None:
    """Write the files of a straight double track."""
    folder.mkdir()
    curve = trace([Element(PIECE_M)], heading=HEADING)
    tracks = [Track(curve, spacing(STANDARD), np.full(len(curve.xy), 100.0), left_m=left) for left in TRACKS_AT_M]
    scene = build("piece", Plan(tracks, STANDARD, Scanner(noise_m=0.004)), np.random.RandomState(8))
    xyz = scene.xyz[scene.classification == RAIL]
    chosen = np.random.RandomState(9).randint(len(xyz), size=int(points_per_m * PIECE_M))
    step = PIECE_M * np.array([np.cos(HEADING), np.sin(HEADING), 0.0])
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.001)
    for number in range(round(1000 * km / PIECE_M)):
        cloud = laspy.LasData(header)
        cloud.x, cloud.y, cloud.z = (xyz[chosen] + number * step).T
        cloud.classification = np.full(len(chosen), RAIL, dtype=np.uint8)
        cloud.write(folder / f"tile_{number:05}.las")


def parameters() -> Parameters:
    """Return the parameters of all runs."""
    return Parameters(STANDARD.gauge_m, STANDARD.head_width_m)


def laid_rails(source: SpooledPoints, square: Square, *_) -> SquareRails:
    """Return the true lines in a square, with as many vertices and figures as lines that are drawn from points."""
    ahead, left = np.array([np.cos(HEADING), np.sin(HEADING)]), np.array([-np.sin(HEADING), np.cos(HEADING)])
    corner = square.side_m * np.array(square.key)
    middle_m = (corner + 0.5 * square.side_m) @ ahead
    vertices = VERTEX_M * np.arange(
        max((middle_m - square.side_m) // VERTEX_M, 0), (middle_m + square.side_m) // VERTEX_M
    )
    vertices = vertices[square.holds(vertices[:, None] * ahead - corner, 2 * HALO_M)]
    if len(vertices) < 2:
        return trim([], square)
    stations = np.arange(0.0, np.ptp(vertices), STATION_M)
    figures = np.full(len(stations), 0.001)
    support = Support.of_one_strip(stations, np.full(len(stations), 30), figures, 0.001)
    half_m = 0.5 * spacing(STANDARD)
    sides = [track_m + side_m for track_m in TRACKS_AT_M for side_m in (-half_m, half_m)]
    plans = [vertices[:, None] * ahead + side_m * left - corner for side_m in sides]
    lines = [np.column_stack([plan, 100.0 + np.sin(vertices / 300.0)]) for plan in plans]
    rails = [RailLine(line, 1, RAIL, 30.0 * len(stations), 1.0, 1.0, 0.0, support=support) for line in lines]
    return trim(rails, square)


def in_own_process(folder: Path, lines: str) -> dict:
    """Measure in a separate process, because peak memory belongs to a process."""
    words = [sys.executable, __file__, "--measure", str(folder), lines]
    run = subprocess.run(words, capture_output=True, text=True)
    if run.returncode:
        sys.exit(run.stderr)
    return json.loads(run.stdout.splitlines()[-1])


def measure(folder: Path, drawn: bool) -> dict:
    """Extract the clouds in a folder; return core-seconds by step, peak memory and sizes in bytes."""
    if not drawn:
        drawing.clean_square, drawing.rails_of_square = (lambda *_: None), laid_rails
    draw_squares = drawing.Drawing.run
    marks = []

    def marked(*arguments):
        marks.append(time.process_time())
        try:
            return draw_squares(*arguments)
        finally:
            marks.append(time.process_time())

    drawing.Drawing.run = marked
    engine_for(parameters())  # loads the packages, which happens only once
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as work:
        marks.append(time.process_time())
        clouds = spool(ask(folder, [RAIL]), square_side(parameters()), Path(work))
        network = extract_rails(clouds, parameters())
        marks.append(time.process_time())
        spooled = size_of(Path(work))
    return {
        "seconds": time.perf_counter() - start,
        "reading_s": marks[1] - marks[0],
        "squares_s": marks[2] - marks[1],
        "joining_s": marks[3] - marks[2],
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "cloud_bytes": size_of(folder),
        "spool_bytes": spooled,
        "lines_bytes": sum(line.xyz.nbytes for line in (*network.rails, *network.centerlines)),
        "rails": len(network.rails),
        "rails_km": sum(rail.length_m for rail in network.rails) / 1000,
        "engine": network.engine,
    }


def size_of(folder: Path) -> int:
    """Return the size of the files in a folder, bytes."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def show(what: str, figures: dict) -> dict:
    """Print the figures of a run, and return them."""
    steps = ", ".join(f"{figures[f'{step}_s']:.1f} {step}" for step in ("reading", "squares", "joining"))
    print(f"{what}: {figures['seconds']:.1f} s ({steps} core-seconds), peak {figures['peak_mib']:.0f} MiB", flush=True)
    print(f"  {figures['rails']} rails of {figures['rails_km']:.3f} km, {figures['engine']}", flush=True)
    return figures


if __name__ == "__main__":
    main()
