"""Installs Python packages with pip into a separate folder; the packages of QGIS stay unchanged."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from ...core.disk import scratch_folder, sweep
from ...core.errors import RailExtractError
from ...core.progress import SILENT, Progress
from . import processes
from .dependencies import OWNED_BY_QGIS, is_installed, pins
from .interpreter import Interpreter
from .locked import Locked, locked_order, locked_packages

MIN_PIP = (22, 2)
"""The first version that can report what it would install."""

PIP_ENVIRONMENT = {
    "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    "PIP_NO_INPUT": "1",
    "PIP_PROGRESS_BAR": "off",
    "PIP_REQUIRE_HASHES": "0",
    "PIP_REQUIRE_VIRTUALENV": "0",
    "PIP_RETRIES": "2",
    "PIP_ROOT_USER_ACTION": "ignore",
    "PIP_USER": "0",
    "PYTHONIOENCODING": "utf-8",
    "PYTHONSAFEPATH": "1",
}
"""Settings that override the user's own, where those would conflict with a separate folder or a run without a shell."""

WRONG_FILE = "DO NOT MATCH THE HASHES"
"""What pip says about a file with another checksum."""

BINARIES = "--only-binary=:all:"
"""No user should need a compiler."""

IMPORT = (
    "import sys; end = int(sys.argv[1]); sys.path += sys.argv[2:end]; [__import__(name) for name in sys.argv[end:]]"
)


@dataclass(frozen=True)
class Order:
    """What to install: requirements for pip, modules that must be importable afterwards, and options for pip."""

    requirements: tuple[str, ...]
    modules: tuple[str, ...]
    options: tuple[str, ...] = ()


class Pip:
    """The pip of QGIS's Python, with a folder for temporary files, and further folders of packages than its own."""

    def __init__(self, interpreter: Interpreter, temporary: Path, folders: Sequence[Path]) -> None:
        self._program = interpreter.program
        self._temporary = temporary
        self._paths = [*filter(None, [_inherited()]), *map(str, folders)]
        self._changes = {**interpreter.changes, **PIP_ENVIRONMENT}

    def prepare(self, locked: Mapping[str, Locked], progress: Progress) -> None:
        """Check that pip is installed, and get a newer one if it is too old.

        Raises RailExtractError if there is no pip, or no newer one can be installed.
        """
        version = re.match(r"pip (\d+)\.(\d+)", self._run("--version").output)
        if version is None:
            raise RailExtractError(
                f"The Python of this QGIS, {self._program}, has no pip: install it (Debian and Ubuntu: the package "
                "python3-pip; OSGeo4W: the package python3-pip) and run Install packages again."
            )
        if tuple(map(int, version.groups())) < MIN_PIP:
            newer = self._temporary / "pip"
            if "pip" in locked:
                self.download([locked["pip"]], newer, [], progress)
            else:
                self._install(["pip"], ["--target", str(newer), "pip"], progress)
            self._paths.insert(0, str(newer))

    def resolve(self, order: Order, locked: Mapping[str, Locked], progress: Progress) -> list[Locked]:
        """Return the files that an order would add: those that are locked, otherwise those that the index names."""
        report, constraints = self._temporary / "report.json", self._temporary / "constraints.txt"
        if order.options:
            locked = {}
            progress.info(
                f"The files of {', '.join(order.requirements)} come from an index of their own, {order.options[-1]}: "
                "they are compared with its checksums, because this plugin has none of them."
            )
        versions = [package.requirement for name, package in locked.items() if _version_in_qgis(name) is None]
        constraints.write_text("\n".join([*pins(), *versions]), encoding="utf-8")
        options = ["--dry-run", "--report", str(report), "--constraint", str(constraints), *order.options]
        self._install(order.requirements, [*options, *order.requirements], progress)
        found = [_found(item) for item in json.loads(report.read_text(encoding="utf-8"))["install"]]
        originals = {package.requirement: package for package in locked.values()}
        return [originals.get(package.requirement, package) for package in found]

    def download(self, packages: Sequence[Locked], target: Path, options: Sequence[str], progress: Progress) -> None:
        """Install packages into a folder if their files have the right checksums."""
        listed = self._temporary / "requirements.txt"
        listed.write_text("\n".join(package.checked_requirement for package in packages), encoding="utf-8")
        call = ["--no-deps", "--require-hashes", "--requirement", str(listed), "--target", str(target), *options]
        self._install([package.requirement for package in packages], call, progress)

    def _install(self, names: Sequence[str], arguments: Sequence[str], progress: Progress) -> None:
        """Run pip install; raises RailExtractError with these names if it fails."""
        completed = self._run("install", BINARIES, *arguments, progress=progress)
        if completed.code == 0:
            return
        if WRONG_FILE in completed.output:
            raise RailExtractError(
                f"The downloaded files of {', '.join(names)} are not the original ones and may be harmful: check the "
                "package index in the settings of pip. No files were kept."
            )
        reasons = re.findall(r"^ERROR: (.*)$", completed.output, re.MULTILINE) or ["see the log"]
        raise RailExtractError(
            f"pip could not install {', '.join(names)} ({reasons[-1].rstrip('.')}): check the connection to "
            "the package index and the free disk space. No files were kept."
        )

    def check_imports(self, modules: Sequence[str], folders: Sequence[Path]) -> None:
        """Check that QGIS will be able to import modules; raises RailExtractError if it won't."""
        paths = list(map(str, folders))
        arguments = ["-c", IMPORT, str(len(paths) + 2), *paths, *modules]
        completed = processes.run(self._program, arguments, self._changes)
        if completed.code != 0:
            reason = completed.output.strip().splitlines()[-1:] or ["it crashed"]
            raise RailExtractError(
                f"{', '.join(modules)} does not work in the Python of this QGIS ({reason[0]}). No files were kept."
            )

    def _run(self, *arguments: str, progress: Progress = SILENT) -> processes.Completed:
        changes = {**self._changes, "PYTHONPATH": os.pathsep.join(self._paths)}
        return processes.run(self._program, ["-m", "pip", *arguments], changes, progress)


