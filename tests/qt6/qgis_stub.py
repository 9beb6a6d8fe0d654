"""Stands in for the modules of QGIS that our widgets import, on PyQt6.

A class of QGIS that they extend or make has what they use of it; any other name is a `Nothing`, which accepts all.
"""

from __future__ import annotations

import enum
import sys
from types import ModuleType
from typing import Any

from PyQt6 import QtCore, QtGui, QtWidgets, sip


class _Permissive(type):
    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Nothing if name[0].isupper() else Nothing()


class Nothing(metaclass=_Permissive):
    """Has every attribute, can be called and extended, is 0 as a number, empty as a list, and false."""

    def __init__(self, *_: Any, **__: Any) -> None:
        pass

    def __call__(self, *_: Any, **__: Any) -> Any:
        return Nothing()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Nothing()

    def __setitem__(self, name: Any, value: Any) -> None:
        pass

    def __iter__(self):
        return iter(())

    def __bool__(self) -> bool:
        return False

    def __and__(self, other: Any) -> int:
        return 0

    def __int__(self) -> int:
        return 0

    __index__ = __int__


class Qgis(Nothing):
    """Says that it is QGIS 4, so that its branches of our code are taken."""

    QGIS_VERSION_INT = 40000


class Settings:
    """`QgsSettings`, of which all objects share the values."""

    values: dict[str, Any] = {}

    def value(self, name: str, default: Any = None) -> Any:
        return self.values.get(name, default)

    def setValue(self, name: str, value: Any) -> None:
        self.values[name] = value


class MessageBar(QtWidgets.QFrame):
    """`QgsMessageBar`."""

    def __init__(self) -> None:
        super().__init__()
        self.items: list[QtWidgets.QWidget] = []

    def createMessage(self, title: str, text: str) -> QtWidgets.QWidget:
        item = QtWidgets.QWidget()
        QtWidgets.QHBoxLayout(item).addWidget(QtWidgets.QLabel(f"{title}: {text}"))
        return item

    def pushWidget(self, item: QtWidgets.QWidget, level: Any, seconds: int) -> None:
        self.items.append(item)

    def popWidget(self, item: QtWidgets.QWidget) -> None:
        self.items.remove(item)

    def clearWidgets(self) -> None:
        self.items.clear()


class AlgorithmDialog(QtWidgets.QDialog):
    """The dialog of the processing framework: a log, a help, fields, and buttons."""

    def __init__(self, algorithm: Any, in_place: bool = False, parent: QtWidgets.QWidget | None = None) -> None:
        super().__init__(parent)
        self.in_place, self.active_layer, self.feedback, self._algorithm = in_place, None, None, algorithm
        column = QtWidgets.QVBoxLayout(self)
        self._log, help_text = QtWidgets.QTextEdit(self), QtWidgets.QTextBrowser(self)
        self._log.setObjectName("txtLog")
        help_text.setObjectName("textShortHelp")
        help_text.setHtml(f'<img src="{PICTURE}"><p>text</p>')
        kinds = QtWidgets.QDialogButtonBox.StandardButton
        self._buttons = QtWidgets.QDialogButtonBox(kinds.Ok | kinds.Help)
        self._bar = MessageBar()
        self._main = self.getParametersPanel(algorithm, self)
        for widget in (self._main, self._log, help_text, self._bar, self._buttons):
            column.addWidget(widget)

    def algorithm(self) -> Any:
        return self._algorithm

    def mainWidget(self) -> QtWidgets.QWidget:
        return self._main

    def buttonBox(self) -> QtWidgets.QDialogButtonBox:
        return self._buttons

    def messageBar(self) -> MessageBar:
        return self._bar

    def setInfo(self, text: str, escapeHtml: bool = True) -> None:
        self._log.append(text)


class ParametersPanel(QtWidgets.QWidget):
    """The fields of the dialog: a list and a number, and an empty group for the advanced ones."""

    def __init__(self, parent: QtWidgets.QWidget, algorithm: Any, *_: Any) -> None:
        super().__init__(parent)
        self.wrappers: dict[str, Any] = {}
        self._algorithm, column = algorithm, QtWidgets.QVBoxLayout(self)
        group = QtWidgets.QGroupBox(self)
        group.setObjectName("grpAdvanced")
        QtWidgets.QVBoxLayout(group)
        self.combo, self.number = QtWidgets.QComboBox(), QtWidgets.QSpinBox()
        self.combo.addItems(["one", "two"])
        for widget in (self.combo, self.number, group):
            column.addWidget(widget)
        self.initWidgets()

    def algorithm(self) -> Any:
        return self._algorithm

    def initWidgets(self) -> None:
        pass


class WidgetWrapper(QtCore.QObject):
    """The base of wrappers of parameters, in a dialog for one run."""

    widgetValueHasChanged = QtCore.pyqtSignal(object)  # noqa: N815 - the name of QGIS

    def __init__(self, definition: Any, options: Any = ()) -> None:
        super().__init__()
        self._definition, self.dialogType = definition, WidgetType.Standard
        self.widget = self.createWidget()

    def parameterDefinition(self) -> Any:
        return self._definition


class WidgetType(enum.Enum):
    """`QgsProcessingGui.WidgetType`."""

    Standard, Batch, Modeler = range(3)


class ProcessingGui:
    """`QgsProcessingGui`."""

    WidgetType = WidgetType


class MapTool(QtCore.QObject):
    """`QgsMapTool`."""

    def __init__(self, canvas: Any) -> None:
        super().__init__()

    def setCursor(self, shape: QtCore.Qt.CursorShape) -> None:
        self.cursor = QtGui.QCursor(shape)

    def setAction(self, action: QtGui.QAction) -> None:
        self.action = action


PICTURE = ""
"""Address of the picture in the help of dialogs."""

CLASSES = {
    "qgis.core": {"Qgis": Qgis, "QgsSettings": Settings, "NULL": None},
    "qgis.gui": {"QgsProcessingGui": ProcessingGui, "QgsMapTool": MapTool, "QgsMessageBar": MessageBar},
    "processing.gui.AlgorithmDialog": {"AlgorithmDialog": AlgorithmDialog},
    "processing.gui.ParametersPanel": {"ParametersPanel": ParametersPanel},
    "processing.gui.wrappers": {"WidgetWrapper": WidgetWrapper},
}
"""What is not a `Nothing`, by module."""

MOVED = ("QAction", "QActionGroup", "QShortcut")
"""Of QtGui in Qt 6; `qgis.PyQt.QtWidgets` has them, too."""


def install() -> None:
    """Put the modules where imports find them."""
    widgets = {**vars(QtWidgets), **{name: getattr(QtGui, name) for name in MOVED}}
    known = {
        **CLASSES,
        **{f"qgis.PyQt.{one}": vars(module) for one, module in (("QtCore", QtCore), ("QtGui", QtGui), ("sip", sip))},
        "qgis.PyQt.QtWidgets": widgets,
        "qgis.PyQt": {"sip": sip},
    }
    packages = ("qgis", "processing", "processing.gui", "processing.core", "processing.core.ProcessingConfig")
    further = ("processing.gui.ContextAction", "processing.gui.ProviderActions", "qgis.utils", "osgeo")
    for name in (*packages, *further, *known):
        module = ModuleType(name)
        module.__path__ = []
        vars(module).update(known.get(name, {}))
        if "PyQt" not in name:
            module.__getattr__ = _missing
        sys.modules[name] = module


def _missing(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return Nothing
