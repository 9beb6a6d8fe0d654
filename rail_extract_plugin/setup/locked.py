"""The versions of packages that are installed, and the checksums of their files; tools/lock.py writes the list."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

LIST = Path(__file__).with_name("locked.txt")

SYSTEMS = ("win32-amd64", "linux-x86_64", "linux-aarch64", "darwin-x86_64", "darwin-arm64")
"""Systems and processors of which the list has the files."""

BROUGHT = {
    "laspy[lazrs]": ("laspy", "lazrs"),
    "opencv-python-headless": ("opencv-python-headless",),
    "pyproj": ("pyproj", "certifi"),
}
"""What each requirement installs besides packages of QGIS: pip would have to download all files to find that out."""


@dataclass(frozen=True)
class Locked:
    """A version of a package, and the checksums of its files for all systems."""

    name: str
    version: str
    checksums: tuple[str, ...]

    @property
    def requirement(self) -> str:
        """The version in the syntax of pip."""
        return f"{self.name}=={self.version}"

    @property
    def checked_requirement(self) -> str:
        """A line of a requirements file by which pip accepts only these files."""
        return " ".join([self.requirement, *(f"--hash={checksum}" for checksum in self.checksums)])


def locked_packages() -> dict[str, Locked]:
    """Return the packages of the list for this Python, by name; none on a system of which the list has no files."""
    system, python = f"{sys.platform}-{platform.machine().lower()}", "{}.{}".format(*sys.version_info)
    here = {python, f"{python}:{system}"} if system in SYSTEMS else set()
    return {locked.name: locked for locked, places in _listed() if here.intersection(places)}


def locked_order(requirements: Sequence[str], locked: Mapping[str, Locked]) -> list[Locked] | None:
    """Return all packages of an order, or None if the list does not have all of them."""
    names = dict.fromkeys(name for requirement in requirements for name in BROUGHT.get(requirement, (requirement,)))
    known = set(requirements) <= set(BROUGHT) and set(names) <= set(locked)
    return [locked[name] for name in names] if known else None


def _listed() -> Iterator[tuple[Locked, list[str]]]:
    """Yield each version in the list, and the Pythons it is for, each on all systems or, after a colon, on one."""
    for line in LIST.read_text(encoding="ascii").splitlines():
        if not line.startswith("#"):
            requirement, places, *checksums = line.split()
            name, version = requirement.split("==")
            yield Locked(name, version, tuple(checksums)), places.split(",")