def install(order: Order, interpreter: Interpreter, folder: Path, others: Sequence[Path], progress: Progress) -> str:
    """Install packages into `folder`, either all of them or none, and return their names and versions.

    The folder is created if it does not exist; `others` are further ones that QGIS uses. Raises RailExtractError if pip
    failed, the folder cannot be written, or the packages do not work with those of QGIS.
    """
    locked = locked_packages()
    with _temporary_folder(folder) as temporary:
        pip = Pip(interpreter, temporary, [*others, folder])
        pip.prepare(locked, progress.span(0, 0.1))
        ordered = locked_order(order.requirements, locked)
        if ordered is None:
            wanted = _beyond_qgis(pip.resolve(order, locked, progress), progress)
        else:
            wanted = [package for package in ordered if _version_in_qgis(package.name) is None]
        progress.set_fraction(0.3)
        staging = temporary / "packages"
        if wanted:
            pip.download(wanted, staging, order.options, progress)
        progress.set_fraction(0.8)
        pip.check_imports(order.modules, [*others, folder, staging])
        if wanted:
            _move(staging, folder)
    return ", ".join(f"{package.name} {package.version}" for package in wanted)


def normalized(name: str) -> str:
    """Return a package's name in the normalized spelling, in which names can be compared."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _found(item: Mapping[str, Any]) -> Locked:
    """Return a package of pip's report, with the checksum that the index names; pip before 23.1 writes it as "hash"."""
    facts, archive = item["metadata"], item["download_info"]["archive_info"]
    checksum = f"sha256:{archive['hashes']['sha256']}" if "hashes" in archive else archive["hash"].replace("=", ":")
    return Locked(normalized(facts["name"]), facts["version"], (checksum,))


def _beyond_qgis(found: Sequence[Locked], progress: Progress) -> list[Locked]:
    """Leave out packages that QGIS has: they come first on the path, and stay."""
    wanted = []
    for package in found:
        present = _version_in_qgis(package.name)
        if present is None:
            wanted.append(package)
        else:
            progress.warning(f"QGIS has {package.name} {present}, which is used instead of {package.version}.")
    return wanted


def _version_in_qgis(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "of its own" if name in OWNED_BY_QGIS and is_installed(name) else None


def _inherited() -> str:
    return os.environ.get("PYTHONPATH", "")


@contextmanager
def _temporary_folder(folder: Path) -> Iterator[Path]:
    """Create a temporary folder next to `folder`, and delete it afterwards in any case."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        sweep(folder.parent)
        with scratch_folder(folder.parent) as temporary:
            yield temporary
    except OSError as error:
        raise RailExtractError(
            f"{folder} can't be written ({error}): free disk space, or make the folder writable."
        ) from error


def _move(staging: Path, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for entry in staging.iterdir():
        old = folder / entry.name
        if old.is_dir():
            shutil.rmtree(old)
        entry.replace(old)
