"""The Python packages that Rail Extract needs and QGIS does not bring, and what to do if some are missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec


@dataclass(frozen=True)
class Package:
    """A package: the name that Python imports, and the requirement that pip installs."""

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
"""All packages that an algorithm may need; requirements.txt lists those that do not come with QGIS."""

OWNED_BY_QGIS = ("numpy", "scipy")
"""Kept at the versions that came with QGIS, because parts of QGIS are built against them."""

OPTIONAL = ("torch",)
"""Modules that another one can replace."""

INSTALL = "installpackages"
"""Name of the algorithm that installs packages."""


def missing_packages(needs: tuple[tuple[str, ...], ...]) -> tuple[Package, ...]:
    """Find out which packages are missing, without importing modules.

    Any one module of an inner tuple is enough; if none is installed, the first one is missing.
    """
    unmet = {modules[0] for modules in needs if not any(map(is_installed, modules))}
    return tuple(package for package in PACKAGES if package.module in unmet)


def is_installed(module: str) -> bool:
    """Return whether Python finds a module, without importing it."""
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def explain_missing(label: str, packages: Sequence[Package], usable: Sequence[str]) -> str:
    """Return a message: which packages an algorithm lacks, the remedy, and which algorithms work without them."""
    names = ", ".join(package.module for package in packages)
    nouns = "Python package" if len(packages) == 1 else "Python packages"
    verb, them = "works" if len(usable) == 1 else "work", "it" if len(packages) == 1 else "them"
    others = f" {_listed(usable)} {verb} without {them}." if usable else ""
    with_torch = any(package.module in OPTIONAL for package in packages)
    choice, option = (", with PyTorch set to CPU,", " -- TORCH=CPU") if with_torch else ("", "")
    return (
        f"{label} needs the {nouns} {names}, which this QGIS does not have: run Install packages{choice} in the "
        f"toolbox under Rail Extract, or qgis_process run railextract:{INSTALL}{option} in a shell.{others}"
    )


def version_of(module: str) -> str | None:
    """Import a module and return its version, or None if it is not installed."""
    return str(getattr(import_module(module), "__version__", "")) if is_installed(module) else None


def pins() -> list[str]:
    """Return requirements that keep the packages of QGIS at their versions."""
    return [f"{name}=={version_of(name)}" for name in OWNED_BY_QGIS if is_installed(name)]


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
