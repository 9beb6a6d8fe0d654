"""Base of all algorithms: how they appear in the toolbox, check their values, run and report errors."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsApplication,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingOutputDefinition,
    QgsProcessingOutputFile,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSink,
)
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QWidget

from ...core.disk import Destination
from ...core.jobs.declaration import RAILS, STEPS
from ...core.jobs.values import Job
from ...core.kernels import blas, one_thread
from ...core.progress import Progress
from ..dialog.checks import check_values, explain_invalid
from ..dialog.definitions import definitions_of
from ..dialog.guide import guide
from ..dialog.help_panel import help_panel
from ..dialog.parameter_values import ParameterValues
from ..dialog.wording import WITH_DIALOGS, for_user
from ..feedback import QgisProgress
from ..notices import notices
from ..paths import ICONS, PICTURES
from ..runs.missing import with_link
from ..runs.running import running
from ..setup.dependencies import explain_missing, missing_packages
from ..writing.destinations import PAGE, appends, check_layer_name, check_page_name, destinations
from ..writing.layers import layer_writers, write_raster
from ..writing.reports import write_shown
from ..writing.run import new_run, properties_of, properties_of_profile
from ..writing.styling import NO_PROPERTIES
from ..writing.whole_files import write_each
from .sentences import COMMAND_LINE, sentence_for

if TYPE_CHECKING:
    from ...core.jobs.result import Rasters

FIGURE_DECIMALS = 3
"""Decimals of the figures of a result: millimetres of lengths in metres, and no more than anybody reads."""


def _rounded(value: Any) -> Any:
    """Return a figure of a result as people read it; what is not a fraction stays as it is."""
    return round(float(value), FIGURE_DECIMALS) + 0.0 if isinstance(value, float) else value


class RailAlgorithm(QgsProcessingAlgorithm):
    """An algorithm of Rail Extract in the toolbox.

    A subclass has the declaration of its job, reads the parameters in `read` and computes in `compute`. Modules that
    depend on what it needs are imported inside these two only.
    """

    JOB: Job
    layer_properties: Mapping[str, str] = NO_PROPERTIES
    """What the layers of a run remember of it; see `writing.run`."""

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs."""
        for definition in definitions_of(self.JOB):
            if isinstance(definition, QgsProcessingOutputDefinition):
                self.addOutput(definition)
            elif _is_page(definition):
                # Declared as a file: the batch dialog of several QGIS versions never ends after a web page.
                self.addParameter(definition, False)
                self.addOutput(QgsProcessingOutputFile(definition.name(), definition.description()))
            else:
                self.addParameter(definition)

    def read(self, values: ParameterValues) -> Any:
        """Read and check the parameters in the main thread, and return what `compute` needs.

        Raises RailExtractError if a value is wrong or contradicts another.
        """
        raise NotImplementedError

    def compute(self, job: Any, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Compute from what `read` returned, write the outputs and return the results by name."""
        raise NotImplementedError

    def checkParameterValues(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        """Check all values before a run; the message uses the terms of the user's platform."""
        try:
            accepted, message = self._check(parameters, context)
            return accepted, for_user(message, self.parameterDefinitions())
        except BaseException as error:
            return False, sentence_for(error, self.parameterDefinitions())

    def _check(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        """Check as QGIS does, then that the outputs can be written, then as `read` does."""
        accepted, message = super().checkParameterValues(parameters, context)
        refusal = self._refusal(parameters, context)
        if refusal or not accepted:
            return False, refusal or message
        accepted, message = self.canExecute()
        if not accepted:
            return False, message
        for output in self.destinationParameterDefinitions():
            value = parameters.get(output.name())
            supported, message = self.provider().isSupportedOutputValue(value, output, context)
            if not supported and not appends(value):  # which QGIS compares as if it were a file name
                return False, f"{message}: choose another one, such as .{output.defaultFileExtension()}."
        self._destinations(parameters, context)
        self._read(parameters, context)
        return True, ""

    def prepareAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> bool:
        """Read the parameters in the main thread; older ``qgis_process`` does not call `canExecute` first."""
        executable, reason = self.canExecute()
        if not executable:
            raise QgsProcessingException(reason)
        try:
            self.destinations = self._destinations(parameters, context)
            self._job = self._read(parameters, context)
            self.layer_properties = new_run(self.displayName(), parameters.get("INPUT"), context)
        except BaseException as error:
            raise QgsProcessingException(sentence_for(error, self.parameterDefinitions())) from None
        return True

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict:
        """Compute in any thread; every error becomes one sentence."""
        progress = QgisProgress(feedback, self.parameterDefinitions())
        progress.status("Loading packages")  # the first run of a session takes a second or two for it
        try:
            with running(feedback), one_thread(*blas()):
                results = self.compute(self._job, ParameterValues(self, parameters, context), progress)
        except BaseException as error:
            reason = sentence_for(error, self.parameterDefinitions())
            notices.run_failed.emit(feedback, type(error))
        else:
            progress.set_fraction(1)
            return {name: _rounded(value) for name, value in results.items()}
        # PyQt keeps what is raised here: with the error as its context, files that it refers to would stay open.
        notices.run_left.emit(sys._getframe())
        raise QgsProcessingException(reason)

    def remember(self, properties: Mapping[str, str]) -> None:
        """Have the layers of the run state further properties."""
        self.layer_properties = {**self.layer_properties, **properties}

    def _destinations(self, parameters: dict[str, Any], context: QgsProcessingContext) -> dict[str, Destination]:
        """Check the files of the outputs, and remember what they replace."""
        outputs = self.destinationParameterDefinitions()
        for output in outputs:
            if isinstance(output, QgsProcessingParameterFeatureSink):
                check_layer_name(output.name(), parameters.get(output.name()), context)
            elif _is_page(output):
                check_page_name(output.name(), parameters.get(output.name()), context)
        return destinations({output.name(): parameters.get(output.name()) for output in outputs}, context)

    def _read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Any:
        """Check the values that need no file, then read the parameters."""
        values = ParameterValues(self, parameters, context)
        check_values(self.parameterDefinitions(), values)
        return self.read(values)

    def _refusal(self, parameters: dict[str, Any], context: QgsProcessingContext) -> str | None:
        """Return what is wrong with the first input that QGIS does not accept."""
        reasons = (
            explain_invalid(one, self.parameterDefinition(one.name), parameters.get(one.name), context)
            for one in self.JOB.parameters
        )
        return next(filter(None, reasons), None)

    def canExecute(self) -> tuple[bool, str]:
        """Return whether the required packages are installed; the toolbox lists the algorithm in either case."""
        try:
            missing = missing_packages(self.JOB.needs)
            if not missing:
                return True, ""
            reason = explain_missing(self.displayName(), missing, self._usable_labels())
            return False, with_link(reason, missing) if QgsApplication.platform() == WITH_DIALOGS else reason
        except BaseException as error:
            return False, sentence_for(error, self.parameterDefinitions())

    def _usable_labels(self) -> list[str]:
        """Labels of the algorithms for classified clouds whose packages are all installed."""
        mates = self.provider().algorithms() if self.provider() else ()
        return [
            mate.displayName()
            for mate in mates
            if mate.JOB.group in (RAILS, STEPS) and not missing_packages(mate.JOB.needs)
        ]

    def createCustomParametersWidget(self, parent: QWidget | None = None) -> QWidget:
        """Return the dialog for one run, which QGIS would build itself otherwise."""
        from ..runs.run_dialog import RunDialog

        return RunDialog(self, parent)

    def createInstance(self) -> RailAlgorithm:
        """Create an instance for a run."""
        return type(self)()

    def name(self) -> str:
        """Return the identifier for scripts and models; it never changes."""
        return self.JOB.name

    def displayName(self) -> str:
        """Return the label shown in the toolbox."""
        return self.JOB.label

    def group(self) -> str:
        """Return the label of the group."""
        return self.JOB.group.label

    def groupId(self) -> str:
        """Return the identifier of the group."""
        return self.JOB.group.id

    def tags(self) -> list[str]:
        """Return the search terms."""
        return list(self.JOB.tags)

    def shortDescription(self) -> str:
        """Return the sentence of the tooltip."""
        return self.JOB.summary

    def shortHelpString(self) -> str:
        """Return the text of the help panel; a command line prints no HTML, and the summary and parameters itself."""
        summary, text = self.JOB.summary, self.JOB.help
        if QgsApplication.platform() == COMMAND_LINE:
            return "\n\n".join((text, *(f"{field.name}: {field.meaning}." for field in self.JOB.fields)))
        picture = PICTURES / self.JOB.picture if self.JOB.picture else None
        return help_panel(summary, picture, text, self.parameterDefinitions(), self.JOB.pages)

    def helpUrl(self) -> str:
        """Return the address of the guide's page."""
        return guide(self.JOB.guide)

    def icon(self) -> QIcon:
        """Return the icon shown in the toolbox."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Return the path of the icon, where QGIS draws it itself."""
        return str(ICONS / f"{self.JOB.name}.svg")


class JobAlgorithm(RailAlgorithm):
    """An algorithm that reads, runs and writes as its job declares."""

    def read(self, values: ParameterValues) -> ParameterValues:
        """Open the layers and check the values."""
        values.open_sources()
        self.JOB.check(values)
        return values

    def compute(self, job: ParameterValues, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Run, then write what is wanted of the result."""
        values.follow(job)
        result = self.JOB.run(values, progress)
        progress.check()
        if result.cloud is not None:
            cloud = values.cloud(result.cloud.name)
            shown = result.cloud.class_codes, result.cloud.head_width_m
            self.remember(properties_of(cloud, *shown, result.frame))
            if result.cloud.profile is not None:
                self.remember(properties_of_profile(result.cloud.profile))
        for sentence in result.sentences:
            progress.info(sentence)
        writers: dict[str, Callable[[], dict[str, str]]] = {
            name: partial(_write_rasters, values, name, make, progress) for name, make in result.rasters.items()
        }
        writers.update(layer_writers(values, result.layers, result.frame))
        writers.update({name: partial(write_shown, values, make, name) for name, make in result.pages.items()})
        return {**write_each(writers, values), **result.figures}


def _write_rasters(
    values: ParameterValues, name: str, make: Callable[[], Rasters | None], progress: Progress
) -> dict[str, str]:
    """Write rasters if they are wanted, and not empty."""
    made = make() if values.wanted(name) else None
    return {} if made is None else write_raster(values, name, *made, progress.span(1, 1))


def _is_page(definition: QgsProcessingParameterDefinition) -> bool:
    return definition.isDestination() and definition.defaultFileExtension() == PAGE
