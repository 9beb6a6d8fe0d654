"""A runner that executes tasks in several processes, and reports as if they ran one after another."""

from __future__ import annotations

import ctypes
import os
import pickle  # nosec B403 - read from processes that this one has started only
import sys
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any

from ..errors import RailExtractError
from ..kernels import cores
from ..progress import SILENT, Progress, counted
from ..tasks import InTurn, Name, Results, Runner, Task, turns
from .process import REPORT_EVERY_S, Answer, Interpreter, Kind, Messages, Worker

WORTH_S = 5.0
"""Least work, in seconds, for which workers are started: that takes each of them one to two seconds."""

WORKER_BYTES = 600 << 20
"""Memory of a worker at its peak (docs/scaling.md)."""

BUDGET_BYTES, BUDGET_SHARE = 2 << 30, 0.25
"""Memory for all workers unless their number is given: what a computer with 8 GB has to spare beside QGIS, or this
share of the memory of a larger one."""


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
    wanted: int, interpreter: Callable[[], Interpreter] = lambda: Interpreter(sys.executable)
) -> Iterator[Runner]:
    """Provide a runner with workers, as many as `worker_count` says, which end with the context.

    The Python program is looked for when the first worker is started.
    """
    count = worker_count(wanted)
    if count == 1:
        yield InTurn()
        return
    runner = Workers(count, interpreter)
    try:
        yield runner
    finally:
        runner.end()


class Workers:
    """Executes tasks in several processes; the first error ends the run.

    Results, messages and errors come in the order of `InTurn`, so that nothing depends on the number of workers. Work
    that is too little, or can't be divided, is done in this process.

    Parameters
    ----------
    count : int
        Number of processes.
    interpreter : callable
        Finds the Python program.
    """

    def __init__(self, count: int, interpreter: Callable[[], Interpreter]) -> None:
        self.failures: list[str] = []
        self._count, self._interpreter, self._can_start = count, interpreter, True
        self._in_turn = InTurn()
        self._workers: list[Worker] = []
        self._messages: Messages = SimpleQueue()

    def run(self, tasks: Mapping[Name, Task], progress: Progress = SILENT) -> Iterator[tuple[Name, Any]]:
        """Execute tasks; see `Runner.run`.

        Raises
        ------
        RailExtractError
            A process ended.
        """
        missing = min(self._count, len(tasks)) - len(self._workers)
        if missing > 0 and self._can_start and _is_worth(tasks):
            self._start(missing, progress)
        if not self._workers:
            yield from self._in_turn.run(tasks, progress)
            return
        try:
            yield from _Run(tasks, self._workers, self._messages, progress).results()
        except BaseException:  # what is still running is not wanted any more
            self.end()
            raise

    def end(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.end()
        self._workers, self._messages = [], SimpleQueue()

    def _start(self, missing: int, progress: Progress) -> None:
        """Start processes; if that fails, this process works alone, and the log says why."""
        if not self._workers:
            progress.info(f"Up to {self._count} worker processes on {counted(cores(), 'core')} (WORKERS).")
        try:
            interpreter = self._interpreter()
            for _ in range(missing):
                self._workers.append(Worker(interpreter, self._messages))
            for _ in range(missing):
                if _next(self._messages, progress)[1] != Kind.READY:
                    raise OSError("they end at once")
        except (OSError, RailExtractError) as error:
            self.end()
            self._can_start = False
            progress.info(f"One process works alone, because worker processes can't be started: {error}")


class _Run:
    """One execution of tasks: what waits, what runs, and what is finished."""

    def __init__(self, tasks: Mapping[Any, Task], idle: Sequence[Worker], messages: Messages, progress: Progress):
        self._tasks, self._messages, self._progress = tasks, messages, progress
        self._order = turns(tasks)
        self._waiting = list(self._order)
        self._idle = list(idle)
        self._running: dict[Worker, Hashable] = {}
        self._kept = Results(tasks)
        self._answers: dict[Hashable, Answer] = {}
        self._finished: set[Hashable] = set()
        self._total_s = sum(task.weight for task in tasks.values())
        self._done_s: dict[Hashable, float] = {}

    def results(self) -> Iterator[tuple[Any, Any]]:
        """Yield results, and pass on messages and the first error, in the order of `turns`."""
        self._start_ready()
        for name in self._order:
            while name not in self._answers:
                self._hear(*_next(self._messages, self._progress))
            answer = self._answers.pop(name)
            for method, text in answer.said:
                getattr(self._progress, method)(text)
            if answer.error is not None:
                raise answer.error
            if self._tasks[name].returned:
                yield name, pickle.loads(answer.result)  # nosec B301

    def _hear(self, worker: Worker, kind: Kind, content: Any) -> None:
        """Note what a worker says, and give it a new task if it has finished one."""
        name = self._running[worker]
        if kind == Kind.ENDED:
            raise RailExtractError(
                f"{self._tasks[name].label} failed, because its worker process ended: close other programs that take "
                "memory, or set WORKERS to 1."
            )
        if kind == Kind.STATUS:
            self._progress.status(content)
        elif kind == Kind.FRACTION:
            self._advance(name, content)
        elif kind == Kind.ANSWER:
            self._idle.append(worker)
            self._advance(name, 1.0)
            self._finish(name, content)

    def _finish(self, name: Hashable, answer: Answer) -> None:
        """Keep what came of a task, and start those that waited for it; none that come after an error."""
        self._answers[name] = answer
        self._finished.add(name)
        self._kept.keep(name, answer.result)
        if answer.error is not None:
            before = set(self._order[: self._order.index(name)])
            self._waiting = [one for one in self._waiting if one in before]
        self._start_ready()

    def _start_ready(self) -> None:
        """Give idle workers the first tasks whose inputs are there."""
        for name in list(self._waiting):
            if not self._idle:
                return
            task = self._tasks[name]
            if self._finished.issuperset(task.inputs):
                self._waiting.remove(name)
                worker = self._idle.pop()
                self._running[worker] = name
                worker.send(task, self._kept.take(task))

    def _advance(self, name: Hashable, fraction: float) -> None:
        self._done_s[name] = fraction * self._tasks[name].weight
        self._progress.set_fraction(sum(self._done_s.values()) / self._total_s)


def _is_worth(tasks: Mapping[Any, Task]) -> bool:
    """Return whether the tasks take long enough, and several of them can run at a time."""
    total_s = sum(task.weight for task in tasks.values())
    return total_s >= WORTH_S and sum(not task.inputs for task in tasks.values()) > 1


def _next(messages: Messages, progress: Progress) -> tuple[Worker, Kind, Any]:
    """Wait for a message; the user may cancel meanwhile."""
    while True:
        progress.check()
        with suppress(Empty):
            return messages.get(timeout=REPORT_EVERY_S)
