"""Install Packages: installs missing Python packages into a folder of the user's profile."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

from ...core.errors import Cancelled, ParameterError, RailExtractError
from ...core.jobs.declaration import SETUP, Choice, Figure
from ...core.jobs.values import Job as Declared
from ...core.progress import Progress
from ..dialog.parameter_values import ParameterValues
from ..notices import notices
from ..setup import package_folders
from ..setup.dependencies import INSTALL, OPTIONAL, PACKAGES, is_installed
from .base import RailAlgorithm

BUILDS = {
    ("CPU", "linux"): ("--index-url", "https://download.pytorch.org/whl/cpu"),
    ("CUDA", "win32"): ("--index-url", "https://download.pytorch.org/whl/cu126"),
}
"""Options for pip where the default index has no such build of PyTorch for a system."""


JOB = Declared(
    INSTALL,
    "Install packages",
    "Installs the Python packages that Rail Extract needs and this QGIS lacks.",
    "The packages go into a folder of your QGIS profile, in versions that work with the numpy and scipy of QGIS. "
    "QGIS itself is not changed, administrator rights are not needed, and packages that are already installed are "
    "skipped. An internet connection is required.\n\n"
    "PyTorch is optional: with it, the network can use a GPU, and the network of the paper runs faster than with "
    "OpenCV. With the smaller network, which is the default, a run on the sample takes as long with OpenCV. The "
    "download is about 200 MB for the processor and several GB for an Nvidia GPU.\n\n"
    "All files are compared with a list of checksums in the plugin, except the builds that only PyTorch's own index "
    "has, for processors on Linux and Nvidia GPUs on Windows: they are compared with the checksums of that index.",
    ("rail", "setup", "install", "python", "pip", "dependencies", "laspy", "opencv", "torch", "pytorch"),
    parameters=(
        Choice(
            "TORCH",
            "PyTorch",
            "NONE does not install PyTorch; OpenCV runs the network. CPU works on any computer. CUDA needs an Nvidia "
            "GPU.",
            options=("NONE", "CPU", "CUDA"),
            default="NONE",
        ),
    ),
    figures=(
        Figure("FOLDER", "Folder of the packages", "folder"),
        Figure("INSTALLED", "Installed packages", "text"),
    ),
    group=SETUP,
    guide="troubleshooting",
)


@dataclass(frozen=True)
class Job:
    """What to install: requirements by module, and the build of PyTorch or None."""

    packages: dict[str, str]
    torch: str | None


class InstallPackages(RailAlgorithm):
    """The algorithm ``railextract:installpackages``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Find what is missing."""
        build = values["TORCH"]
        if build == "CUDA" and sys.platform == "darwin":
            raise ParameterError("There is no CUDA on macOS: set TORCH to CPU.")
        needed = [package for package in PACKAGES if package.module not in OPTIONAL]
        missing = {package.module: package.requirement for package in needed if not is_installed(package.module)}
        return Job(missing, None if build == "NONE" or is_installed("torch") else build)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Install what is missing; PyTorch last, because it may fail on its own."""
        from ..setup.installation import Order, install
        from ..setup.interpreter import find_interpreter

        orders = []
        if job.packages:
            orders.append(Order(tuple(dict.fromkeys(job.packages.values())), tuple(job.packages)))
        if job.torch:
            orders.append(Order(("torch",), ("torch",), BUILDS.get((job.torch, sys.platform), ())))
        folder = package_folders.own_folder()
        if not orders:
            notices.packages_installed.emit()
            progress.info("All packages are installed; there is nothing to do.")
            return {"FOLDER": str(folder), "INSTALLED": ""}
        interpreter = find_interpreter()
        progress.info(f"Python: {interpreter.program}")
        installed = []
        for order, share in zip(orders, progress.split(len(orders))):
            try:
                installed.append(install(order, interpreter, folder, package_folders.folders(), share))
            except (RailExtractError, Cancelled) as error:
                if not installed:
                    raise
                reason = str(error) or "Cancelled."
                raise RailExtractError("{} Already installed: {}.".format(reason, ", ".join(installed))) from error
            package_folders.use()
        progress.info("Installed: {} in {}".format(", ".join(installed), folder))
        notices.packages_installed.emit()
        return {"FOLDER": str(folder), "INSTALLED": ", ".join(installed)}
