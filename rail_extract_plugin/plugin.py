"""The plugin, which registers the provider."""

from __future__ import annotations

from typing import TYPE_CHECKING

from qgis.core import QgsApplication

from .algorithms.base import RailAlgorithm
from .provider import RailExtractProvider
from .runs.running import stop_all
from .setup import package_folders

if TYPE_CHECKING:
    from .windows import Windows


class RailExtractPlugin:
    """Life cycle of the plugin; under ``qgis_process``, QGIS has no interface."""

    def __init__(self, iface) -> None:
        self.iface = iface
        self.provider: RailExtractProvider | None = None
        self.windows: Windows | None = None

    def initProcessing(self) -> None:
        """Register the algorithms; ``qgis_process`` calls only this."""
        package_folders.use()
        self.provider = RailExtractProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Start in QGIS with windows: register the algorithms, the menu entries, the dock and the settings."""
        self.initProcessing()

        from .windows import Windows

        self.windows = Windows(self.iface)

    def unload(self) -> None:
        """Remove everything that was registered, after the ends of all runs."""
        stop_all(RailAlgorithm)
        if self.windows is not None:
            self.windows.remove()
            self.windows = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
