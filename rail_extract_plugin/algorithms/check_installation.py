"""Check Installation: versions, engine, models, and a short test run."""

from __future__ import annotations

import platform
import sys
from typing import Any

from qgis.core import (
    Qgis,
    QgsProcessingContext,
    QgsProcessingOutputBoolean,
    QgsProcessingOutputString,
)

from ...core.errors import RailExtractError
from ...core.progress import Progress
from ..dialog import outputs
from ..i18n import tr
from ..setup.dependencies import missing_packages
from ..writing.reports import write_check
from .base import RailAlgorithm
from .extract_rails import ExtractRails
from .toolbox_groups import SETUP


class CheckInstallation(RailAlgorithm):
    """The algorithm ``railextract:checkinstallation``."""

    NAME = "checkinstallation"
    LABEL = "Check installation"
    GROUP = SETUP
    GUIDE = "troubleshooting"
    TAGS = ("rail", "setup", "version", "versions", "test", "diagnose", "support", "gpu", "cuda", "engine")
    SUMMARY = "Lists the versions, the engine and the models in use, and tests them on a short piece of track."
    HELP = (
        "Takes less than a minute. It extracts 20 m of the sample that comes with the plugin and compares the lines "
        "with the true rails. Include the output in every bug report."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the outputs; without the report among them, QGIS would open no dialog and show no result."""
        self._add_report(outputs.check_report())
        for name, label in (
            ("VERSIONS", tr("Versions of QGIS, Python and packages")),
            ("MODELS", tr("State of the models")),
            ("ENGINE_USED", tr("Engine and device that run the network")),
            ("SELF_TEST", tr("Result of the test")),
        ):
            self.addOutput(QgsProcessingOutputString(name, label))
        self.addOutput(QgsProcessingOutputBoolean("PASSED", tr("Whether all checks passed")))

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> None:
        """Read nothing: there are no parameters."""

    def compute(
        self, job: None, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Check everything, and report it line by line."""
        from ..setup import self_test

        versions = {
            "QGIS": Qgis.QGIS_VERSION,
            "Python": f"{platform.python_version()} ({sys.executable})",
            "system": platform.platform(),
            **{module: self_test.version(module) for module in self_test.MODULES},
        }
        models = self_test.model_states()
        found = {**versions, **{f"model {name}": state for name, state in models.items()}}
        for name, text in found.items():
            progress.info(f"{name}: {text}")
        passed, words, engine = self._test(progress)
        if passed and set(models.values()) != {"ok"}:
            passed, words = False, tr("{}, but the weights are not those of the release").format(words)
        verdict = tr("passed") if passed else tr("failed")
        sentence = tr("Rail Extract works here.") if passed else tr("Rail Extract does not work here.")
        (progress.info if passed else progress.warning)(f"{sentence} Self test {verdict}: {words}.")
        facts = {tr("Self test"): f"{verdict}: {words}", tr("Engine"): engine or tr("none"), **found}
        return {
            **write_check(self, "REPORT", sentence, facts, parameters, context),
            "VERSIONS": _joined(versions),
            "MODELS": _joined(models),
            "ENGINE_USED": engine,
            "SELF_TEST": f"{verdict}: {words}",
            "PASSED": passed,
        }

    def _test(self, progress: Progress) -> tuple[bool, str, str]:
        """Run the test if all packages for it are installed."""
        from ..setup import self_test

        missing = missing_packages(ExtractRails.NEEDS)
        if missing:
            names = ", ".join(package.module for package in missing)
            return False, tr("{} missing: run Install packages").format(names), ""
        try:
            return self_test.extract_sample(progress)
        except (RailExtractError, ImportError) as error:
            return False, str(error).rstrip("."), ""


def _joined(texts: dict[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in texts.items())
