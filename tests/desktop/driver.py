"""Drives QGIS from inside: `start` is called in the real application and takes the steps of a scenario one by one.

A scenario is a generator. It yields what it waits for: a number of seconds, or a callable that returns something true
when the time has come, which `yield` then returns. The event loop runs meanwhile, also that of a modal window.
"""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from qgis.core import Qgis, QgsApplication, QgsProcessingAlgorithm, QgsProject
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QModelIndex, QTimer
from qgis.PyQt.QtWidgets import QApplication, QDialogButtonBox, QDockWidget, QTextEdit, QWidget
from qgis.utils import iface

INTERVAL_MS = 50
"""Time between two looks at what a scenario waits for."""

PATIENCE_S = 200.0
"""Longest wait; the longest runs take a tenth of this on a desktop computer."""

Scenario = Callable[["Driver"], Iterator]


class Driver:
    """Takes the steps of a scenario and keeps what it finds, in `results.json`, and pictures, in a folder."""

    def __init__(self, scenario: Scenario, folder: Path) -> None:
        self.folder = folder
        self.results: dict[str, Any] = {"exceptions": [], "ended": False, "version": Qgis.QGIS_VERSION_INT}
        self._steps = scenario(self)
        self._begun = self._active = False
        self._wait: Callable[[], Any] = lambda: True
        self._deadline = time.monotonic() + PATIENCE_S
        sys.excepthook = self._note_exception
        iface.mainWindow().setGeometry(QApplication.primaryScreen().geometry())  # as there is no window manager
        self._timer = QTimer()
        self._timer.timeout.connect(self._advance)
        self._timer.start(INTERVAL_MS)

    def keep(self, name: str, value: Any) -> None:
        """Keep a finding; it is in the file at once, in case QGIS crashes."""
        self.results[name] = value
        text = json.dumps(self.results, indent=1, default=str)
        (self.folder / "results.json").write_text(text, encoding="utf-8")

    def picture(self, name: str) -> None:
        """Take a picture of the screen."""
        QApplication.processEvents()
        QApplication.primaryScreen().grabWindow(0).save(str(self.folder / f"{name}.png"))

    def _advance(self) -> None:
        """Take the next step if it is time; never within another step, whose windows have event loops too."""
        if self._active:
            return
        self._active = True
        try:
            found = self._wait()
            if found:
                self._step(found if self._begun else None)
            elif time.monotonic() > self._deadline:
                self._fail(TimeoutError("What the scenario waits for does not come."))
        except Exception as error:
            self._fail(error)
        finally:
            self._active = False

    def _step(self, found: Any) -> None:
        self._begun = True
        try:
            wait = self._steps.send(found)
        except StopIteration:
            self.keep("ended", True)
            self._leave()
            return
        if not callable(wait):
            end = time.monotonic() + wait
            wait = lambda: time.monotonic() >= end  # noqa: E731
        self._wait, self._deadline = wait, time.monotonic() + PATIENCE_S

    def _fail(self, error: Exception) -> None:
        self._note_exception(type(error), error, error.__traceback__)
        self.picture("failure")
        os._exit(1)  # whatever still runs

    def _leave(self) -> None:
        """End QGIS as a user does who discards the project."""
        self._timer.stop()
        for window in QApplication.topLevelWidgets():
            if window is not iface.mainWindow() and window.isVisible():
                window.close()
        QgsProject.instance().clear()
        later(iface.actionExit().trigger)

    def _note_exception(self, kind, value, trace) -> None:
        text = "".join(traceback.format_exception(kind, value, trace))
        self.keep("exceptions", [*self.results["exceptions"], text])


def later(call: Callable[[], Any]) -> None:
    """Call from the event loop: for all that returns only when a window is closed."""
    QTimer.singleShot(0, call)


def window(kind: str) -> QWidget | None:
    """Return the visible window of a class, given by name, or of one that extends it; None where there is none."""
    visible = (one for one in QApplication.topLevelWidgets() if one.isVisible())
    return next((one for one in visible if kind in (base.__name__ for base in type(one).__mro__)), None)


def install(archive: str) -> Iterator:
    """Install the plugin from its zip, as the plugin manager does."""
    import pyplugin_installer

    pyplugin_installer.instance().installFromZipFile(archive)
    yield lambda: QgsApplication.processingRegistry().providerById("railextract")


def choose(name: str) -> QDockWidget:
    """Select an algorithm of the plugin in the toolbox, and return the toolbox."""
    dock = iface.mainWindow().findChild(QDockWidget, "ProcessingToolbox")
    dock.setUserVisible(True)
    tree, pending = dock.algorithmTree, [QModelIndex()]
    while pending:
        index = pending.pop()
        algorithm = tree.algorithmForIndex(index) if index.isValid() else None
        if algorithm is not None and algorithm.id() == f"railextract:{name}":
            tree.setCurrentIndex(index)
            return dock
        pending += [tree.model().index(row, 0, index) for row in range(tree.model().rowCount(index))]
    raise LookupError(f"{name} is not in the toolbox.")


def algorithm(name: str) -> QgsProcessingAlgorithm:
    """Return an algorithm of the plugin."""
    return QgsApplication.processingRegistry().algorithmById(f"railextract:{name}")


def open_dialog(name: str) -> Iterator:
    """Open an algorithm's dialog from the toolbox; returns the dialog."""
    later(choose(name).executeAlgorithm)
    return (yield lambda: window("AlgorithmDialog"))


def open_batch(name: str) -> Iterator:
    """Open an algorithm's batch dialog from the toolbox; returns the dialog."""
    later(choose(name).executeAlgorithmAsBatchProcess)
    return (yield lambda: window("BatchAlgorithmDialog"))


def press_run(dialog: QWidget) -> Iterator:
    """Press Run and wait for the end; returns the log."""
    button, log = dialog.buttonBox().button(QDialogButtonBox.StandardButton.Ok), dialog.findChild(QTextEdit, "txtLog")
    before = log.toPlainText()
    later(button.click)
    # A run may end between two looks at the button; its log stays.
    yield lambda: not button.isEnabled() or log.toPlainText() != before
    yield button.isEnabled
    yield 0.5
    return log.toPlainText()


def close(dialog: QWidget) -> Iterator:
    """Close a window."""
    dialog.close()
    yield lambda: sip.isdeleted(dialog) or not dialog.isVisible()


def start(scenario: Scenario, folder: str) -> None:
    """Begin once QGIS is ready."""
    QApplication.instance().driver = Driver(scenario, Path(folder))  # kept, or Python would remove it
