"""The entry "Open the Sample": Extract Rails with the sample that comes with the plugin filled in."""

from __future__ import annotations

from processing.gui.ContextAction import ContextAction
from processing.gui.ProviderActions import ProviderContextMenuActions
from qgis.core import QgsApplication, QgsProcessingAlgorithm

from .i18n import tr
from .model_action import EXTRACT_RAILS
from .paths import SAMPLE

PARAMETERS = {"INPUT": str(SAMPLE / "sample.laz"), "STANDARD": "IN_75R_1000"}
"""The sample, and the standard of its rails."""


class OpenSampleAction(ContextAction):
    """Opens the dialog with the sample; it is in the toolbox's context menu and in the menu of the plugin."""

    def __init__(self) -> None:
        super().__init__()
        self.name = tr("Open the Sample…")

    def register(self) -> None:
        """Add the entry to the context menu."""
        ProviderContextMenuActions.registerProviderContextMenuActions([self])

    def deregister(self) -> None:
        """Remove the entry."""
        ProviderContextMenuActions.deregisterProviderContextMenuActions([self])

    def isEnabled(self) -> bool:
        """Return whether the entry applies to the clicked algorithm, which must be Extract Rails."""
        return isinstance(self.itemData, QgsProcessingAlgorithm) and self.itemData.id() == EXTRACT_RAILS

    def execute(self) -> None:
        """Open the dialog."""
        from processing.gui.AlgorithmDialog import AlgorithmDialog

        algorithm = QgsApplication.processingRegistry().createAlgorithmById(EXTRACT_RAILS)
        self.dialog = AlgorithmDialog(algorithm)
        self.dialog.setParameters(PARAMETERS)
        self.dialog.show()
