"""The entry of the toolbox's context menu that opens Extract Rails as a model, for editing in the model designer."""

from __future__ import annotations

from qgis.core import QgsApplication, QgsProcessingModelAlgorithm

from .paths import MODEL
from .toolbox_action import ToolboxAction


class OpenModelAction(ToolboxAction):
    """Opens a copy of the model: saving it asks for a name, so the plugin's own file stays unchanged."""

    def __init__(self) -> None:
        super().__init__("Open as Model…")

    def execute(self) -> None:
        """Open the model designer."""
        # Not at the top: newer QGIS moves it, and the plugin must still start.
        from processing.modeler.ModelerDialog import ModelerDialog

        model = QgsProcessingModelAlgorithm()
        model.fromFile(str(MODEL))
        # Running a model without a provider crashes QGIS.
        model.setProvider(QgsApplication.processingRegistry().providerById("model"))
        self.dialog = ModelerDialog.create(model)
        self.dialog.show()
