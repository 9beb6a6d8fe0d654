"""The widget for a choice: a list in words, of which the values are the ids of the interface.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from typing import Any

from processing.gui.wrappers import WidgetWrapper
from qgis.core import QgsProcessingModelChildParameterSource
from qgis.gui import QgsProcessingGui
from qgis.PyQt.QtWidgets import QComboBox

from .choices import in_words
from .wheel import ignore_wheel


class ChoiceWidgetWrapper(WidgetWrapper):
    """Connects the list with the dialogs for one run, for a batch, and for a step of a model."""

    def createWidget(self) -> QComboBox:
        """Create the list."""
        combo = QComboBox()
        combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        for text, value in (*self._sources(), *self.entries()):
            combo.addItem(text, value)
        combo.currentIndexChanged.connect(lambda _: self.widgetValueHasChanged.emit(self))
        ignore_wheel(combo)
        return combo

    def entries(self) -> list[tuple[str, Any]]:
        """Return the words and the values of the list."""
        return in_words(self.parameterDefinition())

    def setValue(self, value: Any) -> None:
        """Show a choice, given by its id; several are a list of ids, or a text with commas."""
        if self.parameterDefinition().allowMultiple() and not isinstance(value, QgsProcessingModelChildParameterSource):
            value = [one for one in value.split(",") if one] if isinstance(value, str) else list(value or [])
        rows = range(self.widget.count())
        self.widget.setCurrentIndex(next((row for row in rows if self.widget.itemData(row) == value), -1))

    def value(self) -> Any:
        """Return the id of the choice, or the ids of all that are chosen."""
        return self.widget.currentData()

    def _sources(self) -> list[tuple[str, QgsProcessingModelChildParameterSource]]:
        """Return the inputs of a model that may name a choice, by their names there."""
        if self.dialogType != QgsProcessingGui.WidgetType.Modeler:
            return []
        model = self.dialog.model
        sources = model.availableSourcesForChild(self.dialog.childId, ["enum", "string"], ["outputString"])
        return [(source.friendlyIdentifier(model), source) for source in sources]
