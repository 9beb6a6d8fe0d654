"""Base of all algorithms: how they appear in the toolbox, check their values, run and report errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
from ...core.fields import Field
from ...core.kernels import blas, one_thread
from ...core.progress import Progress
from ..dialog.checks import check_values, explain_invalid
from ..dialog.definitions import Definitions
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
from ..writing.run import new_run
from ..writing.styling import NO_PROPERTIES
from .sentences import COMMAND_LINE, sentence_for
from .toolbox_groups import RAILS, STEPS, Group

# Search terms, also in the languages of the larger railways: the toolbox search compares whole words.
RAIL_WORDS = (
    "rail",
    "rails",
    "railway",
    "railroad",
    "track",
    "Gleis",
    "Schiene",
    "Bahn",
    "voie ferrée",
    "vía",
    "binario",
)
CLOUD_WORDS = ("lidar", "las", "laz", "copc", "point cloud", "laser scanning", "Punktwolke", "nuage de points")
TRACK_WORDS = ("gauge", "cant", "superelevation", "alignment", "Spurweite", "Gleisachse", "Überhöhung", "écartement")

ALIGNMENT_WORDS = ("alignment", "elements", "straight", "clothoid", "arc", "Trasse", "Trassierung", "tracé")


class RailAlgorithm(QgsProcessingAlgorithm):
    """An algorithm of Rail Extract in the toolbox.

    A subclass states its name and its needs in the class attributes, its parameters in `definitions`, reads them in
    `read` and computes in `compute`. Modules that depend on `NEEDS` are imported inside these two only.
    """

    NAME = ""
    LABEL = ""
    GROUP: Group = RAILS
    TAGS: tuple[str, ...] = ()
    SUMMARY = ""
    HELP = ""
    FIELDS: tuple[Field, ...] = ()
    """Fields of the main result, for the help on the command line; windows link to the reference."""
    PICTURE = ""
    """File in the folder of pictures, shown in the help panel of the dialog."""
    GUIDE = "parameters"
    """Page of the guide that the Help button opens."""
    PAGES: tuple[str, ...] = ("parameters",)
    """Pages of the guide to which the help panel links."""
    NEEDS: tuple[tuple[str, ...], ...] = ()
    """Required Python modules: of each inner tuple one is enough, and the first is recommended."""

    layer_properties: Mapping[str, str] = NO_PROPERTIES
    """What the layers of a run remember of it; see `writing.run`."""

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        raise NotImplementedError

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs."""
        for definition in self.definitions():
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

        Raises
        ------
        RailExtractError
            A value is wrong or contradicts another.
        """
        raise NotImplementedError

    def compute(self, job: Any, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Compute, write the outputs and return the results by name.

        Parameters
        ----------
        job : object
            What `read` returned.
        values : ParameterValues
        progress : Progress
        """
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
            self.layer_properties = new_run()
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
            return results
        # PyQt keeps what is raised here: with the error as its context, files that it refers to would stay open.
        raise QgsProcessingException(reason)

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
            explain_invalid(definition, parameters.get(definition.name()), context)
            for definition in self.parameterDefinitions()
            if not definition.isDestination()
        )
        return next(filter(None, reasons), None)

    def canExecute(self) -> tuple[bool, str]:
        """Return whether the required packages are installed; the toolbox lists the algorithm in either case."""
        try:
            missing = missing_packages(self.NEEDS)
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
            mate.displayName() for mate in mates if mate.GROUP in (RAILS, STEPS) and not missing_packages(mate.NEEDS)
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
        return self.NAME

    def displayName(self) -> str:
        """Return the label shown in the toolbox."""
        return self.LABEL

    def group(self) -> str:
        """Return the label of the group."""
        return self.GROUP.label

    def groupId(self) -> str:
        """Return the identifier of the group."""
        return self.GROUP.id

    def tags(self) -> list[str]:
        """Return the search terms."""
        return list(self.TAGS)

    def shortDescription(self) -> str:
        """Return the sentence of the tooltip."""
        return self.SUMMARY

    def shortHelpString(self) -> str:
        """Return the text of the help panel; a command line prints no HTML, and the summary and parameters itself."""
        summary, text = self.SUMMARY, self.HELP
        if QgsApplication.platform() == COMMAND_LINE:
            return "\n\n".join((text, *(f"{field.name}: {field.meaning}." for field in self.FIELDS)))
        picture = PICTURES / self.PICTURE if self.PICTURE else None
        return help_panel(summary, picture, text, self.parameterDefinitions(), self.PAGES)

    def helpUrl(self) -> str:
        """Return the address of the guide's page."""
        return guide(self.GUIDE)

    def icon(self) -> QIcon:
        """Return the icon shown in the toolbox."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Return the path of the icon, where QGIS draws it itself."""
        return str(ICONS / f"{self.NAME}.svg")


def _is_page(definition: QgsProcessingParameterDefinition) -> bool:
    return definition.isDestination() and definition.defaultFileExtension() == PAGE
