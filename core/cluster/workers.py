"""Workers on this computer, or those of a Dask cluster that is already running."""

from __future__ import annotations

import logging
import os
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import dask
from distributed import Client, LocalCluster
from distributed import TimeoutError as NoAnswer
from distributed.security import Security
from distributed.system import MEMORY_LIMIT

from ..errors import ParameterError, RailExtractError
from ..kernels import ENVIRONMENT
from ..scratch import scratch_folder, sweep

MAX_DEATHS = 10
"""Local workers that may die while they execute a task, for whatever reason, before the task is abandoned."""

HERE = "127.0.0.1"
"""Address that only programs on this computer reach."""

PAGES = ("distributed.scheduler.http.routes", "distributed.worker.http.routes")
"""Settings of Dask that list the web pages about a run."""

TIMEOUT_S = 20
"""How long a scheduler may take to answer, and to have workers."""

WORKER_BYTES = 3 << 29
"""Memory per local worker: its peak is a gigabyte (docs/scaling.md), and the joining process needs some."""


@dataclass(frozen=True)
class Certificates:
    """Files with which a scheduler and its clients recognize each other, all PEM.

    Attributes
    ----------
    authority, certificate, key : Path
        Certificate of the authority that signs for the cluster; own certificate and its private key.
    """

    authority: Path
    certificate: Path
    key: Path

    def security(self) -> Security:
        """Return Dask's form of these files.

        Raises
        ------
        ParameterError
            A file is missing or is not what it should be.
        """
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
def connect(
    scheduler: str | None,
    workers: int | None = None,
    certificates: Certificates | None = None,
    dashboard_port: int | None = None,
) -> Iterator[Client]:
    """Use a running Dask scheduler, or start workers with one thread each on this computer.

    Whoever can talk to a scheduler can run programs on its workers. Local workers therefore only accept the certificate
    that is made for this run and never leaves memory.

    Parameters
    ----------
    scheduler : str or None
        Address of the scheduler, such as tls://10.0.0.1:8786.
    workers : int, optional
        Number of workers to start; by default one per core, or fewer if the memory is not enough for them.
    certificates : Certificates, optional
        For a scheduler at a tls:// address.
    dashboard_port : int, optional
        Port of this computer at which Dask shows what local workers do, to all users of this computer; 0 for any free
        one. Without a port there is no dashboard.

    Raises
    ------
    RailExtractError
        There is no scheduler at this address, or the certificates can't be used.
    """
    with _running(scheduler, certificates) if scheduler is not None else _started(workers, dashboard_port) as client:
        yield client


@contextmanager
def _running(scheduler: str, certificates: Certificates | None) -> Iterator[Client]:
    """Use a running scheduler that has workers; see `connect`."""
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
def _started(workers: int | None, dashboard_port: int | None) -> Iterator[Client]:
    """Start workers on this computer; see `connect`."""
    settings: dict[str, object] = {
        f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in ENVIRONMENT.items()
    }
    settings["distributed.scheduler.allowed-failures"] = MAX_DEATHS
    if dashboard_port is None:  # Dask serves pages without a dashboard, too
        settings.update({page: [] for page in PAGES})
    temporary = Path(tempfile.gettempdir())
    sweep(temporary)
    with scratch_folder(temporary) as folder, dask.config.set({**settings, "temporary-directory": str(folder)}):
        with _deaf_to_interrupts():
            cluster = LocalCluster(
                n_workers=workers or max(min(os.cpu_count() or 1, MEMORY_LIMIT // WORKER_BYTES), 1),
                threads_per_worker=1,
                memory_limit=None,  # Dask's own, an even share of the memory, kills workers at their peak
                host=HERE,
                security=Security.temporary(),
                dashboard_address=f"{HERE}:{dashboard_port or 0}",
                scheduler_kwargs={"dashboard": dashboard_port is not None},
                silence_logs=logging.ERROR,  # Dask warns of workers that it ends
            )
        with cluster, Client(cluster) as client:
            yield client
