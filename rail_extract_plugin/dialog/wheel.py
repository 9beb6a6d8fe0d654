"""Lists and fields of numbers that ignore a mouse wheel which only passes over them."""

from __future__ import annotations

from qgis.PyQt.QtCore import QEvent, QObject, Qt
from qgis.PyQt.QtWidgets import QAbstractSpinBox, QComboBox, QWidget


class _Guard(QObject):
    """Passes the wheel on to what scrolls around a widget, unless the user works in the widget."""

    def eventFilter(self, watched: QWidget, event: QEvent) -> bool:
        if event.type() != QEvent.Type.Wheel or watched.hasFocus():
            return False
        event.ignore()
        return True


_guard = _Guard()
"""One for all: Python forgets a guard of a widget that only QGIS refers to."""


def ignore_wheel(widget: QWidget) -> None:
    """Make a widget, and all lists and fields of numbers in it, ignore the wheel unless they have the focus.

    Without this, scrolling a dialog changes the values that pass under the mouse.
    """
    for one in (widget, *widget.findChildren(QComboBox), *widget.findChildren(QAbstractSpinBox)):
        if isinstance(one, (QComboBox, QAbstractSpinBox)):
            one.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            one.installEventFilter(_guard)
