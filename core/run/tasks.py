"""Tasks, pieces of work that can run in any process, and the one loop that runs them; an `Executor` decides where.

`InTurn` executes them in this process, one after another, `processes.Processes` in several processes, and
`cluster.Cluster` on many machines. By the `version` of the code, computers see that they run the same.
"""

from __future__ import annotations

import hashlib
import pickle  # nosec B403 - reads what this process has just written
import traceback
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from graphlib import TopologicalSorter
from heapq import heappop, heappush
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol, TypeVar

from ..errors import Cancelled, CloudError, DiskError, WorkerError
from ..progress import SILENT, Progress, Share

READ_S = 1e-6
"""Run time per point that is read or written, compressed, in seconds; the weight of such tasks."""

CORE = Path(__file__).resolve().parent.parent

Name = TypeVar("Name", bound=Hashable)
Message = TypeVar("Message")

CHECK_EVERY_S = 0.1
"""Interval at which cancellation is checked while others compute, and least time between two reports of a fraction."""

NOTES = "__notes__"
"""What Python 3.11 and newer write below a traceback: here, that of the worker process, which is not sent itself."""

ENDING = (Cancelled, DiskError, KeyboardInterrupt, SystemExit)
"""Errors that end every run."""

NAMED = (CloudError, WorkerError)
"""Errors that say themselves which file or which task has failed."""


class Once:
    """The latest result that is worth keeping for further tasks in the same thread, such as an engine."""

    def __init__(self) -> None:
        self._kept: dict[tuple, Any] = {}

    def keeps(self, function: Callable[..., Any], *arguments: Hashable) -> bool:
        """Return whether ``function(*arguments)`` is there already."""
        return (function, arguments) in self._kept

    def __call__(self, function: Callable[..., Any], *arguments: Hashable) -> Any:
        """Return ``function(*arguments)``, computed only if the call before this one was different."""
        key = (function, arguments)
        if key not in self._kept:
            self._kept = {key: function(*arguments)}
        return self._kept[key]


@dataclass(frozen=True)
class Context:
    """What a task gets beside its arguments: results of all its needs, and of what it uses if that did not fail."""

    results: Mapping[Any, Any]
    once: Once
    progress: Progress

    def network(self, function: Callable[..., Any], *arguments: Hashable) -> Any:
        """Return ``once(function, *arguments)``; the progress names the start of a network as an activity of its own.

        The import of its library takes seconds in which nothing of the task is done.
        """
        if not self.once.keeps(function, *arguments):
            self.progress.status("Starting the network")
            self.once(function, *arguments)
            self.progress.status("The network has started")
        return self.once(function, *arguments)


@dataclass(frozen=True)
class Task:
    """A piece of work that can run in any process, and again if this process ends half-way.

    Attributes
    ----------
    label : str
        What the task does, for error messages.
    function : callable
        Called with the arguments followed by a `Context`. A function of a module, so that other processes find it.
    needs : tuple of Name
        Tasks without whose results this one cannot run.
    uses : tuple of Name
        Tasks that have to finish first, and whose results this one takes if they did not fail.
    weight : float
        Expected run time in seconds, roughly: for the progress, and to decide whether workers are worth their start.
    returned : bool
        Whether the runner returns the result; otherwise it only passes it to other tasks.
    """

    label: str
    function: Callable[..., Any]
    arguments: tuple
    needs: tuple[Hashable, ...] = ()
    uses: tuple[Hashable, ...] = ()
    weight: float = 1.0
    returned: bool = True

    @property
    def inputs(self) -> tuple[Hashable, ...]:
        """Every task whose result this one can take."""
        return (*self.needs, *self.uses)


@lru_cache
def version() -> str:
    """Return the fingerprint of the code and of all weights."""
    digest = hashlib.sha256()
    for file in (*sorted(CORE.rglob("*.py")), *sorted((CORE.parent / "models").glob("*.npz"))):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@dataclass(frozen=True)
class Answer:
    """The result of a task as its executor passes it on, or what it raised, and its calls of `Progress`."""

    result: Any = None
    error: BaseException | None = None
    said: tuple[tuple[str, str], ...] = ()


class Heard(Progress):
    """Keeps what a task says for the log, where another process executes it."""

    def __init__(self) -> None:
        self._said: list[tuple[str, str]] = []

    def info(self, text: str) -> None:
        """Keep it."""
        self._said.append(("info", text))

    def warning(self, text: str) -> None:
        """Keep it."""
        self._said.append(("warning", text))

    def propose(self, standard: str) -> None:
        """Keep it."""
        self._said.append(("propose", standard))

    def answer(self, compute: Callable[[], Any]) -> Answer:
        """Return what comes of a task, errors of every kind and what was said included."""
        try:
            return Answer(compute(), said=tuple(self._said))
        except BaseException as error:  # lazrs raises one on damaged files that is not an `Exception`
            return Answer(error=_sendable(error), said=tuple(self._said))


