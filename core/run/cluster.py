"""Tasks on the workers of a Dask cluster that is already running, or on Dask's workers of this computer."""

from __future__ import annotations

import logging
import signal
import sys
import tempfile
import threading
import uuid
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import dask
from distributed import Client, Future, LocalCluster
from distributed import TimeoutError as NoAnswer
from distributed.security import Security

from ..disk import scratch_folder, sweep
from ..errors import ParameterError, RailExtractError, WorkerError
from ..kernels import ENVIRONMENT
from ..progress import Progress
from .processes import worker_count
from .tasks import CORE, Answer, Context, Executor, Heard, Once, Task, next_of, version

MAX_DEATHS = 10
"""Local workers that may die while they execute a task, for whatever reason, before the task is abandoned."""

HERE = "127.0.0.1"
"""Address that only programs on this computer reach."""

TIMEOUT_S = 20
"""How long a scheduler may take to answer, and to have workers."""


@dataclass(frozen=True)
class Certificates:
    """PEM files: the certificate of the authority that signs for the cluster, and one's own with its private key."""

    authority: Path
    certificate: Path
    key: Path

    def security(self) -> Security:
        """Return Dask's form of these files; `ParameterError` if one is missing or is not what it should be."""
        security = Security(
            require_encryption=True,
            tls_ca_file=str(self.authority),
            tls_client_cert=str(self.certificate),
            tls_client_key=str(self.key),
        )
        try:
            security.get_connection_args("client")
        except OSError as error:  # as are those of SSL
            names = ", ".join(map(str, (self.authority, self.certificate, self.key)))
            raise ParameterError(
                f"The certificates ({names}) can't be used ({error.strerror or error}): give PEM files."
            ) from error
        return security


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start processes that ignore Ctrl-C, which a terminal sends to all: the command itself ends its workers."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def running(scheduler: str, certificates: Certificates | None = None) -> Iterator[Client]:
    """Use a running scheduler that has workers, given its address, such as tls://10.0.0.1:8786.

    Raises RailExtractError if there is no scheduler at this address, or the certificates can't be used.
    """
    security = None if certificates is None else certificates.security()
    try:
        client = Client(scheduler, timeout=TIMEOUT_S, security=security)
    except (OSError, ValueError, TypeError) as error:
        raise RailExtractError(
            f"No Dask scheduler answers at {scheduler} ({error}): check the address and the certificates."
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=TIMEOUT_S)
        except NoAnswer:
            raise RailExtractError(
                f"The Dask scheduler at {scheduler} has no workers: start some with `dask worker {scheduler}`."
            ) from None
        yield client


@contextmanager
def started(workers: int = 0, dashboard_port: int = 0) -> Iterator[Client]:
    """Start workers with one thread each on this computer, as many as `worker_count` says; port 0 is any free one.

    Whoever can talk to a scheduler can run programs on its workers. These therefore only accept the certificate that is
    made for this run and never leaves memory. The dashboard can be read by all users of this computer.
    """
    settings: dict[str, object] = {
        f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in ENVIRONMENT.items()
    }
    settings["distributed.scheduler.allowed-failures"] = MAX_DEATHS
    temporary = Path(tempfile.gettempdir())
    sweep(temporary)
    with scratch_folder(temporary) as folder, dask.config.set({**settings, "temporary-directory": str(folder)}):
        with _deaf_to_interrupts():
            cluster = LocalCluster(
                n_workers=worker_count(workers),
                threads_per_worker=1,
                memory_limit=None,  # Dask's own, an even share of the memory, kills workers at their peak
                host=HERE,
                security=Security.temporary(),
                dashboard_address=f"{HERE}:{dashboard_port}",
                silence_logs=logging.ERROR,  # Dask warns of workers that it ends
            )
        with cluster, Client(cluster) as client:
            yield client


class Cluster(Executor):
    """Executes tasks on the workers of a cluster, each again if its worker dies."""

    places = sys.maxsize

    def __init__(self, client: Client) -> None:
        self._client, self._version = client, version()
        self._started: dict[Hashable, tuple[Task, Future]] = {}
        self._ended: SimpleQueue[Hashable] = SimpleQueue()

    def start(self, name: Hashable, task: Task, inputs: Mapping[Any, Any]) -> None:
        """Send a task to the scheduler, under a name that shows in Dask's dashboard what it does."""
        key, ended = f"{task.label.split()[0]}-{uuid.uuid4().hex}", self._ended
        future = self._client.submit(execute, task, inputs, self._version, key=key, pure=False)
        self._started[name] = task, future
        future.add_done_callback(lambda _: ended.put(name))

    def wait(self, progress: Progress, advance: Callable[[Any, float], None]) -> tuple[Hashable, Answer]:
        """Wait until a task has ended."""
        name = next_of(self._ended, progress)
        task, future = self._started.pop(name)
        if future.status == "error":
            return name, Answer(error=WorkerError(f"{task.label} was abandoned ({future.exception()})."))
        return name, future.result()

    def end(self) -> None:
        """Cancel what has been started."""
        self._started, self._ended = {}, SimpleQueue()


class _OfThread(threading.local):
    """What a thread of this worker keeps between tasks: engines of OpenCV cannot be shared between threads."""

    def __init__(self) -> None:
        self.once = Once()


_OF_THREAD = _OfThread()


def execute(task: Task, inputs: Mapping[Hashable, Any], expected_version: str) -> Answer:
    """Execute a task on a worker, if that has the `version` of the code that asks for it."""
    heard = Heard()

    def compute() -> Any:
        if version() != expected_version:
            raise WorkerError(
                f"A worker has another version of Rail Extract ({CORE.parent}): install the same everywhere."
            )
        return task.function(*task.arguments, Context(inputs, _OF_THREAD.once, heard))

    return heard.answer(compute)
