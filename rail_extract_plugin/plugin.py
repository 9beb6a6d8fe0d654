"""The plugin, which registers the provider."""

from __future__ import annotations

from typing import TYPE_CHECKING

from qgis.core import QgsApplication

from .provider import RailExtractProvider
from .setup import package_folders

if TYPE_CHECKING:
    from .model_action import OpenModelAction


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
        self.action: OpenModelAction | None = None

    def initProcessing(self) -> None:
        """Register the algorithms; ``qgis_process`` calls only this."""
        package_folders.use()
        self.provider = RailExtractProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Start in QGIS with windows: register the algorithms, the menu entry and the setting."""
        self.initProcessing()

        from .model_action import OpenModelAction
        from .setup import package_setting

        self.action = OpenModelAction()
        self.action.register()
        package_setting.register()

    def unload(self) -> None:
        """Remove everything that was registered."""
        if self.action is not None:
            from .setup import package_setting

            package_setting.deregister()
            self.action.deregister()
            self.action = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
