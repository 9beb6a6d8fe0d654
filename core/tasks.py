"""Tasks and the runners that execute them: `pipeline` describes its work as tasks, and a runner decides where they run.

`InTurn` runs tasks in this process, one after another, `workers.runner.Workers` in several processes, and
`cluster.runner.DaskRunner` on many machines.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import Any, Protocol, TypeVar

from .progress import SILENT, Progress

Name = TypeVar("Name", bound=Hashable)

READ_S = 1e-6
"""Run time per point that is read or written, compressed, in seconds; the weight of such tasks."""


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
    """What a runner passes to a task.

    Attributes
    ----------
    results : mapping of Name to Any
        Results of other tasks: all of `Task.needs`, and those of `Task.uses` that did not fail.
    once : Once
    progress : Progress
    """

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
    """A piece of work that can run in any process.

    Attributes
    ----------
    label : str
        What the task does, for error messages.
    function : callable
        Called with the arguments followed by a `Context`. A function of a module, so that other processes find it.
    arguments : tuple
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


class Runner(Protocol):
    """Executes tasks."""

    @property
    def failures(self) -> list[str]:
        """Sentences that say what is missing from the result."""

    def run(self, tasks: Mapping[Name, Task], progress: Progress = SILENT) -> Iterator[tuple[Name, Any]]:
        """Execute tasks in any order that respects their inputs.

        Parameters
        ----------
        tasks : mapping of Name to Task
            Tasks that are listed first start first.
        progress : Progress

        Yields
        ------
        Name
            A finished task, unless it failed or its result is not to be returned.
        Any
            Its result.
        """


class InTurn:
    """Executes tasks in this process, one after another; the first error ends the run.

    A task runs as soon as its inputs are there, and a result is released as soon as no further task takes it, so that
    few results are in memory at a time.
    """

    def __init__(self) -> None:
        self.failures: list[str] = []
        self._once = Once()

    def run(self, tasks: Mapping[Name, Task], progress: Progress = SILENT) -> Iterator[tuple[Name, Any]]:
        """Execute tasks; see `Runner.run`."""
        results = Results(tasks)
        done, total = 0.0, sum(task.weight for task in tasks.values())
        for name in turns(tasks):
            progress.check()
            task = tasks[name]
            share = progress.span(done / total, (done + task.weight) / total)
            result = task.function(*task.arguments, Context(results.take(task), self._once, share))
            share.set_fraction(1.0)
            done += task.weight
            results.keep(name, result)
            if task.returned:
                yield name, result


class Results:
    """Results that further tasks take."""

    def __init__(self, tasks: Mapping[Any, Task]) -> None:
        self._uses = Counter(name for task in tasks.values() for name in task.inputs)
        self._kept: dict[Hashable, Any] = {}

    def keep(self, name: Hashable, result: Any) -> None:
        """Keep a result if a further task takes it."""
        if self._uses[name]:
            self._kept[name] = result

    def take(self, task: Task) -> dict[Hashable, Any]:
        """Return the inputs of a task, and release those that no further task takes."""
        taken = {name: self._kept[name] for name in task.inputs}
        for name in taken:
            self._uses[name] -= 1
            if not self._uses[name]:
                del self._kept[name]
        return taken


def turns(tasks: Mapping[Name, Task]) -> list[Name]:
    """Order tasks as listed, except that each comes as soon as its inputs are there."""
    order, found = in_order(tasks), []
    waiting = deque(order.get_ready())
    while waiting:
        found.append(waiting.popleft())
        order.done(found[-1])
        waiting.extendleft(reversed(order.get_ready()))
    return found


def in_order(tasks: Mapping[Name, Task]) -> TopologicalSorter[Name]:
    """Prepare the order in which tasks become ready: as listed, as far as their inputs allow."""
    order: TopologicalSorter[Any] = TopologicalSorter({name: task.inputs for name, task in tasks.items()})
    order.prepare()
    return order


def in_listed_order(tasks: Mapping[Name, Task], results: Iterable[tuple[Name, Any]]) -> Iterator[Any]:
    """Yield results in the order in which their tasks are listed, each as soon as those before it are there.

    Parameters
    ----------
    tasks : mapping of Name to Task
    results : iterable of Name and result
        From `Runner.run`; tasks that failed are missing.
    """
    waiting: dict[Any, Any] = {}
    order = deque(tasks)
    for name, result in results:
        waiting[name] = result
        while order and order[0] in waiting:
            yield waiting.pop(order.popleft())
    yield from (waiting[name] for name in order if name in waiting)
