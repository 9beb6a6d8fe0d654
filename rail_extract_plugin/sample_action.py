"""The entry "Open the Sample": Extract Rails with the sample that comes with the plugin filled in."""

from __future__ import annotations

from qgis.core import QgsApplication

from .i18n import tr
from .paths import SAMPLE
from .toolbox_action import EXTRACT_RAILS, ToolboxAction

PARAMETERS = {"INPUT": str(SAMPLE / "sample.laz"), "STANDARD": "IN_75R_1000"}
"""The sample, and the standard of its rails."""


class OpenSampleAction(ToolboxAction):
    """Opens the dialog with the sample; it is in the toolbox's context menu and in the menu of the plugin."""

    def __init__(self) -> None:
        super().__init__(tr("Open the Sample…"))

    def execute(self) -> None:
        """Open the dialog."""
        from processing.gui.AlgorithmDialog import AlgorithmDialog

        algorithm = QgsApplication.processingRegistry().createAlgorithmById(EXTRACT_RAILS)
        self.dialog = AlgorithmDialog(algorithm)
        self.dialog.setParameters(PARAMETERS)
        self.dialog.show()
