"""The plugin: registers the provider, nothing else."""

from __future__ import annotations

from qgis.core import QgsApplication

from .provider import RailExtractProvider


class RailExtractPlugin:
    """Life cycle of the plugin.

    Parameters
    ----------
    iface : qgis.gui.QgisInterface or None
        None under ``qgis_process``.
    """

    def __init__(self, iface) -> None:
        self.iface = iface
        self.provider: RailExtractProvider | None = None
        self.action = None

    def initProcessing(self) -> None:
        """Offer the algorithms; all that ``qgis_process`` calls."""
        self.provider = RailExtractProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Start in QGIS with windows."""
        from .model_action import OpenModelAction

        self.initProcessing()
        self.action = OpenModelAction()
        self.action.register()

    def unload(self) -> None:
        """Take the algorithms away again."""
        if self.action is not None:
            self.action.deregister()
            self.action = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
