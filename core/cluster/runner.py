"""A runner that executes tasks on the workers of a Dask cluster and keeps their results in files.

Workers exchange the names of files instead of arrays. The name of a file is a fingerprint of everything that the result
depends on, so that a restarted run computes only what is not finished.
"""

from __future__ import annotations

import os
import threading
import uuid
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from distributed import Client, Future, as_completed

from ..disk import writing
from ..errors import CloudError, DiskError, RailExtractError
from ..progress import SILENT, Progress, Recording
from ..scratch import discard, sweep
from ..tasks import Context, Name, Once, Task, in_order
from .store import CORE, DamagedError, Stored, can_store, fingerprint, load, save, version


@dataclass(frozen=True)
class Answer:
    """What a worker returns: a `Stored` or a result that `store` does not keep, or why there is none, and warnings."""

    result: Any = None
    failure: str | None = None
    warnings: tuple[str, ...] = ()


class DaskRunner:
    """Executes tasks on the workers of a cluster; a task that fails is recorded, and the others continue.

    Parameters
    ----------
    client : Client
    folder : Path
        Folder for the results, which workers must reach under the same path.

    Attributes
    ----------
    failures : list of str
        A sentence per failed task.
    """

    def __init__(self, client: Client, folder: Path) -> None:
        self.failures: list[str] = []
        self._client, self._folder, self._version = client, folder.resolve(), version()
        self._warned: set[str] = set()
        with writing(self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)  # not by workers: a failed run may have removed it

    def run(self, tasks: Mapping[Name, Task], progress: Progress = SILENT) -> Iterator[tuple[Name, Any]]:
        """Execute tasks; see `Runner.run`.

        Raises
        ------
        DiskError
            A worker could not write its result.
        """
        order = in_order(tasks)
        results: dict[Hashable, Any] = {}
        running: dict[Future, Name] = {}
        queue = as_completed()

        def submit_ready() -> None:
            while ready := order.get_ready():
                for name in ready:
                    if all(need in results for need in tasks[name].needs):
                        inputs = {one: results[one] for one in tasks[name].inputs if one in results}
                        future = self._submit(tasks[name], inputs)
                        running[future] = name
                        queue.add(future)
                    else:
                        order.done(name)

        submit_ready()
        done, total = 0.0, sum(task.weight for task in tasks.values())
        for future in queue:
            progress.check()
            name = running.pop(future)
            answer = _answer(future, tasks[name].label)
            self._warn(answer.warnings, progress)
            if answer.failure is not None:
                self.failures.append(answer.failure)
            else:
                results[name] = answer.result
            order.done(name)
            submit_ready()
            done += tasks[name].weight
            progress.set_fraction(done / total)
            if name in results and tasks[name].returned:
                try:
                    yield name, _loaded(answer.result)
                except DamagedError as error:
                    self.failures.append(f"{tasks[name].label} failed ({error}): start the run again.")

    def _warn(self, warnings: Iterable[str], progress: Progress) -> None:
        """Pass each warning on once, however many workers have it."""
        for warning in warnings:
            if warning not in self._warned:
                self._warned.add(warning)
                progress.warning(warning)

    def _submit(self, task: Task, inputs: Mapping[Hashable, Any]) -> Future:
        """Send a task to a worker, under a name that shows in Dask's dashboard what it does."""
        key = f"{task.function.__name__.strip('_')}-{uuid.uuid4().hex}"
        return self._client.submit(execute, task, inputs, str(self._folder), self._version, key=key, pure=False)


def execute(task: Task, inputs: Mapping[Hashable, Any], folder: str, expected_version: str) -> Answer:
    """Execute a task on a worker, unless its result is in the folder already.

    Parameters
    ----------
    task : Task
    inputs : mapping of Hashable to Stored or Any
        Results of the tasks that this one takes.
    folder : str
    expected_version : str
        Version of the code and the weights that asks for the task; see `store.version`.

    Raises
    ------
    DiskError
        The result could not be written.
    """
    if version() != expected_version:
        return Answer(
            failure=f"A worker has another version of Rail Extract ({CORE.parent}): install the same everywhere."
        )
    _sweep_once(folder)
    heard = Recording(SILENT)
    try:
        return Answer(_result(task, inputs, Path(folder), expected_version, heard), warnings=heard.warnings)
    except DiskError:
        raise
    except CloudError as error:
        return Answer(failure=str(error), warnings=heard.warnings)  # it names the file
    except Exception as error:  # noqa: BLE001 - whatever the reason, one failing square must not stop the others
        return Answer(failure=f"{task.label} failed ({error}).", warnings=heard.warnings)


def _result(task: Task, inputs: Mapping[Hashable, Any], folder: Path, expected_version: str, progress: Progress) -> Any:
    """Return the file of a result that is kept and intact; otherwise compute it, and keep it if `store` can."""
    name = task.function.__name__.strip("_")
    path = folder / f"{name}_{fingerprint(name, *task.arguments, inputs, expected_version)}.npz"
    if os.path.lexists(path):
        try:
            load(Stored(str(path)))
            return Stored(str(path))
        except DamagedError:
            progress.warning(f"{task.label}: the stored result is damaged, so it is computed again.")
            with writing(folder):
                discard(path)
    results = {one: _loaded(given) for one, given in inputs.items()}
    result = task.function(*task.arguments, Context(results, _OF_THREAD.once, progress))
    if not can_store(result):
        return result
    save(path, result)
    return Stored(str(path))


def _loaded(result: Any) -> Any:
    return load(result) if isinstance(result, Stored) else result


@lru_cache
def _sweep_once(folder: str) -> None:
    """Remove what killed workers of this computer have left in a folder."""
    sweep(Path(folder))


class _OfThread(threading.local):
    """What a thread of this worker keeps between tasks: engines of OpenCV cannot be shared between threads."""

    def __init__(self) -> None:
        self.once = Once()


_OF_THREAD = _OfThread()


def _answer(future: Future, label: str) -> Answer:
    """Return what a worker has answered, or a failure if its workers died.

    Raises
    ------
    DiskError
        A worker could not write.
    """
    error = future.exception() if future.status == "error" else None
    if isinstance(error, RailExtractError):
        raise error
    return future.result() if error is None else Answer(failure=f"{label} was abandoned ({error}).")
