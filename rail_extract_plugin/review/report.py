"""Opens the report of a run that was started in a dialog."""

from __future__ import annotations

from processing.core.ProcessingConfig import ProcessingConfig, Setting
from qgis.PyQt.QtCore import QObject, QUrl
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QApplication

from ..notices import notices
from ..setup.package_setting import GROUP

OPEN_REPORT = "RAIL_EXTRACT_OPEN_REPORT"
"""Name of the setting."""

SINGLE_RUN, BATCH = "AlgorithmDialog", "BatchAlgorithmDialog"
"""Classes of QGIS's dialogs."""


class ReportOpener(QObject):
    """Opens reports in the web browser, except in a batch, in scripts, or if the user does not want it."""

    def register(self) -> None:
        """Show the setting and wait for reports."""
        description = "Open the report after a run in a dialog"
        ProcessingConfig.addSetting(Setting(GROUP, OPEN_REPORT, description, True))
        ProcessingConfig.readSettings()
        notices.report_written.connect(self.open)

    def deregister(self) -> None:
        """Remove the setting, whose value is kept, and stop waiting."""
        notices.report_written.disconnect(self.open)
        ProcessingConfig.removeSetting(OPEN_REPORT)

    def open(self, path: str) -> None:
        """Open a report."""
        if ProcessingConfig.getSetting(OPEN_REPORT) and _visible(SINGLE_RUN) and not _visible(BATCH):
            QDesktopServices.openUrl(QUrl.fromLocalFile(path))


def _visible(kind: str) -> bool:
    """Return whether a window of a class, given by name, or of one that extends it is visible."""
    windows = (window for window in QApplication.topLevelWidgets() if window.isVisible())
    return any(kind in (one.__name__ for one in type(window).__mro__) for window in windows)
