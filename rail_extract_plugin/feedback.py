"""Reports the core's progress to QGIS: to the log of a run, and to the status bar."""

from __future__ import annotations

from collections.abc import Sequence

from qgis.core import QgsProcessingFeedback, QgsProcessingParameterDefinition, QgsTask

from ..core.progress import Progress
from .dialog.wording import for_user
from .notices import notices


class QgisProgress(Progress):
    """Passes reports of the core to a QGIS feedback, and the state of its Cancel button back.

    Messages may name parameters of these definitions.
    """

    def __init__(
        self, feedback: QgsProcessingFeedback, definitions: Sequence[QgsProcessingParameterDefinition]
    ) -> None:
        self._feedback = feedback
        self._definitions = definitions

    def set_fraction(self, fraction: float) -> None:
        """Move the progress bar."""
        self._feedback.setProgress(100 * fraction)

    def status(self, text: str) -> None:
        """Show a line above the progress bar."""
        self._feedback.setProgressText(text)

    def info(self, text: str) -> None:
        """Write a line into the log."""
        self._feedback.pushInfo(for_user(text, self._definitions))

    def warning(self, text: str) -> None:
        """Write a warning into the log."""
        self._feedback.pushWarning(for_user(text, self._definitions))

    def propose(self, standard: str) -> None:
        """Tell the dialog of the run."""
        notices.standard_proposed.emit(self._feedback, standard)

    def is_cancelled(self) -> bool:
        """Return whether the Cancel button was pressed."""
        return self._feedback.isCanceled()


class TaskProgress(Progress):
    """Shows the progress of a background task in QGIS's status bar."""

    def __init__(self, task: QgsTask) -> None:
        self._task = task

    def set_fraction(self, fraction: float) -> None:
        """Move the progress bar."""
        self._task.setProgress(100 * fraction)

    def is_cancelled(self) -> bool:
        """Return whether the task was cancelled."""
        return self._task.isCanceled()
