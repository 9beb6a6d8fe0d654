"""What all algorithms of Rail Extract share: how they appear, check, prepare, run and fail."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsApplication,
    QgsPointCloudLayer,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingParameterPointCloudLayer,
)
from qgis.PyQt.QtGui import QIcon

from ...core.errors import Cancelled, RailExtractError
from ...core.progress import Progress
from ..dialog.checks import check_values, explain_invalid
from ..dialog.guide import guide
from ..dialog.help_panel import help_panel
from ..dialog.parameter_values import ParameterValues
from ..dialog.wording import for_user
from ..feedback import QgisProgress
from ..i18n import tr
from ..paths import ICONS, PICTURES
from ..setup.dependencies import explain_missing, missing_packages
from ..writing.destinations import check_distinct, check_writable

# What people search for, also in the languages of the larger railways; the search looks at the words as they stand.
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

COMMAND_LINE = "qgis_process"
"""What QGIS calls the platform of its command line."""


class RailAlgorithm(QgsProcessingAlgorithm):
    """A step of Rail Extract in the toolbox.

    A subclass says in the attributes what it is called and needs, declares its parameters in `initAlgorithm`, reads
    them in `read` and computes in `compute`, the only method that may import what depends on `NEEDS`.
    """

    NAME = ""
    LABEL = ""
    GROUP = "Rails and tracks"
    GROUP_ID = "railsandtracks"
    TAGS: tuple[str, ...] = ()
    SUMMARY = ""
    HELP = ""
    PICTURE = ""
    """File in the folder of pictures, shown beside the dialog."""
    GUIDE = "parameters"
    """Page of the guide that the dialog's help button opens."""
    NEEDS: tuple[tuple[str, ...], ...] = ()
    """Python modules without which it can't run; any one of those in a need meets it, the first is recommended."""

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Any:
        """Turn the parameters into what `compute` needs, and check them; runs in the main thread.

        Raises
        ------
        RailExtractError
            A value is wrong or contradicts another.
        """
        raise NotImplementedError

    def compute(self, job: Any, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress) -> dict:
        """Do the work, then write the outputs, and return the results by name."""
        raise NotImplementedError

    def checkParameterValues(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        """Check all values before a run, and say what is wrong in words of whom QGIS shows it to."""
        accepted, message = self._check(parameters, context)
        return accepted, for_user(message, self.parameterDefinitions())

    def _check(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        """Check as QGIS does, then whether outputs can be written, then as `read` does."""
        accepted, message = super().checkParameterValues(self._with_paths_accepted(parameters), context)
        if not accepted:
            return False, self._refusal(parameters, context) or message
        accepted, message = self.canExecute()
        if not accepted:
            return False, message
        try:
            for output in self.destinationParameterDefinitions():
                value = parameters.get(output.name())
                supported, message = self.provider().isSupportedOutputValue(value, output, context)
                if not supported:
                    return False, f"{message}: choose another one, such as .{output.defaultFileExtension()}."
                check_writable(value, context)
            outputs = self.destinationParameterDefinitions()
            check_distinct({output.name(): parameters.get(output.name()) for output in outputs}, context)
            self._read(parameters, context)
        except RailExtractError as error:
            return False, str(error)
        return True, ""

    def prepareAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> bool:
        """Read the parameters in the main thread; older ``qgis_process`` asks no `canExecute` before."""
        executable, reason = self.canExecute()
        if not executable:
            raise QgsProcessingException(reason)
        try:
            self._job = self._read(parameters, context)
        except RailExtractError as error:
            raise QgsProcessingException(for_user(str(error), self.parameterDefinitions())) from None
        return True

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict:
        """Compute in any thread; every failure that a user can remedy is one sentence."""
        progress = QgisProgress(feedback, self.parameterDefinitions())
        try:
            results = self.compute(self._job, parameters, context, progress)
        except RailExtractError as error:
            raise QgsProcessingException(for_user(str(error), self.parameterDefinitions())) from None
        except Cancelled:
            raise QgsProcessingException(tr("Cancelled; nothing was written.")) from None
        except MemoryError:
            raise QgsProcessingException(tr("The memory does not suffice: choose a smaller extent.")) from None
        progress.set_fraction(1)
        return results

    def _read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Any:
        """Read the parameters, after a look at those that need no file."""
        check_values(self.parameterDefinitions(), ParameterValues(self, parameters, context))
        return self.read(parameters, context)

    def _refusal(self, parameters: dict[str, Any], context: QgsProcessingContext) -> str | None:
        """Say what is wrong with the first value that QGIS does not accept, outputs aside."""
        accepted = self._with_paths_accepted(parameters)
        told = (
            explain_invalid(definition, accepted.get(definition.name()), context)
            for definition in self.parameterDefinitions()
            if not definition.isDestination()
        )
        return next(filter(None, told), None)

    def _with_paths_accepted(self, parameters: dict[str, Any]) -> dict[str, Any]:
        """Put a layer object in place of paths of clouds: QGIS refuses all that its build can't open; `read` checks."""
        stand_ins = {
            definition.name(): QgsPointCloudLayer("", "", "")
            for definition in self.parameterDefinitions()
            if isinstance(definition, QgsProcessingParameterPointCloudLayer) and parameters.get(definition.name())
        }
        return {**parameters, **stand_ins}

    def canExecute(self) -> tuple[bool, str]:
        """Tell whether the needed packages are there; the algorithm stands in the toolbox in any case."""
        missing = missing_packages(self.NEEDS)
        return (False, explain_missing(self.displayName(), missing, self._usable_labels())) if missing else (True, "")

    def _usable_labels(self) -> list[str]:
        """Names of the provider's algorithms in this one's group that lack no package."""
        mates = self.provider().algorithms() if self.provider() else ()
        return [
            mate.displayName() for mate in mates if mate.GROUP_ID == self.GROUP_ID and not missing_packages(mate.NEEDS)
        ]

    def createInstance(self) -> RailAlgorithm:
        """Make another one, for a run of its own."""
        return type(self)()

    def name(self) -> str:
        """Give the identifier that scripts and models use; it never changes."""
        return self.NAME

    def displayName(self) -> str:
        """Give the name shown in the toolbox."""
        return tr(self.LABEL)

    def group(self) -> str:
        """Give the group shown in the toolbox."""
        return tr(self.GROUP)

    def groupId(self) -> str:
        """Give the group's identifier."""
        return self.GROUP_ID

    def tags(self) -> list[str]:
        """Give words that the toolbox search finds it by."""
        return [tr(tag) for tag in self.TAGS]

    def shortDescription(self) -> str:
        """Give the sentence shown under the mouse."""
        return tr(self.SUMMARY)

    def shortHelpString(self) -> str:
        """Give the text beside the dialog; a command line prints summary and parameters itself, and no HTML."""
        summary, text = tr(self.SUMMARY), tr(self.HELP)
        if QgsApplication.platform() == COMMAND_LINE:
            return text
        return help_panel(summary, PICTURES / self.PICTURE if self.PICTURE else None, text, self.parameterDefinitions())

    def helpUrl(self) -> str:
        """Give the address of the guide."""
        return guide(self.GUIDE)

    def icon(self) -> QIcon:
        """Give the icon shown in the toolbox."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Give the same icon for places that draw it themselves."""
        return str(ICONS / f"{self.NAME}.svg")
