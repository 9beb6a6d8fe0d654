"""The runs that are under way: QGIS ends if the plugin is disabled or updated while its code runs in another thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingFeedback, QgsTask
from qgis.PyQt.QtWidgets import QApplication, QDialog

PROVIDER, TASKS = "railextract", "Rail Extract:"
"""Id of the provider, and beginning of the names of the plugin's own tasks."""

PATIENCE_S = 20.0
"""Longest wait for the end of runs. They look at Cancel every half second; a program that installs packages, or a
library that reads a file, may take longer."""

INTERVAL_S = 0.02
"""Time between two looks at whether they have ended."""

_running: dict[QgsProcessingFeedback, int] = {}
"""Feedback of each run, and its thread."""


@contextmanager
def running(feedback: QgsProcessingFeedback) -> Iterator[None]:
    """Note a run for as long as it lasts."""
    _running[feedback] = threading.get_ident()
    try:
        yield
    finally:
        _running.pop(feedback, None)


def stop_all(kind: type[QgsProcessingAlgorithm]) -> None:
    """Cancel all runs and tasks of the plugin, wait for their ends, then close its dialogs; in the main thread.

    A dialog that stays open would use the provider, which is deleted when the plugin is unloaded. `kind` is the base of
    the plugin's algorithms.
    """
    tasks = [task for task in QgsApplication.taskManager().activeTasks() if _is_own(task)]
    for one in (*_running, *tasks):
        one.cancel()
    end = time.monotonic() + PATIENCE_S
    is_active = True
    while is_active and time.monotonic() < end:
        is_active = _is_any_active(tasks)
        time.sleep(INTERVAL_S)
        # What a run does in the main thread when it ends happens here, once more after the thread has ended.
        QApplication.processEvents()
    for window in QApplication.topLevelWidgets():
        if isinstance(window, QDialog) and hasattr(window, "algorithm") and isinstance(window.algorithm(), kind):
            window.close()


def _is_own(task: QgsTask) -> bool:
    """Return whether a task is one of the plugin, or the run of one of its algorithms, of which it has the name."""
    provider = QgsApplication.processingRegistry().providerById(PROVIDER)
    labels = [algorithm.displayName() for algorithm in provider.algorithms()] if provider else []
    return any(label in task.description() for label in (TASKS, *labels))


def _is_any_active(tasks: Sequence[QgsTask]) -> bool:
    """Return whether a run is under way in another thread, or a task of the plugin."""
    if any(thread != threading.get_ident() for thread in _running.values()):
        return True
    active = QgsApplication.taskManager().activeTasks()
    return any(task in active for task in tasks)
