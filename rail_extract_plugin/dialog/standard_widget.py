"""The widget for the rail standard: a list in words, by region, of which the value is the id of the interface.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from typing import Any

from processing.gui.wrappers import WidgetWrapper
from qgis.core import QgsProcessingModelChildParameterSource, QgsSettings
from qgis.gui import QgsProcessingGui
from qgis.PyQt.QtWidgets import QComboBox

from ...core.standards import CUSTOM, DETECT, STANDARDS
from ..i18n import tr

LAST = "rail_extract/standard"
"""Setting that keeps the last choice."""


class StandardWidgetWrapper(WidgetWrapper):
    """Connects the list with the dialogs for one run, for a batch, and for a step of a model."""

    def createWidget(self) -> QComboBox:
        """Create the list."""
        combo = QComboBox()
        combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        for text, value in (*self._sources(), *described(self.parameterDefinition().options())):
            combo.addItem(text, value)
        combo.activated.connect(lambda _: self._remember())
        combo.currentIndexChanged.connect(lambda _: self.widgetValueHasChanged.emit(self))
        return combo

    def postInitialize(self, wrappers: list) -> None:
        """Begin with the last choice in the dialog for one run; values that are set later replace it."""
        last = QgsSettings().value(LAST)
        if self.dialogType == QgsProcessingGui.WidgetType.Standard and last in self.parameterDefinition().options():
            self.setValue(last)

    def setValue(self, value: Any) -> None:
        """Show a standard, given by its id."""
        rows = range(self.widget.count())
        self.widget.setCurrentIndex(next((row for row in rows if self.widget.itemData(row) == value), -1))

    def value(self) -> Any:
        """Return the id of the standard."""
        return self.widget.currentData()

    def _remember(self) -> None:
        if isinstance(self.value(), str):
            QgsSettings().setValue(LAST, self.value())

    def _sources(self) -> list[tuple[str, QgsProcessingModelChildParameterSource]]:
        """Return the inputs of a model that may name a standard, by their names there."""
        if self.dialogType != QgsProcessingGui.WidgetType.Modeler:
            return []
        model = self.dialog.model
        sources = model.availableSourcesForChild(self.dialog.childId, ["enum", "string"], ["outputString"])
        return [(source.friendlyIdentifier(model), source) for source in sources]


def described(names: list[str]) -> list[tuple[str, str]]:
    """Return the names of standards with their descriptions, sorted by these; other choices come first."""
    others = {DETECT: tr("Detect from the points"), CUSTOM: tr("Custom: gauge and railhead width as below")}
    first = [(text, name) for name, text in others.items() if name in names]
    return first + sorted((STANDARDS[name].description, name) for name in names if name in STANDARDS)
