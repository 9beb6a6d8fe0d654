"""Lets go of what failed runs would leave behind.

QGIS keeps the error of a run for good, and with it the values of all functions that were under way, such as the task by
which a batch shows its progress: it would never end.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from types import FrameType

from qgis.PyQt.QtCore import QObject, QTimer

from ..notices import notices

QGIS_DIALOGS = "processing."
"""Beginning of the names of the modules whose functions start a run from a dialog."""

INTERVAL_MS = 500
"""Time between two looks at whether these functions have ended."""


class Leftovers(QObject):
    """Clears the functions of runs that failed, once they have ended."""

    def __init__(self) -> None:
        super().__init__()
        self._frames: list[FrameType] = []
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.clear)
        notices.run_left.connect(self._note)

    def stop(self) -> None:
        """Clear what has ended, and listen no more."""
        notices.run_left.disconnect(self._note)
        self._timer.stop()
        self.clear()

    def _note(self, frame: FrameType) -> None:
        """Keep the function that a run failed in, and the functions of the dialog that called it."""
        self._frames += _of_dialog(frame)
        self._timer.start(INTERVAL_MS)

    def clear(self) -> None:
        """Forget the values of the functions that have ended."""
        running = []
        for frame in self._frames:
            try:
                frame.clear()
            except RuntimeError:
                running.append(frame)
        self._frames = running
        if not running:
            self._timer.stop()


def _of_dialog(frame: FrameType) -> Iterator[FrameType]:
    """Yield a function, and those that called it as far as they are QGIS's own; none that goes on later."""
    yield frame
    caller = frame.f_back
    while caller is not None and caller.f_globals.get("__name__", "").startswith(QGIS_DIALOGS):
        if not caller.f_code.co_flags & inspect.CO_GENERATOR:
            yield caller
        caller = caller.f_back
