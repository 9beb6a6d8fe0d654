"""The command `extract`: Extract Rails, with results that are kept for a restart, also on a cluster."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..errors import ParameterError, RailExtractError
from ..jobs.extract_rails import JOB
from ..parameters import Parameters
from ..progress import Progress
from ..run.processes import workers
from ..run.tasks import Runner
from ..squares.kept import KeptResults
from .files import FileValues
from .jobs import console_of, declare, given_to, run_and_print

CLUSTER_PACKAGES = ("distributed", "cryptography")
"""Modules that Dask needs, which have the names of their packages."""

LAST_PORT = 65_535
"""Largest number of a port; 0 stands for any that is free."""

INCOMPLETE = 2
"""Exit code of a run that has written results in which some files or squares are missing."""


def extract(parser: argparse.ArgumentParser) -> None:
    """Declare the command."""
    declare(JOB, parser)
    _add_workers(parser.add_argument_group("workers"))
    parser.set_defaults(run=_run)


def _add_workers(group: argparse._ArgumentGroup) -> None:
    """Declare what computes."""
    text = "use the Dask cluster at tls://HOST:PORT and not local workers; see docs/scaling.md on trust"
    group.add_argument("--scheduler", metavar="ADDRESS", help=text)
    group.add_argument("--tls-ca", type=Path, metavar="PEM", help="certificate of the cluster's authority")
    group.add_argument(
        "--tls-cert", type=Path, metavar="PEM", help="certificate of this computer, signed by the authority"
    )
    group.add_argument("--tls-key", type=Path, metavar="PEM", help="private key of this certificate")
    text = "compute with Dask on this computer, and show what it does at http://127.0.0.1:PORT, to all users"
    group.add_argument("--dashboard", type=int, metavar="PORT", help=text)
    group.add_argument(
        "--square-tiles",
        type=int,
        default=Parameters.square_tiles,
        metavar="N",
        help=f"side of the squares processed at a time, in raster tiles (default: {Parameters.square_tiles})",
    )


def _run(args: argparse.Namespace) -> int:
    """Extract and write; returns the exit code."""
    missing = [package for package in CLUSTER_PACKAGES if _on_dask(args) and find_spec(package) is None]
    if missing:
        raise RailExtractError(f"Packages are missing ({', '.join(missing)}): in a clone, run pip install .[cluster].")
    progress = console_of(JOB)
    result = run_and_print(JOB, partial(_Values, args, progress), progress)
    return INCOMPLETE if result.found.failures else 0


class _Values(FileValues):
    """The values of an extraction whose work may be kept, and be done by a cluster."""

    def __init__(self, args: argparse.Namespace, progress: Progress) -> None:
        super().__init__(JOB, given_to(JOB, args), args.command_line, work=args.work)
        self._args, self._folder = args, Path()
        self._certificates = _certificate_files(args, progress)

    def settings(self, *args: Any) -> Parameters:
        """Return the parameters for the walk."""
        return replace(super().settings(*args), square_tiles=self._args.square_tiles)

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """Provide the folder for finished results; without one, one next to the outputs, where a cluster finds it."""
        with super().scratch() as folder:
            self._folder = folder.resolve()
            yield self._folder

    def runner(self) -> AbstractContextManager[Runner]:
        """Provide the runner: Dask if it is asked for, else processes of this computer."""
        if _on_dask(self._args):
            return self._cluster()
        keeping = None if self._args.work is None else KeptResults(self._folder)
        return workers(self["WORKERS"], keeping=keeping, tolerant=True)

    @contextmanager
    def _cluster(self) -> Iterator[Runner]:
        """Provide a runner on Dask, whose workers exchange files, so that it keeps results in any case."""
        from ..run.cluster import Certificates, Cluster, running, started

        address, files = self._args.scheduler, self._certificates
        certificates = Certificates(*files) if files else None
        with running(address, certificates) if address else started(self["WORKERS"], self._args.dashboard) as client:
            yield Runner(Cluster(client), KeptResults(self._folder), tolerant=True)


def _on_dask(args: argparse.Namespace) -> bool:
    """Return whether an option asks for Dask: a cluster, or the page about its workers."""
    return bool(args.scheduler) or args.dashboard is not None


def _certificate_files(args: argparse.Namespace, progress: Progress) -> tuple[Path, ...]:
    """Return authority, certificate and key for a scheduler; none for local workers, or for a tcp:// address."""
    files = args.tls_ca, args.tls_cert, args.tls_key
    secured = (args.scheduler or "").startswith("tls://")
    if secured and None in files:
        raise ParameterError("A scheduler at tls:// needs the options --tls-ca, --tls-cert and --tls-key.")
    if not secured and files != (None, None, None):
        raise ParameterError("The options --tls-ca, --tls-cert and --tls-key need a --scheduler at tls://.")
    if args.dashboard is not None and not 0 <= args.dashboard <= LAST_PORT:
        raise ParameterError(f"--dashboard must be a number from 0 to {LAST_PORT}, not {args.dashboard}.")
    if args.scheduler and args.dashboard is not None:
        raise ParameterError("The option --dashboard is for local workers: a running scheduler has its own.")
    if args.scheduler and not secured:
        progress.warning(
            f"{args.scheduler} is not secured: everybody who reaches it can run programs on its workers. "
            "docs/scaling.md describes tls://."
        )
    return files if secured else ()
