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

    def initProcessing(self) -> None:
        """Offer the algorithms; all that ``qgis_process`` calls."""
        self.provider = RailExtractProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Start in QGIS with windows."""
        self.initProcessing()

    def unload(self) -> None:
        """Take the algorithms away again."""
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
