"""An entry in the toolbox's context menu: Extract Rails as a model, to be changed in the model designer."""

from __future__ import annotations

from processing.gui.ContextAction import ContextAction
from processing.gui.ProviderActions import ProviderContextMenuActions
from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingModelAlgorithm

from .i18n import tr
from .paths import MODEL

EXTRACT_RAILS = "railextract:extractrails"


class OpenModelAction(ContextAction):
    """Opens a copy of the model: saving it asks for a name, so that the plugin's own file stays as it is."""

    def __init__(self) -> None:
        super().__init__()
        self.name = tr("Open as Model…")

    def register(self) -> None:
        """Add the entry to the context menu."""
        ProviderContextMenuActions.registerProviderContextMenuActions([self])

    def deregister(self) -> None:
        """Take the entry away again."""
        ProviderContextMenuActions.deregisterProviderContextMenuActions([self])

    def isEnabled(self) -> bool:
        """Tell whether the entry belongs to what was clicked: Extract Rails alone."""
        return isinstance(self.itemData, QgsProcessingAlgorithm) and self.itemData.id() == EXTRACT_RAILS

    def execute(self) -> None:
        """Open the model designer."""
        from processing.modeler.ModelerDialog import ModelerDialog  # newer QGIS moves it, which must not stop a start

        model = QgsProcessingModelAlgorithm()
        model.fromFile(str(MODEL))
        # Running a model without a provider crashes QGIS.
        model.setProvider(QgsApplication.processingRegistry().providerById("model"))
        self.dialog = ModelerDialog.create(model)
        self.dialog.show()
