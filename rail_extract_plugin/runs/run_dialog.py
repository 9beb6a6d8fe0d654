"""The dialog for one run: QGIS's own, with sections, lists that ignore a passing wheel, and links in the log.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from processing.gui.AlgorithmDialog import AlgorithmDialog
from processing.gui.ParametersPanel import ParametersPanel
from qgis.core import (
    Qgis,
    QgsApplication,
    QgsPointCloudLayer,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingParameterDefinition,
    QgsProject,
)
from qgis.PyQt import sip
from qgis.PyQt.QtWidgets import (
    QDialogButtonBox,
    QGroupBox,
    QLabel,
    QPushButton,
    QTextBrowser,
    QTextEdit,
    QVBoxLayout,
    QWidget,
)
from qgis.utils import iface

from ...core.errors import RailExtractError
from ..dialog.help_panel import ADVANCED
from ..dialog.sections import OTHERS, RESULTS, SECTIONS, section_of
from ..dialog.wheel import ignore_wheel
from ..dialog.wording import with_labels
from ..links import LinkFollower, links
from ..notices import notices
from ..paths import is_sample
from ..writing.run import cloud_of
from . import preview
from .help_pictures import PictureFitter
from .next_steps import Step, after_failure, after_success

EXTRACT = "extractrails"
"""Algorithm that a part of the cloud may be tried with."""


class RunDialog(AlgorithmDialog):
    """Opens on an algorithm of the plugin.

    `given` has the values of the run that this one goes on with, also for parameters that only later steps have.
    """

    def __init__(self, algorithm: QgsProcessingAlgorithm, parent: QWidget | None = None) -> None:
        super().__init__(algorithm, parent=parent)
        ignore_wheel(self.mainWidget())
        self._follower = LinkFollower(self.findChild(QTextEdit, "txtLog"))
        self._fitter = PictureFitter(self.findChild(QTextBrowser, "textShortHelp"))
        self.given: dict[str, Any] = {}
        self._failure: type | None = None
        self._is_preview = False
        self._standard = ""
        self._part = ""
        self._try_button: QPushButton | None = None
        if algorithm.name() == EXTRACT:
            self._try_button = QPushButton(preview.TEXT)
            self._try_button.setToolTip(preview.TIP)
            self._try_button.clicked.connect(lambda: self.try_part())
            self.buttonBox().addButton(self._try_button, QDialogButtonBox.ButtonRole.ResetRole)
        notices.run_failed.connect(self._note_failure)
        notices.standard_proposed.connect(self._note_standard)

    def getParametersPanel(self, alg: QgsProcessingAlgorithm, parent: QWidget) -> ParametersPanel:
        """Return the fields; `AlgorithmDialog` asks for them."""
        return _Panel(parent, alg, self.in_place, self.active_layer)

    def try_part(self) -> None:
        """Run on the part of the cloud that the map shows."""
        try:
            cloud = self.mainWidget().wrappers["INPUT"].parameterValue()
            self._part = preview.visible_part(cloud, iface.mapCanvas())
        except RailExtractError as error:
            self.messageBar().pushMessage("", str(error), Qgis.MessageLevel.Warning, 0)
            return
        self.run_again({})
        self._part = ""  # the run has its values

    def createProcessingParameters(self, *given: Any) -> dict[str, Any]:
        """Return the values of the fields, limited to the part that is tried; `AlgorithmDialog` asks for them."""
        values = super().createProcessingParameters(*given)
        outputs = [one.name() for one in self.algorithm().destinationParameterDefinitions()]
        return preview.limited(values, outputs, self._part) if self._part else values

    def runAlgorithm(self) -> None:
        """Begin a run; the lines of an earlier preview go."""
        preview.drop_previews()
        self._is_preview = bool(self._part)
        super().runAlgorithm()

    def blockAdditionalControlsWhileRunning(self) -> None:
        """Disable what would begin another run."""
        super().blockAdditionalControlsWhileRunning()
        if self._try_button is not None:
            self._try_button.setEnabled(False)

    def resetAdditionalGui(self) -> None:
        """Enable it again."""
        super().resetAdditionalGui()
        if self._try_button is not None:
            self._try_button.setEnabled(True)

    def run_again(self, changes: dict[str, Any]) -> None:
        """Run with other values, as if the user had filled them in."""
        self.setParameters(changes)
        self.buttonBox().button(QDialogButtonBox.StandardButton.Ok).click()

    def _note_failure(self, feedback: QgsProcessingFeedback, kind: type) -> None:
        """Keep what kind of error ended the run of this dialog."""
        if feedback is self.feedback:
            self._failure = kind

    def _note_standard(self, feedback: QgsProcessingFeedback, name: str) -> None:
        """Keep the standard that fits the points of the run of this dialog better."""
        if feedback is self.feedback:
            self._standard = name

    def finish(
        self,
        successful: bool,
        result: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
        in_place: bool = False,
    ) -> None:
        """Show the end of a run; `AlgorithmDialog` calls this, whereas its signal does not come after a failure."""
        super().finish(successful, result, context, feedback, in_place)
        self.after_run(successful, result, context)

    def after_run(self, successful: bool, results: dict[str, Any], context: QgsProcessingContext) -> None:
        """Keep the standard that succeeded, unless that was a demonstration, and offer what may follow."""
        if successful and not self._is_preview:
            self._remember()
        if successful:
            steps = list(after_success(self, results, context, self._standard, self._is_preview))
        else:
            steps = list(after_failure(self, self._failure, self._standard))
            for step in steps:
                self._offer(step)
        if steps:
            offered = " &nbsp;·&nbsp; ".join(links.to(step.text, self._step(step)) for step in steps)
            self.setInfo(f"<b>{'Next:'}</b> {offered}", escapeHtml=False)
        self._failure, self._standard = None, ""

    def go_on(self, name: str, values: dict[str, Any]) -> None:
        """Open the dialog of another algorithm that goes on with the results of this one."""
        self._next = open_dialog(name, values, self.parentWidget())

    def cloud_layer(self, path: str) -> str:
        """Show a cloud that the run has written, if this QGIS can; returns the id of the layer, or else the path."""
        layer = QgsPointCloudLayer(path, Path(path).stem, "vpc" if path.endswith(".vpc") else "pdal")
        if not layer.isValid():
            return path
        return QgsProject.instance().addMapLayer(layer).id()

    def _remember(self) -> None:
        """Keep the standard for the next dialog."""
        wrappers = self.mainWidget().wrappers
        if "STANDARD" in wrappers and not self._is_demonstration():
            wrappers["STANDARD"].remember()

    def _is_demonstration(self) -> bool:
        """Return whether the run has to do with the sample, also if only the steps before it had."""
        wrappers = self.mainWidget().wrappers
        inputs = [wrappers[name].parameterValue() for name in ("INPUT", "POINTS") if name in wrappers]
        return any(_is_of_sample(value) for value in (*inputs, self.given.get("POINTS")))

    def _offer(self, step: Step) -> None:
        """Offer a step in the message bar."""
        button = QPushButton(step.text)
        button.clicked.connect(self._step(step))
        item = self.messageBar().createMessage("", step.why)
        item.layout().addWidget(button)
        self.messageBar().pushWidget(item, Qgis.MessageLevel.Warning, 0)

    def _step(self, step: Step) -> Callable[..., None]:
        """Return a function that takes a step, unless the dialog is gone or at work."""

        def take(*_: Any) -> None:
            if not sip.isdeleted(self) and self.feedback is None:
                self.messageBar().clearWidgets()
                step.take()

        return take


class _Panel(ParametersPanel):
    """The fields, of which the advanced ones are in sections."""

    def initWidgets(self) -> None:
        """Create the fields; `ParametersPanel` calls this."""
        self._layouts = {title: QVBoxLayout() for title in (*SECTIONS, OTHERS, RESULTS)}
        super().initWidgets()
        for output in self.algorithm().destinationParameterDefinitions():
            if output.flags() & ADVANCED and output.name() in self.wrappers:
                wrapper = self.wrappers[output.name()]
                for widget in filter(None, (wrapper.wrappedLabel(), wrapper.wrappedWidget())):
                    self._layouts[RESULTS].addWidget(widget)
        used = {title: layout for title, layout in self._layouts.items() if layout.count()}
        group = self.findChild(QGroupBox, "grpAdvanced").layout()
        # Kept, because Python removes widgets that it has made for a parent that only QGIS refers to.
        self._headings = [_heading(title) for title in used] if len(used) > 1 else []
        for number, layout in enumerate(used.values()):
            if self._headings:
                group.addWidget(self._headings[number])
            group.addLayout(layout)

    def addParameterLabel(self, parameter: QgsProcessingParameterDefinition, label: QWidget) -> None:
        """Add a label, to its section if the parameter is an advanced one."""
        if parameter.flags() & ADVANCED:
            self._layouts[section_of(parameter.name())].addWidget(label)
        else:
            super().addParameterLabel(parameter, label)

    def addParameterWidget(
        self, parameter: QgsProcessingParameterDefinition, widget: QWidget, stretch: int = 0
    ) -> None:
        """Add a field, to its section if the parameter is an advanced one, with its help in the words of the dialog."""
        definitions = self.algorithm().parameterDefinitions()
        text = with_labels(parameter.help(), definitions, parameter.name())
        widget.setToolTip(parameter.toolTip().replace(parameter.help(), text))
        if parameter.flags() & ADVANCED:
            self._layouts[section_of(parameter.name())].addWidget(widget, stretch)
        else:
            super().addParameterWidget(parameter, widget, stretch)


def _is_of_sample(value: Any) -> bool:
    """Return whether the value of an input is the sample: its path, a layer of it, or one that a run made of it."""
    layer = QgsProject.instance().mapLayer(value) if isinstance(value, str) else None
    if layer is None:
        return is_sample(str(value or ""))
    cloud = cloud_of(layer)
    return is_sample(layer.source()) or any(map(is_sample, cloud.paths if cloud else ()))


def _heading(title: str) -> QLabel:
    label = QLabel(title)
    label.setStyleSheet("font-weight: 600; margin-top: 8px")
    return label


def open_dialog(name: str, values: dict[str, Any], parent: QWidget | None = None) -> RunDialog:
    """Open the dialog of an algorithm of the plugin with values filled in."""
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(f"railextract:{name}")
    dialog = RunDialog(algorithm, parent)
    dialog.given = values
    dialog.setParameters(values)
    dialog.show()
    return dialog