def _sendable(error: BaseException) -> BaseException:
    """Return an error with its traceback as a note, or one that says the same if it can't be pickled or made again."""
    text = "".join(traceback.format_exception(type(error), error, error.__traceback__))
    again = RuntimeError(f"{type(error).__name__}: {error}")
    for one in (error, again):
        with suppress(Exception):
            setattr(one, NOTES, [f"In a worker process:\n{text}"])
            pickle.loads(pickle.dumps(one))  # nosec B301
            return one
    return again


def next_of(messages: SimpleQueue[Message], progress: Progress) -> Message:
    """Wait for a message; the user may cancel meanwhile."""
    while True:
        progress.check()
        with suppress(Empty):
            return messages.get(timeout=CHECK_EVERY_S)


class Executor:
    """Decides where tasks run."""

    places = 1
    """How many tasks can run at a time."""

    def ready_for(self, tasks: Mapping[Any, Task], progress: Progress) -> Executor:
        """Get ready for tasks, and return the executor that suits them."""
        return self

    def start(self, name: Hashable, task: Task, inputs: Mapping[Any, Any]) -> None:
        """Start a task with the results that it takes."""
        raise NotImplementedError

    def wait(self, progress: Progress, advance: Callable[[Any, float], None]) -> tuple[Hashable, Answer]:
        """Wait until a task has ended, and report meanwhile which fraction of each is done."""
        raise NotImplementedError

    def opened(self, result: Any) -> Any:
        """Return a result, given the form in which it is passed on."""
        return result

    def end(self) -> None:
        """End what still runs."""


class InTurn(Executor):
    """Executes tasks in this process, each when it is waited for."""

    def __init__(self) -> None:
        self._once = Once()
        self._started: deque[tuple[Hashable, Task, Mapping]] = deque()

    def start(self, name: Hashable, task: Task, inputs: Mapping[Any, Any]) -> None:
        """Note a task."""
        self._started.append((name, task, inputs))

    def wait(self, progress: Progress, advance: Callable[[Any, float], None]) -> tuple[Hashable, Answer]:
        """Execute the task that was noted first."""
        progress.check()
        name, task, inputs = self._started.popleft()
        share = Share(progress, partial(advance, name))
        try:
            return name, Answer(task.function(*task.arguments, Context(inputs, self._once, share)))
        except BaseException as error:  # noqa: BLE001 - for the runner to raise
            return name, Answer(error=error)

    def end(self) -> None:
        """Forget the tasks that were noted."""
        self._started.clear()


class Keeping(Protocol):
    """Keeps results for later runs; see `squares.kept.KeptResults`."""

    def kept(self, task: Task) -> Task:
        """Return a task that takes its result from an earlier run, or keeps it for later ones."""

    def opened(self, result: Any) -> Any:
        """Return a result, given what such a task returns."""


class Runner:
    """Executes tasks, each as soon as its inputs are there, and reports as if they ran one after another.

    Results, messages and errors come in the order of `turns`, so that nothing depends on the executor, by default this
    process. A result is released as soon as no further task takes it; `keeping` keeps results for later runs. A
    tolerant runner records a task that fails, in `failures`, which say what is missing from the result, and continues
    with the others; otherwise the first error ends the run.
    """

    def __init__(
        self, executor: Executor | None = None, keeping: Keeping | None = None, tolerant: bool = False
    ) -> None:
        self.failures: list[str] = []
        self._executor: Executor = InTurn() if executor is None else executor
        self._keeping, self.tolerant = keeping, tolerant

    def run(self, tasks: Mapping[Name, Task], progress: Progress = SILENT) -> Iterator[tuple[Name, Any]]:
        """Execute tasks, those that are listed first before others; yields the results that are to be returned."""
        executor = self._executor.ready_for(tasks, progress)
        if self._keeping is not None:
            tasks = {name: self._keeping.kept(task) for name, task in tasks.items()}
        try:
            for name, answer in _Run(tasks, executor, progress, self.tolerant).answers():
                for method, text in answer.said:
                    getattr(progress, method)(text)
                try:
                    result = self._opened(answer, executor)
                except BaseException as error:  # noqa: BLE001
                    self._note(tasks[name], error)
                    continue
                if tasks[name].returned:
                    yield name, result
        except BaseException:  # what still runs is not wanted any more
            executor.end()
            raise

    def _opened(self, answer: Answer, executor: Executor) -> Any:
        """Return the result in an answer, or raise its error."""
        if answer.error is not None:
            raise answer.error
        result = None if answer.result is None else executor.opened(answer.result)
        return result if self._keeping is None else self._keeping.opened(result)

    def _note(self, task: Task, error: BaseException) -> None:
        """Record that a task has failed, or raise its error if the others are not to continue."""
        if not self.tolerant or isinstance(error, ENDING):
            raise error
        self.failures.append(str(error) if isinstance(error, NAMED) else f"{task.label} failed ({error}).")


