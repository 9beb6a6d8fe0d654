"""The core's progress, shown by QGIS."""

from __future__ import annotations

from qgis.core import QgsProcessingFeedback

from ..core.progress import Progress


class QgisProgress(Progress):
    """Passes what the core reports on to a QGIS feedback, and its cancel button back.

    Parameters
    ----------
    feedback : QgsProcessingFeedback
    """

    def __init__(self, feedback: QgsProcessingFeedback) -> None:
        self._feedback = feedback

    def set_fraction(self, fraction: float) -> None:
        """Move the progress bar."""
        self._feedback.setProgress(100 * fraction)

    def status(self, text: str) -> None:
        """Show a line above the progress bar."""
        self._feedback.setProgressText(text)

    def info(self, text: str) -> None:
        """Write a line into the log."""
        self._feedback.pushInfo(text)

    def warning(self, text: str) -> None:
        """Write a marked line into the log."""
        self._feedback.pushWarning(text)

    def is_cancelled(self) -> bool:
        """Tell whether the cancel button was pressed."""
        return self._feedback.isCanceled()
