"""A whole extraction on a Dask cluster: files are sorted, stretches cleaned and drawn, and what they give is joined."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import dask
from distributed import Client, Future, LocalCluster, as_completed
from distributed.system import MEMORY_LIMIT

from ..clouds.points import Request, ask
from ..disk import writing
from ..errors import CloudError, NoTrackError, RailExtractError
from ..frame import LocalFrame
from ..frpdf.models import choose
from ..pipeline import Parameters, square_side, tracks_of, warn_of_rails, whole_rails
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine
from ..squares.grid import Key, lay_out
from ..squares.spool import SpooledFile, SpooledPoints, gather
from .store import load_rails, version
from .tasks import Failure, SquareTask, clean, draw, sort_points

DEATHS = 10
"""Workers that may die over one stretch, of whatever else, before it is given up."""

READING, STRETCHES = 0.25, 0.7
"""Shares of the progress; joining, pairing and writing have the rest."""

ONE_THREAD = tuple(f"{name}_NUM_THREADS" for name in ("OMP", "MKL", "OPENBLAS", "RAYON")) + ("OPENCV_FOR_THREADS_NUM",)
"""Variables that keep a local worker on one core: there are as many workers as cores."""

MEMORY_KEPT = {"MALLOC_TRIM_THRESHOLD_": 256 << 20, "MALLOC_MMAP_THRESHOLD_": 32 << 20}
"""Bytes that glibc keeps of what a local worker frees, and the largest array it takes from them. Under Dask's 64 KiB
every array goes back to the system, which clears its memory before it is lent again: a tenth of a worker's time."""

WORKER_BYTES = 3 << 29
"""Memory for each local worker: one takes a gigabyte at its peak (docs/scaling.md), and the joining process some."""


@dataclass(frozen=True)
class Extraction:
    """What a run gives.

    Attributes
    ----------
    rails : tuple of RailLine
    centerlines : tuple of Centerline
    frame : LocalFrame
    failures : tuple of str
        A sentence for each file or stretch that is missing.
    """

    rails: tuple[RailLine, ...]
    centerlines: tuple[Centerline, ...]
    frame: LocalFrame
    failures: tuple[str, ...]


@contextmanager
def connect(scheduler: str | None, workers: int | None = None) -> Iterator[Client]:
    """Use an existing Dask scheduler, or start workers of one thread each on this computer.

    Without a number there is one a core, as far as the memory suffices.

    Raises
    ------
    RailExtractError
        There is no scheduler at this address.
    """
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout="20s")
        except (OSError, ValueError) as error:
            raise RailExtractError(f"No Dask scheduler answers at {scheduler} ({error}): check the address.") from error
        with client:
            yield client
        return
    if workers is None:
        workers = max(min(os.cpu_count() or 1, MEMORY_LIMIT // WORKER_BYTES), 1)
    environment = {**dict.fromkeys(ONE_THREAD, 1), **MEMORY_KEPT}
    settings = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in environment.items()}
    settings["distributed.scheduler.allowed-failures"] = DEATHS
    with dask.config.set(settings):
        # No limit of memory: Dask's own, an even share of what there is, kills workers at their peak.
        cluster = LocalCluster(n_workers=workers, threads_per_worker=1, memory_limit=None, dashboard_address=":0")
    with cluster, Client(cluster) as client:
        yield client


def extract(
    client: Client,
    paths: Sequence[Path],
    class_codes: Sequence[int],
    parameters: Parameters,
    folder: Path,
    crs_wkt: str | None = None,
    progress: Progress = SILENT,
) -> Extraction:
    """Extract rails and centerlines; files and stretches that fail are left out and named.

    Parameters
    ----------
    client : Client
    paths : sequence of Path
        LAS, LAZ or COPC files, or folders of them; workers have to reach them under the same names.
    class_codes : sequence of int
    parameters : Parameters
    folder : Path
        Where what is finished stays, for workers and for the next run; workers have to reach it too.
    crs_wkt : str, optional
        Coordinate system of files that state none.
    progress : Progress

    Raises
    ------
    CloudError
        Not one file can be read.
    DiskError
        The disk is full.
    NoRailPointsError
        The files hold no point of the wanted classes.
    """
    failures: list[str] = []
    request = ask(paths, class_codes, crs_wkt, progress=progress, unreadable=failures)
    folder = folder.resolve()
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)  # not by workers: a run that has failed may have removed it
    side_m = square_side(parameters)
    found = _sorted_points(client, request, side_m, folder, failures, progress.span(0.0, READING))
    sources = gather(request, side_m, found)
    drawn = progress.span(READING, READING + STRETCHES)
    results = _stretches(client, sources, parameters, folder, failures, drawn)
    if not any(results):
        raise RailExtractError(f"Not one stretch could be extracted; the first error was: {failures[0]}")
    rails: list[RailLine] = []
    for source, tasks in zip(sources, results):
        parts = [load_rails(file, task.stretch) for task, file in tasks]
        mine = whole_rails(parts, source.frame, parameters, len(rails) + 1) if parts else []
        warn_of_rails(mine, source.class_code, parameters, progress)
        rails += mine
    centerlines: list[Centerline] = []
    try:
        centerlines = tracks_of(rails, parameters, progress.span(READING + STRETCHES, 1.0))
    except NoTrackError as error:
        failures.append(str(error))
    progress.set_fraction(1.0)
    return Extraction(tuple(rails), tuple(centerlines), sources[0].frame, tuple(failures))


