"""Install Packages: puts the Python packages that QGIS lacks into a folder of the user's profile."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

from qgis.core import QgsProcessingContext, QgsProcessingOutputFolder, QgsProcessingOutputString

from ...core.errors import Cancelled, ParameterError, RailExtractError
from ...core.progress import Progress
from ..dialog import parameters as groups
from ..dialog.parameter_values import ParameterValues
from ..i18n import tr
from ..setup import package_folders
from ..setup.dependencies import OPTIONAL, PACKAGES, is_installed
from .base import RailAlgorithm

BUILDS = {
    ("CPU", "linux"): ("--index-url", "https://download.pytorch.org/whl/cpu"),
    ("CUDA", "win32"): ("--index-url", "https://download.pytorch.org/whl/cu126"),
}
"""Where the builds of PyTorch are that the usual index does not have for a system."""


@dataclass(frozen=True)
class Job:
    """What is to be installed: requirements by module, and PyTorch's build or None."""

    packages: dict[str, str]
    torch: str | None


class InstallPackages(RailAlgorithm):
    """The algorithm ``railextract:installpackages``."""

    NAME = "installpackages"
    LABEL = "Install packages"
    GROUP = "Setup"
    GROUP_ID = "setup"
    GUIDE = "troubleshooting"
    TAGS = ("rail", "setup", "install", "python", "pip", "dependencies", "laspy", "opencv", "torch", "pytorch")
    SUMMARY = "Installs the Python packages that Rail Extract needs and this QGIS does not have."
    HELP = (
        "They go into a folder of your QGIS profile, fitted to the numpy and scipy that QGIS came with; nothing that "
        "belongs to QGIS is changed, and no administrator's rights are needed. What is there already is not installed "
        "again. It takes a connection to the internet.\n\n"
        "PyTorch is optional: with it the network runs faster than with OpenCV, and on a GPU. It is a download of "
        "about 200 MB for the processor and of several GB for CUDA."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs."""
        self.addParameter(groups.torch())
        self.addOutput(QgsProcessingOutputFolder("FOLDER", tr("Folder of the packages")))
        self.addOutput(QgsProcessingOutputString("INSTALLED", tr("What was installed")))

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """See what is missing."""
        build = ParameterValues(self, parameters, context).choice("TORCH")
        if build == "CUDA" and sys.platform == "darwin":
            raise ParameterError("There is no CUDA on macOS: set TORCH to CPU.")
        needed = [package for package in PACKAGES if package.module not in OPTIONAL]
        missing = {package.module: package.requirement for package in needed if not is_installed(package.module)}
        return Job(missing, None if build == "NONE" or is_installed("torch") else build)

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Install what is missing, PyTorch last since it may fail on its own."""
        from ..setup.installation import Order, install
        from ..setup.interpreter import find_interpreter

        orders = []
        if job.packages:
            orders.append(Order(tuple(dict.fromkeys(job.packages.values())), tuple(job.packages)))
        if job.torch:
            orders.append(Order(("torch",), ("torch",), BUILDS.get((job.torch, sys.platform), ())))
        folder = package_folders.own_folder()
        if not orders:
            progress.info(tr("All packages are there; nothing is to be done."))
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
                reason = str(error) or tr("Cancelled.")
                raise RailExtractError(tr("{} Kept is {}.").format(reason, ", ".join(installed))) from error
            package_folders.use()
        progress.info(tr("Installed: {} in {}").format(", ".join(installed), folder))
        return {"FOLDER": str(folder), "INSTALLED": ", ".join(installed)}
