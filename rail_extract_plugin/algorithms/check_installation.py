"""Check Installation: versions, engine, models, and a short test run."""

from __future__ import annotations

import platform
import sys
from dataclasses import replace
from typing import Any

from qgis.core import Qgis

from ...core.errors import RailExtractError
from ...core.jobs import extract_rails
from ...core.jobs.declaration import SETUP, Figure
from ...core.jobs.outputs import REPORT
from ...core.jobs.values import Job
from ...core.progress import Progress
from ..dialog.parameter_values import ParameterValues
from ..setup.dependencies import missing_packages
from ..writing.reports import write_check
from .base import RailAlgorithm

JOB = Job(
    "checkinstallation",
    "Check installation",
    "Lists the versions, the engine and the models in use, and tests them on a short piece of track.",
    "Takes less than a minute. It extracts 20 m of the sample that comes with the plugin and compares the lines "
    "with the true rails. Include the output in every bug report.",
    ("rail", "setup", "version", "versions", "test", "diagnose", "support", "gpu", "cuda", "engine"),
    # Without the report among the outputs, QGIS would open no dialog and show no result.
    outputs=(replace(REPORT, help="A web page with the result, to be attached to bug reports."),),
    figures=(
        Figure("VERSIONS", "Versions of QGIS, Python and packages", "text"),
        Figure("MODELS", "State of the models", "text"),
        Figure("ENGINE_USED", "Engine and device that run the network", "text"),
        Figure("SELF_TEST", "Result of the test", "text"),
        Figure("PASSED", "Whether all checks passed", "flag"),
    ),
    group=SETUP,
    guide="troubleshooting",
)


class CheckInstallation(RailAlgorithm):
    """The algorithm ``railextract:checkinstallation``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> None:
        """Read nothing: there are no parameters."""

    def compute(self, job: None, values: ParameterValues, progress: Progress) -> dict[str, Any]:
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
            passed, words = False, f"{words}, but the weights are not those of the release"
        verdict = "passed" if passed else "failed"
        sentence = "Rail Extract works here." if passed else "Rail Extract does not work here."
        (progress.info if passed else progress.warning)(f"{sentence} Self test {verdict}: {words}.")
        facts = {"Self test": f"{verdict}: {words}", "Engine": engine or "none", **found}
        return {
            **write_check(values, sentence, facts),
            "VERSIONS": _joined(versions),
            "MODELS": _joined(models),
            "ENGINE_USED": engine,
            "SELF_TEST": f"{verdict}: {words}",
            "PASSED": passed,
        }

    def _test(self, progress: Progress) -> tuple[bool, str, str]:
        """Run the test if all packages for it are installed."""
        from ..setup import self_test

        missing = missing_packages(extract_rails.JOB.needs)
        if missing:
            names = ", ".join(package.module for package in missing)
            return False, f"{names} missing: run Install packages", ""
        try:
            return self_test.extract_sample(progress)
        except (RailExtractError, ImportError) as error:
            return False, str(error).rstrip("."), ""


def _joined(texts: dict[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in texts.items())
