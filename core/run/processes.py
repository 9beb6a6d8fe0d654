"""Tasks on the cores of this computer: processes of this Python, without other packages."""

from __future__ import annotations

import ctypes
import os
import pickle  # nosec B403 - read from processes that this one has started only
import sys
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from ..errors import RailExtractError, WorkerError
from ..kernels import cores
from ..progress import Progress, counted
from .tasks import Answer, Executor, InTurn, Keeping, Runner, Task, next_of
from .worker import Interpreter, Kind, Messages, Worker

WORTH_S = 5.0
"""Least work, in seconds, for which workers are started: that takes each of them one to two seconds."""

WORKER_BYTES = 600 << 20
"""Memory of a worker at its peak (docs/scaling.md)."""

BUDGET_BYTES, BUDGET_SHARE = 2 << 30, 0.25
"""Memory for all workers unless their number is given: what a computer with 8 GB has to spare beside QGIS, or this
share of the memory of a larger one."""


REMEDY = "close other programs that take memory, or set WORKERS to 1."

MAX_DEATHS = 3
"""Workers that may end while they execute a task: memory may be short for a moment, but a crash comes again."""


def worker_count(wanted: int) -> int:
    """Return the number of workers that is asked for; for 0, one per core, as far as their memory allows."""
    budget_bytes = max(BUDGET_BYTES, BUDGET_SHARE * memory_bytes())
    return wanted or max(1, min(cores(), int(budget_bytes / WORKER_BYTES)))


def memory_bytes() -> int:
    """Return the size of this computer's memory."""
    if sys.platform == "win32":
        kilobytes = ctypes.c_ulonglong()
        ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
        return kilobytes.value << 10
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


@contextmanager
def workers(
    wanted: int,
    interpreter: Callable[[], Interpreter] = lambda: Interpreter(sys.executable),
    keeping: Keeping | None = None,
    tolerant: bool = False,
) -> Iterator[Runner]:
    """Provide a runner with workers, as many as `worker_count` says, which end with the context; one is this process.

    The Python program is looked for when the first worker is started.
    """
    count = worker_count(wanted)
    executor = InTurn() if count == 1 else Processes(count, interpreter)
    try:
        yield Runner(executor, keeping, tolerant)
    finally:
        executor.end()


@dataclass
class _Given:
    """A task, the pickled results that it takes, and the number of workers that have ended with it."""

    name: Hashable
    task: Task
    inputs: Mapping[Hashable, bytes]
    deaths: int = 0


class Processes(Executor):
    """Executes tasks in several processes; work that is too little, or can't be divided, is done in this one."""

    def __init__(self, count: int, interpreter: Callable[[], Interpreter]) -> None:
        self._count, self._interpreter, self._can_start = count, interpreter, True
        self._in_turn = InTurn()
        self._idle: list[Worker] = []
        self._given: dict[Worker, _Given] = {}
        self._messages: Messages = SimpleQueue()

    @property
    def places(self) -> int:  # type: ignore[override]
        """The number of workers without a task."""
        return len(self._idle)

    def ready_for(self, tasks: Mapping[Any, Task], progress: Progress) -> Executor:
        """Start workers if the tasks are worth it; without any, this process does the work."""
        missing = min(self._count, len(tasks)) - len(self._idle)
        if missing > 0 and self._can_start and _is_worth(tasks):
            self._begin(missing, progress)
        return self if self._idle else self._in_turn

    def _begin(self, missing: int, progress: Progress) -> None:
        """Start workers; if that fails, this process works alone, and the log says why."""
        if not self._idle:
            progress.info(f"Up to {self._count} worker processes on {counted(cores(), 'core')} (WORKERS).")
        try:
            for _ in range(missing):
                self._idle.append(self._new())
            for _ in range(missing):
                if next_of(self._messages, progress)[1] != Kind.READY:
                    raise OSError("they end at once")
        except (OSError, RailExtractError) as error:
            self.end()
            self._can_start = False
            progress.info(f"One process works alone, because worker processes can't be started: {error}")

    def _new(self) -> Worker:
        return Worker(self._interpreter(), self._messages)

    def start(self, name: Hashable, task: Task, inputs: Mapping[Any, bytes]) -> None:
        """Send a task to a worker."""
        self._send(self._idle.pop(), _Given(name, task, inputs))

    def _send(self, worker: Worker, given: _Given) -> None:
        self._given[worker] = given
        worker.send(given.task, given.inputs)

    def wait(self, progress: Progress, advance: Callable[[Any, float], None]) -> tuple[Hashable, Answer]:
        """Pass on what workers say until one of them has finished its task, or too many have ended with it."""
        while True:
            worker, kind, content = next_of(self._messages, progress)
            if kind == Kind.ENDED:
                self._replace(worker, progress)
            elif kind == Kind.STATUS:
                progress.status(content)
            elif kind == Kind.FRACTION:
                advance(self._given[worker].name, content)
            elif kind == Kind.ANSWER:
                self._idle.append(worker)
                return self._given.pop(worker).name, content

    def _replace(self, worker: Worker, progress: Progress) -> None:
        """Let a new worker take the place and the task of one that has ended; if too many have, it only gives up."""
        worker.end()
        try:
            new = self._new()
        except OSError as error:
            raise WorkerError(f"A worker process ended, and no other can be started ({error}): {REMEDY}") from error
        if worker in self._idle:
            self._idle[self._idle.index(worker)] = new
            return
        given = self._given.pop(worker)
        given.deaths += 1
        if given.deaths < MAX_DEATHS:
            progress.info(f"A worker process ended: {given.task.label} starts again in another one.")
            self._send(new, given)
        else:
            self._given[new] = given
            sentence = f"{given.task.label} failed, because its worker process ended: {REMEDY}"
            self._messages.put((new, Kind.ANSWER, Answer(error=WorkerError(sentence))))

    def opened(self, result: bytes) -> Any:
        """Unpickle a result."""
        return pickle.loads(result)  # nosec B301

    def end(self) -> None:
        """End all processes."""
        for worker in (*self._idle, *self._given):
            worker.end()
        self._idle, self._given, self._messages = [], {}, SimpleQueue()


def _is_worth(tasks: Mapping[Any, Task]) -> bool:
    """Return whether the tasks take long enough, and several of them can run at a time."""
    total_s = sum(task.weight for task in tasks.values())
    return total_s >= WORTH_S and sum(not task.inputs for task in tasks.values()) > 1
