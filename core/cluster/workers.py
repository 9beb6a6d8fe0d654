"""Workers on this computer, or those of a Dask cluster that is already running."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import dask
from distributed import Client, LocalCluster
from distributed.system import MEMORY_LIMIT

from ..errors import RailExtractError

MAX_DEATHS = 10
"""Local workers that may die while they execute a task, for whatever reason, before the task is abandoned."""

ONE_THREAD = tuple(f"{name}_NUM_THREADS" for name in ("OMP", "MKL", "OPENBLAS", "RAYON")) + ("OPENCV_FOR_THREADS_NUM",)
"""Variables that keep a local worker on one core: there are as many workers as cores."""

MEMORY_KEPT = {"MALLOC_TRIM_THRESHOLD_": 256 << 20, "MALLOC_MMAP_THRESHOLD_": 32 << 20}
"""Bytes of freed memory that glibc keeps in a local worker, and the largest array that it takes from them. With Dask's
64 KiB every array returns to the system, which clears the memory before it lends it again: a tenth of the run time."""

WORKER_BYTES = 3 << 29
"""Memory per local worker: its peak is a gigabyte (docs/scaling.md), and the joining process needs some."""


@contextmanager
def connect(scheduler: str | None, workers: int | None = None) -> Iterator[Client]:
    """Use a running Dask scheduler, or start workers with one thread each on this computer.

    Parameters
    ----------
    scheduler : str or None
        Address of the scheduler, such as tcp://10.0.0.1:8786.
    workers : int, optional
        Number of workers to start; by default one per core, or fewer if the memory is not enough for them.

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
    settings["distributed.scheduler.allowed-failures"] = MAX_DEATHS
    with dask.config.set(settings):
        # Without a memory limit: Dask's own, an even share of the memory, kills workers at their peak.
        cluster = LocalCluster(n_workers=workers, threads_per_worker=1, memory_limit=None, dashboard_address=":0")
    with cluster, Client(cluster) as client:
        yield client
