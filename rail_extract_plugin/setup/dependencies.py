"""The Python packages that Rail Extract needs beyond QGIS: which are missing, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec


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

OPTIONAL = ("torch",)
"""Modules in whose place another one serves."""


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
    unmet = {modules[0] for modules in needs if not any(map(is_installed, modules))}
    return tuple(package for package in PACKAGES if package.module in unmet)


def is_installed(module: str) -> bool:
    """Tell whether Python finds a module; it is not imported."""
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def explain_missing(label: str, packages: Sequence[Package], usable: Sequence[str]) -> str:
    """Say what an algorithm lacks, what to do, and what works without it.

    Parameters
    ----------
    label : str
        Name of the algorithm.
    packages : sequence of Package
    usable : sequence of str
        Names of the algorithms that lack nothing.
    """
    names = ", ".join(package.module for package in packages)
    nouns = "Python package" if len(packages) == 1 else "Python packages"
    others = f" {_listed(usable)} can be used without." if usable else ""
    return (
        f"{label} needs the {nouns} {names}, which this QGIS does not have: run Install packages in the toolbox under "
        f"Rail Extract, or qgis_process run railextract:installpackages in a shell.{others}"
    )


def version_of(module: str) -> str | None:
    """Give the version of a module, which is imported; None where it is not there."""
    return str(getattr(import_module(module), "__version__", "")) if is_installed(module) else None


def pins() -> list[str]:
    """Give requirements that hold what belongs to QGIS at the versions it has."""
    return [f"{name}=={version_of(name)}" for name in OWNED_BY_QGIS if is_installed(name)]


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
