"""The Python packages that Rail Extract needs beyond QGIS: which are missing, and how to install them."""

from __future__ import annotations

import sys
import sysconfig
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path


@dataclass(frozen=True)
class Package:
    """A package by the name that Python imports and the name that pip installs."""

    module: str
    requirement: str


PACKAGES = (
    Package("numpy", "numpy"),
    Package("scipy", "scipy"),
    Package("laspy", "laspy[lazrs]"),
    Package("lazrs", "laspy[lazrs]"),
    Package("cv2", "opencv-python-headless"),
    Package("pyproj", "pyproj"),
    Package("torch", "torch"),
)
"""All that an algorithm may need; requirements.txt lists the same without what belongs to QGIS."""

OWNED_BY_QGIS = ("numpy", "scipy")
"""Held at the version QGIS came with, since its own parts are built against them."""


def missing_packages(needs: tuple[tuple[str, ...], ...]) -> tuple[Package, ...]:
    """Look for modules without importing them.

    Parameters
    ----------
    needs : tuple of tuple of str
        Modules of `PACKAGES`; each need is met by any one of its modules.

    Returns
    -------
    tuple of Package
        The first choice of every need that is not met.
    """
    unmet = {modules[0] for modules in needs if all(find_spec(module) is None for module in modules)}
    return tuple(package for package in PACKAGES if package.module in unmet)


def install_command(packages: tuple[Package, ...]) -> str:
    """Command line that installs `packages` for the Python of this QGIS and leaves QGIS's own packages alone."""
    options = ["--user"]
    if (Path(sysconfig.get_path("stdlib")) / "EXTERNALLY-MANAGED").exists():
        options.append("--break-system-packages")
    requirements = list(dict.fromkeys(package.requirement for package in packages))
    words = [_interpreter(), "-m", "pip", "install", *options, *_pins(), *requirements]
    return " ".join(f'"{word}"' if set(word) & set(" [") else word for word in words)


def explain_missing(packages: tuple[Package, ...]) -> str:
    """One sentence that names the missing packages and the command that installs them."""
    names = ", ".join(package.module for package in packages)
    noun = "package" if len(packages) == 1 else "packages"
    return f"Missing Python {noun} {names}: run {install_command(packages)} and restart QGIS."


def _interpreter() -> str:
    """Python program of this QGIS: `sys.executable` may be QGIS itself, or another Python that comes first on PATH."""
    prefix = Path(sys.prefix)
    candidates = (prefix / "python.exe", Path(sys.executable).parent / "bin" / "python3", prefix / "bin" / "python3")
    return next((str(path) for path in candidates if path.exists()), "python3")


def _pins() -> list[str]:
    pins = []
    for name in OWNED_BY_QGIS:
        try:
            pins.append(f"{name}=={metadata.version(name)}")
        except metadata.PackageNotFoundError:
            continue
    return pins
