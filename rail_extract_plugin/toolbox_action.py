"""Entries of the toolbox's context menu that belong to Extract Rails."""

from __future__ import annotations

from processing.gui.ContextAction import ContextAction
from processing.gui.ProviderActions import ProviderContextMenuActions
from qgis.core import QgsProcessingAlgorithm

EXTRACT_RAILS = "railextract:extractrails"


class ToolboxAction(ContextAction):
    """An entry that appears on Extract Rails; a subclass opens something in `execute`."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name

    def register(self) -> None:
        """Add the entry to the context menu."""
        ProviderContextMenuActions.registerProviderContextMenuActions([self])

    def deregister(self) -> None:
        """Remove the entry."""
        ProviderContextMenuActions.deregisterProviderContextMenuActions([self])

    def isEnabled(self) -> bool:
        """Return whether the entry applies to the clicked algorithm, which must be Extract Rails."""
        return isinstance(self.itemData, QgsProcessingAlgorithm) and self.itemData.id() == EXTRACT_RAILS