def _sorted_points(
    client: Client, request: Request, side_m: float, folder: Path, failures: list[str], progress: Progress
) -> list[SpooledFile]:
    """Sort the points of all files into squares; gives what was found in those that could be read, in their order."""
    futures = {
        client.submit(sort_points, replace(request, headers=()), header, side_m, str(folder), pure=False): number
        for number, header in enumerate(request.headers)
    }
    found: dict[int, SpooledFile] = {}
    for future in progress.follow(as_completed(futures), total=len(futures)):
        number = futures[future]
        result = _result(future, request.headers[number].path.name)
        if isinstance(result, Failure):
            failures.append(result.reason)
        else:
            found[number] = result
    if not found:
        raise CloudError(f"Not one file could be read; the first error was: {failures[0]}")
    return [found[number] for number in sorted(found)]


def _stretches(
    client: Client,
    sources: Sequence[SpooledPoints],
    parameters: Parameters,
    folder: Path,
    failures: list[str],
    progress: Progress,
) -> list[list[tuple[SquareTask, Path]]]:
    """Clean and draw the stretches of all classes; gives the files of the rails of each.

    Those of a stretch are drawn as soon as its neighbours are clean, or have failed: Dask itself would give up whatever
    depends on a failure.
    """
    weights = choose(parameters.gauge_m, parameters.head_width_m).path
    tasks = {
        (number, stretch.key): SquareTask(source.part(stretch), stretch, parameters, version(weights), str(folder))
        for number, source in enumerate(sources)
        for stretch in lay_out(sources, source)
    }
    running = {client.submit(clean, task, pure=False): (clean, one) for one, task in tasks.items()}
    queue = as_completed(running)
    rasters: dict[tuple[int, Key], str | Failure] = {}
    results: list[list[tuple[SquareTask, Path]]] = [[] for _ in sources]
    for future in progress.follow(queue, total=2 * len(tasks)):
        work, (number, key) = running.pop(future)
        found = _result(future, f"Square {key}")
        if work is draw:
            if isinstance(found, Failure):
                failures.append(found.reason)
            else:
                results[number].append((tasks[number, key], Path(found)))
            continue
        rasters[number, key] = found
        for near in tasks[number, key].neighbours():
            around = [(number, one) for one in tasks[number, near].neighbours()]
            if all(one in rasters for one in around):
                drawing = client.submit(draw, tasks[number, near], [rasters[one] for one in around], pure=False)
                running[drawing] = (draw, (number, near))
                queue.add(drawing)
    return results


def _result(future: Future, what: str) -> object:
    """Give what a task gave, or why it failed.

    Raises
    ------
    DiskError
        A worker could not write.
    """
    error = future.exception() if future.status == "error" else None
    if isinstance(error, RailExtractError):
        raise error
    return future.result() if error is None else Failure(f"{what} was given up ({error}).")
