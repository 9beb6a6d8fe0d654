"""The dialog for one run: QGIS's own, with sections, lists that ignore a passing wheel, and links in the log.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from typing import Any

from processing.gui.AlgorithmDialog import AlgorithmDialog
from processing.gui.ParametersPanel import ParametersPanel
from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingParameterDefinition
from qgis.PyQt.QtWidgets import QDialogButtonBox, QGroupBox, QLabel, QTextEdit, QVBoxLayout, QWidget

from ..dialog.help_panel import ADVANCED
from ..dialog.sections import OTHERS, RESULTS, SECTIONS, section_of
from ..dialog.wheel import ignore_wheel
from ..dialog.wording import with_labels
from ..links import LinkFollower


class RunDialog(AlgorithmDialog):
    """Opens on an algorithm of the plugin.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    parent : QWidget, optional
    """

    def __init__(self, algorithm: QgsProcessingAlgorithm, parent: QWidget | None = None) -> None:
        super().__init__(algorithm, parent=parent)
        ignore_wheel(self.mainWidget())
        self._follower = LinkFollower(self.findChild(QTextEdit, "txtLog"))
        self.algorithmFinished.connect(self._finished)

    def getParametersPanel(self, alg: QgsProcessingAlgorithm, parent: QWidget) -> ParametersPanel:
        """Return the fields; `AlgorithmDialog` asks for them."""
        return _Panel(parent, alg, self.in_place, self.active_layer)

    def run_again(self, changes: dict[str, Any]) -> None:
        """Run with other values, as if the user had filled them in."""
        self.setParameters(changes)
        self.buttonBox().button(QDialogButtonBox.StandardButton.Ok).click()

    def _finished(self, successful: bool, results: dict[str, Any]) -> None:
        """Keep the standard that was run with."""
        standard = self.mainWidget().wrappers.get("STANDARD")
        if standard is not None:
            standard.remember()


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
        for title, layout in used.items():
            if len(used) > 1:
                group.addWidget(_heading(title))
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


def _heading(title: str) -> QLabel:
    label = QLabel(title)
    label.setStyleSheet("font-weight: 600; margin-top: 8px")
    return label


def open_dialog(name: str, values: dict[str, Any], parent: QWidget | None = None) -> RunDialog:
    """Open the dialog of an algorithm of the plugin with values filled in."""
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(f"railextract:{name}")
    dialog = RunDialog(algorithm, parent)
    dialog.setParameters(values)
    dialog.show()
    return dialog