class _Run:
    """One execution of tasks: which are ready, which run, and what has come of the others."""

    def __init__(self, tasks: Mapping[Any, Task], executor: Executor, progress: Progress, tolerant: bool) -> None:
        self._tasks, self._executor, self._progress, self._tolerant = tasks, executor, progress, tolerant
        self._order = turns(tasks)
        self._turn = {name: turn for turn, name in enumerate(self._order)}
        self._last = len(self._order)
        self._inputs = _in_order(tasks)
        self._ready = sorted(self._turn[name] for name in self._inputs.get_ready())
        self._free = executor.places
        self._results = _Results(tasks)
        self._answers: dict[Hashable, Answer | None] = {}
        self._failed: set[Hashable] = set()
        self._fractions: dict[Hashable, float] = {}
        self._done_s, self._total_s = 0.0, sum(task.weight for task in tasks.values())

    def answers(self) -> Iterator[tuple[Any, Answer]]:
        """Yield what comes of tasks in the order of `turns`; nothing comes of those that lack what they need."""
        self._start_ready()
        for name in self._order:
            while name not in self._answers:
                ended, answer = self._executor.wait(self._progress, self._advance)
                self._free += 1
                self._finish(ended, answer)
                self._start_ready()
            found = self._answers.pop(name)
            if found is not None:
                yield name, found

    def _start_ready(self) -> None:
        """Start tasks whose inputs are there, the first of them first, as many as there are places."""
        while self._free and self._ready and self._ready[0] < self._last:
            name = self._order[heappop(self._ready)]
            task = self._tasks[name]
            inputs = self._results.take(task)
            if self._failed.intersection(task.needs):
                self._finish(name, None)
            else:
                self._free -= 1
                self._executor.start(name, task, inputs)

    def _finish(self, name: Hashable, answer: Answer | None) -> None:
        """Note what has come of a task; unless errors are tolerated, none that comes after one is started."""
        if answer is None or answer.error is not None:
            self._failed.add(name)
            self._last = self._last if self._tolerant else min(self._last, self._turn[name])
        else:
            self._results.keep(name, answer.result)
            answer = answer if self._tasks[name].returned else replace(answer, result=None)
        self._answers[name] = answer
        self._inputs.done(name)
        for one in self._inputs.get_ready():
            heappush(self._ready, self._turn[one])
        self._done_s += self._tasks[name].weight
        self._fractions.pop(name, None)
        self._report()

    def _advance(self, name: Hashable, fraction: float) -> None:
        """Note the fraction of a running task that is done."""
        self._fractions[name] = fraction
        self._report()

    def _report(self) -> None:
        """Report the fraction of all tasks that is done."""
        running_s = sum(self._tasks[name].weight * fraction for name, fraction in self._fractions.items())
        self._progress.set_fraction((self._done_s + running_s) / self._total_s)


class _Results:
    """Results that further tasks take."""

    def __init__(self, tasks: Mapping[Any, Task]) -> None:
        self._uses = Counter(name for task in tasks.values() for name in task.inputs)
        self._kept: dict[Hashable, Any] = {}

    def keep(self, name: Hashable, result: Any) -> None:
        """Keep a result if a further task takes it."""
        if self._uses[name]:
            self._kept[name] = result

    def take(self, task: Task) -> dict[Hashable, Any]:
        """Return the inputs of a task, but for those that failed, and release those that no further task takes."""
        self._uses.subtract(task.inputs)
        taken = {name: self._kept[name] for name in task.inputs if name in self._kept}
        for name in taken:
            if not self._uses[name]:
                del self._kept[name]
        return taken


def turns(tasks: Mapping[Name, Task]) -> list[Name]:
    """Order tasks as listed, except that each comes as soon as its inputs are there."""
    order, found = _in_order(tasks), []
    waiting = deque(order.get_ready())
    while waiting:
        found.append(waiting.popleft())
        order.done(found[-1])
        waiting.extendleft(reversed(order.get_ready()))
    return found


def _in_order(tasks: Mapping[Name, Task]) -> TopologicalSorter[Name]:
    """Prepare the order in which tasks become ready: as listed, as far as their inputs allow."""
    order: TopologicalSorter[Any] = TopologicalSorter({name: task.inputs for name, task in tasks.items()})
    order.prepare()
    return order
