"""The widget for a point cloud: loaded clouds, a path that can be typed, and buttons that select a file or a folder.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from processing.gui.wrappers import WidgetWrapper
from qgis.core import QgsMapLayer, QgsPointCloudLayer, QgsProcessingParameterDefinition, QgsProject, QgsSettings
from qgis.gui import QgsProcessingGui
from qgis.PyQt.QtCore import pyqtSignal
from qgis.PyQt.QtWidgets import QComboBox, QFileDialog, QHBoxLayout, QToolButton, QWidget

from .cloud_parameter import file_filter

LAST_FOLDER = "/Processing/LastInputPath"
"""Setting in which QGIS's own widgets keep the folder of the last input."""

BATCH_WIDTH = 300
"""Pixels for the path in the batch dialog, as many as QGIS gives paths of outputs there."""

MODEL_INPUTS = ["pointcloud", "layer", "file", "string"]
MODEL_OUTPUTS = ["outputPointCloud", "outputLayer", "outputFile", "outputFolder", "outputString"]
"""Types of a model's inputs, and of the outputs of its steps, that may name a cloud."""


class CloudWidget(QWidget):
    """Takes a value from a list of names and values, or a path."""

    changed = pyqtSignal()

    def __init__(self, choices: Callable[[], list[tuple[str, Any]]]) -> None:
        super().__init__()
        self._choices = choices
        self.combo = QComboBox()
        self.combo.setEditable(True)
        self.combo.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.combo.lineEdit().setPlaceholderText("Layer, or path of a file or folder")
        self.file_button = _button("…", "Select a file", self._select_file)
        self.folder_button = _button("Folder…", "Select a folder of point clouds", self._select_folder)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for widget in (self.combo, self.file_button, self.folder_button):
            layout.addWidget(widget)
        layout.setStretch(0, 1)
        self.list_choices()
        self.combo.editTextChanged.connect(lambda _: self.changed.emit())

    def value(self) -> Any:
        """Return the chosen value, or the path; None for neither."""
        text, index = self.combo.currentText().strip(), self.combo.currentIndex()
        if index < 0 or self.combo.itemText(index) != text:
            index = self.combo.findText(text)
        return self.combo.itemData(index) if index >= 0 else text or None

    def set_value(self, value: Any) -> None:
        """Show a value of the list, given as such or by its name, or a path."""
        rows = range(self.combo.count())
        index = next((row for row in rows if value in (self.combo.itemData(row), self.combo.itemText(row))), -1)
        self.combo.setCurrentIndex(index)
        if index < 0:
            self.combo.setEditText("" if value is None else str(value))

    def list_choices(self) -> None:
        """Fill the list again; what is shown stays, unless it was an entry of the list that is gone."""
        value = self.value()
        listed = self.combo.findText(self.combo.currentText()) >= 0
        self.combo.clear()
        for name, choice in self._choices():
            self.combo.addItem(name, choice)
        self.set_value(value)
        if listed and self.combo.currentIndex() < 0:
            self.combo.clearEditText()

    def _select_file(self) -> None:
        self._take(QFileDialog.getOpenFileName(self, "Select a point cloud", self._folder(), file_filter())[0])

    def _select_folder(self) -> None:
        self._take(QFileDialog.getExistingDirectory(self, "Select a folder of point clouds", self._folder()))

    def _folder(self) -> str:
        """Folder in which a dialog begins."""
        path = Path(self.combo.currentText())
        return str(path.parent) if path.is_absolute() else str(QgsSettings().value(LAST_FOLDER, ""))

    def _take(self, path: str) -> None:
        """Show what a dialog selected; nothing changes if it was cancelled."""
        if path:
            QgsSettings().setValue(LAST_FOLDER, str(Path(path).parent))
            self.set_value(path)


class CloudWidgetWrapper(WidgetWrapper):
    """Connects the widget with the dialogs for one run, for a batch, and for a step of a model."""

    def createWidget(self) -> CloudWidget:
        """Create the widget; it begins with the active cloud, or with the first one, if a cloud is needed at once."""
        if self.dialogType == QgsProcessingGui.WidgetType.Modeler:
            return CloudWidget(self._sources)
        widget = CloudWidget(loaded_clouds)
        project = QgsProject.instance()
        project.layersAdded.connect(widget.list_choices)
        project.layersRemoved.connect(widget.list_choices)
        if self.dialogType == QgsProcessingGui.WidgetType.Batch:
            widget.combo.setMinimumWidth(BATCH_WIDTH)
        optional = self.parameterDefinition().flags() & QgsProcessingParameterDefinition.Flag.FlagOptional
        if self.dialogType == QgsProcessingGui.WidgetType.Standard and not optional:
            widget.combo.setCurrentIndex(0)
        widget.changed.connect(lambda: self.widgetValueHasChanged.emit(self))
        return widget

    def setWidgetContext(self, context) -> None:
        """Take the active layer from the main window."""
        super().setWidgetContext(context)
        if isinstance(context.activeLayer(), QgsPointCloudLayer) and self.widget.combo.currentIndex() == 0:
            self.widget.set_value(context.activeLayer().id())

    def setValue(self, value: Any) -> None:
        """Show a value."""
        self.widget.set_value(value.id() if isinstance(value, QgsMapLayer) else value)

    def value(self) -> Any:
        """Return the value that is shown."""
        return self.widget.value()

    def _sources(self) -> list[tuple[str, Any]]:
        """Return what can name a cloud in a model, inputs and outputs of other steps, by its name there."""
        model = self.dialog.model
        sources = model.availableSourcesForChild(self.dialog.childId, MODEL_INPUTS, MODEL_OUTPUTS)
        return [(source.friendlyIdentifier(model), source) for source in sources]


def loaded_clouds() -> list[tuple[str, str]]:
    """Return the names and ids of the loaded clouds."""
    layers = QgsProject.instance().mapLayers().values()
    return sorted((layer.name(), layer.id()) for layer in layers if isinstance(layer, QgsPointCloudLayer))


def _button(text: str, tip: str, call: Callable[[], None]) -> QToolButton:
    button = QToolButton()
    button.setText(text)
    button.setToolTip(tip)
    button.clicked.connect(lambda _: call())
    return button
