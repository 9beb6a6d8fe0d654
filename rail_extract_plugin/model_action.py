"""The entry of the toolbox's context menu that opens Extract Rails as a model, for editing in the model designer."""

from __future__ import annotations

from processing.gui.ContextAction import ContextAction
from processing.gui.ProviderActions import ProviderContextMenuActions
from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingModelAlgorithm

from .i18n import tr
from .paths import MODEL

EXTRACT_RAILS = "railextract:extractrails"


class OpenModelAction(ContextAction):
    """Opens a copy of the model: saving it asks for a name, so the plugin's own file stays unchanged."""

    def __init__(self) -> None:
        super().__init__()
        self.name = tr("Open as Model…")

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
        """Open the model designer."""
        from processing.modeler.ModelerDialog import (
            ModelerDialog,
        )  # not at the top: newer QGIS moves it, and the plugin must still start

        model = QgsProcessingModelAlgorithm()
        model.fromFile(str(MODEL))
        # Running a model without a provider crashes QGIS.
        model.setProvider(QgsApplication.processingRegistry().providerById("model"))
        self.dialog = ModelerDialog.create(model)
        self.dialog.show()
